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


LENGTHS = np.array([2.0, 3.0])


def turned(angles: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """(4, 3) points whose apexes 1 and 3 have these angles and distances from their edges."""
    points = np.zeros((4, 3))
    along = EDGES[:, 1] - EDGES[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    inward = -(CONORMAL - np.einsum("kd,kd->k", CONORMAL, along)[:, None] * along)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    normal = np.cross(along, -inward)
    across = np.cos(angles)[:, None] * inward + np.sin(angles)[:, None] * normal
    points[[1, 3]] = EDGES[:, 0] + 0.4 * along + arms[:, None] * across
    return points


def random_points(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (4, 3))


def test_height_in_closed_form() -> None:
    """Truth: renewed within 60 degrees at arm r, the energy is k/2 l (height / r)^2 wherever the
    apex goes, even behind its edge: height = rho sin phi in cylinder coordinates."""
    penalty, arms = made(), np.array([1.3, 0.02])
    penalty.renew(turned(np.radians([59.0, -20.0]), arms))
    for rho, phi in ((arms, [0.0, 0.0]), (2 * arms, [0.5, -1.0]), (arms / 7, [3.0, -2.5])):
        height = rho * np.sin(phi)
        points = turned(np.array(phi), rho)
        expected = 7.0 / 2 * LENGTHS @ (height / arms) ** 2
        assert penalty.energy(points) == pytest.approx(expected, rel=1e-12)
        force = np.linalg.norm(penalty.gradient(points), axis=1)[[1, 3]]
        np.testing.assert_allclose(force, 7.0 * LENGTHS * np.abs(height) / arms**2, atol=1e-10)


def test_height_is_the_angle_to_first_order() -> None:
    """Truth: at the arm of the renewal sin^2 phi = phi^2 - phi^4/3 + ...: what is missing to the
    energy of the angle is k/2 l phi^4/3, and falls with order four."""
    near, far, arms = made(), made(), np.array([1.3, 0.7])
    near.renew(turned(np.array([0.2, -0.1]), arms))
    for phi in (0.04, 0.02):
        points = turned(np.array([phi, -2 * phi]), arms)
        missing = far.energy(points) - near.energy(points)
        expected = 7.0 / 2 * LENGTHS @ (np.array([phi, 2 * phi]) ** 4 / 3)
        assert missing == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("apex", [(1, 3), (2, 2)])
@pytest.mark.parametrize("angles", [(50.0, -59.0), (61.0, -100.0), (170.0, 10.0)])
def test_derivatives_after_renewal(apex: tuple[int, int], angles: tuple[float, float]) -> None:
    """Truth: gradient and Hessian are those of the energy, with all edges near their half-planes,
    none, and one of each. A quadratic energy has no remainder, so differences are exact there."""
    penalty = made(apex)
    start = turned(np.radians(angles), np.array([1.3, 0.7]))
    start[2] = start[1]
    penalty.renew(start)
    points, way = start + 0.05 * random_points(2), random_points(3)
    gradient, hessian = penalty.gradient(points), penalty.hessian(points).toarray()
    ahead, behind = points + 1e-5 * way, points - 1e-5 * way
    slope = (penalty.energy(ahead) - penalty.energy(behind)) / 2e-5
    assert slope == pytest.approx(np.vdot(gradient, way), rel=1e-7)
    change = (penalty.gradient(ahead) - penalty.gradient(behind)) / 2e-5
    expected = (hessian @ way.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(change, expected, atol=1e-7 * np.abs(hessian).max())
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12 * np.abs(hessian).max())
    if max(np.abs(angles)) > 60.0:
        if apex == (1, 3):  # the quadratic part would hide the order
            check_derivatives(penalty, points, way)
    else:
        quadratic = way.ravel() @ hessian @ way.ravel() / 2
        whole = penalty.energy(points + way) - penalty.energy(points)
        assert whole == pytest.approx(np.vdot(gradient, way) + quadratic, rel=1e-11)


def test_hessian_is_positive_near_the_half_plane() -> None:
    """Truth: a square of a linear function: eigenvalues are 0 but for k l / r^2 of each edge, also
    at points far from those of the renewal; the angle's own Hessian has negative ones there."""
    penalty, plain, arms = made(), made(), np.array([1.3, 0.7])
    penalty.renew(turned(np.array([0.9, -0.5]), arms))
    found_negative = False
    for seed in range(10):
        points = random_points(seed)
        values = np.linalg.eigvalsh(penalty.hessian(points).toarray())
        np.testing.assert_allclose(values[-2:], np.sort(7.0 * LENGTHS / arms**2), rtol=1e-12)
        np.testing.assert_allclose(values[:-2], 0.0, atol=1e-12)
        found_negative |= np.linalg.eigvalsh(plain.hessian(points).toarray())[0] < -1e-3
    assert found_negative


def test_no_singularity_on_the_edge() -> None:
    """Truth: energy, force and Hessian stay those of the height when the apex is squeezed against
    its edge, down to lying on it."""
    penalty, arms = made(), np.array([1.3, 0.7])
    penalty.renew(turned(np.array([0.3, 0.2]), arms))
    expected = penalty.hessian(turned(np.array([0.3, 0.2]), arms)).toarray()
    for rho in (1e-3, 1e-9, 1e-60):
        points = turned(np.array([0.3, 2.0]), np.full(2, rho))
        assert np.linalg.norm(penalty.gradient(points)) < 100 * rho + 1e-13
        np.testing.assert_allclose(penalty.hessian(points).toarray(), expected, rtol=1e-14)


def test_apex_exactly_on_the_edge() -> None:
    """Truth: there the height is 0: no energy, no force, the Hessian of anywhere else."""
    penalty, arms = made(), np.array([1.3, 0.7])
    start = turned(np.array([0.3, 0.2]), arms)
    penalty.renew(start)
    points = np.zeros((4, 3))
    points[[1, 3]] = EDGES[:, 0]
    assert penalty.energy(points) == 0.0
    assert not penalty.gradient(points).any()
    np.testing.assert_array_equal(
        penalty.hessian(points).toarray(), penalty.hessian(start).toarray()
    )


@pytest.mark.parametrize("angle", [61.0, 120.0, -179.0])
def test_beyond_60_degrees_the_angle_counts(angle: float) -> None:
    """Truth: renewed there, energy and force are k/2 l phi^2 and k l phi / rho at any distance from
    the edge; the other edge, renewed within 60 degrees, has its height."""
    penalty, arms = made(), np.array([1.3, 0.7])
    penalty.renew(turned(np.radians([angle, 30.0]), arms))
    phi = np.radians(angle) * 1.1
    points = turned(np.array([phi, 0.4]), np.array([0.6, 0.9]))
    expected = 7.0 / 2 * LENGTHS @ [phi**2, (0.9 * np.sin(0.4) / 0.7) ** 2]
    assert penalty.energy(points) == pytest.approx(expected, rel=1e-12)
    force = np.linalg.norm(penalty.gradient(points)[1])
    assert force == pytest.approx(7.0 * 2.0 * abs(phi) / 0.6, rel=1e-12)


@pytest.mark.parametrize("renewed", [False, True])
def test_edges_switched_off(renewed: bool) -> None:
    """Truth: what is left is the penalty of the other edge alone, in every digit; with none active
    there is nothing; angles are told all the same."""
    both, points = made(), random_points(5)
    if renewed:
        both.renew(turned(np.array([0.3, 2.0]), np.array([1.3, 0.7])))
    angles = both.angles(points)
    for kept, apex in ((0, 1), (1, 3)):
        alone = ClampPenalty(
            4,
            np.array([apex]),
            EDGES[kept : kept + 1],
            CONORMAL[kept : kept + 1],
            LENGTHS[kept : kept + 1],
            7.0,
        )
        alone.reference = both.reference[:, kept : kept + 1]
        both.active = np.arange(2) == kept
        assert both.energy(points) == alone.energy(points)
        np.testing.assert_array_equal(both.gradient(points), alone.gradient(points))
        expected = alone.hessian(points).toarray()
        np.testing.assert_array_equal(both.hessian(points).toarray(), expected)
    both.active[:] = False
    assert both.energy(points) == 0.0
    assert not both.gradient(points).any()
    assert not both.hessian(points).toarray().any()
    np.testing.assert_array_equal(both.angles(points), angles)


def test_reference_is_all_there_is_to_keep() -> None:
    """Truth: a fresh penalty given the reference of one that was renewed has its energy, force and
    Hessian bit by bit; the first reference brings back the first energy."""
    penalty, points = made(), random_points(6)
    first, before = penalty.reference, penalty.energy(points)
    for step in (0.5, 1.5, 2.5, 3.5):
        penalty.renew(turned(np.array([step, -step / 3]), np.array([1.3, 0.7])))
    kept = penalty.reference.copy()
    assert penalty.reference[0] == pytest.approx([3.5, -3.5 / 3])
    assert penalty.reference[1] == pytest.approx([1.3, 0.7])
    again = made()
    again.reference = kept
    assert again.energy(points) == penalty.energy(points) != before
    np.testing.assert_array_equal(again.gradient(points), penalty.gradient(points))
    np.testing.assert_array_equal(
        again.hessian(points).toarray(), penalty.hessian(points).toarray()
    )
    penalty.reference = first
    assert penalty.energy(points) == before


def test_no_triangle_turns_over_in_a_step() -> None:
    """Truth: an apex that moves straight at its edge may go 0.9 of the way, however fast; one that
    moves along the edge, away from it, or by less than that may go all of it; edges that do not
    act do not count."""
    edges = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])
    conormal = np.array([[0.0, -1.0, 0.0]])
    penalty = ClampPenalty(3, np.array([2]), edges, conormal, np.ones(1), 1.0)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.4, 0.1, 0.0]])
    for move, share in (
        ([0.0, -1.0, 0.0], 0.09),
        ([5.0, -0.5, 0.0], 0.18),
        ([0.0, -0.2, 3.0], 0.45),
        ([0.0, -0.08, 0.0], 1.0),
        ([1.0, 0.0, 1.0], 1.0),
        ([0.0, 1.0, 0.0], 1.0),
    ):
        moves = np.zeros((3, 3))
        moves[2] = move
        assert penalty.largest_share(points, moves) == pytest.approx(share)
    penalty.active[:] = False
    moves[2] = [0.0, -1.0, 0.0]
    assert penalty.largest_share(points, moves) == 1.0


def test_full_turns_are_forgotten() -> None:
    """Truth: an apex that went round its edge's line is where it was; from 225 degrees on the way
    back is the short one, below that the way it came."""
    penalty, arms = made(), np.array([1.3, 0.7])
    for step in np.radians([60.0, 120.0, 180.0, 210.0]):
        penalty.renew(turned(np.array([step, -step]), arms))
    assert penalty.reference[0] == pytest.approx(np.radians([210.0, -210.0]))
    penalty.renew(turned(np.radians([240.0, -300.0]), arms))
    assert penalty.reference[0] == pytest.approx(np.radians([-120.0, 60.0]))
