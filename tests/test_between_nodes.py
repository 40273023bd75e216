"""What lies between two nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.between_nodes import shortfall_between

Floats = NDArray[np.float64]


class Outside:
    """Everything outside a cylinder of radius 2 about z."""

    def __init__(self) -> None:
        self.asked = 0

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        self.asked += len(points)
        return np.hypot(points[:, 0], points[:, 1]) - 2.0, np.empty(0), np.empty(0)


def test_chord_of_a_circle() -> None:
    """Truth: the middle of a chord of a circle of radius 3, seen from a cylinder of radius 2 inside
    it, is nearer by the sagitta than its ends, which keep the clearance of 1."""
    angle = 0.4
    points = 3.0 * np.array([[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]])
    short = shortfall_between(Outside(), points, np.array([[0, 1]]), np.ones(2))
    np.testing.assert_allclose(short, 3.0 * (1.0 - np.cos(angle / 2)))


def test_clearance_is_linear_between_the_ends() -> None:
    """Truth: on a line away from the axis, from distance 0.1 to 1.1, each place misses a clearance
    that grows from 0.2 to 1.2 by 0.1, as the ends do."""
    points = np.array([[2.1, 0.0, 0.0], [3.1, 0.0, 5.0]])
    short = shortfall_between(Outside(), points, np.array([[0, 1]]), np.array([0.2, 1.2]))
    np.testing.assert_allclose(short, 0.1)


def test_only_where_it_can_matter() -> None:
    """Truth: edges that are farther away than they are long are not looked at."""
    far = np.array([[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]])
    field = Outside()
    edges = np.array([[0, 1], [1, 2], [2, 0]])
    np.testing.assert_array_equal(shortfall_between(field, far, edges, np.ones(3)), np.zeros(3))
    assert field.asked == 3
