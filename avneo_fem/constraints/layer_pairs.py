"""Which places of one folded surface are layers of each other and near: found once, then kept.

A list of pairs made with some room to spare stays complete until a node has moved half of it
(Verlet, Phys. Rev. 159 (1967) 98), so a Newton iteration rarely searches.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

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
    offset = corners - centre[:, None]
    return centre, np.sqrt(np.einsum("kij,kij->ki", offset, offset).max(axis=1))


def _boxes_near(first: Sequence[Floats], second: Sequence[Floats], reach: float) -> Bools:
    """(k,) whether the boxes around nodes (k, 3) of both sides are less than ``reach`` apart."""
    (low, high), (other_low, other_high) = (
        (reduce(np.minimum, side), reduce(np.maximum, side)) for side in (first, second)
    )
    near: Bools = (np.maximum(low - other_high, other_low - high) < reach).all(axis=1)
    return near


def _near_balls(corners: Floats, reach: float) -> Ints:
    """(k, 2) pairs of triangles (m, 3, 3) whose balls are nearer than ``reach``."""
    if not len(corners):
        return np.empty((0, 2), np.int64)
    centre, radius = _balls(corners)
    pairs = cKDTree(centre).query_pairs(reach + 2 * radius.max(), output_type="ndarray")
    first, second = pairs.T
    offset = centre[first] - centre[second]
    bound = reach + radius[first] + radius[second]
    near: Ints = pairs[np.einsum("kd,kd->k", offset, offset) < bound**2].astype(np.int64)
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
        self.reach, self._room = reach, reach
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
        # with a last one that no pair has, for the search
        return np.append(np.sort(self._keys(pairs[near])), np.iinfo(np.int64).max)

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
        within = self.reach + self._room
        corners = points[self.triangles]
        pairs = _near_balls(corners, within)
        keys = self._keys(pairs)
        place = np.searchsorted(self._near, keys)
        pairs = pairs[self._near[place] != keys]
        found = _primitives(self.triangles[pairs[:, 0]], self.triangles[pairs[:, 1]])
        self._points, self._edges = (
            self._nearer_than(within, points, nodes.reshape(-1, 4), is_edges)
            for nodes, is_edges in zip(found, (False, True), strict=True)
        )
        self._built_at = points.copy()
        return self._points, self._edges

    @staticmethod
    def _nearer_than(within: float, points: Floats, nodes: Ints, is_edges: bool) -> Ints:
        """Those of the pairs (k, 4) that are nearer, each once, the smaller numbers first."""
        corners = [points[nodes[:, k]] for k in range(4)]
        sides = 2 if is_edges else 1
        nodes = nodes[_boxes_near(corners[:sides], corners[sides:], within)]
        nodes = nodes[pair_distance(points[nodes], is_edges)[0] < within]
        if is_edges:
            ends = np.sort(nodes.reshape(-1, 2, 2), axis=2)
            # layers share no node, so the first ends tell the edges apart
            order = np.argsort(ends[:, :, 0], axis=1)
            nodes = np.take_along_axis(ends, order[:, :, None], axis=1).reshape(-1, 4)
        once: Ints = np.unique(nodes, axis=0)
        return once
