"""One benchmark problem: a flat shell of any degree, held and loaded, solved by load steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem import compat
from avneo_fem.compat import fem, fem_petsc, ufl
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.directors import renew_directors, start_directors
from avneo_fem.equilibrium.high_order_shell import shell_model
from avneo_fem.equilibrium.newton import NewtonSettings, NewtonSolver, Verdict
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["Problem", "start"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Where = Callable[[Floats], NDArray[np.bool_]]


@dataclass
class Problem:
    """A shell with what holds and loads it; ``state`` is where it stands now.

    Places are chosen by functions of template coordinates (k, 2) that return (k,) booleans.
    """

    model: ShellModel
    system: CuspSystem
    state: Floats
    iterations: list[int] = field(default_factory=list)

    @property
    def positions(self) -> Floats:
        """(n, 3) current positions of the nodes ``model.node_points``."""
        return self.state[self.model.position_dofs]

    @property
    def displacements(self) -> Floats:
        """(n, 3) displacement of the nodes from the flat template in z = 0."""
        flat = np.c_[self.model.node_points, np.zeros(len(self.model.node_points))]
        return self.positions - flat

    def nodes(self, where: Where) -> Ints:
        """Nodes of the finite-element space at the places ``where``."""
        return np.flatnonzero(where(self.model.node_points))

    def edges(self, where: Where) -> Ints:
        """Edges of ``mesh.edges`` on the boundary whose midpoints are at the places ``where``."""
        mesh = self.model.mesh
        middle = mesh.points[mesh.edges].mean(axis=1)
        return np.flatnonzero((mesh.edge_cells[:, 1] < 0) & where(middle))

    def hold(self, where: Where, components: tuple[int, ...] = (0, 1, 2)) -> None:
        """Hold these components of the positions of the nodes at their present values."""
        self.system.fix(self.model.position_dofs[self.nodes(where)][:, list(components)])

    def clamp(self, where: Where) -> None:
        """Hold the directors of the boundary edges at their present directions."""
        self.system.fix(self.model.angle_dofs[self.edges(where)])

    def edge_load(self, where: Where, traction: Floats) -> Floats:
        """(size,) nodal forces of a dead ``traction`` (3,) per length of boundary [mN/mm]."""
        domain, edges = self.model.domain, self.edges(where)
        middle = self.model.mesh.points[self.model.mesh.edges[edges]].mean(axis=1)
        tags = compat.edge_tags(domain, middle, 1)
        ds = ufl.Measure("ds", domain=domain, subdomain_data=tags)(1)
        virtual, _ = self.model._split(ufl.TestFunction(self.model.space))
        value = fem.Constant(domain, np.asarray(traction, dtype=float))
        return self._assembled(ufl.dot(value, virtual) * ds)

    def edge_moment(self, where: Where, moment: float) -> Floats:
        """(size,) load of a ``moment`` per length [mN] about boundary edges at the places
        ``where``, positive about the edge run counter-clockwise round the mesh; it follows the
        edge as it turns."""
        mesh, edges = self.model.mesh, self.edges(where)
        ends = mesh.points[mesh.edges[edges]]
        inside = mesh.points[mesh.triangles[mesh.edge_cells[edges, 0]]].mean(axis=1)
        along, across = ends[:, 1] - ends[:, 0], inside - ends[:, 0]
        sense = np.sign(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
        load = np.zeros(self.model.size)
        if self.model.parameters.degree == 1:
            load[self.model.angle_dofs[edges]] = moment * sense * np.linalg.norm(along, axis=1)
            return load
        domain = self.model.domain
        tags = compat.edge_tags(domain, ends.mean(axis=1), 1)
        ds = ufl.Measure("ds", domain=domain, subdomain_data=tags)(1)
        _, rotation = self.model._split(ufl.TestFunction(self.model.space))
        normal = ufl.FacetNormal(domain)
        tangent = ufl.as_vector([-normal[1], normal[0]])
        value = fem.Constant(domain, np.float64(moment))
        return self._assembled(value * ufl.dot(rotation, tangent) * ds)

    def surface_load(self, force: Any, degree: int | None = None) -> Floats:
        """(size,) nodal forces of a dead load per reference area, a UFL vector (3) [kPa];
        ``degree`` of the quadrature, UFL's estimate if None."""
        virtual, _ = self.model._split(ufl.TestFunction(self.model.space))
        metadata = {} if degree is None else {"quadrature_degree": degree}
        dx = ufl.Measure("dx", domain=self.model.domain, metadata=metadata)
        return self._assembled(ufl.dot(force, virtual) * dx)

    def _assembled(self, form: Any) -> Floats:
        vector = fem_petsc.assemble_vector(compat.compile_form(form)).array_r
        unknowns = getattr(self.model, "_unknowns", slice(None))
        return np.asarray(vector[unknowns])

    def solve(self, tolerance: float = 1e-8, maximum_iterations: int = 100) -> Verdict:
        """Newton iteration from the present state; its verdict. Raises when it fails."""
        settings = NewtonSettings(largest_move=1e30, first_shift=1e-6)
        newton = NewtonSolver(self.system, settings)
        state = renew_directors(self.model, self.state)
        state, verdict = newton.solve(state, tolerance, maximum_iterations=maximum_iterations)
        if not verdict.converged:
            raise RuntimeError(f"benchmark did not converge: {verdict}")
        self.state = state
        self.iterations.append(verdict.iterations)
        return verdict


def start(
    mesh: CuspMesh, degree: int, force_scale: float | None = None, **parameters: Any
) -> Problem:
    """Flat shell in z = 0, nothing held or loaded; ``parameters`` as in ``ShellParameters``.

    ``force_scale`` [mN] is what residuals are given relative to (default: P x area).
    """
    chosen = {"material": "st_venant_kirchhoff", "pressure": 0.0, "free_edge_stiffness": 0.0}
    model = shell_model(mesh, ShellParameters(degree=degree, **(chosen | parameters)))
    system = CuspSystem(model, None)
    system.force_scale = force_scale
    state = np.zeros(model.size)
    state[model.position_dofs[:, :2]] = model.node_points
    return Problem(model, system, start_directors(model, state))
