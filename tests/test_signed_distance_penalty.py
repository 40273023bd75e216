"""The penalty of paper (1.5) against Taylor's theorem, its formula and hand-made volumes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from avneo_fem.constraints.signed_distance_penalty import SignedDistance, SignedDistancePenalty
from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.root import CylinderRoot
from term_cases import check_derivatives
from valve_cases import experiment

RADIUS = 12.0


class HalfSpace:
    """z > level, with a count of how often it is asked."""

    def __init__(self, level: float) -> None:
        self.level, self.calls = level, 0

    def evaluate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """z - level, e_z, 0."""
        self.calls += 1
        up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        return points[:, 2] - self.level, up, np.zeros((len(points), 3, 3))


def cylinder() -> SignedDistance:
    """The root of all experiments."""
    return CylinderRoot(RADIUS)


def wedge_field() -> SignedDistance:
    """Contact wedge of cusp 1 of Experiment 3 at lambda = 0.6."""
    valve = experiment(3, "code")
    family = ContactWedgeFamily(
        valve.commissures, valve.triple_contact.point, valve.contact_lengths
    )
    return family.wedge(1, 0.6)


VOLUMES = pytest.mark.parametrize("build", [cylinder, wedge_field], ids=["root", "wedge"])


def nodes_near(field: SignedDistance, low: float, high: float, count: int = 12) -> np.ndarray:
    """Points of the root's inside whose distance lies between ``low`` and ``high``."""
    rng = np.random.default_rng(7)
    points = rng.uniform(-RADIUS, RADIUS, (60000, 3))
    distance = field.evaluate(points)[0]
    found = points[(distance > low) & (distance < high)]
    assert len(found) >= count
    return found[:count]


def penalty_of(field: SignedDistance, count: int, **changes: float) -> SignedDistancePenalty:
    """Unequal nodes, eta_1 = 16 kPa, eta_2 = 1 mm, d_0 from 0.1 mm on."""
    values = {"stiffness": 16.0, "width": 1.0, **changes}
    areas, clearance = np.linspace(0.5, 2.0, count), np.linspace(0.1, 0.3, count)
    return SignedDistancePenalty(field, areas, values["stiffness"], values["width"], clearance)


@VOLUMES
def test_gradient_and_hessian(build: Callable[[], SignedDistance]) -> None:
    """Truth: Taylor's theorem, remainders of order two for energy and gradient, with curvature.

    The nodes stay in the active range for every step, and off the planes where the closest part of
    the wedge's border changes: there the energy is smooth.
    """
    field = build()
    points = nodes_near(field, -1.0, 0.3)
    penalty = penalty_of(field, len(points))
    direction = np.random.default_rng(8).normal(size=points.shape)
    direction *= 0.1 / np.linalg.norm(direction, axis=1)[:, None]
    assert np.all(penalty.ramp(points) > 0)
    check_derivatives(penalty, points, direction)


@VOLUMES
def test_nothing_outside_the_active_range(build: Callable[[], SignedDistance]) -> None:
    """Truth: (1.5) vanishes for d >= d_0 + eta_2 / 2."""
    field = build()
    points = nodes_near(field, 0.85, 3.0)
    penalty = penalty_of(field, len(points))
    assert penalty.energy(points) == 0.0
    assert not penalty.gradient(points).any()
    assert not penalty.hessian(points).toarray().any()
    assert not penalty.shortfall(points).any()


def test_force_at_the_clearance() -> None:
    """Truth: (1.5) with d = d_0 is eta_1 S_n towards the axis; half as much half way out."""
    count = 9
    penalty = penalty_of(CylinderRoot(RADIUS), count)
    angle = np.linspace(0.0, 6.0, count)
    axis = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    rise = [0.0, 0.0, 3.0]
    for share, factor in ((0.0, 1.0), (0.25, 0.5), (0.5, 0.0), (-0.5, 2.0)):
        points = (RADIUS - penalty.clearance - share * penalty.width)[:, None] * axis + rise
        force = -penalty.gradient(points)
        expected = -factor * 16.0 * penalty.node_areas[:, None] * axis
        assert force == pytest.approx(expected, abs=1e-11)
        assert penalty.energy(points) == pytest.approx(
            16.0 / 4 * factor**2 * penalty.node_areas.sum(), abs=1e-11
        )
        assert penalty.shortfall(points) == pytest.approx([max(-share, 0.0)] * count, abs=1e-12)


def test_half_space_by_hand() -> None:
    """Truth: a spring eta_1 S_n 2/eta_2 per node: one number for energy, force and stiffness."""
    penalty = SignedDistancePenalty(
        HalfSpace(1.0), np.array([3.0, 3.0]), 8.0, 0.5, np.array([0.25, 0.25])
    )
    points = np.array([[5.0, 6.0, 1.25], [7.0, 8.0, 1.6]])
    assert penalty.energy(points) == pytest.approx(8.0 * 3.0 * 0.5 / 4)
    assert penalty.gradient(points).tolist() == [[0.0, 0.0, -24.0], [0.0, 0.0, 0.0]]
    dense = penalty.hessian(points).toarray()
    assert dense[2, 2] == pytest.approx(24.0 * 2 / 0.5)
    assert np.count_nonzero(dense) == 1
    assert penalty.hessian(points).shape == (6, 6)


def test_stiffness_and_width_act_at_once() -> None:
    """Truth: energy, force and tangent are linear in eta_1, also when it is raised later."""
    points = nodes_near(CylinderRoot(RADIUS), -1.0, 0.2)
    penalty = penalty_of(CylinderRoot(RADIUS), len(points))
    before = penalty.energy(points), penalty.gradient(points), penalty.hessian(points).toarray()
    penalty.stiffness *= 3.0
    assert penalty.energy(points) == pytest.approx(3.0 * before[0], rel=1e-14)
    assert penalty.gradient(points) == pytest.approx(3.0 * before[1], rel=1e-14)
    assert penalty.hessian(points).toarray() == pytest.approx(3.0 * before[2], rel=1e-14)


def test_a_replaced_field_is_asked_again() -> None:
    """Truth: the kept answer belongs to one field and one set of points, and is kept for these."""
    first, second = HalfSpace(0.0), HalfSpace(10.0)
    points = np.array([[0.0, 0.0, 4.0]])
    penalty = SignedDistancePenalty(first, np.ones(1), 1.0, 1.0, np.zeros(1))
    assert penalty.evaluate(points)[0].tolist() == [4.0]
    penalty.energy(points), penalty.gradient(points), penalty.hessian(points)
    assert first.calls == 1
    penalty.field = second
    assert penalty.field is second
    assert penalty.evaluate(points)[0].tolist() == [-6.0]
    points[0, 2] = 12.0  # the same array, changed in place
    assert penalty.evaluate(points)[0].tolist() == [2.0]
    assert (first.calls, second.calls) == (1, 2)


class Chain:
    """Nodes tied to each other by springs and to their rest by weaker ones, over the floor z = 0.

    The energy is piecewise quadratic: a ramp acts on those nodes that are low enough.
    """

    def __init__(self, seed: int, count: int = 5) -> None:
        random = np.random.default_rng(seed)
        ties = np.diff(np.eye(count), axis=0)
        springs = np.diag(random.uniform(1.0, 3.0, count)) + 2.0 * ties.T @ ties
        self.matrix = np.kron(springs, np.eye(3))
        self.rest = random.uniform(-1.5, 1.5, (count, 3))
        self.penalty = SignedDistancePenalty(
            HalfSpace(0.0), random.uniform(0.5, 2.0, count), 8.0, 0.5, np.full(count, 0.1)
        )
        self.start = random.uniform(-1.0, 1.0, (count, 3))

    def residual(self, points: np.ndarray) -> np.ndarray:
        force = self.matrix @ (points - self.rest).ravel()
        return force + self.penalty.gradient(points).ravel()

    def tangent(self, points: np.ndarray) -> np.ndarray:
        return self.matrix + self.penalty.hessian(points).toarray()

    def plain_step(self) -> np.ndarray:
        """Newton's step from the start."""
        step = np.linalg.solve(self.tangent(self.start), -self.residual(self.start))
        return step.reshape(-1, 3)

    def minimiser(self) -> np.ndarray:
        """By trying all sets of nodes that the ramp may act on: the energy is convex."""
        level, slope = 0.1 + 0.5 / 2, 2 / 0.5  # f = slope (level - z) for z < level
        found = []
        for acting in product([0.0, 1.0], repeat=len(self.rest)):
            rate = 8.0 * self.penalty.node_areas * slope * np.array(acting)
            matrix = self.matrix + np.diag(np.kron(rate, [0.0, 0.0, 1.0]))
            right = self.matrix @ self.rest.ravel() + np.kron(rate * level, [0.0, 0.0, 1.0])
            points = np.linalg.solve(matrix, right).reshape(-1, 3)
            if np.array_equal(points[:, 2] < level, acting):
                found.append(points)
        (only,) = found
        return only


@pytest.mark.parametrize("seed", range(12))
def test_foreseen_steps_land_on_the_minimiser(seed: int) -> None:
    """Truth: the minimiser of a convex, piecewise quadratic energy, found by trying every set of
    nodes. Newton's step misses it unless that set acts already; solved again with what the step
    switches, until nothing new does, one step lands on it."""
    chain = Chain(seed)
    expected, step = chain.minimiser(), chain.plain_step()
    assert not np.allclose(chain.residual(chain.start), 0.0)
    first = chain.penalty.foreseen(chain.start, step)
    seen = 0 * first.switched
    for _ in range(6):
        found = chain.penalty.foreseen(chain.start, step)
        if np.array_equal(found.switched, seen):
            break
        seen = found.switched
        matrix = chain.tangent(chain.start) + found.hessian.toarray()
        right = chain.residual(chain.start) + found.gradient.ravel()
        step = np.linalg.solve(matrix, -right).reshape(-1, 3)
    np.testing.assert_allclose(chain.start + step, expected, atol=1e-12)
    acts, will = ((chain.penalty.ramp(p) > 0).astype(int) for p in (chain.start, expected))
    np.testing.assert_array_equal(seen, will - acts)
    missed = np.abs(chain.start + chain.plain_step() - expected).max()
    assert (missed > 1e-3) if seen.any() else (missed < 1e-12)


def test_chains_switch_both_ways() -> None:
    """Truth: the chains above are no empty test: nodes begin to act, cease to, and do neither."""
    switched = [
        chain.penalty.foreseen(chain.start, chain.plain_step()).switched
        for chain in map(Chain, range(12))
    ]
    assert {-1, 0, 1} == set(np.concatenate(switched))


def test_foreseen_gradient_is_that_of_the_end_of_the_step() -> None:
    """Truth: over a plane the ramp is linear on either side: gradient, tangent and what is foreseen
    give the gradient after any step in every digit, and the tangent there, switched or not."""
    random = np.random.default_rng(9)
    penalty = penalty_of(HalfSpace(0.0), 40)
    points, moves = random.uniform(-1.5, 1.5, (2, 40, 3))
    found = penalty.foreseen(points, moves)
    assert {-1, 0, 1} == set(found.switched)
    assert found.gradient.shape == (40, 3)
    assert found.hessian.shape == (120, 120)
    matrix = (penalty.hessian(points) + found.hessian).toarray()
    ahead = penalty.gradient(points) + found.gradient + (matrix @ moves.ravel()).reshape(-1, 3)
    after = penalty.gradient(points + moves)
    np.testing.assert_allclose(ahead, after, atol=1e-12 * np.abs(after).max())
    np.testing.assert_allclose(matrix, penalty.hessian(points + moves).toarray(), atol=1e-12)
    acts = [(penalty.ramp(p) > 0).astype(int) for p in (points, points + moves)]
    np.testing.assert_array_equal(found.switched, acts[1] - acts[0])


@VOLUMES
def test_nothing_is_foreseen_where_nothing_switches(build: Callable[[], SignedDistance]) -> None:
    """Truth: nodes that stay on their side of the ramp's end change nothing; nor does a rest."""
    field = build()
    points = np.vstack([nodes_near(field, -1.0, 0.1), nodes_near(field, 0.9, 3.0)])
    penalty = penalty_of(field, len(points))
    small = 0.05 * np.random.default_rng(2).uniform(-1, 1, points.shape)
    for moves in (np.zeros_like(points), small):
        found = penalty.foreseen(points, moves)
        assert not found.switched.any()
        assert not found.gradient.any()
        assert not found.hessian.toarray().any()


def test_foreseen_on_a_curved_wall() -> None:
    """Truth: a node that goes straight to the wall of the root sees the distance grow linearly: it
    is foreseen to act just when it will; one that goes along the tangent never is."""
    penalty = penalty_of(CylinderRoot(RADIUS), 4)
    angle = np.arange(4) * 1.3
    axis, around = (
        np.column_stack([np.cos(a), np.sin(a), np.zeros(4)]) for a in (angle, angle + np.pi / 2)
    )
    begins = RADIUS - penalty.clearance - penalty.width / 2  # radius from which the ramp acts
    points = (begins - 0.2)[:, None] * axis
    for length, expected in ((0.19, 0), (0.21, 1), (-1.0, 0)):
        np.testing.assert_array_equal(penalty.foreseen(points, length * axis).switched, expected)
        back = penalty.foreseen((begins + 0.2)[:, None] * axis, -length * axis)
        np.testing.assert_array_equal(back.switched, -expected)
    assert not penalty.foreseen(points, around).switched.any()


@VOLUMES
def test_only_nodes_that_may_act_are_asked(build: Callable[[], SignedDistance]) -> None:
    """Truth: on a walk of nodes in and out of the ramp, energy, gradient, Hessian and what is
    foreseen are those of a penalty that asks all of them, to the bit, and fewer are asked."""

    class Counted:
        asked = 0

        def evaluate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            self.asked += len(points)
            return build().evaluate(points)

    rng = np.random.default_rng(3)
    field, points = Counted(), nodes_near(build(), -0.5, 6.0, count=200)
    penalty = penalty_of(field, len(points))
    for size in (0.01, 0.03, 1.0, 0.1, 0.01, 0.01, 2.0, 0.001):
        points = points + size * rng.standard_normal(points.shape)
        moves = 0.3 * rng.standard_normal(points.shape)
        fresh = penalty_of(build(), len(points))
        fresh.evaluate(points)
        assert penalty.energy(points) == fresh.energy(points)
        np.testing.assert_array_equal(penalty.gradient(points), fresh.gradient(points))
        found, expected = penalty.hessian(points), fresh.hessian(points)
        np.testing.assert_array_equal(found.toarray(), expected.toarray())
        found, expected = penalty.foreseen(points, moves), fresh.foreseen(points, moves)
        np.testing.assert_array_equal(found.switched, expected.switched)
        np.testing.assert_array_equal(found.gradient, expected.gradient)
    assert field.asked < 0.8 * 8 * len(points)
