"""How near the layers of one folded surface come to each other. Shares nothing with the solver."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.results.proximity import near_boxes, triangle_distance

__all__ = ["closest_layers", "least_way_between_layers", "search_radius"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]
Pairs = NDArray[np.intp]
Bools = NDArray[np.bool_]

_ROWS = 20_000  # pairs measured at a time: those farther apart need not be once one is found


def least_way_between_layers(thickness: float, clearance: float) -> float:
    """Distance in the template from which two places of a sheet count as layers [mm].

    max(2 H, pi/2 c): two thicknesses, and at least the half circle that a fold around a gap of
    ``clearance`` c takes.

    Parameters
    ----------
    thickness, clearance : float
        H and the distance that layers must keep [mm].
    """
    return max(2.0 * thickness, np.pi / 2.0 * clearance)


def search_radius(thickness: float, clearance: float) -> float:
    """Layers farther apart than this are not looked for, max(4 H/pi, c) [mm].

    It is the diameter of the half circle that :func:`least_way_between_layers` makes. By Schur's
    comparison theorem a sheet that is nowhere curved more tightly than that keeps places so far
    apart along it at least a diameter apart in space: so bending alone, without a fold back, is
    never taken for a second layer.
    """
    return 2.0 / np.pi * least_way_between_layers(thickness, clearance)


def _nearest_corners(a: Array, b: Array) -> Array:
    """(k,) smallest distance between a corner of each triangle and one of its partner."""
    square = np.full(len(a), np.inf)
    for i in range(3):
        for j in range(3):
            offset = a[:, i] - b[:, j]
            square = np.minimum(square, np.einsum("kd,kd->k", offset, offset))
    return np.sqrt(square)


def _balls(corners: Array) -> tuple[Array, Array]:
    """Centres (m, 3) and radii (m,) of balls around triangles (m, 3, 3)."""
    centre = corners.mean(axis=1)
    return centre, np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)


def _between_balls(corners: Array, pairs: Pairs) -> Array:
    """(k,) lower bound of the distance of each pair."""
    centre, radius = _balls(corners)
    apart = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
    bound: Array = apart - radius[pairs].sum(axis=1)
    return bound


def _far_in_template(flat: Array, pairs: Pairs, way: float) -> Bools:
    """Whether all of one triangle is at least ``way`` from all of the other in the template."""
    far: Bools = _between_balls(flat, pairs) >= way
    doubtful = np.flatnonzero(~far)
    a, b = flat[pairs[doubtful, 0]], flat[pairs[doubtful, 1]]
    doubtful = doubtful[_nearest_corners(a, b) >= way]
    a, b = flat[pairs[doubtful, 0]], flat[pairs[doubtful, 1]]
    far[doubtful] = triangle_distance(a, b) >= way
    return far


def _closest(corners: Array, pairs: Pairs, reach: float) -> float:
    """Smallest distance of the pairs of triangles, infinity if not below ``reach``."""
    bound = _between_balls(corners, pairs)
    order = np.argsort(bound)
    best = reach
    for start in range(0, len(order), _ROWS):
        rows = order[start : start + _ROWS]
        rows = rows[bound[rows] < best]
        if not len(rows):
            break
        a, b = corners[pairs[rows, 0]], corners[pairs[rows, 1]]
        best = min(best, float(triangle_distance(a, b).min()))
    return best if best < reach else np.inf


def closest_layers(
    points: Array,
    template_points: Array,
    triangles: Indices,
    distance_to_suture: Array,
    unrestricted: float,
    thickness: float,
    clearance: float,
) -> tuple[float, float]:
    """Closest approach of the layers of one cusp, away from the suture and near it.

    Two triangles belong to different layers when all of one is at least
    :func:`least_way_between_layers` from all of the other in the flat template; distance in the
    template is straight. So triangles that share a node are never layers, and a sheet that is
    flat or gently curved has none that come near (:func:`search_radius`). Distances are those of
    the flat triangles, faces and edges included; layers that cross are 0 apart. What is not below
    the search radius is infinity.

    Parameters
    ----------
    points : (n, 3) array
        Current positions [mm].
    template_points : (n, 2) array
        The same nodes in the flat template [mm].
    triangles : (m, 3) array of int
        Corners.
    distance_to_suture : (n,) array
        Distance of each node from the suture line in the template [mm].
    unrestricted : float
        A triangle is near the suture when one of its nodes is nearer to it than this [mm].
    thickness, clearance : float
        H and the distance that layers must keep away from the suture [mm].

    Returns
    -------
    beyond, near_suture : float
        Closest approach of layers that both lie away from the suture, and of all others [mm].
    """
    reach = search_radius(thickness, clearance)
    corners = points[triangles]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    pairs = near_boxes(lower, upper, lower, upper, reach)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    pairs = pairs[_between_balls(corners, pairs) < reach]
    flat = np.concatenate([template_points, np.zeros((len(template_points), 1))], axis=1)[triangles]
    way = least_way_between_layers(thickness, clearance)
    pairs = pairs[_far_in_template(flat, pairs, way)]
    away = (distance_to_suture[triangles] >= unrestricted).all(axis=1)
    beyond = away[pairs].all(axis=1)
    return _closest(corners, pairs[beyond], reach), _closest(corners, pairs[~beyond], reach)
