"""First and second derivatives of the distance of a point and a triangle, or of two edges.

The distance is a minimum over the places t on both parts: its gradient is that at fixed places,
its Hessian has the places follow, g_xx - g_xt g_tt^-1 g_tx (implicit function theorem).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.contact_pairs import nearest_weights

__all__ = ["edge_mollifier", "pair_distance", "pair_distance_derivatives"]

Floats = NDArray[np.float64]

#: edges count as parallel below this square of the sine between them, measured in the rest lengths
PARALLEL = 1e-3


def pair_distance(corners: Floats, is_edges: bool) -> tuple[Floats, Floats]:
    """Distance of each pair and the weights of its nearest places.

    Parameters
    ----------
    corners : (k, 4, 3) array
        Point and triangle, or first and second edge [mm].
    is_edges : bool
        Which of the two.

    Returns
    -------
    distance : (k,) array
        [mm].
    weights : (k, 4) array
        Signed; with them the corners give the vector between the nearest places.
    """
    weights = nearest_weights(corners, is_edges)
    return np.linalg.norm(np.einsum("kn,knd->kd", weights, corners), axis=1), weights


def _tangents(weights: Floats, is_edges: bool) -> Floats:
    """(k, 2, 4) changes of the weights when the nearest places move freely; 0 where they cannot."""
    free = weights != 0.0
    tangents = np.zeros((len(weights), 2, 4))
    if is_edges:
        for row, (start, end) in enumerate(((0, 1), (2, 3))):
            moves = (free[:, start] & free[:, end]).astype(float)
            tangents[:, row, start], tangents[:, row, end] = -moves, moves
        return tangents
    # on the triangle from its first involved node to the second and to the third
    order = np.argsort(~free[:, 1:], axis=1, kind="stable") + 1
    count, pair = free[:, 1:].sum(axis=1), np.arange(len(weights))
    for row in (0, 1):
        moves = (count > row + 1).astype(float)
        tangents[pair, row, order[:, 0]] = -moves
        tangents[pair, row, order[:, row + 1]] = moves
    return tangents


def pair_distance_derivatives(
    corners: Floats, weights: Floats, is_edges: bool
) -> tuple[Floats, Floats]:
    """Gradient and Hessian of the distances of pairs that are apart.

    Parameters
    ----------
    corners, weights, is_edges
        Corners (k, 4, 3) [mm] and what :func:`pair_distance` returns for them.

    Returns
    -------
    gradient : (k, 12) array
    hessian : (k, 12, 12) array
        [1/mm]; exact where the set of places that can move does not change.
    """
    count = len(corners)
    offset = np.einsum("kn,knd->kd", weights, corners)
    distance = np.linalg.norm(offset, axis=1)
    normal = offset / distance[:, None]
    tangents = _tangents(weights, is_edges)
    along = np.einsum("ktn,knd->ktd", tangents, corners)
    gradient = np.einsum("kn,kd->knd", weights, normal).reshape(count, 12)
    # all of half the square of the distance
    still = np.einsum("ki,kj,de->kidje", weights, weights, np.eye(3)).reshape(count, 12, 12)
    mixed = np.einsum("ktn,kd->kntd", tangents, offset) + np.einsum("kn,ktd->kntd", weights, along)
    mixed = mixed.transpose(0, 1, 3, 2).reshape(count, 12, 2)
    metric = np.einsum("ksd,ktd->kst", along, along)
    # a place that cannot move: its row is 0, and 1 on the diagonal leaves it so
    held = ~tangents.any(axis=2)
    metric[:, (0, 1), (0, 1)] += held
    follow = mixed @ np.linalg.solve(metric, mixed.transpose(0, 2, 1))
    outer = gradient[:, :, None] * gradient[:, None, :]
    hessian = (still - 0.5 * (follow + follow.transpose(0, 2, 1)) - outer) / distance[:, None, None]
    return gradient, hessian


def edge_mollifier(corners: Floats, rest_squares: Floats) -> tuple[Floats, Floats, Floats]:
    """Factor that fades a pair of edges out where they become parallel, with its derivatives.

    Where they are, the nearest places are not unique and the distance has a kink. Li et al.,
    Incremental Potential Contact, ACM Trans. Graph. 39 (2020) 49, (24): m = (2 - c/e) c/e below
    c = e and 1 above, c = |u x v|^2, e = ``PARALLEL`` times the product of the rest squares.

    Parameters
    ----------
    corners : (k, 4, 3) array
        Ends of the first and the second edge [mm].
    rest_squares : (k,) array
        Product of the squares of their rest lengths [mm^4].

    Returns
    -------
    factor, gradient, hessian : (k,), (k, 12), (k, 12, 12) arrays
    """
    count = len(corners)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 2]
    uu, uv, vv = (np.einsum("kd,kd->k", a, b)[:, None] for a, b in ((u, u), (u, v), (v, v)))
    limit = PARALLEL * rest_squares
    # not uu vv - uv^2, which cancels where the edges are nearly parallel
    share = np.minimum(np.square(np.cross(u, v)).sum(axis=1) / limit, 1.0)
    by_sides = 2.0 * np.stack([vv * u - uv * v, uu * v - uv * u], axis=1) / limit[:, None, None]
    second = np.empty((count, 2, 3, 2, 3))
    unit = np.eye(3)[None]
    second[:, 0, :, 0] = vv[..., None] * unit - v[:, :, None] * v[:, None, :]
    second[:, 1, :, 1] = uu[..., None] * unit - u[:, :, None] * u[:, None, :]
    second[:, 0, :, 1] = (
        2.0 * u[:, :, None] * v[:, None, :] - v[:, :, None] * u[:, None, :] - uv[..., None] * unit
    )
    second[:, 1, :, 0] = second[:, 0, :, 1].transpose(0, 2, 1)
    second *= 2.0 / limit[:, None, None, None, None]
    # from sides to ends: u and v are differences
    ends = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])
    slope = np.einsum("ksd,sn->knd", by_sides, ends).reshape(count, 12)
    bend = np.einsum("ksdte,sn,tm->kndme", second, ends, ends).reshape(count, 12, 12)
    rate = 2.0 * (1.0 - share)
    curved = np.where(share < 1.0, -2.0, 0.0)
    hessian = rate[:, None, None] * bend
    hessian += curved[:, None, None] * slope[:, :, None] * slope[:, None, :]
    return (2.0 - share) * share, rate[:, None] * slope, hessian
