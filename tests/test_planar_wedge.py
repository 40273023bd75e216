"""Signed distance to the section of a contact wedge."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.bezier_arcs import CUTS
from avneo_fem.geometry.planar_wedge import PlanarWedge
from contact_wedge_cases import bezier, brute_distance, inside

THIRDS = np.arange(4.0)[:, None] / 3.0


def _straight(apex, first, second):
    apex = np.asarray(apex, dtype=float)
    return np.stack([apex + THIRDS * (np.asarray(e) - apex) for e in (first, second)])


def _arms(opening, length=5.0):
    """Straight arms from the apex, the wedge of ``opening`` degrees around the -x axis."""
    half = np.deg2rad(180.0 - opening / 2.0)
    return _straight(
        [1.0, 2.0],
        np.array([1.0, 2.0]) + length * np.array([np.cos(half), np.sin(half)]),
        np.array([1.0, 2.0]) + length * np.array([np.cos(half), -np.sin(half)]),
    )


def _wedge_distance(points, opening):
    """Closed form: wedge of an opening around -x; outside is the wedge of the rest around +x."""
    x, y = (points - [1.0, 2.0]).T
    r, angle = np.hypot(x, y), np.abs(np.arctan2(y, -x))  # from the wedge's axis
    off = angle - np.deg2rad(opening) / 2.0  # > 0 outside
    return -np.sign(off) * np.where(np.abs(off) < np.pi / 2, r * np.abs(np.sin(off)), r)


CURVED = {
    # a reflex and a convex apex, strong curvature, a cusp-like start, an inflection
    "convex": [[[0, 0], [1, 4], [-2, 5], [-6, 8]], [[0, 0], [-2, -1], [-3, -6], [-8, -7]]],
    "reflex": [[[0, 0], [6, 1], [5, 6], [3, 9]], [[0, 0], [5, -1], [4, -7], [2, -9]]],
    "spiral": [[[0, 0], [-9, 0], [2, 1.5], [3, 9]], [[0, 0], [0, -6], [-1, -3], [-1, -12]]],
    "slow": [[[0, 0], [0, 0], [-2, 5], [-6, 8]], [[0, 0], [-1e-7, -1e-7], [-3, -6], [-8, -7]]],
}


@pytest.mark.parametrize("opening", [30.0, 90.0, 120.0, 170.0, 180.0, 200.0, 300.0])
def test_straight_arms_in_closed_form(opening):
    """Truth: distance, gradient and Hessian of a wedge between two half-lines."""
    rng = np.random.default_rng(int(opening))
    points = np.array([1.0, 2.0]) + rng.normal(size=(4000, 2)) * rng.choice([1e-6, 1, 9], (4000, 1))
    wedge = PlanarWedge(_arms(opening))
    distance, gradient, bending = wedge.signed_distance(points)
    np.testing.assert_allclose(distance, _wedge_distance(points, opening), atol=5e-15)
    np.testing.assert_allclose(np.hypot(*gradient.T), 1.0, atol=1e-15)
    radius = np.hypot(*(points - [1.0, 2.0]).T)
    at_apex = np.abs(np.abs(distance) - radius) < 1e-9 * radius
    np.testing.assert_allclose(bending[~at_apex], 0.0, atol=1e-13)
    strictly = np.abs(np.abs(distance) - radius) < 1e-15 * radius
    np.testing.assert_allclose((bending * distance)[strictly & (bending != 0)], 1.0, atol=1e-12)


def test_on_the_curve_and_at_the_apex():
    """Truth: distance 0, the normal on an arm, the bisector at the apex, no Hessian there."""
    wedge = PlanarWedge(_arms(120.0))
    apex = np.array([1.0, 2.0])
    arm = np.array([-0.5, np.sqrt(3) / 2])
    points = np.stack([apex, apex + 2 * arm, apex + 50 * arm])
    distance, gradient, bending = wedge.signed_distance(points)
    np.testing.assert_allclose(distance, 0.0, atol=1e-14)
    np.testing.assert_allclose(gradient[0], [-1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(gradient[1:], [[-np.sqrt(3) / 2, -0.5]] * 2, atol=1e-14)
    np.testing.assert_allclose(bending, 0.0, atol=1e-14)


@pytest.mark.parametrize("name", CURVED)
def test_closest_point_and_sign_by_brute_force(name):
    """Truth: refined dense samples; the even-odd rule on a closed polygon."""
    polygons = np.array(CURVED[name], dtype=float)
    rng = np.random.default_rng(3)
    points = rng.uniform(-14, 14, (3000, 2))
    distance, gradient, _ = PlanarWedge(polygons).signed_distance(points)
    brute = brute_distance(polygons, points, 2000, 2)
    assert np.all(np.abs(distance) <= brute + 1e-11)
    foot = points - distance[:, None] * gradient
    assert brute_distance(polygons, foot, 2000, 2).max() < 1e-8
    clear = brute > 1e-3
    assert np.array_equal(distance[clear] > 0, inside(polygons, points)[clear])


@pytest.mark.parametrize("name", CURVED)
@pytest.mark.parametrize("radius", [1e-3, 1e-5, 1e-7, 1e-9])
def test_sign_near_and_behind_the_apex(name, radius):
    """Truth: the even-odd rule on a polygon graded towards the apex."""
    polygons = np.array(CURVED[name], dtype=float)
    angle = np.linspace(-np.pi, np.pi, 720)
    points = polygons[0, 0] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    distance, _, _ = PlanarWedge(polygons).signed_distance(points)
    clear = np.abs(distance) > 2e-3 * radius  # of the polygon's own error
    assert clear.mean() > 0.9
    assert np.array_equal(distance[clear] > 0, inside(polygons, points)[clear])


def test_constructed_points_have_known_value_gradient_and_hessian():
    """Truth: y(t) + r n has d = r, g = n, h = -kappa / (1 - kappa r), for r below the reach."""
    polygons = np.array(CURVED["convex"], dtype=float)
    for side, polygon in zip((1.0, -1.0), polygons, strict=True):
        t = np.linspace(0.2, 0.98, 100)[:, None]
        a = np.diff(polygon, axis=0)
        first = 3 * (a[0] * (1 - t) ** 2 + 2 * t * (1 - t) * a[1] + t * t * a[2])
        second = 6 * ((a[1] - a[0]) * (1 - t) + t * (a[2] - a[1]))
        speed = np.hypot(*first.T)[:, None]
        normal = side * np.stack([-first[:, 1], first[:, 0]], axis=1) / speed
        kappa = (second * normal).sum(axis=1) / speed[:, 0] ** 2
        assert np.abs(kappa).max() < 2.0
        for r in (-0.3, -1e-9, 0.0, 1e-4, 0.3):
            points = bezier(polygon, t[:, 0]) + r * normal
            distance, gradient, bending = PlanarWedge(polygons).signed_distance(points)
            np.testing.assert_allclose(distance, r, atol=1e-14)
            np.testing.assert_allclose(gradient, normal, atol=1e-12)
            np.testing.assert_allclose(bending, -kappa / (1 - kappa * r), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("name", CURVED)
def test_derivatives_by_finite_differences(name):
    """Truth: central differences, where the closest piece is the same at all four offsets."""
    polygons = np.array(CURVED[name], dtype=float)
    wedge = PlanarWedge(polygons)
    points = np.random.default_rng(8).uniform(-12, 12, (4000, 2))
    distance, gradient, bending = wedge.signed_distance(points)
    step = 1e-5
    offsets = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    value = np.stack([wedge.signed_distance(points + o)[:2][0] for o in offsets])
    slope = np.stack([wedge.signed_distance(points + o)[1] for o in offsets])
    # the same curve at all offsets, and a foot that moves little: not across the medial axis
    foot = np.stack([points + o for o in offsets]) - value[..., None] * slope
    label = np.stack([wedge.nearest(points + o)[0] for o in offsets])
    label = np.where(label < 2 * CUTS, label // CUTS, label)
    label[np.hypot(*(foot - polygons[0, 0]).transpose(2, 0, 1)) < 1e-12] = -1  # the apex
    same = np.all(label == label[0], axis=0) & (np.abs(distance) > 1e-3)
    same &= np.ptp(foot, axis=0).max(axis=1) < 100 * step
    assert same.mean() > 0.98
    difference = np.stack([value[0] - value[1], value[2] - value[3]], axis=1) / (2 * step)
    np.testing.assert_allclose(difference[same], gradient[same], atol=1e-6)
    across = np.stack([-gradient[:, 1], gradient[:, 0]], axis=1)
    hessian = bending[:, None, None] * across[:, :, None] * across[:, None, :]
    difference = np.stack([slope[0] - slope[1], slope[2] - slope[3]], axis=2) / (2 * step)
    scale = 1.0 + np.abs(bending[same]) ** 3
    error = np.abs(difference - hessian)[same].max(axis=(1, 2))
    assert (error / scale).max() < 1e-5


def test_zero_opening_is_outside_behind_the_apex():
    """Truth: two curves that touch at the apex enclose nothing behind it."""
    polygons = np.array([[[0, 0], [-4, 0], [-6, 3], [-9, 9]], [[0, 0], [-2, 0], [-5, 0], [-9, 0]]])
    points = np.array([[1e-9, 0.0], [1.0, 3.0], [2.0, -3.0], [-8.0, 4.0], [-8.0, -1.0]])
    distance, gradient, _ = PlanarWedge(polygons.astype(float)).signed_distance(points)
    assert (distance > 0).tolist() == [False, False, False, True, False]
    np.testing.assert_allclose(distance[:3], -np.hypot(*points[:3].T))
    np.testing.assert_allclose(gradient[0], [-1.0, 0.0], atol=1e-12)


def test_continuous_across_the_joint_of_curve_and_extension():
    """Truth: the extension (3.5b) is tangent, so value and gradient do not jump there."""
    polygons = np.array(CURVED["convex"], dtype=float)
    end, direction = polygons[0, 3], polygons[0, 3] - polygons[0, 2]
    direction /= np.hypot(*direction)
    normal = np.array([-direction[1], direction[0]])
    for r in (-0.5, 0.0, 0.5):
        points = end + r * normal + np.array([[-1e-9], [1e-9]]) * direction
        distance, gradient, _ = PlanarWedge(polygons).signed_distance(points)
        np.testing.assert_allclose(distance, r, atol=1e-12)
        np.testing.assert_allclose(gradient, [normal, normal], atol=1e-8)


def test_crossing_is_noticed():
    """Truth: by construction the second set crosses: apart from the apex, and in one curve."""
    for name in CURVED:
        assert not PlanarWedge(np.array(CURVED[name], dtype=float)).crosses_itself()
    assert not PlanarWedge(_arms(60.0)).crosses_itself()
    crossing = [[[0, 0], [3, 0], [3, 3], [0, 6]], [[0, 0], [0, 4], [4, 2], [6, 1]]]
    assert PlanarWedge(np.array(crossing, dtype=float)).crosses_itself()
    loop = [[[0, 0], [9, 6], [-9, 6], [0, 1]], [[0, 0], [0, -1], [0, -2], [-1, -9]]]
    assert PlanarWedge(np.array(loop, dtype=float)).crosses_itself()
    rays = [[[0, 0], [-1, 1], [-2, 2], [-2, 1]], [[0, 0], [-1, -1], [-2, -2], [-2, -1]]]
    assert PlanarWedge(np.array(rays, dtype=float)).crosses_itself()


def test_no_points_and_nan():
    """Truth: no points give no values; NaN gives NaN, never a number."""
    wedge = PlanarWedge(np.array(CURVED["convex"], dtype=float))
    assert [a.shape for a in wedge.signed_distance(np.zeros((0, 2)))] == [(0,), (0, 2), (0,)]
    distance, _, _ = wedge.signed_distance(np.array([[np.nan, 0.0], [1.0, 1.0]]))
    assert np.isnan(distance).tolist() == [True, False]
