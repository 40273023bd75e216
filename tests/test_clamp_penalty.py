"""The clamp's penalty: derivatives, closed forms, and angles counted without a jump."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.clamp_penalty import ClampPenalty
from term_cases import check_derivatives

EDGES = np.array([[[0.0, 0, 0], [2.0, 0, 0]], [[2.0, 0, 0], [3.0, 1.0, 0]]])
CONORMAL = np.array([[0.0, -1, 0], [1.0, -1.0, 0.5]])


def made(apex: tuple[int, int] = (1, 3)) -> ClampPenalty:
    """Two suture edges, four nodes."""
    return ClampPenalty(4, np.array(apex), EDGES, CONORMAL, np.array([2.0, 3.0]), 7.0)


@pytest.mark.parametrize("apex", [(1, 3), (2, 2)])
def test_derivatives(apex: tuple[int, int]) -> None:
    """Truth: gradient and Hessian are those of the energy (Taylor tests of order 2), also where
    two edges share their apex."""
    random = np.random.default_rng(5)
    check_derivatives(made(apex), random.uniform(0.5, 2.0, (4, 3)), random.standard_normal((4, 3)))


def test_angle_in_closed_form() -> None:
    """Truth: a node turned by phi from -b towards t x b, whatever its height and place along the
    edge, has the angle phi and the energy k/2 l phi^2."""
    penalty = made()
    points = np.zeros((4, 3))
    inward, normal = np.array([0.0, 1, 0]), np.array([0.0, 0, -1])  # -b and t x b
    points[3] = EDGES[1, 0] - 2.0 * np.array([1.0, -1.0, 0.5])
    for phi in (-2.5, -1.0, 0.0, 0.3, 3.0):
        points[1] = [0.7, 0, 0] + 1.3 * (np.cos(phi) * inward + np.sin(phi) * normal)
        np.testing.assert_allclose(penalty.angles(points), [phi, 0.0], atol=1e-14)
        assert penalty.energy(points) == pytest.approx(7.0 / 2 * 2.0 * phi**2, abs=1e-12)


def test_large_rotations_are_counted() -> None:
    """Truth: renewed on the way, the angle passes 180 degrees without the jump of arctan."""
    penalty = made()
    points = np.zeros((4, 3))
    points[3] = [2.0, 1.0, 1.0]
    for phi in np.linspace(0.0, 4.0, 9):
        points[1] = [0.0, np.cos(phi), -np.sin(phi)]
        assert penalty.angles(points)[0] == pytest.approx(phi, abs=1e-13)
        penalty.renew(points)
