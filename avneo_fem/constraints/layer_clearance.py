"""Layers of one cusp keep a clearance from each other, away from the gathered suture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.layer_pairs import LayerPairs, least_way
from avneo_fem.constraints.pair_distance import (
    edge_mollifier,
    pair_distance,
    pair_distance_derivatives,
)
from avneo_fem.constraints.term import Foreseen
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["LayerClearance"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class _Acting:
    """Pairs of one kind whose ramp acts: nodes (k, 4), ramp (k,), area (k,), ..."""

    nodes: Ints
    is_edges: bool
    corners: Floats
    weights: Floats
    ramp: Floats
    areas: Floats
    rest_squares: Floats


class LayerClearance:
    """Penalty eta_1 eta_2/4 sum_c A_c m_c f(d_c)^2, f(d) = max(1 - 2 (d - c)/eta_2, 0).

    It runs over all pairs of a point and a triangle and of two edges that belong to different
    layers (:class:`avneo_fem.constraints.layer_pairs.LayerPairs`), d their distance. A_c is the
    template area of the point, or the mean of those of the two edges; m_c fades edges out that
    are parallel, whose ends then do the work. So the term is that of the signed distances (1.5),
    the other layer being the obstacle: below c + eta_2/2 a pair is pushed apart.

    Parameters
    ----------
    mesh : CuspMesh
        Template, with areas and distances to the suture.
    thickness : float
        H [mm].
    clearance : float
        c that layers must keep [mm]; 0 asks for nothing, and nothing acts.
    unrestricted : float
        Nearer to the suture than this, measured in the template, layers are left alone [mm].
    stiffness, width : float
        eta_1 [kPa], which may be changed between solves, and eta_2 [mm].

    Attributes
    ----------
    project : bool
        Whether :meth:`hessian` makes every pair positive semi-definite; by default it is exact.
    """

    def __init__(
        self,
        mesh: CuspMesh,
        thickness: float,
        clearance: float,
        unrestricted: float,
        stiffness: float,
        width: float,
    ) -> None:
        self.clearance, self.width, self.stiffness = clearance, width, stiffness
        self.project = False
        self._template, self._node_areas = mesh.points, mesh.node_areas
        self._edge_areas = self._areas_of_edges(mesh)
        triangles = mesh.triangles if clearance > 0 else mesh.triangles[:0]
        way = least_way(thickness, clearance)
        reach = clearance + width / 2
        self._made = partial(
            LayerPairs, mesh.points, triangles, mesh.distance_to_suture, unrestricted, way, reach
        )
        self._seen: Floats | None = None
        self._acting: list[_Acting] = []
        self._closest = np.inf

    @cached_property
    def _layers(self) -> LayerPairs:
        """Made when first asked for: on coarser meshes nobody does."""
        return self._made()

    @staticmethod
    def _areas_of_edges(mesh: CuspMesh) -> sp.csr_matrix:
        """(n, n) matrix with a third of the triangles' areas at each edge [mm^2], smaller first."""
        shares = np.bincount(
            mesh.cell_edges.ravel(), np.repeat(mesh.cell_areas / 3, 3), minlength=len(mesh.edges)
        )
        count = len(mesh.points)
        return sp.csr_matrix((shares, (mesh.edges[:, 0], mesh.edges[:, 1])), shape=(count, count))

    def _at(self, points: Floats) -> list[_Acting]:
        """Pairs that act at ``points``; the last answer is kept."""
        if self._seen is None or not np.array_equal(self._seen, points):
            self._acting, self._closest = [], np.inf
            for nodes, is_edges in zip(self._layers.at(points), (False, True), strict=True):
                if len(nodes):
                    self._look_at(points, nodes, is_edges)
            self._seen = points.copy()
        return self._acting

    def _look_at(self, points: Floats, nodes: Ints, is_edges: bool) -> None:
        distance, weights = pair_distance(points[nodes], is_edges)
        self._closest = min(self._closest, float(distance.min()))
        ramp = 1.0 - 2.0 * (distance - self.clearance) / self.width
        acts = ramp > 0.0
        nodes, weights, ramp = nodes[acts], weights[acts], ramp[acts]
        if not len(nodes):
            return
        areas, rest_squares = self._areas(nodes, is_edges), self._rest_squares(nodes)
        self._acting.append(
            _Acting(nodes, is_edges, points[nodes], weights, ramp, areas, rest_squares)
        )

    def _areas(self, nodes: Ints, is_edges: bool) -> Floats:
        """(k,) template area that goes with each pair [mm^2]."""
        if not is_edges:
            return self._node_areas[nodes[:, 0]]
        table, ends = self._edge_areas, nodes.T
        return 0.5 * np.asarray(table[ends[0], ends[1]] + table[ends[2], ends[3]]).ravel()

    def _rest_squares(self, nodes: Ints) -> Floats:
        """(k,) product of the squared lengths in the template, for edges [mm^4]."""
        flat = self._template[nodes]
        return np.square(flat[:, [1, 3]] - flat[:, [0, 2]]).sum(axis=2).prod(axis=1)

    def active(self, points: Floats) -> int:
        """Number of pairs that are pushed apart at points (n, 3) [mm]."""
        return sum(len(group.nodes) for group in self._at(points))

    def shortfall(self, points: Floats) -> float:
        """By how much the nearest layers miss the clearance at points (n, 3), 0 if they do not."""
        self._at(points)
        return max(self.clearance - self._closest, 0.0)

    def energy(self, points: Floats) -> float:
        """Penalty energy [mN mm] at points (n, 3) [mm]."""
        total = 0.0
        for group in self._at(points):
            share = group.areas * group.ramp**2
            if group.is_edges:
                share = share * edge_mollifier(group.corners, group.rest_squares)[0]
            total += self.stiffness * self.width / 4 * float(share.sum())
        return total

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy [mN]."""
        result = np.zeros(points.shape)
        for group in self._at(points):
            offset = np.einsum("kn,knd->kd", group.weights, group.corners)
            normal = offset / np.linalg.norm(offset, axis=1)[:, None]
            slope = np.einsum("kn,kd->knd", group.weights, normal)
            load = self.stiffness * group.areas
            force = -load * group.ramp
            if group.is_edges:
                factor, rate, _ = edge_mollifier(group.corners, group.rest_squares)
                slope = (factor * force)[:, None, None] * slope
                held = self.width / 4 * load * group.ramp**2
                slope += held[:, None, None] * rate.reshape(-1, 4, 3)
            else:
                slope = force[:, None, None] * slope
            np.add.at(result, group.nodes, slope)
        return result

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) second derivative [mN/mm]; an empty matrix when no pair acts."""
        size = points.size
        total = sp.csr_matrix((size, size))
        for group in self._at(points):
            blocks = self._blocks(group)
            if self.project:
                values, vectors = np.linalg.eigh(blocks)
                blocks = (vectors * np.maximum(values, 0.0)[:, None]) @ vectors.transpose(0, 2, 1)
            total = total + _scattered(blocks, group.nodes, size)
        return total

    def foreseen(self, points: Floats, moves: Floats) -> Foreseen:
        """What changes when the pairs that act are those that act after ``moves`` (n, 3).

        The Hessian added is that of the linearised distances, without their curvature.
        """
        gradient, size = np.zeros(points.shape), points.size
        total, switches = sp.csr_matrix((size, size)), []
        for nodes, is_edges in zip(self._layers.at(points), (False, True), strict=True):
            if not len(nodes):
                continue
            distance, weights = pair_distance(points[nodes], is_edges)
            offset = np.einsum("kn,knd->kd", weights, points[nodes])
            slope = np.einsum("kn,kd->knd", weights, offset / distance[:, None])
            ramp = 1.0 - 2.0 * (distance - self.clearance) / self.width
            ahead = ramp - 2.0 / self.width * np.einsum("knd,knd->k", slope, moves[nodes])
            switched = (ahead > 0).astype(int) - (ramp > 0)
            switches.append(switched)
            rows = np.flatnonzero(switched)
            if not len(rows):
                continue
            nodes, slope = nodes[rows], slope[rows]
            load = self.stiffness * self._areas(nodes, is_edges) * switched[rows]
            if is_edges:
                corners = points[nodes]
                load = load * edge_mollifier(corners, self._rest_squares(nodes))[0]
            np.add.at(gradient, nodes, -(load * ramp[rows])[:, None, None] * slope)
            flat = slope.reshape(-1, 12)
            blocks = (2.0 / self.width * load)[:, None, None] * flat[:, :, None] * flat[:, None, :]
            total = total + _scattered(blocks, nodes, size)
        none = np.zeros(0, dtype=int)
        return Foreseen(np.concatenate([none, *switches]), gradient, total)

    def _blocks(self, group: _Acting) -> Floats:
        """(k, 12, 12) second derivatives of the pairs [mN/mm]."""
        slope, bend = pair_distance_derivatives(group.corners, group.weights, group.is_edges)
        load = self.stiffness * group.areas
        force, held = -load * group.ramp, self.width / 4 * load * group.ramp**2
        outer = slope[:, :, None] * slope[:, None, :]
        blocks: Floats = (2.0 / self.width * load)[:, None, None] * outer
        blocks += force[:, None, None] * bend
        if not group.is_edges:
            return blocks
        factor, rate, second = edge_mollifier(group.corners, group.rest_squares)
        mixed = slope[:, :, None] * rate[:, None, :]
        blocks *= factor[:, None, None]
        blocks += force[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
        return blocks + held[:, None, None] * second


def _scattered(blocks: Floats, nodes: Ints, size: int) -> sp.csr_matrix:
    """(size, size) matrix of blocks (k, 12, 12) at the coordinates of nodes (k, 4)."""
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 12)
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    entries = (blocks.ravel(), (rows.ravel(), columns.ravel()))
    return sp.coo_matrix(entries, shape=(size, size)).tocsr()
