"""One cusp as a shell of degree 2 or more: moments eliminated cell by cell."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import combinations
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
    moment_force_in_cells,
    moment_force_on_edges,
    moment_on_cells,
    moment_on_edges,
    symmetric,
)
from avneo_fem.mechanics.projected_strain import projected_right_cauchy_green
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

    _curvature_at: Floats | None = None
    _places: tuple[Any, ...] | None = None

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
            self.space = compat.mixed_space(self.domain, [element, trace])
            self._trace_space, trace_map = self.space.sub(1).collapse()
            of_edges = compat.edge_dofs(self._trace_space, degree)
            middle = self.mesh.points[self.mesh.edges].mean(axis=1)
            self._trace_dofs = of_edges[compat.match_edges(self.domain, middle)]
            angles = np.asarray(trace_map)[self._trace_dofs]
            every = np.arange(len(fem.Function(self.space).x.array))
            idle = np.setdiff1d(trace_map, angles)  # inside the cells, without a trace
            self._unknowns = np.setdiff1d(every, idle)
            number = np.full(len(every), -1)
            number[self._unknowns] = np.arange(len(self._unknowns))
            self.angle_dofs = number[angles]
            self._gradient = self._edge_gradients()
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
        self._curvature_at = None
        self._director.x.array.reshape(-1, 3)[self._node_rows] = directors

    @cached_property
    def node_areas(self) -> Floats:
        """(n,) share of the template's area that goes with each node [mm^2], same for all nodes
        of a triangle."""
        count = self.cell_nodes.shape[1]
        weights = np.repeat(compat.cell_areas(self.domain) / count, count)
        shares = np.bincount(self.cell_nodes.ravel(), weights, minlength=len(self.node_points))
        return np.asarray(shares, float)

    def _projected_strain(self, position: Any) -> Any:
        if self.parameters.degree != 2 or not self.parameters.membrane_projection:
            return None
        element = compat.vector_element(self.domain, "DG", 3, 1)
        barycentric = fem.Function(compat.function_space(self.domain, element))
        rows = compat.cell_dofs(barycentric.function_space)
        barycentric.x.array.reshape(-1, 3)[rows] = np.eye(3)
        return projected_right_cauchy_green(self.domain, position, barycentric)

    # -- bending ---------------------------------------------------------------------------
    def _around_cells(self, integrand: Callable[[Any], Any]) -> Any:
        """Integral over the boundaries of all cells; ``integrand`` takes the outward normal nu.

        A cell integral with points on the edges: a facet integral would couple all unknowns of
        both cells, though an edge's angle sees one cell at a time.
        """
        degree = self.parameters.degree
        shares, weights = np.polynomial.legendre.leggauss(degree)
        along = (1 + shares[:, None]) / 2
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        points = np.vstack([(1 - along) * a + along * b for a, b in combinations(corners, 2)])
        metadata = {
            "quadrature_rule": "custom",
            "quadrature_degree": 2 * degree - 1,
            # tuples: of an array UFL would put a rounded text into the form's signature
            "quadrature_points": tuple(tuple(map(float, point)) for point in points),
            "quadrature_weights": tuple(map(float, np.tile(weights / 2, 3))),
        }
        measure = ufl.Measure("dx", domain=self.domain, metadata=metadata)
        # the barycentric gradient of an edge has its length over twice the area
        steepness = ufl.sqrt(ufl.dot(self._gradient, self._gradient))
        return steepness * integrand(-self._gradient / steepness) * measure

    def _edge_gradients(self) -> Any:
        """Function that is grad lambda_e at the Gauss points of every edge e of a cell, where
        the barycentric coordinate lambda_e vanishes.

        The Legendre polynomial P_k(1 - 2 lambda_e) is 1 on e and 0 at the points of the others.
        One rule for the three edges, and not three: with three rules of one point each the energy
        came out wrong (FFCx 0.5.2).
        """
        degree = self.parameters.degree
        element = compat.vector_element(self.domain, "DG", 2, degree)
        function = fem.Function(compat.function_space(self.domain, element))
        nodes = function.function_space.tabulate_dof_coordinates()[:, :2]
        of_cells = compat.cell_dofs(function.function_space)
        corners = compat.cell_corners(self.domain)
        across = np.roll(corners, 1, axis=1) - np.roll(corners, 2, axis=1)
        gradients = np.stack([-across[..., 1], across[..., 0]], axis=2)
        heights = np.einsum("ced,ced->ce", corners - np.roll(corners, 1, axis=1), gradients)
        gradients /= heights[..., None]
        away = nodes[of_cells][:, :, None] - np.roll(corners, 1, axis=1)[:, None]
        coordinate = np.einsum("cned,ced->cne", away, gradients)
        share = np.polynomial.legendre.Legendre.basis(degree)(1 - 2 * coordinate)
        values = np.einsum("cne,ced->cnd", share, gradients)
        function.x.array.reshape(-1, 2)[of_cells] = values
        return function

    def _bending(self, rigidity: Any, test: Any) -> tuple[Any, Any]:
        degree = self.parameters.degree
        space = compat.mixed_space(
            self.domain, [compat.scalar_element(self.domain, "DG", degree - 1)] * 3
        )
        self._moment = fem.Function(space)
        position, rotation = ufl.split(self._state)
        moment = ufl.as_vector(ufl.split(self._moment))
        work = self._around_cells(
            lambda normal: moment_on_edges(position, rotation, self._director, moment, normal)
        )
        if degree > 1:
            work += moment_on_cells(position, moment) * self._dx(2 * degree - 1)
        moment_test, moment_trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        mass = ufl.inner(symmetric(moment_test), symmetric(moment_trial))
        force = self._moment_force(work, test)
        self._curvature_form = compat.compile_form(ufl.derivative(work, self._moment, moment_test))
        # rows for the state: with rows for the moments DOLFINx 0.5.2 assembles wrong entries
        self._slope_form = compat.compile_form(ufl.derivative(force, self._moment, moment_trial))
        self._slope_matrix = fem_petsc.create_matrix(self._slope_form)
        self._moments = compat.cell_dofs(space)
        self._invert_mass(compat.compile_form(mass * self._dx(2 * degree - 2)))
        return None, force

    def _moment_force(self, work: Any, test: Any) -> Any:
        """Variation of the work of the moments with the state, derived by hand."""
        position, _ = self._split(self._state)
        virtual, moment = self._split(test), ufl.as_vector(ufl.split(self._moment))
        force = self._around_cells(
            lambda normal: moment_force_on_edges(position, virtual, self._director, moment, normal)
        )
        degree = self.parameters.degree
        if degree > 1:
            force += moment_force_in_cells(position, virtual[0], moment) * self._dx(2 * degree - 1)
        return force

    def _invert_mass(self, form: Any) -> None:
        """Inverse blocks of the mass matrix of the moments cell by cell, and roots R^T R = it."""
        mass = compat.assembled_matrix(form)
        cells, count = self._moments.shape
        places = np.repeat(self._moments, count, 1).ravel(), np.tile(self._moments, count).ravel()
        blocks = np.linalg.inv(np.asarray(mass[places]).reshape(cells, count, count))
        self._unit_compliance: Floats = blocks
        self._root: Floats = np.linalg.cholesky(blocks).transpose(0, 2, 1)

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
        """(m, q) curvature of the present state tested with the moments of each cell.

        Kept until state or directors change: a Newton step asks three times at the same state.
        """
        state = self._state.x.array
        if self._curvature_at is None or not np.array_equal(self._curvature_at, state):
            vector = fem_petsc.assemble_vector(self._curvature_form)
            self._kept_curvature: Floats = vector.array_r[self._moments]
            self._curvature_at = state.copy()
            vector.destroy()
        return self._kept_curvature

    def _update_moments(self, state: Floats) -> None:
        self._put(self._state, state)
        strain = np.einsum("cij,cj->ci", self._unit_compliance, self._curvature())
        self._moment.x.array[self._moments] = self.rigidity * strain

    def energy(self, state: Floats) -> float:
        """Membrane, bending and free-edge energy [mN mm]."""
        total = super().energy(state)
        if not self.parameters.bending:
            return total
        self._update_moments(state)
        return total + float(np.vdot(self._moment.x.array[self._moments], self._curvature()) / 2)

    def residual(self, state: Floats) -> Floats:
        """Gradient of the energy minus the pressure force, (size,)."""
        if self.parameters.bending:
            self._update_moments(state)
        else:
            self._put(self._state, state)
        return self._assembled_residual()[self._unknowns]

    def tangent(self, state: Floats) -> sp.csr_matrix:
        """Derivative of :meth:`residual`, (size, size); the moments are eliminated in it."""
        if not self.parameters.bending:
            return super().tangent(state)
        self._update_moments(state)
        whole = self._assembled_tangent()
        self._slope_matrix.zeroEntries()
        fem_petsc.assemble_matrix(self._slope_matrix, self._slope_form)
        self._slope_matrix.assemble()
        slopes = self._slope_matrix.getValuesCSR()
        if self._places is None:
            self._places = self._find_places(whole, slopes)
        of_slopes, of_blocks, kept, indices, starts = self._places
        variation = slopes[2][of_slopes] @ self._root.transpose(0, 2, 1)
        blocks = self.rigidity * (variation @ variation.transpose(0, 2, 1))
        values = whole.data + np.bincount(of_blocks, blocks.ravel(), minlength=whole.nnz)
        return sp.csr_matrix((values[kept], indices, starts), shape=(self.size, self.size))

    def _find_places(self, whole: sp.csr_matrix, slopes: Any) -> tuple[Any, ...]:
        """Where the entries of the cells stand in the assembled matrices, whose patterns stay."""
        dofs, moments = compat.cell_dofs(self.space), self._moments
        of_slopes = _places_in(slopes[0], slopes[1], dofs, moments)
        of_blocks = _places_in(whole.indptr, whole.indices, dofs, dofs)
        order = sp.csr_matrix((np.arange(whole.nnz), whole.indices, whole.indptr), whole.shape)
        kept = order[self._unknowns][:, self._unknowns]
        return of_slopes, of_blocks.ravel(), kept.data, kept.indices, kept.indptr

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

        def along(field: Any, nu: Any) -> Any:
            return ufl.dot(field, ufl.as_vector([-nu[1], nu[0]]))

        mass = self._around_cells(lambda normal: along(test, normal) * along(trial, normal))
        change = self._around_cells(
            lambda normal: (
                angle_between(ufl.grad(position), self._other_director, self._director, normal)
                * along(test, normal)
            )
        )
        dofs = self._trace_dofs.ravel()
        full = compat.assembled_matrix(compat.compile_form(mass))
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


def _places_in(starts: Ints, columns: Ints, row: Ints, column: Ints) -> Ints:
    """(m, r, c) where the entries of every cell's ``row`` (m, r) and ``column`` (m, c) stand in
    the values of a CSR matrix with sorted columns."""
    rows = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    width = int(columns.max()) + 1
    keys = rows * width + columns
    wanted = row[:, :, None] * width + column[:, None, :]
    places = np.searchsorted(keys, wanted)
    if not np.array_equal(keys[np.minimum(places, len(keys) - 1)], wanted):
        raise RuntimeError("an entry of a cell is missing in the assembled matrix")
    return places
