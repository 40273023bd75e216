"""From scene and result to what the independent judge asks for.

The wedge is handed over as a dense polyline and the wall as a radius: the judge computes its own
distances.
"""

from __future__ import annotations

import numpy as np

from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.verdict import Tolerances
from avneo_fem.results.verify import Constraints, CuspSurface
from avneo_fem.scene import Scene
from avneo_fem.stages.record import CuspResult

__all__ = ["constraints_of", "surface_of", "tolerances_of"]

#: how far a sutured node may be off its line, in units of R: rounding of the way there
_SUTURE = 8e-8


def surface_of(geometry: ValveGeometry, result: CuspResult) -> CuspSurface:
    """Mid-surface of a result and what its edges were asked to do."""
    mesh, cusp = result.mesh, geometry.cusps[result.index]
    arc = mesh.suture_arc_length
    return CuspSurface(
        points=result.points,
        template_points=mesh.points,
        triangles=mesh.triangles,
        suture_nodes=mesh.suture_line,
        suture_targets=cusp.sutured_position(arc),
        suture_edges=np.c_[mesh.suture_line[:-1], mesh.suture_line[1:]],
        prescribed_conormals=cusp.sutured_conormal((arc[1:] + arc[:-1]) / 2),
        free_edge_nodes=mesh.free_edge,
        template_height=mesh.points[mesh.free_edge, 1] - cusp.template.corners[0, 1],
        distance_to_suture=mesh.distance_to_suture,
        thickness=cusp.thickness,
    )


def constraints_of(
    scene: Scene, geometry: ValveGeometry, wedges: ContactWedgeFamily, index: int
) -> Constraints:
    """What cusp ``index`` must stay within."""
    line = geometry.cusps[index].suture_line
    lowest = line.point(np.array([line.length / 2]))[0]
    thickness = geometry.cusps[index].thickness
    plane = geometry.commissures
    return Constraints(
        radius=geometry.root.radius,
        wedge=wedges.wedge(index, 1.0).polyline3(500, 4 * geometry.root.radius)[:, :2],
        wedge_inside=lowest[:2],
        plane_point=plane.points[0],
        plane_normal=plane.normal,
        free_edge_clearance=scene.free_edge.clearance,
        taper=scene.wall_taper(thickness),
        layer_clearance=scene.layer_clearance(thickness),
        unrestricted=scene.layers_unrestricted(thickness),
    )


def _edges_apart(given: ValveInput) -> float:
    """Smallest sum of the distances of two neighbouring sutured edges from the closed wedge [mm].

    A cusp keeps its clearance from the wedge but where its sutured edge itself lies closer.
    """
    wedges, cusps = given.wedges, given.geometry.cusps
    nearest = np.empty((3, 2))
    for index, cusp in enumerate(cusps):
        places = np.linspace(0.0, cusp.suture_line.length, 2001)
        distance = wedges.wedge(index, 1.0).signed_distance(cusp.suture_line.point(places))
        nearest[index] = distance[:1001].min(), distance[1000:].min()
    # cusp i hangs from A_(i+1) to A_(i+2), where cusp i+1 begins
    return float(min(nearest[i, 1] + nearest[(i + 1) % 3, 0] for i in range(3)))


def tolerances_of(given: ValveInput) -> Tolerances:
    """What a verified result of this scene must keep.

    Mid-surfaces of different cusps keep the sum of their clearances from the contact wedge, but
    no more than their sutured edges keep from it or from each other (design.md §1); the wall its
    clearance beyond the taper; layers that of the thinnest cusp.
    """
    scene, geometry = given.scene, given.geometry
    if scene.solver.quality == "approximate":
        # no equilibrium and no clearance is claimed, but no crossing, and inside
        inside = scene.inside_tolerance(min(cusp.thickness for cusp in geometry.cusps))
        return Tolerances(residual=np.inf, inside_mm=inside, **_edges(scene))
    halves = sorted(cusp.thickness / 2 for cusp in geometry.cusps)
    wedge = (
        halves[0] + halves[1] if scene.contact.clearance is None else 2 * scene.contact.clearance
    )
    radius, gap = geometry.root.radius, scene.commissures.gap
    apart = min(_edges_apart(given), 2 * radius * np.sin(gap / (2 * radius)))
    return Tolerances(
        residual=scene.solver.tolerance,
        inside_mm=scene.inside_tolerance(2 * halves[0]),
        clamp_deg=scene.clamp.tolerance_degrees if scene.material.bending else np.inf,
        cusp_distance_mm=max(min(wedge, float(apart)), 0.0),
        wall_distance_mm=max(
            halves[0] if scene.wall.clearance is None else scene.wall.clearance, 0.0
        ),
        layer_distance_mm=scene.layer_clearance(2 * halves[0]),
        **_edges(scene),
    )


def _edges(scene: Scene) -> dict[str, float]:
    """What sutured and free edges may be off by: nothing, and the width eta_2 of (1.6) [mm]."""
    return {"suture_mm": _SUTURE * scene.root.radius, "sag_mm": scene.free_edge.width}
