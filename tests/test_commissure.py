"""Commissures, contact lengths and Propositions 3.1 and 3.2 against geometry and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import (
    CommissurePlane,
    commissure_angles,
    commissure_directions,
    contact_lengths,
    quasi_optimal_lengths,
    triple_contact_point,
    triple_contact_points,
)

Batch = tuple[np.ndarray, np.ndarray]


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


def random_batch(count: int, seed: int) -> Batch:
    """Random triangles with random contact lengths, ratio up to 20."""
    commissures = random_triangles(count, seed)
    return commissures, np.random.default_rng(seed + 1).uniform(1.0, 20.0, (len(commissures), 3))


def dilation(commissures: np.ndarray, contact: np.ndarray, points: np.ndarray) -> np.ndarray:
    """max_i |A_i P| / c_i (m,), the function that C minimises."""
    return np.max(np.linalg.norm(commissures - points[:, None], axis=2) / contact, axis=1)


@settings(deadline=None)
@given(st.floats(1.0, 10.0), st.floats(1.0, 10.0), st.floats(0.01, 0.99))
def test_angles_follow_the_law_of_cosines(a: float, b: float, share: float) -> None:
    """Truth: c^2 = a^2 + b^2 - 2 a b cos(gamma) for each angle; the angles add up to pi."""
    ratio = np.array([a, b, abs(a - b) + share * (a + b - abs(a - b))])
    alpha = commissure_angles(ratio)
    assert alpha.sum() == pytest.approx(np.pi, rel=1e-14)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        square = ratio[j] ** 2 + ratio[k] ** 2 - 2.0 * ratio[j] * ratio[k] * np.cos(alpha[i])
        assert square == pytest.approx(ratio[i] ** 2, abs=1e-11 * ratio.max() ** 2)


@pytest.mark.parametrize("ratio", [(1.0, 1.0, 1.0), (8.0, 9.0, 6.0), (6.0, 4.0, 5.0), (2, 2, 3.9)])
def test_directions_give_the_chords(ratio: tuple[float, float, float]) -> None:
    """Truth: points on the circle at these angles have chords in the ratio, counter-clockwise."""
    alpha = commissure_angles(ratio)
    angle = commissure_directions(alpha)
    points = 12.0 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(3)])
    plane = CommissurePlane(points)
    assert plane.chord_lengths / plane.chord_lengths[0] == pytest.approx(
        np.array(ratio) / ratio[0], rel=1e-13
    )
    assert points[0].tolist() == [12.0, 0.0, 0.0]
    assert plane.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    arcs = np.mod(np.roll(angle, -2) - np.roll(angle, -1), 2.0 * np.pi)
    assert arcs == pytest.approx(2.0 * alpha, rel=1e-13)


@pytest.mark.parametrize("ratio", [(1.0, 2.0, 3.0), (5.0, 1.0, 1.0), (1.0, 0.0, 1.0)])
def test_chords_that_form_no_triangle(ratio: tuple[float, float, float]) -> None:
    """Truth: the triangle inequality, strictly."""
    with pytest.raises(SceneError, match="form a triangle") as caught:
        commissure_angles(ratio)
    assert caught.value.key == "commissures.chord_ratio"


def test_plane_coordinates() -> None:
    """Truth: equidistant centre, orthonormal right-handed basis, round trip, extended sine rule."""
    for points in random_triangles(50, 3):
        plane = CommissurePlane(points)
        to_centre = np.linalg.norm(points - plane.centre, axis=1)
        assert to_centre == pytest.approx([plane.circumradius] * 3, rel=1e-9)
        frame = np.vstack([plane.basis, plane.normal])
        assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-13
        assert np.linalg.det(frame) == pytest.approx(1.0, rel=1e-13)
        flat = plane.to_plane(points)
        assert flat[0].tolist() == [0.0, 0.0]
        assert flat[2, 1] > 0.0
        assert np.abs(plane.from_plane(flat) - points).max() < 1e-12
        lifted = plane.to_plane(points + 3.0 * plane.normal)
        assert np.abs(lifted - flat).max() < 1e-12
        ratio = plane.chord_lengths / np.sin(commissure_angles(plane.chord_lengths))
        assert ratio == pytest.approx([2.0 * plane.circumradius] * 3, rel=1e-9)


def test_plane_needs_a_triangle() -> None:
    """Truth: three points on a line span no plane."""
    with pytest.raises(SceneError, match="not on a line"):
        CommissurePlane(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [3.0, 3.0, 0.0]]))


@settings(deadline=None)
@given(*[st.floats(0.1, 50.0)] * 3)
def test_contact_lengths_solve_their_system(c_0: float, c_1: float, c_2: float) -> None:
    """Truth: l_0 = c_1 + c_2, l_1 = c_2 + c_0, l_2 = c_0 + c_1 (paper section 3.3)."""
    found = contact_lengths([c_1 + c_2, c_2 + c_0, c_0 + c_1])
    assert found == pytest.approx([c_0, c_1, c_2], abs=1e-13 * (c_0 + c_1 + c_2))


@pytest.mark.parametrize(("cusp", "length"), [(0, 50.0), (1, 60.0), (2, 50.0)])
def test_inconsistent_lengths(cusp: int, length: float) -> None:
    """Truth: l_k >= l_i + l_j leaves no c_k; the error names the cusp and the open interval."""
    lengths = [20.0, 20.0, 20.0]
    lengths[(cusp + 1) % 3] = 30.0
    lengths[cusp] = length
    with pytest.raises(SceneError, match="between 10 and 50 mm") as caught:
        contact_lengths(lengths)
    assert caught.value.key == f"cusp.{cusp}.template.free_edge_length"
    assert caught.value.value == length
    for valid in (10.001, 49.999):
        lengths[cusp] = valid
        assert contact_lengths(lengths).min() > 0.0


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
        assert point[i] == pytest.approx(plane.centre, abs=1e-9)
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
