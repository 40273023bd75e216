"""Random triangles shared by the tests of the commissures and of the triple contact point."""

from __future__ import annotations

import numpy as np


def sides(commissures: np.ndarray) -> np.ndarray:
    """a_i = |A_j A_k|, (m, 3)."""
    return np.linalg.norm(commissures[:, [1, 2, 0]] - commissures[:, [2, 0, 1]], axis=2)


def random_triangles(count: int, seed: int) -> np.ndarray:
    """Triangles (m, 3, 3) in random planes; about three in four are obtuse, needles left out."""
    points = np.random.default_rng(seed).normal(scale=10.0, size=(count, 3, 3))
    area = np.linalg.norm(
        np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1
    )
    return points[area > 1e-2 * sides(points).max(axis=1) ** 2]
