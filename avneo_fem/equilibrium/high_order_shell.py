"""One cusp as a shell of degree 2 or more: moments eliminated cell by cell."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from avneo_fem import compat
from avneo_fem.compat import fem, fem_petsc, ufl
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.mechanics.hybrid_bending import (
    angle_between,
    moment_on_cells,
    moment_on_edges,
    symmetric,
)
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["HighOrderShell", "shell_model"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def shell_model(mesh: CuspMesh, parameters: ShellParameters) -> ShellModel:
    """The model for ``parameters.degree``: the fast linear kernel, or :class:`HighOrderShell`."""
    if parameters.degree == 1:
        return ShellModel(mesh, parameters)
    return HighOrderShell(mesh, parameters)


class HighOrderShell(ShellModel):
    """Shell of degree k (``mechanics.hybrid_bending``), used like :class:`ShellModel`.

    The state holds the positions of all Lagrange nodes (``position_dofs``, (n, 3), vertices
    first, at ``node_points``) and k angle unknowns an edge (``angle_dofs``, (e, k)). Directors
    are given at the nodes, (n, 3).
    """

    def _make_space(self, degree: int) -> None:
        element = compat.vector_element(self.domain, "Lagrange", 3, degree)
        node_space = compat.function_space(self.domain, element)
        nodes = node_space.tabulate_dof_coordinates()[:, :2]
        if not self.parameters.bending:
            self.space = node_space
            self._unknowns = np.arange(3 * len(nodes))
            self.angle_dofs = np.empty((0, degree), dtype=np.int64)
            places = self._unknowns.reshape(-1, 3)
        else:
            trace = compat.edge_trace_element(self.domain, degree - 1)
            moment = compat.scalar_element(self.domain, "DG", degree - 1)
            # one space for all: DOLFINx 0.5.2 gets facet integrals of a rectangular form wrong
            parts = [element, trace, moment, moment, moment]
            self.space = compat.mixed_space(self.domain, parts)
            self._trace_space, trace_map = self.space.sub(1).collapse()
            self._moments = compat.dofs_of_parts(self.space, [2, 3, 4])
            of_edges = compat.edge_dofs(self._trace_space, degree)
            middle = self.mesh.points[self.mesh.edges].mean(axis=1)
            self._trace_dofs = of_edges[compat.match_edges(self.domain, middle)]
            angles = np.asarray(trace_map)[self._trace_dofs]
            every = np.arange(len(fem.Function(self.space).x.array))
            idle = np.setdiff1d(trace_map, angles)  # inside the cells, without a trace
            self._unknowns = np.setdiff1d(every, np.r_[self._moments, idle])
            number = np.full(len(every), -1)
            number[self._unknowns] = np.arange(len(self._unknowns))
            self.angle_dofs = number[angles]
            self._director = fem.Function(node_space)
            self._other_director = fem.Function(node_space)
            triples, where = compat.vector_nodes(self.space, degree)
            places = number[triples[compat.match_points(where, nodes)]]
        vertices = compat.match_points(nodes, self.mesh.points)
        order = np.r_[vertices, np.setdiff1d(np.arange(len(nodes)), vertices)]
        self.position_dofs: Ints = places[order]
        self.node_points = nodes[order]
        self._node_rows = order
        row = np.empty(len(order), dtype=np.int64)
        row[order] = np.arange(len(order))
        self.cell_nodes: Ints = row[compat.cell_dofs(node_space)]
        if self.parameters.bending:
            self.set_directors(np.tile([0.0, 0.0, 1.0], (len(order), 1)))

    def set_directors(self, directors: Floats) -> None:
        """Reference directors p at the nodes, (n, 3) unit vectors."""
        self.directors = directors.copy()
        self._director.x.array.reshape(-1, 3)[self._node_rows] = directors

    @cached_property
    def node_areas(self) -> Floats:
        """(n,) share of the template's area that goes with each node [mm^2], same for all nodes
        of a triangle."""
        count = self.cell_nodes.shape[1]
        weights = np.repeat(compat.cell_areas(self.domain) / count, count)
        shares = np.bincount(self.cell_nodes.ravel(), weights, minlength=len(self.node_points))
        return np.asarray(shares, float)

    # -- bending ---------------------------------------------------------------------------
    def _facets(self, kind: str) -> Any:
        metadata = {"quadrature_degree": 2 * self.parameters.degree - 1}
        return ufl.Measure(kind, domain=self.domain, metadata=metadata)

    def _around_cells(self, integrand: Any) -> Any:
        """Integral over the boundaries of all cells; ``integrand`` takes a restriction."""
        inner, outer = self._facets("dS"), self._facets("ds")
        both = integrand(lambda f: f("+")) + integrand(lambda f: f("-"))
        return both * inner + integrand(lambda f: f) * outer

    def _bending(self, rigidity: Any) -> tuple[Any, Any]:
        degree = self.parameters.degree
        position, rotation, *components = ufl.split(self._state)
        moment, normal = ufl.as_vector(components), ufl.FacetNormal(self.domain)
        work = self._around_cells(
            lambda side: moment_on_edges(
                side(position), side(rotation), side(self._director), side(moment), side(normal)
            )
        )
        if degree > 1:
            work += moment_on_cells(position, moment) * self._dx(2 * degree - 1)
        space = self._moment_space = compat.mixed_space(
            self.domain, [compat.scalar_element(self.domain, "DG", degree - 1)] * 3
        )
        test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        mass = ufl.inner(symmetric(test), symmetric(trial)) * self._dx(2 * degree - 2)
        self._unit_compliance, self._root = self._inverse_mass(compat.compile_form(mass))
        return None, work

    def _inverse_mass(self, form: Any) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Inverse of the block-diagonal mass matrix of the moments, and R with R^T R = it.

        Rows and columns run cell by cell, as ``self._moments`` does.
        """
        matrix = fem_petsc.assemble_matrix(form)
        matrix.assemble()
        rows, columns, values = matrix.getValuesCSR()
        dofs = compat.cell_dofs(self._moment_space)
        mass = sp.csr_matrix((values, columns, rows))[dofs.ravel()][:, dofs.ravel()]
        cells, count = dofs.shape
        here = np.arange(cells * count).reshape(cells, count)
        places = np.repeat(here, count, 1).ravel(), np.tile(here, (1, count)).ravel()
        blocks = np.linalg.inv(np.asarray(mass[places]).reshape(cells, count, count))
        upper = np.linalg.cholesky(blocks).transpose(0, 2, 1)
        return (
            sp.csr_matrix((blocks.ravel(), places), shape=mass.shape),
            sp.csr_matrix((upper.ravel(), places), shape=mass.shape),
        )

    @property
    def rigidity(self) -> float:
        """D = E H^3 / 12 [mN mm]."""
        return float(self._constants.value[0] * self._constants.value[1] ** 3 / 12)

    @property
    def size(self) -> int:
        """Number of unknowns, constrained ones included; the moments are none."""
        return len(self._unknowns)

    def _put(self, function: Any, state: Floats) -> None:
        function.x.array[self._unknowns] = state

    def _curvature(self) -> Floats:
        """Curvature of the present state tested with the moments."""
        return self._assembled_residual()[self._moments]

    def _update_moments(self, state: Floats) -> None:
        self._put(self._state, state)
        self._state.x.array[self._moments] = self.rigidity * (
            self._unit_compliance @ self._curvature()
        )

    def energy(self, state: Floats) -> float:
        """Membrane, bending and free-edge energy [mN mm]."""
        total = super().energy(state)
        if not self.parameters.bending:
            return total
        curvature = self._curvature()
        return total + float(self.rigidity / 2 * curvature @ (self._unit_compliance @ curvature))

    def residual(self, state: Floats) -> Floats:
        """Gradient of the energy minus the pressure force, (size,)."""
        if not self.parameters.bending:
            return super().residual(state)
        self._update_moments(state)
        return self._assembled_residual()[self._unknowns]

    def tangent(self, state: Floats) -> sp.csr_matrix:
        """Derivative of :meth:`residual`, (size, size); the moments are eliminated in it."""
        if not self.parameters.bending:
            return super().tangent(state)
        self._update_moments(state)
        whole = self._assembled_tangent()
        at_fixed_moments = whole[self._unknowns][:, self._unknowns]
        variation = self._root @ whole[self._moments][:, self._unknowns]
        return (at_fixed_moments + self.rigidity * (variation.T @ variation)).tocsr()

    # -- directors -------------------------------------------------------------------------
    def unit_rotations(self) -> Floats:
        """(e, k) entries of ``angle_dofs`` that turn an edge's director by 1 rad about the edge
        as stored in ``mesh.edges``."""
        along = np.diff(self.mesh.points[self.mesh.edges], axis=1)[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        parts = [
            compat.interpolated(self._trace_space, unit)[self._trace_dofs] for unit in np.eye(2)
        ]
        return along[:, :1] * parts[0] + along[:, 1:] * parts[1]

    def mean_normals(self, state: Floats) -> Floats:
        """(n, 3) unit means of the normals of the triangles at each node."""
        points = state[self.position_dofs]
        slopes = compat.lagrange_slopes(self.parameters.degree)
        tangents = np.einsum("cjd,qjr->cqdr", points[self.cell_nodes], slopes)
        plane = np.einsum("cjd,qjr->cqdr", self.node_points[self.cell_nodes], slopes)
        normal = np.cross(tangents[..., 0], tangents[..., 1])
        normal *= np.sign(np.linalg.det(plane))[..., None]
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        total = np.zeros_like(points)
        np.add.at(total, self.cell_nodes.ravel(), normal.reshape(-1, 3))
        length = np.linalg.norm(total, axis=1, keepdims=True)
        last = np.empty_like(points)
        last[self.cell_nodes.ravel()] = normal.reshape(-1, 3)
        return np.where(length < 1e-6, last, total / np.maximum(length, 1e-300))

    @cached_property
    def _trace_problem(self) -> tuple[Any, Any]:
        """Factorised mass matrix of the edge angles, and the form of their change on renewal."""
        test, trial = ufl.TestFunction(self._trace_space), ufl.TrialFunction(self._trace_space)
        position, _ = self._split(self._state)
        normal = ufl.FacetNormal(self.domain)

        def along(field: Any, nu: Any) -> Any:
            return ufl.dot(field, ufl.as_vector([-nu[1], nu[0]]))

        mass = self._around_cells(
            lambda side: along(side(test), side(normal)) * along(side(trial), side(normal))
        )
        change = self._around_cells(
            lambda side: (
                angle_between(
                    ufl.grad(side(position)),
                    side(self._other_director),
                    side(self._director),
                    side(normal),
                )
                * along(side(test), side(normal))
            )
        )
        matrix = fem_petsc.assemble_matrix(compat.compile_form(mass))
        matrix.assemble()
        rows, columns, values = matrix.getValuesCSR()
        dofs = self._trace_dofs.ravel()
        full = sp.csr_matrix((values, columns, rows))
        return splu(full[dofs][:, dofs].tocsc()), compat.compile_form(change)

    def start_directors(self, state: Floats) -> Floats:
        """Directors along the mean normals at the nodes; returns the state, angles 0."""
        if not self.parameters.bending:
            return state
        self.set_directors(self.mean_normals(state))
        result = state.copy()
        result[self.angle_dofs] = 0.0
        return result

    def renew_directors(self, state: Floats) -> Floats:
        """Measure the same directors from the present mean normals; the energy does not change."""
        if not self.parameters.bending:
            return state
        factors, change = self._trace_problem
        fresh = self.mean_normals(state)
        self._put(self._state, state)
        self._other_director.x.array.reshape(-1, 3)[self._node_rows] = fresh
        vector = fem_petsc.assemble_vector(change)
        result = state.copy()
        result[self.angle_dofs] += factors.solve(vector.array_r[self._trace_dofs.ravel()]).reshape(
            self._trace_dofs.shape
        )
        self.set_directors(fresh)
        return result
