"""Barrier and collision filter of ipctk, as wrapped: derivatives, units, crossings."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.self_contact import SelfContact
from term_cases import check_derivatives

DISTANCE = 0.2
KAPPA = 50.0


def grid(count: int, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Square sheet (count^2, 3) in z = 0 with its triangles."""
    ticks = np.linspace(0.0, side, count)
    x, y = (a.ravel() for a in np.meshgrid(ticks, ticks, indexing="ij"))
    number = np.arange(count**2).reshape(count, count)
    a, b, c, d = (
        number[i : count - 1 + i, j : count - 1 + j].ravel() for i in (0, 1) for j in (0, 1)
    )
    triangles = np.vstack([np.column_stack([a, c, d]), np.column_stack([a, d, b])])
    return np.column_stack([x, y, np.zeros(count**2)]), triangles


def two_sheets(gap: float, seed: int = 1, wobble: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Two 5 x 5 sheets of 1 mm triangles, ``gap`` apart, turned and shifted in their planes."""
    rng = np.random.default_rng(seed)
    sheet, triangles = grid(5, 4.0)
    angle = 0.4
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    upper = sheet.copy()
    upper[:, :2] = (upper[:, :2] - 2.0) @ turn.T + 2.0 + [0.13, 0.07]
    upper[:, 2] = gap
    points = np.vstack([sheet, upper]) + wobble * rng.uniform(-1.0, 1.0, (50, 3))
    return points, np.vstack([triangles, triangles + 25])


def contact_at(
    points: np.ndarray, triangles: np.ndarray, distance: float = DISTANCE, kappa: float = KAPPA
) -> SelfContact:
    """Self-contact with the given state as rest state."""
    return SelfContact(points, triangles, distance, kappa)


def test_gradient_and_hessian() -> None:
    """Truth: Taylor's theorem, remainders of order two for energy and gradient."""
    points, triangles = two_sheets(0.12, wobble=0.02)
    contact = contact_at(points, triangles)
    contact.project = False
    direction = 2e-3 * np.random.default_rng(5).normal(size=points.shape)
    assert contact.collisions(points) > 20
    check_derivatives(contact, points, direction)


def test_projection_is_positive_semidefinite() -> None:
    """Truth: eigenvalues; the exact Hessian has negative ones, the projected one has none."""
    points, triangles = two_sheets(0.12, wobble=0.02)
    contact = contact_at(points, triangles)
    projected = np.linalg.eigvalsh(contact.hessian(points).toarray())
    contact.project = False
    exact = np.linalg.eigvalsh(contact.hessian(points).toarray())
    assert exact[0] < -1e-3 * exact[-1]
    assert projected[0] > -1e-12 * projected[-1]


def test_one_point_above_a_triangle() -> None:
    """Truth: kappa b(d), b = -(d^2 - dhat^2)^2 ln(d^2/dhat^2); its derivative as force."""
    d = 0.05
    lower = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]]
    upper = [[0.5, 0.5, d], [0.7, 0.5, 2.0], [0.5, 0.7, 2.0]]
    points, triangles = np.array(lower + upper), np.array([[0, 1, 2], [3, 4, 5]])
    contact = contact_at(points, triangles)
    assert contact.collisions(points) == 1
    square, edge = d**2, DISTANCE**2
    energy = -KAPPA * (square - edge) ** 2 * np.log(square / edge)
    slope = -2.0 * (square - edge) * np.log(square / edge) - (square - edge) ** 2 / square
    assert contact.energy(points) == pytest.approx(energy, rel=1e-12)
    force = -contact.gradient(points)
    assert force[3] == pytest.approx([0.0, 0.0, -KAPPA * slope * 2.0 * d], rel=1e-10, abs=1e-12)
    assert force[3, 2] > 0.0
    assert force.sum(axis=0) == pytest.approx([0.0] * 3, abs=1e-12)
    assert force[:3, 2] / force[:3, 2].sum() == pytest.approx([2 / 3, 1 / 6, 1 / 6], rel=1e-10)
    contact.stiffness = 2.0 * KAPPA
    assert contact.energy(points) == pytest.approx(2.0 * energy, rel=1e-12)


@pytest.mark.parametrize("scale", [0.1, 3.0])
def test_energy_scales_with_the_fourth_power_of_length(scale: float) -> None:
    """Truth: all lengths times s, kappa kept: energy times s^4, so kappa is in mN/mm^3.

    With kappa = k E H / dhat^2, k a number, energy scales as the membrane's, E H times an area.
    """
    points, triangles = two_sheets(0.12, wobble=0.02)
    one = contact_at(points, triangles)
    two = contact_at(scale * points, triangles, scale * DISTANCE)
    assert two.energy(scale * points) == pytest.approx(scale**4 * one.energy(points), rel=1e-9)
    assert two.gradient(scale * points) == pytest.approx(
        scale**3 * one.gradient(points), rel=1e-9, abs=1e-12 * scale**3
    )


def test_motions_of_the_whole() -> None:
    """Truth: a rigid motion keeps energy and turns forces; forces and moments are in balance."""
    points, triangles = two_sheets(0.12, wobble=0.02)
    contact = contact_at(points, triangles)
    turn, _ = np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))
    moved = points @ turn.T + [3.0, -8.0, 5.0]
    gradient = contact.gradient(points)
    assert contact.energy(moved) == pytest.approx(contact.energy(points), rel=1e-9)
    assert contact.gradient(moved) == pytest.approx(
        gradient @ turn.T, abs=1e-8 * np.abs(gradient).max()
    )
    assert np.abs(gradient.sum(axis=0)).max() < 1e-12 * np.abs(gradient).sum()
    assert np.abs(np.cross(points, gradient).sum(axis=0)).max() < 1e-11 * np.abs(gradient).sum()


def test_nothing_when_far() -> None:
    """Truth: beyond dhat no energy, force or stiffness; a flat sheet does not act on itself."""
    points, triangles = two_sheets(1.001 * DISTANCE)
    contact = contact_at(points, triangles)
    assert contact.collisions(points) == 0
    assert contact.energy(points) == 0.0
    assert not contact.gradient(points).any()
    assert contact.hessian(points).shape == (150, 150)
    assert not contact.hessian(points).toarray().any()
    assert contact.closest(points) == DISTANCE


@pytest.mark.parametrize("gap", [0.19, 0.05, 1e-3, 1e-6])
def test_closest(gap: float) -> None:
    """Truth: parallel sheets are as far apart as they were drawn."""
    points, triangles = two_sheets(gap)
    contact = contact_at(points, triangles)
    assert contact.closest(points) == pytest.approx(gap, rel=1e-9)
    assert not contact.intersects(points)


def test_kept_contacts_follow_the_points() -> None:
    """Truth: a fresh object at the new points; also when the array is changed in place."""
    points, triangles = two_sheets(0.12, wobble=0.02)
    contact = contact_at(points, triangles)
    before = contact.energy(points)
    points[25:, 2] -= 0.03
    fresh = contact_at(two_sheets(0.12, wobble=0.02)[0], triangles)
    assert contact.energy(points) == fresh.energy(points) > before
    with pytest.raises(AttributeError):
        contact.distance = 1.0  # type: ignore[misc]


def test_intersects() -> None:
    """Truth: a triangle pushed through another crosses it; one beside it or hinged to it, not."""
    floor = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]]
    through = [[0.5, 0.5, -1.0], [0.6, 0.5, 1.0], [0.5, 0.6, 1.0]]
    points, triangles = np.array(floor + through), np.array([[0, 1, 2], [3, 4, 5]])
    contact = contact_at(points, triangles)
    assert contact.intersects(points)
    assert not contact.intersects(points + np.repeat([[0.0] * 3, [5.0, 0.0, 0.0]], 3, axis=0))
    assert not contact.intersects(points + np.repeat([[0.0] * 3, [0.0, 0.0, 1.1]], 3, axis=0))
    hinge = contact_at(np.array([*floor, [1.0, 1.0, 2.0]]), np.array([[0, 1, 2], [0, 1, 3]]))
    assert not hinge.intersects(np.array([*floor, [1.0, 1.0, 2.0]]))


def test_step_stops_at_first_touch() -> None:
    """Truth: sheets 0.5 apart, one moved by 10 through the other: they touch at a share of 0.05.

    ipctk keeps a tenth of the gap in hand, so between 0.8 and 1 of it is granted.
    """
    points, triangles = two_sheets(0.5)
    contact = contact_at(points, triangles)
    step = np.zeros_like(points)
    step[25:, 2] = -10.0
    assert not contact.intersects(points + step)  # it comes out on the other side
    share = contact.step_fraction(points, step)
    assert 0.8 * 0.05 < share < 0.05
    assert contact.step_fraction(points, -step) == 1.0
    assert contact.step_fraction(points, np.ones_like(points) * 100.0) == 1.0


@pytest.mark.parametrize("seed", range(8))
def test_filtered_steps_never_cross(seed: int) -> None:
    """Truth: big random steps cross when taken whole, and never when shortened as advised."""
    points, triangles = two_sheets(0.15, seed, wobble=0.01)
    contact = contact_at(points, triangles)
    rng = np.random.default_rng(seed)
    crossed = 0
    for _ in range(15):
        step = rng.normal(scale=1.0, size=points.shape)
        crossed += contact.intersects(points + step)
        points = points + contact.step_fraction(points, step) * step
        assert not contact.intersects(points)
        assert contact.closest(points) > 0.0
    assert crossed > 10
