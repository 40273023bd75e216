"""The three experiments and brute-force references, built without avneo_fem.geometry's help."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

RADIUS, GAP = 12.0, 0.5
RIM = RADIUS * np.cos(GAP / (2.0 * RADIUS))  # A_i: midpoint of the chord between two line ends


def commissures(ratio):
    """A_i (3, 2): cusp i takes 2 alpha_i of the rim (law of cosines), A_0 on the first axis."""
    a, b, c = np.asarray(ratio, dtype=float)
    alpha_0 = np.arccos((b * b + c * c - a * a) / (2 * b * c))
    alpha_2 = np.arccos((a * a + b * b - c * c) / (2 * a * b))
    angle = np.array([0.0, 2 * alpha_2, 2 * alpha_2 + 2 * alpha_0])
    return RIM * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def triple_point(ends, lengths):
    """C by Proposition 3.1: on a side if case 1 holds, else where |A_iC| / c_i are equal."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        share = lengths[j] / (lengths[j] + lengths[k])
        on_side = ends[j] + share * (ends[k] - ends[j])
        nu = np.hypot(*(ends[k] - ends[j])) / (lengths[j] + lengths[k])
        if np.hypot(*(ends[i] - on_side)) < nu * lengths[i]:
            return on_side
    # |x - A_i|^2 = s c_i^2: differences are linear in (x, s), one quadratic in s is left
    squares = np.asarray(lengths) ** 2
    matrix = 2.0 * (ends[1:] - ends[0])
    norms = (ends**2).sum(axis=1)
    x0 = np.linalg.solve(matrix, norms[1:] - norms[0])
    x1 = np.linalg.solve(matrix, squares[0] - squares[1:])
    e = x0 - ends[0]
    for s in np.roots(np.trim_zeros([x1 @ x1, 2 * x1 @ e - squares[0], e @ e], "f")):
        x = x0 + s.real * x1
        if np.linalg.solve(np.vstack([ends.T, np.ones(3)]), np.r_[x, 1.0]).min() > 0:
            return x
    raise AssertionError("no triple point")


def _quasi_optimal():
    sides = np.linalg.norm(np.roll(commissures((6, 4, 5)), -1, 0) - commissures((6, 4, 5)), axis=1)
    free = 2.0 / np.sqrt(3.0) * np.roll(sides, -1)  # side i is opposite to A_i
    return tuple(free.sum() / 2 - free)


#: name -> (chord ratio, contact lengths c, sigma* as printed in design.md)
EXPERIMENTS = {
    1: ((1, 1, 1), (19.5, 19.5, 19.5), (1.2387, 1.2387, 1.2387)),
    2: ((8, 9, 6), (14.625, 34.125, 24.375), (0.9715, 2.7451, 2.1577)),
    3: ((6, 4, 5), _quasi_optimal(), (0.0303, 0.0860, 0.1059)),
}


def inputs(number):
    """A_i (3, 3), C (3,) and c (3,) of an experiment."""
    ratio, lengths, _ = EXPERIMENTS[number]
    ends = commissures(ratio)
    flat = np.hstack([ends, np.zeros((3, 1))])
    centre = np.append(triple_point(ends, lengths), 0.0)
    return flat, centre, np.array(lengths)


def bezier(polygon, t):
    t = np.asarray(t)[:, None]
    s = 1.0 - t
    return (
        s**3 * polygon[..., 0, :]
        + 3 * t * s**2 * polygon[..., 1, :]
        + 3 * t**2 * s * polygon[..., 2, :]
        + t**3 * polygon[..., 3, :]
    )


def brute_distance(polygons, points, samples=4000, neighbours=3):
    """Unsigned distance (n,) to the two curves and extensions: nearest samples, refined."""
    best = np.full(len(points), np.inf)
    for polygon in polygons:
        direction = polygon[3] - polygon[2]
        direction = direction / np.hypot(*direction)
        s = np.maximum((points - polygon[3]) @ direction, 0.0)
        away = points - polygon[3] - s[:, None] * direction
        best = np.minimum(best, np.hypot(away[:, 0], away[:, 1]))
        grid = np.unique(np.r_[np.linspace(0, 1, samples), np.geomspace(1e-12, 0.01, 200)])
        _, near = cKDTree(bezier(polygon, grid)).query(points, k=np.arange(1, neighbours + 1))
        for index in near.T:
            low, high = grid[np.maximum(index - 1, 0)], grid[np.minimum(index + 1, grid.size - 1)]
            for _ in range(45):  # thirds
                a, b = low + (high - low) / 3, high - (high - low) / 3
                pa, pb = points - bezier(polygon, a), points - bezier(polygon, b)
                left = (pa * pa).sum(axis=1) < (pb * pb).sum(axis=1)
                low, high = np.where(left, low, a), np.where(left, b, high)
            for t in (low, high):  # the ends too: the apex may be the closest point
                away = points - bezier(polygon, t)
                best = np.minimum(best, np.hypot(away[:, 0], away[:, 1]))
    return best


def inside(polygons, points):
    """Whether points (n, 2) are in the wedge: even-odd rule on a polygon closed far away.

    The polygon runs counter-clockwise from the far end of the first extension around the cusp's
    side to that of the second; it is graded towards the apex, to decide there at any scale.
    """
    apex = polygons[0, 0]
    t = np.unique(np.r_[np.linspace(0, 1, 700), np.geomspace(1e-14, 0.02, 400)])
    first, second = (bezier(p - apex, t) for p in polygons)
    far = [p[3] - apex + 1e4 * (p[3] - p[2]) / np.hypot(*(p[3] - p[2])) for p in polygons]
    start, end = (np.arctan2(e[1], e[0]) for e in far)
    angle = start + np.linspace(0, 1, 100)[1:-1] * ((end - start) % (2 * np.pi))
    rim = 1e4 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    loop = np.vstack([far[0], first[::-1], second[1:], far[1], rim[::-1]])
    x, y = (points - apex).T
    odd = np.zeros(len(points), dtype=bool)
    for (ax, ay), (bx, by) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
        if ay != by:
            odd ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * ((bx - ax) / (by - ay)))
    return odd
