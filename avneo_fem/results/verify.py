"""The independent judge of a result: it shares no code with the solver (design.md §2, §5).

The lead hands over positions, topology and what was asked for as plain arrays; everything here is
measured anew on the flat triangles that are also written as STL.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SolveError
from avneo_fem.results.containment import (
    edges_outside_wedge_mm,
    min_wall_distance,
    outside_root_mm,
    outside_wedge_mm,
    wall_excess,
)
from avneo_fem.results.crossings import cusp_intersections, min_distance, self_intersections
from avneo_fem.results.layers import closest_layers
from avneo_fem.results.measures import clamp_error_deg, free_edge_sag_mm, suture_error_mm
from avneo_fem.results.verdict import CuspVerification, Tolerances, ValveVerification, judge

__all__ = [
    "Constraints",
    "CuspSurface",
    "CuspVerification",
    "Tolerances",
    "ValveVerification",
    "clamp_error_deg",
    "closest_layers",
    "cusp_intersections",
    "edges_outside_wedge_mm",
    "free_edge_sag_mm",
    "judge",
    "min_distance",
    "min_wall_distance",
    "outside_root_mm",
    "outside_wedge_mm",
    "self_intersections",
    "suture_error_mm",
    "verify_cusp",
    "verify_valve",
    "wall_excess",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]


@dataclass(frozen=True)
class CuspSurface:
    """Mid-surface of one sutured cusp and what its edges were asked to do.

    Parameters
    ----------
    points : (n, 3) array
        Current positions of all nodes [mm].
    template_points : (n, 2) array
        The same nodes in the flat template [mm].
    triangles : (m, 3) array of int
        Corners, counter-clockwise in the template; a quadratic triangle is given as four.
    suture_nodes, suture_targets : (k,) array of int, (k, 3) array
        Sutured nodes and their places on the aortic suture line [mm].
    suture_edges, prescribed_conormals : (e, 2) array of int, (e, 3) array
        Sutured boundary edges and the outward conormal b prescribed there (3.1).
    free_edge_nodes, template_height : (f,) array of int, (f,) array
        Nodes of the free edge and (P_n − N_0)·e_2 of (1.6) [mm].
    distance_to_suture : (n,) array
        Distance from the suture line in the template [mm].
    thickness : float
        H [mm].

    Raises
    ------
    SolveError
        When a position is not finite.
    ValueError
        When array shapes do not fit together.
    """

    points: Array
    template_points: Array
    triangles: Indices
    suture_nodes: Indices
    suture_targets: Array
    suture_edges: Indices
    prescribed_conormals: Array
    free_edge_nodes: Indices
    template_height: Array
    distance_to_suture: Array
    thickness: float

    def __post_init__(self) -> None:
        expected = {
            "points": (len(self.points), 3),
            "template_points": (len(self.points), 2),
            "triangles": (len(self.triangles), 3),
            "suture_targets": (len(self.suture_nodes), 3),
            "suture_edges": (len(self.suture_edges), 2),
            "prescribed_conormals": (len(self.suture_edges), 3),
            "template_height": (len(self.free_edge_nodes),),
            "distance_to_suture": (len(self.points),),
        }
        for name, shape in expected.items():
            if np.shape(getattr(self, name)) != shape:
                found = np.shape(getattr(self, name))
                raise ValueError(f"CuspSurface.{name}: shape {found}, expected {shape}")
        lost = int((~np.isfinite(self.points)).any(axis=1).sum())
        if lost:
            raise SolveError(f"{lost} of {len(self.points)} cusp nodes have no finite position")


@dataclass(frozen=True)
class Constraints:
    """What a cusp must stay within; root and plane are common to the three.

    Parameters
    ----------
    radius : float
        R of the root [mm].
    wedge : (m, 2) array
        Dense curve of the contact wedge in the plane of commissures [mm].
    wedge_inside : (2,) array
        A point on the cusp's own side of it [mm].
    plane_point, plane_normal : (3,) arrays
        A_0 and the unit normal n of the plane of commissures (1.6).
    free_edge_clearance : float
        d_0 of (1.6) [mm].
    taper : float
        Distance from the suture in the template within which the wall clearance tapers [mm].
    layer_clearance : float
        Distance that layers of the cusp keep from each other away from its suture [mm].
    unrestricted : float
        Distance from the suture in the template within which they need not [mm].
    """

    radius: float
    wedge: Array
    wedge_inside: Array
    plane_point: Array
    plane_normal: Array
    free_edge_clearance: float
    taper: float
    layer_clearance: float
    unrestricted: float


def verify_cusp(
    surface: CuspSurface, constraints: Constraints, residual: float
) -> CuspVerification:
    """Measure one cusp.

    Parameters
    ----------
    surface : CuspSurface
        The result.
    constraints : Constraints
        What it must stay within.
    residual : float
        Relative residual of the final undamped equilibrium, as the solver reports it: the one
        figure that is passed through.
    """
    points, triangles = surface.points, surface.triangles
    beyond, near_suture = closest_layers(
        points,
        surface.template_points,
        triangles,
        surface.distance_to_suture,
        constraints.unrestricted,
        surface.thickness,
        constraints.layer_clearance,
    )
    return CuspVerification(
        residual=float(residual),
        suture_error_mm=suture_error_mm(points[surface.suture_nodes], surface.suture_targets),
        clamp_error_deg=clamp_error_deg(
            points, triangles, surface.suture_edges, surface.prescribed_conormals
        ),
        outside_root_mm=outside_root_mm(points, constraints.radius),
        outside_wedge_mm=outside_wedge_mm(points, constraints.wedge, constraints.wedge_inside),
        edges_outside_wedge_mm=edges_outside_wedge_mm(
            points, triangles, constraints.wedge, constraints.wedge_inside
        ),
        free_edge_sag_mm=free_edge_sag_mm(
            points[surface.free_edge_nodes],
            surface.template_height,
            constraints.plane_point,
            constraints.plane_normal,
            constraints.free_edge_clearance,
        ),
        self_intersections=self_intersections(points, triangles),
        min_wall_distance_mm=min_wall_distance(
            points, constraints.radius, surface.distance_to_suture, constraints.taper
        ),
        closest_layers_mm=beyond,
        closest_layers_near_suture_mm=near_suture,
    )


def verify_valve(
    surfaces: Sequence[CuspSurface],
    constraints: Sequence[Constraints],
    residuals: Sequence[float],
) -> ValveVerification:
    """Measure each cusp and the cusps against each other.

    Raises
    ------
    ValueError
        When the sequences differ in length or are empty.
    """
    cusps = tuple(
        verify_cusp(*given) for given in zip(surfaces, constraints, residuals, strict=True)
    )
    bare = [(surface.points, surface.triangles) for surface in surfaces]
    pairs = [(a, b) for k, a in enumerate(bare) for b in bare[k + 1 :]]
    return ValveVerification(
        cusps=cusps,
        cusp_intersections=cusp_intersections(bare),
        min_distance_mm=min((min_distance(*a, *b) for a, b in pairs), default=np.inf),
        min_wall_distance_mm=min(cusp.min_wall_distance_mm for cusp in cusps),
    )
