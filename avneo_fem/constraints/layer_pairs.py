"""Which places of one folded surface are layers of each other and near: found once, then kept.

A list of pairs made with some room to spare stays complete until a node has moved half of it
(Verlet, Phys. Rev. 159 (1967) 98), so a Newton iteration rarely searches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from avneo_fem.constraints.pair_distance import pair_distance

__all__ = ["LayerPairs", "least_way"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_SIDES = np.array([[0, 1], [1, 2], [2, 0]])


def least_way(thickness: float, clearance: float) -> float:
    """Distance in the template from which parts of the sheet are layers, max(2 H, pi c/2) [mm].

    A fold around a gap of the clearance c takes a half circle of sheet.
    """
    return max(2.0 * thickness, np.pi / 2 * clearance)


def _primitives(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Nodes of the 6 point-triangle and 9 edge-edge pairs of triangles (k, 3) and (k, 3)."""
    both = ((first, second), (second, first))
    points = [np.column_stack([a[:, i], b]) for a, b in both for i in range(3)]
    edges = [np.column_stack([first[:, i], second[:, j]]) for i in _SIDES for j in _SIDES]
    return np.stack(points, axis=1), np.stack(edges, axis=1)


def _balls(corners: Floats) -> tuple[Floats, Floats]:
    """Centres and radii of balls around triangles (m, 3, 3)."""
    centre = corners.mean(axis=1)
    return centre, np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)


def _near_balls(corners: Floats, reach: float) -> Ints:
    """(k, 2) pairs of triangles (m, 3, 3) whose balls are nearer than ``reach``."""
    if not len(corners):
        return np.empty((0, 2), np.int64)
    centre, radius = _balls(corners)
    pairs = cKDTree(centre).query_pairs(reach + 2 * radius.max(), output_type="ndarray")
    apart = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
    near: Ints = pairs[apart < reach + radius[pairs].sum(axis=1)].astype(np.int64)
    return near


class LayerPairs:
    """Pairs of triangles that are layers of each other, and the parts of them that can be near.

    Two triangles qualify when all nodes of both are at least ``unrestricted`` from the suture
    and all of one is at least ``way`` from all of the other in the template (straight distance).

    Parameters
    ----------
    template_points : (n, 2) array
        Flat template [mm].
    triangles : (m, 3) int array
    distance_to_suture : (n,) array
        In the template [mm].
    unrestricted, way : float
        See above [mm]; ``way`` > 0.
    reach : float
        Pairs nearer than this are found [mm].
    """

    def __init__(
        self,
        template_points: Floats,
        triangles: Ints,
        distance_to_suture: Floats,
        unrestricted: float,
        way: float,
        reach: float,
    ) -> None:
        self.reach, self._room = reach, 0.5 * reach
        away = (distance_to_suture[triangles] >= unrestricted).all(axis=1)
        self.triangles = triangles[away].astype(np.int64)
        self._near = self._neighbours(template_points, way)
        self._built_at: Floats | None = None
        self._points, self._edges = (np.empty((0, 4), np.int64),) * 2

    def _neighbours(self, template_points: Floats, way: float) -> Ints:
        """Sorted keys of the pairs of triangles that are too near in the template for layers."""
        flat = np.column_stack([template_points, np.zeros(len(template_points))])
        corners = flat[self.triangles]
        pairs = _near_balls(corners, way)
        first, second = self.triangles[pairs[:, 0]], self.triangles[pairs[:, 1]]
        offset = flat[first][:, :, None] - flat[second][:, None]
        near = (np.einsum("kijd,kijd->kij", offset, offset) < way**2).any(axis=(1, 2))
        doubtful = np.flatnonzero(~near)
        least = np.full(len(doubtful), np.inf)
        for nodes, is_edges in zip(
            _primitives(first[doubtful], second[doubtful]), (False, True), strict=True
        ):
            distance = pair_distance(flat[nodes.reshape(-1, 4)], is_edges)[0]
            least = np.minimum(least, distance.reshape(nodes.shape[:2]).min(axis=1))
        near[doubtful] = least < way
        return np.sort(self._keys(pairs[near]))

    def _keys(self, pairs: Ints) -> Ints:
        keys: Ints = pairs.min(axis=1) * len(self.triangles) + pairs.max(axis=1)
        return keys

    def at(self, points: Floats) -> tuple[Ints, Ints]:
        """Nodes (k, 4) of point-triangle and of edge-edge pairs that may be within reach.

        All that are nearer than ``reach`` at positions (n, 3) [mm], and some more.
        """
        if self._built_at is not None:
            moved = np.square(points - self._built_at).sum(axis=1).max(initial=0.0)
            if moved <= (self._room / 2) ** 2:
                return self._points, self._edges
        pairs = _near_balls(points[self.triangles], self.reach + self._room)
        pairs = pairs[~np.isin(self._keys(pairs), self._near)]
        self._points, self._edges = self._unique(pairs)
        self._built_at = points.copy()
        return self._points, self._edges

    def _unique(self, pairs: Ints) -> tuple[Ints, Ints]:
        if not len(pairs):
            return (np.empty((0, 4), np.int64),) * 2
        first, second = self.triangles[pairs[:, 0]], self.triangles[pairs[:, 1]]
        points, edges = (nodes.reshape(-1, 4) for nodes in _primitives(first, second))
        ends = np.sort(edges.reshape(-1, 2, 2), axis=2)
        swap = ends[:, 0, 0] * (ends.max() + 1) + ends[:, 0, 1]
        swapped = swap > ends[:, 1, 0] * (ends.max() + 1) + ends[:, 1, 1]
        ends[swapped] = ends[swapped][:, ::-1]
        return np.unique(points, axis=0), np.unique(ends.reshape(-1, 4), axis=0)
