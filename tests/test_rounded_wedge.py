"""Wedges rounded by a disc."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from avneo_fem.geometry.planar_wedge import PlanarWedge
from avneo_fem.geometry.rounded_wedge import RoundedWedge

Floats = NDArray[np.float64]
THIRDS = np.linspace(0.0, 1.0, 4)[:, None]
#: the curves of a wedge that opens by about 100 degrees and bends into itself
BENT = np.array(
    [
        [[0.0, 0.0], [1.5, 0.4], [2.5, 2.5], [6.0, 6.0]],
        [[0.0, 0.0], [-0.6, 2.0], [-3.0, 3.0], [-7.0, 3.5]],
    ]
)


def _arms(opening: float) -> PlanarWedge:
    """Straight wedge about +y with its apex in the origin, opening in degrees."""
    half = np.radians(opening) / 2
    ends = np.array([[np.sin(half), np.cos(half)], [-np.sin(half), np.cos(half)]])
    return PlanarWedge(10.0 * THIRDS * ends[:, None, :])


@pytest.mark.parametrize("opening", [20.0, 60.0, 90.0, 120.0, 170.0])
@pytest.mark.parametrize("radius", [0.05, 0.3, 2.0])
def test_centre_of_a_straight_corner(opening: float, radius: float) -> None:
    """Truth: the disc that touches both arms has its centre on the bisector, at
    radius / sin(opening / 2), and touches at radius / tan(opening / 2) from the apex."""
    half = np.radians(opening) / 2
    ((centre, (first, last)),) = RoundedWedge(_arms(opening), radius).corners
    np.testing.assert_allclose(centre, [0.0, radius / np.sin(half)], atol=1e-6)
    touch = radius / np.tan(half)
    beyond = touch / 10.0 if touch <= 10.0 else 1.0 + touch - 10.0
    np.testing.assert_allclose([-first, last], beyond, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("opening", [180.0, 240.0, 330.0])
def test_no_corner(opening: float) -> None:
    """Truth: where the wedge opens by 180 degrees or more, a disc reaches everything."""
    assert RoundedWedge(_arms(opening), 0.5).corners == []


def test_no_radius() -> None:
    """Truth: radius 0 leaves the wedge as it is."""
    assert RoundedWedge(_arms(60.0), 0.0).corners == []


def test_distance_in_a_straight_corner() -> None:
    """Truth: with opening 90 degrees and radius 1, the point (0, y) below the centre (0, sqrt 2)
    is at 1 - (sqrt 2 - y), also behind the apex; above the centre, and beside the corner, the
    distance is that of the wedge."""
    rounded = RoundedWedge(_arms(90.0), 1.0)
    y = np.array([-2.0, 0.0, 0.3, 1.0, 1.4])
    distance, gradient, bending = rounded.signed_distance(np.c_[0 * y, y])
    to_centre = np.sqrt(2.0) - y
    np.testing.assert_allclose(distance, 1.0 - to_centre, atol=1e-6)
    np.testing.assert_allclose(gradient, np.tile([0.0, 1.0], (5, 1)), atol=1e-4)
    np.testing.assert_allclose(bending, -1.0 / to_centre, rtol=1e-4)
    elsewhere = np.array([[0.0, 1.5], [0.0, 4.0], [3.0, 3.2], [3.0, 2.5], [-2.0, 2.1]])
    for mine, exact in zip(
        rounded.signed_distance(elsewhere),
        _arms(90.0).signed_distance(elsewhere),
        strict=True,
    ):
        np.testing.assert_array_equal(mine, exact)


@pytest.mark.parametrize("radius", [0.2, 0.6])
def test_derivatives(radius: float) -> None:
    """Truth: up to the radius, value and gradient have no jump: differences of the value are the
    gradient everywhere, those of the gradient the Hessian but where a neighbour uses another
    piece."""
    wedge = RoundedWedge(PlanarWedge(BENT), radius)
    assert wedge.corners
    random = np.random.default_rng(1)
    centre = wedge.corners[0][0]
    points = centre + random.uniform(-1.5, 1.5, size=(4000, 2))
    points = points[wedge.signed_distance(points)[0] < 0.99 * radius]
    assert len(points) > 500
    _, gradient, bending = wedge.signed_distance(points)
    step = 1e-6
    slope, second = [], []
    for axis in np.eye(2):
        ahead, behind = (wedge.signed_distance(points + s * step * axis) for s in (1, -1))
        slope.append((ahead[0] - behind[0]) / (2 * step))
        second.append((ahead[1] - behind[1]) / (2 * step))
    np.testing.assert_allclose(np.stack(slope, axis=1), gradient, atol=1e-5)
    across = np.stack([-gradient[:, 1], gradient[:, 0]], axis=1)
    hessian = bending[:, None, None] * across[:, :, None] * across[:, None, :]
    error = np.abs(np.stack(second, axis=2) - hessian).max(axis=(1, 2))
    assert np.quantile(error / (1.0 + np.abs(bending)), 0.99) < 1e-4


@pytest.mark.parametrize("radius", [0.2, 0.6])
def test_never_farther_than_the_wedge(radius: float) -> None:
    """Truth: the rounded wedge lies in the wedge, so its distance is nowhere larger; and inside
    it is smaller by at most what it is at the apex."""
    plain = PlanarWedge(BENT)
    rounded = RoundedWedge(plain, radius)
    points = np.random.default_rng(2).uniform(-6.0, 6.0, size=(20000, 2))
    points[0] = 0.0  # the apex, where they differ most
    exact, mine = plain.signed_distance(points)[0], rounded.signed_distance(points)[0]
    assert np.all(mine <= exact + 1e-9)
    depth = np.linalg.norm(rounded.corners[0][0]) - radius
    inside = exact >= 0.0
    assert np.max((exact - mine)[inside]) <= depth + 1e-6
    np.testing.assert_allclose((exact - mine)[0], depth, atol=1e-6)


def test_a_tight_bend() -> None:
    """Truth: a bend of the boundary into itself that is tighter than the disc is a corner, too;
    for a looser one the disc touches everywhere."""
    # a parabola y = 5 x^2 from the apex at its bottom, radius of curvature 0.1
    arms = np.array(
        [[[0.0, 0.0], [s / 3, 0.0], [2 * s / 3, 5.0 / 3.0], [s, 5.0]] for s in (1.0, -1.0)]
    )
    wedge = PlanarWedge(arms)
    assert RoundedWedge(wedge, 0.09).corners == []
    ((centre, (first, last)),) = RoundedWedge(wedge, 0.3).corners
    # a disc of radius r in y = x^2 / 2 rho touches at height (r^2 - rho^2) / 2 rho, rho = 0.1
    x = np.sqrt(2.0 * 0.1 * (0.3**2 - 0.1**2) / (2 * 0.1))
    np.testing.assert_allclose([-first, last], x, atol=1e-5)
    np.testing.assert_allclose(centre, [0.0, x**2 / 0.2 + 0.1], atol=1e-6)


def test_scaling() -> None:
    """Truth: in another unit of length the wedge is the same."""
    points = np.random.default_rng(3).uniform(-1.0, 1.0, size=(500, 2))
    small = RoundedWedge(PlanarWedge(BENT), 0.4).signed_distance(points)
    large = RoundedWedge(PlanarWedge(1024.0 * BENT), 1024.0 * 0.4).signed_distance(1024.0 * points)
    np.testing.assert_allclose(large[0], 1024.0 * small[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(large[1], small[1], rtol=1e-9, atol=1e-9)
