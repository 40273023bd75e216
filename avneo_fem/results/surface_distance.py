"""How far two triangulated surfaces are apart, by samples spread evenly over both."""

from __future__ import annotations

from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray

__all__ = ["SPACING", "samples", "surface_distance", "to_surface"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: between samples of a surface [mm]
SPACING = 0.1


def samples(points: Floats, triangles: Ints, spacing: float = SPACING) -> tuple[Floats, Floats]:
    """Places (k, 3) spread over a surface, and the area that each stands for (k,).

    The centres of the n^2 equal parts of every triangle, n the same for all and such that the
    median edge is cut to ``spacing``.
    """
    corners = points[triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    n = max(1, int(np.ceil(np.median(edges) / spacing)))
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    a = np.r_[i[up] + 1 / 3, i[down] + 2 / 3] / n
    b = np.r_[j[up] + 1 / 3, j[down] + 2 / 3] / n
    weights = np.column_stack([1.0 - a - b, a, b])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.repeat(np.linalg.norm(normal, axis=1) / (2 * n * n), n * n)
    return np.einsum("kc,mcd->mkd", weights, corners).reshape(-1, 3), areas


def to_surface(places: Floats, points: Floats, triangles: Ints) -> tuple[Floats, Ints, Floats]:
    """Distance (k,) [mm], triangle (k,) and closest point (k, 3) on a surface."""
    square, face, closest = igl.point_mesh_squared_distance(
        *(np.ascontiguousarray(x, float) for x in (places, points)),
        np.ascontiguousarray(triangles, np.int64),
    )
    return np.sqrt(square), face, closest


def surface_distance(
    a: tuple[Floats, Ints], b: tuple[Floats, Ints], chosen: tuple[Any, Any] = (slice(None),) * 2
) -> tuple[float, float, float]:
    """Mean, 95 % and largest distance of two surfaces, both ways, weighted by area [mm].

    Parameters
    ----------
    a, b : (points (n, 3), triangles (m, 3))
        Positions [mm] and corners.
    chosen : pair of index arrays or masks of triangles
        From these triangles of each, to all of the other.
    """
    found = []
    for (points, triangles), other, rows in ((a, b, chosen[0]), (b, a, chosen[1])):
        places, areas = samples(points, triangles[rows])
        found.append((to_surface(places, *other)[0], areas / areas.sum()))
    distance, share = (np.concatenate(x) for x in zip(*found, strict=True))
    rising = np.argsort(distance)
    reached = share[rising].cumsum() / share.sum()
    quantile = float(distance[rising][np.searchsorted(reached, 0.95)])
    return float(distance @ share / share.sum()), quantile, float(distance.max())
