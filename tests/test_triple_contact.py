"""Propositions 3.1 and 3.2 and Remark 3.1 on random triangles, against geometry and brute force."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.commissure import contact_lengths, quasi_optimal_lengths
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.triple_contact import triple_contact_point, triple_contact_points
from commissure_cases import random_triangles, sides

Batch = tuple[np.ndarray, np.ndarray]


def random_batch(count: int, seed: int) -> Batch:
    """Random triangles with random contact lengths, ratio up to 20."""
    commissures = random_triangles(count, seed)
    return commissures, np.random.default_rng(seed + 1).uniform(1.0, 20.0, (len(commissures), 3))


def dilation(commissures: np.ndarray, contact: np.ndarray, points: np.ndarray) -> np.ndarray:
    """max_i |A_i P| / c_i (m,), the function that C minimises."""
    return np.max(np.linalg.norm(commissures - points[:, None], axis=2) / contact, axis=1)


def test_proposition_3_1() -> None:
    """Truth: the case by its printed condition; (3.2) in case 2, K_i and nu_i in case 1."""
    commissures, contact = random_batch(30000, 5)
    point, nu, side = triple_contact_points(commissures, contact)
    length, distance = sides(commissures), np.linalg.norm(commissures - point[:, None], axis=2)
    conditions = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        share = (contact[:, j] / (contact[:, j] + contact[:, k]))[:, None]
        foot = commissures[:, j] + share * (commissures[:, k] - commissures[:, j])
        nu_i = length[:, i] / (contact[:, j] + contact[:, k])
        holds = np.linalg.norm(commissures[:, i] - foot, axis=1) < nu_i * contact[:, i]
        conditions.append(holds)
        assert np.array_equal(holds, side == i)
        assert np.abs(point - foot)[holds].max() < 1e-12
        assert np.abs(nu / nu_i - 1.0)[holds].max() < 1e-14
    assert np.sum(conditions, axis=0).max() == 1
    inside = side == -1
    assert min(np.count_nonzero(inside), np.count_nonzero(~inside)) > 3000
    size = length.max(axis=1, keepdims=True)
    assert np.abs((distance - nu[:, None] * contact) / size)[inside].max() < 1e-12
    assert np.max((distance - nu[:, None] * contact) / size) < 1e-12


def test_point_lies_in_triangle_of_dividers() -> None:
    """Truth: C in triangle K_0 K_1 K_2 (Proposition 3.1), by barycentric coordinates there."""
    commissures, contact = random_batch(20000, 7)
    point, _, side = triple_contact_points(commissures, contact)
    j, k = [1, 2, 0], [2, 0, 1]
    c_j, c_k = contact[:, j, None], contact[:, k, None]
    dividers = (c_k * commissures[:, j] + c_j * commissures[:, k]) / (c_j + c_k)
    edges = dividers[:, 1:] - dividers[:, :1]
    gram = np.einsum("mip,mjp->mij", edges, edges)
    right = np.einsum("mip,mp->mi", edges, point - dividers[:, 0])
    two = np.linalg.solve(gram, right[..., None])[..., 0]
    weights = np.column_stack([1.0 - two.sum(axis=1), two])
    assert weights[side == -1].min() > -1e-8


def test_point_is_the_minimiser() -> None:
    """Truth: C minimises max |A_i P|/c_i, which is convex: no nearby or random P does better."""
    commissures, contact = random_batch(4000, 9)
    point, nu, _ = triple_contact_points(commissures, contact)
    assert np.abs(dilation(commissures, contact, point) / nu - 1.0).max() < 1e-11
    rng = np.random.default_rng(10)
    size = sides(commissures).max(axis=1, keepdims=True)
    for reach in (1e-3, 1e-1, 1.0):
        for _ in range(60):
            weights = rng.normal(size=(len(nu), 3))
            weights -= weights.mean(axis=1, keepdims=True)
            step = np.einsum("mi,mip->mp", weights, commissures) / size
            other = point + reach * step
            assert np.min(dilation(commissures, contact, other) / nu) > 1.0 - 1e-11


def test_proposition_3_2() -> None:
    """Truth: l = alpha a gives (3.2), C free of alpha; alpha = 2/sqrt(3) gives nu* <= 1.

    Equality only in the equilateral triangle, so a factor a little smaller must fail somewhere.
    """
    commissures = random_triangles(12000, 11)
    equilateral = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    commissures[0] = equilateral
    assert len(commissures) > 10000
    a = sides(commissures)
    rows = quasi_optimal_lengths(a)
    assert rows == pytest.approx(2.0 * a / np.sqrt(3.0), rel=1e-15)
    contact = np.array([contact_lengths(row) for row in rows])
    point, nu, side = triple_contact_points(commissures, contact)
    assert np.all(side == -1)
    assert nu.max() == pytest.approx(1.0, abs=1e-12)
    assert nu[0] == pytest.approx(1.0, rel=1e-14)
    other, other_nu, _ = triple_contact_points(commissures, 3.7 * contact)
    assert np.abs(other - point).max() < 1e-11
    assert other_nu * 3.7 == pytest.approx(nu, rel=1e-12)


def test_remark_3_1() -> None:
    """Truth: equal c and no obtuse angle: the circumcentre; obtuse: the middle of the long side."""
    commissures = random_triangles(4000, 13)
    point, nu, side = triple_contact_points(commissures, np.full((len(commissures), 3), 2.5))
    a = sides(commissures)
    longest = np.argmax(a, axis=1)
    square = np.sort(a**2, axis=1)
    obtuse = square[:, 2] > square[:, 0] + square[:, 1]
    assert np.array_equal(side >= 0, obtuse)
    assert np.array_equal(side[obtuse], longest[obtuse])
    for i in np.flatnonzero(~obtuse)[:300]:
        plane = CommissurePlane(commissures[i])
        assert point[i] == pytest.approx(plane.origin, abs=1e-9)
        assert nu[i] == pytest.approx(plane.circumradius / 2.5, rel=1e-10)


def test_right_angle_is_the_border_of_the_cases() -> None:
    """Truth: with equal c and a right angle both cases give the middle of the hypotenuse."""
    for nudge in (-1e-9, 0.0, 1e-9):
        corner = np.array([nudge, 0.0, 0.0])
        found = triple_contact_point([corner, [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]], [1.0, 1.0, 1.0])
        assert found.point == pytest.approx([1.5, 2.0, 0.0], abs=1e-8)
        assert found.nu_star == pytest.approx(2.5, rel=1e-8)


@pytest.mark.parametrize("order", [(1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1)])
def test_renumbering_and_similarity(order: tuple[int, int, int]) -> None:
    """Truth: C moves with the triangle, scales with it and does not care about numbering."""
    commissures, contact = random_batch(500, 15)
    point, nu, side = triple_contact_points(commissures, contact)
    turn, _ = np.linalg.qr(np.random.default_rng(16).normal(size=(3, 3)))
    moved = 2.5 * commissures[:, order] @ turn.T + [5.0, -7.0, 100.0]
    other, other_nu, other_side = triple_contact_points(moved, contact[:, order])
    assert np.abs(other - (2.5 * point @ turn.T + [5.0, -7.0, 100.0])).max() < 1e-10
    assert other_nu == pytest.approx(2.5 * nu, rel=1e-11)
    renamed = np.where(other_side >= 0, np.array(order)[other_side], -1)
    assert np.array_equal(renamed, side)


def test_single_point_reports_its_case() -> None:
    """Truth: one large c pushes C on the opposite side; the scalar form says which."""
    triangle = np.array([[0.0, 3.0, 1.0], [-2.0, 0.0, 1.0], [2.0, 0.0, 1.0]])
    edge = triple_contact_point(triangle, [9.0, 1.0, 3.0])
    assert (edge.case, edge.edge_index) == ("edge", 0)
    assert edge.point == pytest.approx([-1.0, 0.0, 1.0], abs=1e-15)
    assert edge.nu_star == pytest.approx(1.0, rel=1e-15)
    interior = triple_contact_point(triangle, [2.0, 2.0, 2.0])
    assert (interior.case, interior.edge_index) == ("interior", None)
    assert interior.point == pytest.approx([0.0, 5.0 / 6.0, 1.0], abs=1e-14)
    with pytest.raises(ValueError, match="positive"):
        triple_contact_point(triangle, [1.0, 0.0, 1.0])
