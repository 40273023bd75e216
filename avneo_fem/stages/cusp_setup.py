"""Everything the stages of one cusp work with, built from the scene."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from avneo_fem.constraints.clamp_penalty import ClampPenalty
from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.newton import NewtonSettings, NewtonSolver
from avneo_fem.equilibrium.relaxation import Relaxation, RelaxationSettings
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.geometry.contact_wedge import ContactWedge, ContactWedgeFamily
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.scene import Scene
from avneo_fem.stages.blocked_edge import LaidRow, blocked_row
from avneo_fem.stages.placement import place_template

__all__ = ["CuspSetup", "clearances", "near_suture"]

Floats = NDArray[np.float64]


def clearances(scene: Scene, index: int, distance_to_suture: Floats) -> tuple[Floats, Floats]:
    """d_0 of every node from wall and contact wedge [mm] (design.md §1, reading of (1.5)).

    From the wedge half the thickness; from the wall the same, tapered so that the cusp can leave
    its sutured edge along the wall: H/2 min(1, s/taper)^2 at distance s from the suture.
    """
    thickness = scene.cusp[index].template.thickness
    wedge = thickness / 2 if scene.contact.clearance is None else scene.contact.clearance
    wall = thickness / 2 if scene.wall.clearance is None else scene.wall.clearance
    taper = scene.wall_taper(thickness)
    share = np.ones(len(distance_to_suture))
    if taper > 0:
        share = np.square(np.minimum(1.0, distance_to_suture / taper))
    return wall * share, np.full(len(distance_to_suture), wedge)


def near_suture(clearance: Floats, line: Floats, mesh: CuspMesh, taper: float) -> Floats:
    """Clearance from the wedge where the sutured edge itself lies closer (design.md §1).

    Parameters
    ----------
    clearance : (n,) array
        d_0 of every node [mm].
    line : (k,) array
        Distance of the sutured nodes from the wedge of lambda = 1 [mm].
    mesh : CuspMesh
    taper : float
        Distance in the template over which d_0 grows from that of the edge to its full value.

    Returns
    -------
    (n,) array
        d_0 [mm]; unchanged where the nearest sutured node keeps it.
    """
    _, nearest = cKDTree(mesh.points[mesh.suture_line]).query(mesh.points)
    at_edge = np.clip(line[nearest], 0.0, clearance)
    share = np.minimum(1.0, mesh.distance_to_suture / taper)
    return at_edge + (clearance - at_edge) * share


class CuspSetup:
    """Model, constraints and solver of one cusp; the edge is held from the start.

    Parameters
    ----------
    scene, geometry, wedges
        The valve.
    index : int
        Which cusp.
    mesh : CuspMesh
        Its triangulated template.
    start : (n, 3) array or None
        Where the nodes start [mm]; None: the template is placed as in the paper.

    Attributes
    ----------
    start : (n, 3) array
        First positions; ``placement_k`` is the k of the paper's search, 0 without one.
    target : (k, 3) array
        Where the sutured nodes go.
    conormal : (k-1, 3) array
        Prescribed outward conormal b of the suture edges.
    path_pressure : float
        Pressure until the first row is in place [kPa], P or more.
    wedge_clearance : (n,) array
        d_0 that the surface must keep from the contact wedge [mm]; ``wedge.clearance``, that of
        the nodes, may become more.
    """

    def __init__(
        self,
        scene: Scene,
        geometry: ValveGeometry,
        wedges: ContactWedgeFamily,
        index: int,
        mesh: CuspMesh,
        start: Floats | None = None,
    ) -> None:
        self.scene, self.wedges, self.index, self.mesh = scene, wedges, index, mesh
        self.geometry, self.cusp = geometry, geometry.cusps[index]
        self.start, self.placement_k = self._place() if start is None else (start, 0)
        clock = time.perf_counter()
        self.model = ShellModel(mesh, self._parameters())
        self.compile_seconds = time.perf_counter() - clock
        self.path_pressure = scene.path_pressure(self.cusp.thickness)
        self.target = self.cusp.sutured_position(mesh.suture_arc_length)
        middles = (mesh.suture_arc_length[1:] + mesh.suture_arc_length[:-1]) / 2
        self.conormal = self.cusp.sutured_conormal(middles)
        self.wall, self.wedge = self._penalties()
        self.wedge_clearance = self.wedge.clearance
        self.wedge.field = self.wedge_field(0.0)
        self.clamp = self._clamp()
        self.layers = self._layers()
        self.row = self._blocked_row()
        self.clamp.active = self.row.has_room
        membrane = scene.material.young_modulus * self.cusp.thickness
        self.contact = self._self_contact(membrane)
        self.system = CuspSystem(self.model, self.contact)
        self.system.fix(self.model.position_dofs[mesh.suture_line])
        self._solver(membrane / geometry.commissures.circumradius**2)

    def on_mesh(self, mesh: CuspMesh, start: Floats) -> CuspSetup:
        """The same cusp on another mesh, its penalties as stiff as they are now."""
        other = CuspSetup(self.scene, self.geometry, self.wedges, self.index, mesh, start)
        other.compile_seconds += self.compile_seconds
        other.newton.iterations = self.newton.iterations
        other.system.stopwatch = self.system.stopwatch
        other.wall.stiffness, other.wedge.stiffness = self.wall.stiffness, self.wedge.stiffness
        other.clamp.stiffness = self.clamp.stiffness
        other.layers.stiffness = self.layers.stiffness
        other.wedge.field = self.wedge.field
        return other

    def wedge_field(self, lam: float) -> ContactWedge:
        """Contact wedge of lambda, its corners rounded as far as the penalty acts."""
        reach = float(self.wedge.clearance.max()) + self.wedge.width / 2
        return self.wedges.wedge(self.index, lam).rounded(reach)

    def _place(self) -> tuple[Floats, int]:
        plane, scene, i = self.geometry.commissures, self.scene, self.index
        line = self.cusp.suture_line
        return place_template(
            self.mesh.points,
            self.mesh.triangles,
            float(self.cusp.template.corners[0, 1]),
            (plane.points[(i + 1) % 3], plane.points[(i + 2) % 3]),
            plane.points[i],
            plane.normal,
            plane.circumradius,
            line.point(np.linspace(0.0, line.length, 500)),
            scene.placement.c0,
            scene.placement.c1,
        )

    def _parameters(self) -> ShellParameters:
        scene, plane = self.scene, self.geometry.commissures
        return ShellParameters(
            material=scene.material.model,
            bending=scene.material.bending,
            young_modulus=scene.material.young_modulus,
            thickness=self.cusp.thickness,
            pressure=scene.diastolic_pressure,
            free_edge_stiffness=scene.free_edge.stiffness,
            free_edge_width=scene.free_edge.width,
            free_edge_clearance=scene.free_edge.clearance,
            plane_point=tuple(plane.points[0]),
            plane_normal=tuple(plane.normal),
            template_level=float(self.cusp.template.corners[0, 1]),
        )

    def _penalties(self) -> tuple[SignedDistancePenalty, SignedDistancePenalty]:
        """Wall and wedge; neither acts until a stage puts it among the system's terms."""
        scene, mesh = self.scene, self.mesh
        from_wall, from_wedge = clearances(scene, self.index, mesh.distance_to_suture)
        line = self.wedges.wedge(self.index, 1.0).signed_distance(self.target)
        from_wedge = near_suture(from_wedge, line, mesh, 5 * self.cusp.thickness)
        options, areas = scene.wall, mesh.node_areas
        wall = SignedDistancePenalty(
            self.geometry.root, areas, options.stiffness, options.width, from_wall
        )
        wedge = SignedDistancePenalty(
            self.wedges.wedge(self.index, 0.0),
            areas,
            scene.contact.stiffness,
            scene.contact.width,
            from_wedge,
        )
        return wall, wedge

    def _layers(self) -> LayerClearance:
        scene, thickness = self.scene, self.cusp.thickness
        return LayerClearance(
            self.mesh,
            thickness,
            scene.layer_clearance(thickness),
            scene.layers_unrestricted(thickness),
            scene.layers.stiffness,
            scene.layers.width,
        )

    def _clamp(self) -> ClampPenalty:
        """Holds the triangles at the suture; acts from the stage ``clamped_edge`` on."""
        mesh = self.mesh
        ends = np.c_[mesh.suture_line[:-1], mesh.suture_line[1:]]
        corners = mesh.triangles[mesh.edge_cells[mesh.suture_edges, 0]]
        apex = corners[~(corners[:, :, None] == ends[:, None, :]).any(axis=2)]
        sides = np.stack([self.target[:-1], self.target[1:]], axis=1)
        lengths = np.linalg.norm(mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1)
        return ClampPenalty(len(mesh.points), apex, sides, self.conormal, lengths)

    def _blocked_row(self) -> LaidRow:
        return blocked_row(
            self.mesh,
            self.clamp.apex,
            self.target,
            self.conormal,
            self.wedges.wedge(self.index, 1.0),
            self.geometry.root,
            self.wedge.clearance,
            0.4 * self.scene.inside_tolerance(self.cusp.thickness),
            self.geometry.commissures.normal,
        )

    def _self_contact(self, membrane: float) -> SelfContact:
        options = self.scene.solver
        distance = options.barrier_distance
        if distance is None:
            distance = min(0.3 * self.cusp.thickness, 0.2 * self.scene.mesh_size)
        stiffness = options.barrier_stiffness * membrane / distance**2
        rest = np.c_[self.mesh.points, np.zeros(len(self.mesh.points))]
        return SelfContact(rest, self.mesh.triangles, distance, stiffness)

    def _solver(self, unit: float) -> None:
        """``unit`` is the membrane's stiffness E H / R^2 [kPa/mm], which scales all damping."""
        settings = NewtonSettings(
            maximum_iterations=self.scene.solver.maximum_iterations,
            largest_move=self.geometry.commissures.circumradius / 6,
            first_shift=0.03 * unit,
            largest_shift=1e7 * unit,
        )
        self.newton = NewtonSolver(self.system, settings)
        self.relaxation = Relaxation(self.system, self.newton, RelaxationSettings(unit))
