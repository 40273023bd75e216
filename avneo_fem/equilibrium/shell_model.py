"""One cusp as a finite-element shell: few compiled kernels, plain arrays outside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem import compat
from avneo_fem.compat import fem, fem_petsc, ufl
from avneo_fem.mechanics.bending import bending_energy_density, bending_force_density
from avneo_fem.mechanics.loads import (
    free_edge_energy_density,
    pressure_force_density,
    pressure_work_density,
)
from avneo_fem.mechanics.materials import material_named
from avneo_fem.mechanics.membrane import membrane_energy_density
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["ShellModel", "ShellParameters"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FREE_EDGE = 1
#: strain whose membrane force stands for the load where there is little pressure
_LOADING_STRAIN = 0.05

#: Entries of the one constant vector in the kernels
_CONSTANTS: dict[str, int | slice] = {
    "young_modulus": 0,
    "thickness": 1,
    "pressure": 2,
    "free_edge_load": 3,
    "free_edge_width": 4,
    "free_edge_clearance": 5,
    "template_level": 6,
    "plane_point": slice(7, 10),
    "plane_normal": slice(10, 13),
}
_NUMBER_OF_CONSTANTS = 13


@dataclass(frozen=True)
class ShellParameters:
    """What the kernels take as constants; changing any of them compiles nothing.

    Attributes
    ----------
    material : str
        ``neo_hookean`` or ``st_venant_kirchhoff``.
    bending : bool
        Kirchhoff-Love bending on or off (c^b of (1.7)); off allocates no edge angles.
    degree : int
        Polynomial degree k of the positions; above 1 ``equilibrium.high_order_shell`` takes over.
    membrane_quadrature : int or None
        Quadrature degree of the membrane energy; None: 2k - 2, but 1 for k = 1.
    membrane_projection : bool
        Degree 2 only: keep thin curved shells from locking (``mechanics.projected_strain``).
    young_modulus, thickness, pressure : float
        E [kPa], H [mm], P [kPa].
    free_edge_stiffness, free_edge_width, free_edge_clearance : float
        eta_1 [kPa], eta_2 [mm], d_0 = -eta_3 [mm] of (1.6).
    plane_point, plane_normal : (3,) arrays
        A_0 and n of the plane of commissures.
    template_level : float
        N_0 . e_2, height of the corners in template coordinates [mm].
    """

    material: str = "neo_hookean"
    bending: bool = True
    degree: int = 1
    membrane_quadrature: int | None = None
    membrane_projection: bool = True
    young_modulus: float = 1000.0
    thickness: float = 0.5
    pressure: float = 8.0
    free_edge_stiffness: float = 80.0
    free_edge_width: float = 0.1
    free_edge_clearance: float = 0.0
    plane_point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    plane_normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    template_level: float = 0.0


class ShellModel:
    """Energy, residual and tangent of a cusp under pressure and free-edge force.

    The state is one vector ``u`` with the current node positions (``position_dofs``, (n, 3)) and,
    with bending, one director angle per edge (``angle_dofs``, (e,)), cf. ``mechanics.bending``.

    Parameters
    ----------
    mesh : CuspMesh
        Flat template, which is the stress-free state.
    parameters : ShellParameters
        Constants of the model.

    Notes
    -----
    Directors start as the template's normal e_3; ``equilibrium.directors`` moves them.
    """

    def __init__(self, mesh: CuspMesh, parameters: ShellParameters) -> None:
        self.mesh, self.parameters = mesh, parameters
        self.domain = compat.create_mesh(mesh.points, mesh.triangles)
        self._make_space(parameters.degree)
        self._state, self._base = fem.Function(self.space), fem.Function(self.space)
        # one constant with all numbers: UFL orders several by the text of their serial numbers
        # ("10" < "9"), so that the same form would now and then be compiled again
        self._constants = fem.Constant(self.domain, np.zeros(_NUMBER_OF_CONSTANTS))
        for name in _CONSTANTS:
            if name != "free_edge_load":
                self._set(name, getattr(parameters, name))
        self.free_edge_stiffness = parameters.free_edge_stiffness
        self._compile(parameters)

    def _make_space(self, degree: int) -> None:
        """Space of the state and the places of positions and angles in it."""
        if degree != 1:
            raise ValueError("this shell is piecewise linear; see high_order_shell.shell_model")
        mesh = self.mesh
        position_element = compat.vector_element(self.domain, "Lagrange")
        if self.parameters.bending:
            angle_element = compat.scalar_element(self.domain, "CR")
            self.space = compat.mixed_space(self.domain, [position_element, angle_element])
            position_space, position_map = self.space.sub(0).collapse()
            angle_space, angle_map = self.space.sub(1).collapse()
            midpoints = mesh.points[mesh.edges].mean(axis=1)
            rows = compat.match_points(angle_space.tabulate_dof_coordinates(), midpoints)
            self.angle_dofs: Ints = np.asarray(angle_map, dtype=np.int64)[rows]
            self._director, rows = self._edge_function(midpoints, 3)
            self._director_rows = rows
            self._direction, rows = self._edge_function(midpoints, 2)
            along = np.diff(mesh.points[mesh.edges], axis=1)[:, 0]
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            self._direction.x.array.reshape(-1, 2)[rows] = along
            self.set_directors(np.tile([0.0, 0.0, 1.0], (len(midpoints), 1)))
        else:
            self.space = compat.function_space(self.domain, position_element)
            position_space, position_map = self.space, np.arange(3 * len(mesh.points))
            self.angle_dofs = np.empty(0, dtype=np.int64)
        nodes = compat.match_points(position_space.tabulate_dof_coordinates(), mesh.points)
        self._place_positions(nodes, position_map, mesh.points)

    def _place_positions(self, nodes: Ints, position_map: Any, points: Floats) -> None:
        blocks = 3 * nodes[:, None] + np.arange(3)
        self.position_dofs: Ints = np.asarray(position_map, dtype=np.int64)[blocks]
        self.node_points = points

    def _bending(self, rigidity: Any, test: Any) -> tuple[Any, Any]:
        """Bending energy (None: not a form) and its residual, a linear form in ``test``."""
        position, angle = self._split(self._state)
        density = bending_energy_density(
            self.domain, position, angle, self._director, self._direction, rigidity
        )
        force = bending_force_density(
            self.domain,
            (position, angle),
            self._split(test),
            self._director,
            self._direction,
            rigidity,
        )
        return density * self._dx(1), force * self._dx(1)

    def _projected_strain(self, position: Any) -> Any:
        """What stands for C in the membrane energy; None: F^T F itself."""
        return None

    def _dx(self, degree: int) -> Any:
        metadata = {"quadrature_degree": degree}
        return ufl.Measure("dx", domain=self.domain, metadata=metadata)

    def _compile(self, p: ShellParameters) -> None:
        c = {name: _part(self._constants, place) for name, place in _CONSTANTS.items()}
        position, _ = self._split(self._state)
        start, _ = self._split(self._base)
        gradient = ufl.grad(position)
        # P x cofactor of F: degree 3k - 2 with the position, exactly
        membrane_dx, pressure_dx = self._dx(self.membrane_quadrature), self._dx(3 * p.degree - 2)
        ends = self.mesh.points[self.mesh.free_edge]
        tags = compat.edge_tags(self.domain, (ends[:-1] + ends[1:]) / 2, _FREE_EDGE)
        ds = ufl.Measure(
            "ds",
            domain=self.domain,
            subdomain_data=tags,
            metadata={"quadrature_degree": 2 * p.degree},
        )(_FREE_EDGE)
        material = material_named(p.material, c["young_modulus"])
        projected = self._projected_strain(position)
        density = membrane_energy_density(gradient, material, c["thickness"], projected)
        energy = density * membrane_dx
        height = ufl.dot(position - c["plane_point"], c["plane_normal"]) - (
            ufl.SpatialCoordinate(self.domain)[1] - c["template_level"]
        )
        support = free_edge_energy_density(
            height, c["free_edge_load"], c["free_edge_width"], c["free_edge_clearance"]
        )
        energy += support * ds
        test, trial = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        residual = ufl.derivative(energy, self._state, test)
        if p.bending:
            rigidity = c["young_modulus"] * c["thickness"] ** 3 / 12
            bending, force = self._bending(rigidity, test)
            residual += force
            energy = energy + bending if bending is not None else energy
        virtual, _ = self._split(test)
        residual -= ufl.dot(pressure_force_density(gradient, c["pressure"]), virtual) * pressure_dx
        work = pressure_work_density(position, start, c["pressure"]) * pressure_dx
        self._energy_form = compat.compile_form(energy)
        self._work_form = compat.compile_form(work)
        self._residual_form = compat.compile_form(residual)
        self._tangent_form = compat.compile_form(ufl.derivative(residual, self._state, trial))
        self._vector = fem_petsc.create_vector(self._residual_form)
        self._matrix = fem_petsc.create_matrix(self._tangent_form)

    def _edge_function(self, midpoints: Floats, dimension: int) -> tuple[Any, Ints]:
        """Crouzeix-Raviart vector function and the row of its array for each edge."""
        element = compat.vector_element(self.domain, "CR", dimension)
        space = compat.function_space(self.domain, element)
        return fem.Function(space), compat.match_points(space.tabulate_dof_coordinates(), midpoints)

    def _set(self, name: str, value: Any) -> None:
        self._constants.value[_CONSTANTS[name]] = value

    def _split(self, function: Any) -> tuple[Any, Any]:
        """Positions and angles of a function or an argument of the space."""
        return ufl.split(function)[:2] if self.parameters.bending else (function, None)

    # -- constants -------------------------------------------------------------------------
    @property
    def pressure(self) -> float:
        """P [kPa]; may be set between solves."""
        return float(self._constants.value[_CONSTANTS["pressure"]])

    @pressure.setter
    def pressure(self, value: float) -> None:
        self._set("pressure", value)

    @property
    def free_edge_stiffness(self) -> float:
        """eta_1 of (1.6) [kPa]; may be set between solves."""
        return self._free_edge_stiffness

    @free_edge_stiffness.setter
    def free_edge_stiffness(self, value: float) -> None:
        self._free_edge_stiffness = value
        along = np.diff(self.mesh.points[self.mesh.free_edge], axis=0)
        length = np.linalg.norm(along, axis=1).sum()
        self._set("free_edge_load", value * self.mesh.area / length)

    def set_directors(self, directors: Floats) -> None:
        """Reference directors p_e, (e, 3) unit vectors in the order of ``mesh.edges``."""
        self.directors = directors.copy()
        self._director.x.array.reshape(-1, 3)[self._director_rows] = directors

    @property
    def membrane_quadrature(self) -> int:
        """Quadrature degree of the membrane energy."""
        chosen = self.parameters.membrane_quadrature
        return max(2 * self.parameters.degree - 2, 1) if chosen is None else chosen

    @property
    def node_areas(self) -> Floats:
        """(n,) share of the template's area that goes with each node [mm^2]."""
        return self.mesh.node_areas

    # -- assembly --------------------------------------------------------------------------
    @property
    def size(self) -> int:
        """Number of unknowns, constrained ones included."""
        return len(self._state.x.array)

    def _put(self, function: Any, state: Floats) -> None:
        function.x.array[:] = state

    def _assembled_residual(self) -> Floats:
        with self._vector.localForm() as local:
            local.set(0.0)
        fem_petsc.assemble_vector(self._vector, self._residual_form)
        return self._vector.array.copy()

    def _assembled_tangent(self) -> sp.csr_matrix:
        self._matrix.zeroEntries()
        fem_petsc.assemble_matrix(self._matrix, self._tangent_form)
        self._matrix.assemble()
        rows, columns, values = self._matrix.getValuesCSR()
        return sp.csr_matrix((values, columns, rows), shape=self._matrix.size)

    def load_scale(self) -> float:
        """Force that residuals are given relative to [mN].

        P x area of the template, or, where that is less, the membrane force of a strain of 5 %
        across it: without much pressure, gathering is what loads a cusp.
        """
        given, area = self.parameters, self.mesh.area
        membrane = _LOADING_STRAIN * given.young_modulus * given.thickness * np.sqrt(area)
        return float(max(given.pressure * area, membrane))

    def energy(self, state: Floats) -> float:
        """Membrane, bending and free-edge energy [mN mm]."""
        self._put(self._state, state)
        return float(fem.assemble_scalar(self._energy_form))

    def pressure_work(self, state: Floats, base: Floats) -> float:
        """Work of the pressure on the straight way from ``base`` to ``state`` [mN mm]."""
        self._put(self._state, state)
        self._put(self._base, base)
        return float(fem.assemble_scalar(self._work_form))

    def residual(self, state: Floats) -> Floats:
        """Gradient of the energy minus the pressure force, (size,) [mN; mN mm for angles]."""
        self._put(self._state, state)
        return self._assembled_residual()

    def tangent(self, state: Floats) -> sp.csr_matrix:
        """Derivative of :meth:`residual`, (size, size)."""
        self._put(self._state, state)
        return self._assembled_tangent()


def _part(vector: Any, place: int | slice) -> Any:
    """One entry of a UFL vector, or several as a vector."""
    if isinstance(place, int):
        return vector[place]
    return ufl.as_vector([vector[row] for row in range(place.start, place.stop)])
