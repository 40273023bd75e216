"""Which triangles of the valve meet, and how far apart its surfaces are.

Written for the verification alone: the solver uses ipctk, this module does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from avneo_fem.results.proximity import near_boxes, segment_distance, triangle_distance

__all__ = ["cusp_intersections", "min_distance", "self_intersections"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

#: Triangles nearer than this share of their size meet (touching, up to rounding).
TOUCH = 1e-10
_ROWS = 512  # edges per tree query: bounds the memory for the pairs found


def _apart(a: Array, b: Array, touch: Array) -> NDArray[np.bool_]:
    """Pairs where one triangle lies strictly on one side of the other's plane."""
    normal = np.cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
    length = np.sqrt(np.einsum("ki,ki->k", normal, normal))
    height = np.einsum("kji,ki->kj", a - b[:, :1], normal)
    bound = touch * length
    return (height.min(axis=1) > bound) | (height.max(axis=1) < -bound)


def _meeting_pairs(a: Array, b: Array, pairs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Those of ``pairs`` of triangles (n, 3, 3) and (m, 3, 3) that meet."""
    first, second = a[pairs[:, 0]], b[pairs[:, 1]]
    touch = TOUCH * np.maximum(np.ptp(first, axis=1), np.ptp(second, axis=1)).max(axis=1)
    near = ~(_apart(first, second, touch) | _apart(second, first, touch))
    pairs, touch = pairs[near], touch[near]
    return pairs[triangle_distance(first[near], second[near]) <= touch]


def _candidates(a: Array, b: Array) -> NDArray[np.intp]:
    reach = TOUCH * float(max(np.ptp(a, axis=1).max(initial=0.0), np.ptp(b, axis=1).max(initial=0)))
    return near_boxes(a.min(axis=1), a.max(axis=1), b.min(axis=1), b.max(axis=1), reach)


def self_intersections(points: Array, triangles: Indices) -> int:
    """Number of pairs of triangles of one surface that meet without sharing a node.

    Parameters
    ----------
    points : (n, 3) array
        Node positions [mm].
    triangles : (m, 3) array of int
        Corners.

    Returns
    -------
    int
        Pairs that cross, touch (within 1e-10 of their size) or lie in one plane and overlap.
        Triangles that share a node are neighbours and never counted, even folded flat.
    """
    corners = points[triangles]
    pairs = _candidates(corners, corners)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    shared = (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    return len(_meeting_pairs(corners, corners, pairs[~shared]))


def cusp_intersections(surfaces: Sequence[tuple[Array, Indices]]) -> int:
    """Number of pairs of triangles of different surfaces that meet.

    Parameters
    ----------
    surfaces : sequence of (points (n, 3) [mm], triangles (m, 3))
        The cusps.
    """
    corners = [points[triangles] for points, triangles in surfaces]
    return sum(
        len(_meeting_pairs(a, b, _candidates(a, b)))
        for k, a in enumerate(corners)
        for b in corners[k + 1 :]
    )


def _edges(triangles: Indices) -> Indices:
    sides = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges: Indices = np.unique(np.sort(sides, axis=1), axis=0)
    return edges


def _near_edges(points: Array, triangles: Indices, distance: Array, bound: float) -> Array:
    """Ends (k, 2, 3) of the edges that can be within ``bound`` of the other surface.

    ``distance`` (n,) is that of the nodes; within an edge it falls by at most half its length.
    """
    edges = _edges(triangles)
    ends = points[edges]
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2.0
    chosen: Array = ends[distance[edges].min(axis=1) - half <= bound]
    return chosen


def min_distance(points_a: Array, tris_a: Indices, points_b: Array, tris_b: Indices) -> float:
    """Smallest distance between two triangulated surfaces [mm], 0 where they meet.

    Parameters
    ----------
    points_a, points_b : (n, 3) arrays
        Node positions [mm].
    tris_a, tris_b : (m, 3) arrays of int
        Corners.

    Notes
    -----
    Surfaces that do not meet are nearest between a node and a triangle or between two edges.
    """
    if cusp_intersections([(points_a, tris_a), (points_b, tris_b)]):
        return 0.0
    nodes_a, nodes_b = np.unique(tris_a), np.unique(tris_b)
    # nodes without a triangle are no part of the surface and stay at infinity
    from_a, from_b = np.full(len(points_a), np.inf), np.full(len(points_b), np.inf)
    from_a[nodes_a] = _distance_to_surface(points_a[nodes_a], points_b, tris_b)
    from_b[nodes_b] = _distance_to_surface(points_b[nodes_b], points_a, tris_a)
    bound = float(min(from_a.min(), from_b.min()))
    a = _near_edges(points_a, tris_a, from_a, bound)
    b = _near_edges(points_b, tris_b, from_b, bound)
    for rows in range(0, len(a), _ROWS):
        bound = min(bound, _edge_distance(a[rows : rows + _ROWS], b, bound))
    return bound


def _edge_distance(a: Array, b: Array, bound: float) -> float:
    """Smallest distance between edges (k, 2, 3) and (m, 2, 3) if below ``bound``, else that."""
    half_a = np.linalg.norm(a[:, 1] - a[:, 0], axis=1) / 2.0
    half_b = np.linalg.norm(b[:, 1] - b[:, 0], axis=1) / 2.0
    # balls, not boxes: far apart and parallel sheets would pair every edge with every other
    near = cKDTree(a.mean(axis=1)).sparse_distance_matrix(
        cKDTree(b.mean(axis=1)),
        bound + half_a.max(initial=0.0) + half_b.max(initial=0.0),
        output_type="ndarray",
    )
    i, j = near["i"], near["j"]
    reachable = near["v"] - half_a[i] - half_b[j] < bound
    first, second = a[i[reachable]], b[j[reachable]]
    between = segment_distance(first[:, 0], first[:, 1], second[:, 0], second[:, 1])
    return float(between.min(initial=bound))


def _distance_to_surface(queries: Array, points: Array, triangles: Indices) -> Array:
    """Distance of each query (k, 3) from the surface -> (k,) [mm]."""
    square = igl.point_mesh_squared_distance(
        np.ascontiguousarray(queries, dtype=np.float64),
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(triangles, dtype=np.int64),
    )[0]
    distance: Array = np.sqrt(square)
    return distance
