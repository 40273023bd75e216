"""Contact wedge family of a valve: sigma*, (3.5), signed distance in space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.contact_curve import curve_length
from avneo_fem.geometry.contact_wedge import ContactWedge, ContactWedgeFamily
from contact_wedge_cases import (
    EXPERIMENTS,
    brute_distance,
    commissures,
    inputs,
    inside,
    triple_point,
)


def _family(points, centre, lengths):
    return ContactWedgeFamily(CommissurePlane(points), centre, lengths)


FAMILIES = {number: _family(*inputs(number)) for number in EXPERIMENTS}
LAMBDAS = np.linspace(0.0, 1.0, 11)


def _polygons(number, cusp, lam):
    """Control points (2, 4, 2) of (3.5a), written out from the Y_i."""
    ends = inputs(number)[0][:, :2]
    result = []
    for i in ((cusp + 1) % 3, (cusp + 2) % 3):
        straight = [ends[cusp] + k / 3 * (ends[i] - ends[cusp]) for k in range(4)]
        y = FAMILIES[number].control_points(i)
        result.append(lam * y + (1 - lam) * np.array(straight))
    return np.array(result)


def _points(rng, count, radius=14.0):
    angle, r = rng.uniform(0, 2 * np.pi, count), radius * np.sqrt(rng.random(count))
    return np.stack([r * np.cos(angle), r * np.sin(angle), rng.uniform(-15, 5, count)], axis=1)


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_sigma_of_the_experiments(number):
    """Truth: the table of design.md §1, and curves of length c_i to 1e-12."""
    family = FAMILIES[number]
    np.testing.assert_allclose(family.sigma, EXPERIMENTS[number][2], atol=5.001e-5)
    for i, c in enumerate(EXPERIMENTS[number][1]):
        assert abs(curve_length(family.control_points(i)) - c) <= 1e-12


def _check_brute_force(number, cusp, lam, count, seed):
    polygons = _polygons(number, cusp, lam)
    wedge = FAMILIES[number].wedge(cusp, lam)
    points = _points(np.random.default_rng(seed), count)
    distance, gradient, _ = wedge.evaluate(points)
    flat = points[:, :2]
    brute = brute_distance(polygons, flat, 2000, 2)
    assert np.all(np.abs(distance) <= brute + 1e-11)  # no closer point was missed,
    foot = flat - distance[:, None] * gradient[:, :2]
    assert brute_distance(polygons, foot, 2000, 1).max() < 1e-9  # and the foot is on the curve
    clear = brute > 1e-4
    assert np.array_equal(distance[clear] > 0, inside(polygons, flat)[clear])
    np.testing.assert_array_equal(distance, wedge.signed_distance(points))
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-14)
    assert np.array_equal(gradient[:, 2], np.zeros(count))


@pytest.mark.parametrize("number", EXPERIMENTS)
@pytest.mark.parametrize(("cusp", "lam"), [(0, 0.5), (1, 1.0), (2, 0.8)])
def test_distance_and_sign_by_brute_force(number, cusp, lam):
    """Truth: refined dense samples of (3.5); the even-odd rule."""
    _check_brute_force(number, cusp, lam, 2000, cusp)


@pytest.mark.slow
@pytest.mark.parametrize("number", EXPERIMENTS)
@pytest.mark.parametrize("cusp", [0, 1, 2])
@pytest.mark.parametrize("lam", LAMBDAS)
def test_distance_and_sign_by_brute_force_everywhere(number, cusp, lam):
    """Truth: as above; 99 wedges with 10^4 points each."""
    _check_brute_force(number, cusp, lam, 10_000, 77)


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_sign_near_and_behind_the_apex(number):
    """Truth: the even-odd rule on a polygon graded to the apex, 1e-3 ... 1e-9 mm from it."""
    angle = np.linspace(0.0, 2 * np.pi, 180)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    for lam in (0.0, 1e-6, 0.3, 0.6, 1 - 1e-6, 1.0):
        for cusp in range(3):
            polygons = _polygons(number, cusp, lam)
            apex = np.append(polygons[0, 0], 0.0)
            points = np.vstack([apex + r * circle for r in (1e-3, 1e-5, 1e-7, 1e-9)])
            radius = np.repeat([1e-3, 1e-5, 1e-7, 1e-9], 180)
            distance = FAMILIES[number].wedge(cusp, lam).signed_distance(points)
            clear = np.abs(distance) > 1e-3 * radius
            assert clear.mean() > 0.95
            assert np.array_equal(distance[clear] > 0, inside(polygons, points[:, :2])[clear])


def _straight_wedge(points, apex, first, second):
    """Closed form for two half-lines from ``apex``, the wedge from first to second."""
    angle = [np.arctan2(*(e - apex)[1::-1]) for e in (first, second)]
    opening = (angle[1] - angle[0]) % (2 * np.pi)
    x, y = (points - apex).T
    turn = (np.arctan2(y, x) - angle[0] - opening / 2 + np.pi) % (2 * np.pi) - np.pi
    off = np.abs(turn) - opening / 2
    r = np.hypot(x, y)
    return -np.sign(off) * np.where(np.abs(off) < np.pi / 2, r * np.abs(np.sin(off)), r)


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_lambda_zero_is_the_straight_wedge(number):
    """Truth: closed form with the apex A_i (G^0 is a half-plane, §3.3.2)."""
    ends = inputs(number)[0][:, :2]
    points = _points(np.random.default_rng(0), 3000)
    for i in range(3):
        exact = _straight_wedge(points[:, :2], ends[i], ends[(i + 1) % 3], ends[(i + 2) % 3])
        found = FAMILIES[number].wedge(i, 0.0).signed_distance(points)
        np.testing.assert_allclose(found, exact, atol=1e-13)


def test_short_cusps_give_straight_contact_lines():
    """Truth: c_i <= |A_iC| gives sigma = 0; closed form with the apex C at lambda = 1."""
    flat, centre, lengths = inputs(3)
    family = _family(flat, centre, 0.9 * lengths)
    assert family.sigma.tolist() == [0.0, 0.0, 0.0]
    points = _points(np.random.default_rng(0), 3000)
    ends = flat[:, :2]
    for i in range(3):
        exact = _straight_wedge(points[:, :2], centre[:2], ends[(i + 1) % 3], ends[(i + 2) % 3])
        np.testing.assert_allclose(family.wedge(i, 1.0).signed_distance(points), exact, atol=1e-13)


@pytest.mark.parametrize("share", [1e-3, 1e-7, 1e-11, 1e-15])
def test_nearly_straight_curves(share):
    """Truth: refined samples and the even-odd rule, where the start of the curve all but stops:
    lambda next to 1 with sigma = 0, and tiny sigma at lambda = 1."""
    flat, centre, lengths = inputs(3)
    spans = np.linalg.norm(flat - centre, axis=1)
    points = _points(np.random.default_rng(9), 300)
    points[::2] = centre + points[::2] * 1e-4
    for c, lam in ((0.9 * lengths, 1.0 - share), (spans * (1.0 + share), 1.0)):
        family = _family(flat, centre, c)
        for cusp in range(3):
            wedge = family.wedge(cusp, lam)
            distance, gradient, hessian = wedge.evaluate(points)
            assert np.isfinite(hessian).all()
            polygons = wedge.section.polygons
            brute = brute_distance(polygons, points[:, :2], 500, 2)
            np.testing.assert_allclose(np.abs(distance), brute, atol=1e-10)
            np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-14)
            clear = brute > 1e-7
            assert np.array_equal(distance[clear] > 0, inside(polygons, points[:, :2])[clear])


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_contact_wedges_tile_the_plane(number):
    """Truth: at lambda = 1 neighbouring wedges share their curves: one positive distance, and the
    second largest is its negative."""
    points = _points(np.random.default_rng(1), 5000, 40.0)
    wedges = [FAMILIES[number].wedge(i, 1.0) for i in range(3)]
    distance = np.sort([w.signed_distance(points) for w in wedges], axis=0)
    assert np.array_equal((distance > 0).sum(axis=0), np.ones(5000))
    np.testing.assert_allclose(distance[2], -distance[1], atol=1e-11)


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_the_suture_line_is_on_the_own_side(number):
    """Truth: cusp i spans A_(i+1) to A_(i+2) counter-clockwise; for every lambda its arc is in."""
    ends = inputs(number)[0][:, :2]
    for i in range(3):
        start, end = (np.arctan2(*ends[(i + k) % 3][::-1]) for k in (1, 2))
        angle = start + np.linspace(0.03, 0.97, 50) * ((end - start) % (2 * np.pi))
        arc = 12.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle - 3.0], axis=1)
        for lam in LAMBDAS:
            assert FAMILIES[number].wedge(i, lam).signed_distance(arc).min() > 0.0


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_gradient_and_hessian_by_finite_differences(number):
    """Truth: central differences; points whose foot jumps between the offsets are left out."""
    rng, step = np.random.default_rng(4), 1e-5
    for cusp, lam in ((0, 1.0), (1, 0.6), (2, 0.3)):
        wedge = FAMILIES[number].wedge(cusp, lam)
        points = _points(rng, 2000)
        distance, gradient, hessian = wedge.evaluate(points)
        assert np.array_equal(hessian, hessian.transpose(0, 2, 1))
        side = [[wedge.evaluate(points + s * step * e) for s in (1, -1)] for e in np.eye(3)]
        slope = np.stack([(p[0] - m[0]) / (2 * step) for p, m in side], axis=1)
        bend = np.stack([(p[1] - m[1]) / (2 * step) for p, m in side], axis=1)
        jump = np.stack([np.abs(p[2] - m[2]).max(axis=(1, 2)) for p, m in side]).max(axis=0)
        turn = np.stack([np.linalg.norm(p[1] - m[1], axis=1) for p, m in side]).max(axis=0)
        smooth = (jump < 1e-3) & (turn < 0.1) & (np.abs(distance) > 1e-4)
        assert smooth.mean() > 0.97
        np.testing.assert_allclose(slope[smooth], gradient[smooth], atol=1e-7)
        np.testing.assert_allclose(bend[smooth], hessian[smooth], atol=1e-4)


@settings(max_examples=10, deadline=None)
@given(
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    shift=st.tuples(*[st.floats(-50.0, 50.0)] * 3),
    number=st.sampled_from(sorted(EXPERIMENTS)),
    lam=st.floats(0.0, 1.0),
)
def test_moves_with_the_valve(angles, shift, number, lam):
    """Truth: a rotation and translation of all input moves distance, gradient and Hessian."""
    turn, shift = Rotation.from_euler("xyz", angles).as_matrix(), np.array(shift)
    flat, centre, lengths = inputs(number)
    moved = _family(flat @ turn.T + shift, turn @ centre + shift, lengths)
    np.testing.assert_allclose(moved.sigma, FAMILIES[number].sigma, rtol=1e-10)
    points = _points(np.random.default_rng(6), 200)
    for cusp in range(3):
        d, g, h = FAMILIES[number].wedge(cusp, lam).evaluate(points)
        wedge = moved.wedge(cusp, lam)
        d_moved, g_moved, h_moved = wedge.evaluate(points @ turn.T + shift)
        np.testing.assert_allclose(d_moved, d, atol=1e-11)
        near_axis = np.linalg.norm(h, axis=(1, 2)) > 50.0
        steady = ~near_axis & (np.linalg.norm(g_moved - g @ turn.T, axis=1) < 1.0)
        assert steady.mean() > 0.97
        np.testing.assert_allclose(g_moved[steady], (g @ turn.T)[steady], atol=1e-8)
        expected = (turn @ h @ turn.T)[steady]
        np.testing.assert_allclose(h_moved[steady], expected, atol=1e-5)
        line = wedge.polyline3(20)
        np.testing.assert_allclose(wedge.signed_distance(line), 0.0, atol=1e-10)


def test_labels_are_cyclic():
    """Truth: counting the commissures from another one renumbers the cusps, nothing else."""
    flat, centre, lengths = inputs(2)
    other = _family(np.roll(flat, -1, 0), centre, np.roll(lengths, -1))
    np.testing.assert_allclose(other.sigma, np.roll(FAMILIES[2].sigma, -1), rtol=1e-12)
    points = _points(np.random.default_rng(2), 500)
    for cusp in range(3):
        found = other.wedge((cusp + 2) % 3, 0.7).signed_distance(points)
        expected = FAMILIES[2].wedge(cusp, 0.7).signed_distance(points)
        np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_sigma_and_distance_scale(number):
    """Truth: with metres instead of millimetres sigma is the same and d a thousandth."""
    flat, centre, lengths = inputs(number)
    family = _family(flat / 1e3, centre / 1e3, lengths / 1e3)
    np.testing.assert_allclose(family.sigma, FAMILIES[number].sigma, rtol=1e-11)
    points = _points(np.random.default_rng(2), 500)
    found = family.wedge(0, 0.4).signed_distance(points / 1e3)
    expected = FAMILIES[number].wedge(0, 0.4).signed_distance(points)
    np.testing.assert_allclose(1e3 * found, expected, atol=1e-12)


def test_curve_runs_over_the_apex_between_the_commissures():
    """Truth: order and length of the pieces as documented; plane coordinates are x, y here."""
    flat = inputs(1)[0][:, :2]
    wedge = FAMILIES[1].wedge(0, 1.0)
    assert isinstance(wedge, ContactWedge)
    line = wedge.curve(51, 5.0)
    assert line.shape == (201, 2)
    np.testing.assert_allclose(line[[50, 100, 150]], [flat[1], [0.0, 0.0], flat[2]], atol=1e-13)
    ends = np.hypot(*(line[[0, 200]] - line[[50, 150]]).T)
    np.testing.assert_allclose(ends, 5.0, atol=1e-12)


def _broken(**change):
    flat, centre, lengths = inputs(1)
    values = {
        "commissures": CommissurePlane(flat),
        "triple_contact_point": centre,
        "contact_lengths": lengths,
    }
    return ContactWedgeFamily(**{**values, **change})


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("triple_contact_point", {"triple_contact_point": np.array([20.0, 0, 0])}),
        ("triple_contact_point", {"triple_contact_point": np.array([0.0, 0, 0.1])}),
        ("triple_contact_point", {"triple_contact_point": inputs(1)[0][1]}),
        ("triple_contact_point", {"triple_contact_point": np.array([np.nan, 0, 0])}),
        ("template.free_edge_length", {"contact_lengths": np.array([1.0, -1, 9])}),
        ("template.free_edge_length", {"contact_lengths": np.array([1e6, 19, 19])}),
        ("contact.omega", {"omega": 0.0}),
    ],
)
def test_bad_input_is_named(key, change):
    """Truth: SceneError with the key that is wrong."""
    with pytest.raises(SceneError) as caught:
        _broken(**change)
    assert caught.value.key == key


def test_bad_wedges_are_named():
    """Truth: no such cusp, no such lambda, and curves that cross (found by a search: very
    unequal contact lengths)."""
    for cusp, lam, key in ((3, 0.5, "cusp"), (0, -0.1, "lam"), (0, np.nan, "lam")):
        with pytest.raises(SceneError) as caught:
            FAMILIES[1].wedge(cusp, lam)
        assert caught.value.key == key
    ends, lengths = commissures((4.1, 4.8, 8.4)), np.array([9.8, 19.1, 32.5])
    flat, centre = np.pad(ends, ((0, 0), (0, 1))), np.append(triple_point(ends, lengths), 0.0)
    family = _family(flat, centre, lengths)
    with pytest.raises(SceneError, match=r"cusp 0 cross each other at lambda = 0\.7"):
        family.wedge(0, 0.7)


def test_frozen():
    """Truth: neither attributes nor arrays can be changed."""
    for array in (FAMILIES[1].sigma, FAMILIES[1].commissures.points, FAMILIES[1].control_points(0)):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
