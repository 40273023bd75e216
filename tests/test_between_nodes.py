"""What lies between two nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.between_nodes import BetweenNodesPenalty, shortfall_between
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.geometry.root import CylinderRoot
from term_cases import check_derivatives

Floats = NDArray[np.float64]


class Outside:
    """Everything outside a cylinder of radius 2 about z."""

    def __init__(self) -> None:
        self.asked = 0

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        self.asked += len(points)
        distance, gradient, hessian = CylinderRoot(2.0).evaluate(points)
        return -distance, -gradient, -hessian


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


#: two triangles over a bend, of which three edges are held off
POINTS = np.array([[1.9, 1.6, 0.0], [1.9, -1.6, 0.1], [1.8, 1.7, 1.0], [1.9, -1.8, 1.1]])
EDGES = np.array([[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]])
AREAS = np.array([0.3, 0.5, 0.9, 0.4, 0.2])
HELD_OFF = np.array([True, False, True, False, True])
CLEARANCE = np.array([0.2, 0.25, 0.3, 0.15])


def penalty() -> BetweenNodesPenalty:
    """Its places are inside the ramp by as much as 0.4 of its width."""
    nodes = SignedDistancePenalty(Outside(), np.ones(4), 16.0, 0.6, CLEARANCE)
    between = BetweenNodesPenalty(nodes, EDGES, AREAS)
    between.hold_off(HELD_OFF)
    return between


def test_derivatives() -> None:
    """Truth: Taylor's theorem for energy and gradient; the Hessian is symmetric."""
    term = penalty()
    direction = np.random.default_rng(3).normal(size=POINTS.shape)
    assert term.energy(POINTS) > 0.0
    check_derivatives(term, POINTS, 0.1 * direction)


def test_energy_by_hand() -> None:
    """Truth: eta_1 eta_2 / 4 times each edge's area times the square of (1.5)'s ramp at its five
    places, the clearance linear between its ends; edges that are not held off have none."""
    expected = 0.0
    for (a, b), area in zip(EDGES[HELD_OFF], AREAS[HELD_OFF], strict=True):
        for share in (0.2, 0.35, 0.5, 0.65, 0.8):
            x, y, _ = (1 - share) * POINTS[a] + share * POINTS[b]
            wanted = (1 - share) * CLEARANCE[a] + share * CLEARANCE[b]
            ramp = max(1 - 2 * (np.hypot(x, y) - 2.0 - wanted) / 0.6, 0.0)
            expected += 16.0 * 0.6 / 4 * area * ramp**2
    np.testing.assert_allclose(penalty().energy(POINTS), expected)


def test_none_held_off() -> None:
    """Truth: with no edge to hold off there is no energy, no force, no stiffness, and no place is
    asked for its distance."""
    term = penalty()
    term.hold_off(np.zeros(5, dtype=bool))
    field = term.nodes.field
    assert isinstance(field, Outside)
    asked = field.asked
    assert term.energy(POINTS) == 0.0
    assert not term.gradient(POINTS).any()
    assert term.hessian(POINTS).nnz == 0
    assert not term.foreseen(POINTS, POINTS).gradient.any()
    assert field.asked == asked


def test_follows_the_nodes() -> None:
    """Truth: stiffness, width, clearance and volume of the nodes' penalty are its own: after a
    change it is what it would have been from the start."""
    term, nodes = (
        penalty(),
        SignedDistancePenalty(CylinderRoot(2.0), np.ones(4), 31.0, 0.2, CLEARANCE + 0.1),
    )
    fresh = BetweenNodesPenalty(nodes, EDGES, AREAS)
    fresh.hold_off(HELD_OFF)
    term.energy(POINTS)
    term.nodes.field, term.nodes.stiffness, term.nodes.width = nodes.field, 31.0, 0.2
    term.nodes.clearance = CLEARANCE + 0.1
    np.testing.assert_array_equal(term.gradient(POINTS), fresh.gradient(POINTS))
    assert term.energy(POINTS) == fresh.energy(POINTS) > 0.0


def test_ends_are_pushed_the_same_way() -> None:
    """Truth: an edge over a sharp bend, its middle nearest: both ends are pushed away from the
    bend, along the mean of their ways, and not apart from each other."""
    points = np.array([[2.1, 1.5, 0.0], [2.1, -1.5, 0.0]])
    nodes = SignedDistancePenalty(Outside(), np.ones(2), 16.0, 0.1, np.full(2, 0.25))
    assert not nodes.gradient(points).any()
    term = BetweenNodesPenalty(nodes, np.array([[0, 1]]), np.ones(1))
    term.hold_off(np.ones(1, dtype=bool))
    force = -term.gradient(points)
    np.testing.assert_allclose(force[0], force[1] * [1, -1, 1], atol=1e-12)
    assert (force[:, 0] > 0).all()
    assert (np.abs(force[:, 1]) < 0.15 * force[:, 0]).all()


def test_foreseen_becomes_what_acts() -> None:
    """Truth: from where nothing acts to where some places do, what was foreseen is the gradient
    there but for the volume's bend, which is of second order in the step."""
    term = penalty()
    start, moves = POINTS + [0.75, 0.0, 0.0], np.tile([-0.3, 0.0, 0.0], (4, 1))
    assert not term.gradient(start).any()
    found = term.foreseen(start, moves)
    assert found.switched.max() == 1
    ahead = found.gradient + (found.hessian @ moves.ravel()).reshape(-1, 3)
    exact = term.gradient(start + moves)
    assert np.abs(ahead - exact).max() < 0.1 * np.abs(exact).max()
