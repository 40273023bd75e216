"""Distances between triangles, and which boxes are near each other. NumPy and KD-trees only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = [
    "near_boxes",
    "point_triangle_distance",
    "segment_distance",
    "triangle_distance",
]

Array = NDArray[np.float64]
_ROWS = 2048  # boxes per tree query: bounds the memory for the pairs found
_FLAT = 1e-12  # a triangle whose area is below this share of its size² has no usable normal


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def _length(a: Array) -> Array:
    return np.sqrt(_dot(a, a))


def _size_classes(half: Array) -> list[NDArray[np.intp]]:
    """Boxes grouped by powers of two of their size, so that one large box slows no small one."""
    largest = float(half.max(initial=0.0))
    if largest == 0.0:
        return [np.arange(len(half))]
    level = np.floor(np.log2(np.maximum(half / largest, 2.0**-12)))
    return [np.flatnonzero(level == value) for value in np.unique(level)]


def near_boxes(
    lower_a: Array, upper_a: Array, lower_b: Array, upper_b: Array, reach: float = 0.0
) -> NDArray[np.intp]:
    """Pairs of axis-parallel boxes whose gap along every axis is at most ``reach``.

    Parameters
    ----------
    lower_a, upper_a : (n, 3) arrays
        Corners of the first boxes [mm].
    lower_b, upper_b : (m, 3) arrays
        Corners of the second boxes [mm].
    reach : float
        Largest gap [mm].

    Returns
    -------
    (k, 2) array of int
        Index of the box in the first and in the second set.
    """
    centre_a, centre_b = (lower_a + upper_a) / 2.0, (lower_b + upper_b) / 2.0
    half_a, half_b = (upper_a - lower_a).max(axis=1) / 2.0, (upper_b - lower_b).max(axis=1) / 2.0
    found = [np.empty((0, 2), dtype=np.intp)]
    for class_b in _size_classes(half_b):
        tree_b = cKDTree(centre_b[class_b])
        for class_a in _size_classes(half_a):
            radius = half_a[class_a].max(initial=0.0) + half_b[class_b].max(initial=0.0) + reach
            radius = radius * (1.0 + 1e-12) + 1e-300
            for first in range(0, len(class_a), _ROWS):
                rows = class_a[first : first + _ROWS]
                near = cKDTree(centre_a[rows]).sparse_distance_matrix(
                    tree_b, radius, p=np.inf, output_type="ndarray"
                )
                i, j = rows[near["i"]], class_b[near["j"]]
                gap = np.maximum(lower_a[i] - upper_b[j], lower_b[j] - upper_a[i]).max(axis=1)
                found.append(np.column_stack([i, j])[gap <= reach])
    return np.concatenate(found)


def _point_segment_distance(p: Array, a: Array, b: Array) -> Array:
    along = b - a
    square = _dot(along, along)
    t = np.divide(_dot(p - a, along), square, out=np.zeros_like(square), where=square > 0.0)
    return _length(p - a - np.clip(t, 0.0, 1.0)[..., None] * along)


def point_triangle_distance(points: Array, triangles: Array) -> Array:
    """Distance of each point from its triangle, (k, 3) and (k, 3, 3) arrays -> (k,) [mm]."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    square = _dot(normal, normal)
    size = np.maximum(_dot(b - a, b - a), _dot(c - a, c - a))
    inside = square > (_FLAT * size) ** 2
    distance = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        distance = np.minimum(distance, _point_segment_distance(points, start, end))
        inside &= _dot(np.cross(normal, end - start), points - start) >= 0.0
    height = np.abs(_dot(normal, points - a)) / np.sqrt(np.where(inside, square, 1.0))
    return np.where(inside, height, distance)


def segment_distance(p0: Array, p1: Array, q0: Array, q1: Array) -> Array:
    """Distance between each segment p0p1 and its segment q0q1, (k, 3) arrays -> (k,) [mm].

    The smallest of the four distances from an end to the other segment, which covers parallel
    segments, and of the distance where the common perpendicular meets both.
    """
    distance = _point_segment_distance(p0, q0, q1)
    for point, start, end in ((p1, q0, q1), (q0, p0, p1), (q1, p0, p1)):
        distance = np.minimum(distance, _point_segment_distance(point, start, end))
    u, v, w = p1 - p0, q1 - q0, p0 - q0
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    solvable = determinant > 0.0
    scale = np.where(solvable, determinant, 1.0)
    # clipped, so that this is the distance of two points of the segments whatever the rounding
    s = np.clip((uv * vw - vv * uw) / scale, 0.0, 1.0)[:, None]
    t = np.clip((uu * vw - uv * uw) / scale, 0.0, 1.0)[:, None]
    return np.where(solvable, np.minimum(distance, _length(w + s * u - t * v)), distance)


def triangle_distance(a: Array, b: Array) -> Array:
    """Distance between each triangle of ``a`` and its triangle of ``b``, (k, 3, 3) -> (k,) [mm].

    Zero, up to rounding, exactly where they meet: crossing, touching, coplanar and overlapping,
    or one inside the other. Triangles without area are treated as segments or points.
    """
    distance = np.full(len(a), np.inf)
    for first, second in ((a, b), (b, a)):
        origin = second[:, 0]
        normal = np.cross(second[:, 1] - origin, second[:, 2] - origin)
        height = [_dot(first[:, k] - origin, normal) for k in range(3)]
        for k in range(3):
            start, end = first[:, k], first[:, (k + 1) % 3]
            distance = np.minimum(distance, point_triangle_distance(start, second))
            fall = height[k] - height[(k + 1) % 3]
            through = (height[k] * height[(k + 1) % 3] <= 0.0) & (fall != 0.0)
            t = np.divide(height[k], fall, out=np.zeros_like(fall), where=through)[:, None]
            hit = point_triangle_distance(start + t * (end - start), second)
            distance = np.where(through, np.minimum(distance, hit), distance)
    for k in range(3):
        for m in range(3):
            distance = np.minimum(
                distance,
                segment_distance(a[:, k], a[:, (k + 1) % 3], b[:, m], b[:, (m + 1) % 3]),
            )
    return distance
