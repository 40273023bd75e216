"""Contact curves: control polygon, length, sigma*."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from avneo_fem.errors import SceneError
from avneo_fem.geometry.contact_curve import (
    control_points,
    curve_length,
    deflection_point,
    match_length,
    rotated,
)

CENTRE, END = np.array([1.0, 2.0]), np.array([5.0, 5.0])


def _at_angle(degrees, distance):
    a = np.deg2rad(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    return CENTRE + distance * turn @ ((END - CENTRE) / 5.0)


def test_lengths_in_closed_form():
    """Truth: segment, parabola y = x² on [0, 1], and the cusp (t², t³) on [0, 1]."""
    segment = CENTRE + np.array([0.0, 0.0, 0.0, 1.0])[:, None] * (END - CENTRE)
    assert curve_length(segment) == pytest.approx(5.0, abs=1e-14)
    parabola = np.array([[0, 0], [1 / 3, 0], [2 / 3, 1 / 3], [1, 1]])
    exact = np.sqrt(5.0) / 2.0 + np.arcsinh(2.0) / 4.0
    assert curve_length(parabola) == pytest.approx(exact, abs=1e-14)
    cusp = np.array([[0, 0], [0, 0], [1 / 3, 0], [1, 1]])
    assert curve_length(cusp) == pytest.approx((13**1.5 - 8.0) / 27.0, abs=1e-14)


@pytest.mark.parametrize("sigma", [1e-9, 1e-6, 1e-3, 0.03, 0.5, 3.0, 50.0])
def test_length_against_adaptive_quadrature(sigma):
    """Truth: QUADPACK on pieces graded to t = 0, where small sigma all but stops the curve."""
    polygon = control_points(CENTRE, END, _at_angle(90, 4.0), sigma, 0.5)
    a = np.diff(polygon, axis=0)

    def speed(t):
        return 3 * np.hypot(*(a[0] * (1 - t) ** 2 + 2 * t * (1 - t) * a[1] + t * t * a[2]))

    knots = np.r_[0.0, np.geomspace(1e-10, 1, 31)]
    exact = sum(quad(speed, p, q, epsabs=0, epsrel=1e-13)[0] for p, q in pairwise(knots))
    assert curve_length(polygon) == pytest.approx(exact, rel=1e-13)


def test_deflection_point_rule():
    """Truth: design.md §1: on the ray C A_j up to 90 degrees, then C A_i turned by 90 degrees."""
    for angle, direction in ((30, 30), (89.9, 89.9), (120, 90), (180, 90)):
        for distance, expected in ((4.0, 4.0), (9.0, 6.0)):  # min(R, |CA_j|), R = 6
            found = deflection_point(CENTRE, END, _at_angle(angle, distance), 6.0)
            np.testing.assert_allclose(found, _at_angle(direction, expected), atol=1e-13)


def test_control_polygon_of_3_3a():
    """Truth: (3.3a) written out for sigma = omega, where Y^2 is the midpoint."""
    y = control_points(CENTRE, END, np.array([0.0, 6.0]), 0.5, 0.5)
    np.testing.assert_allclose(y, [CENTRE, [0.5, 4.0], [3.0, 3.5], END])
    np.testing.assert_allclose(rotated(np.array([3.0, 4.0])), [-4.0, 3.0])


@pytest.mark.parametrize("angle", [5.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("ratio", [1.0 + 1e-9, 1.0 + 1e-4, 1.02, 1.6, 4.0])
def test_match_length(angle, ratio):
    """Truth: the matched curve has the length, and every smaller sigma gives a shorter curve."""
    deflection = _at_angle(angle, 4.0)
    sigma = match_length(CENTRE, END, deflection, 5.0 * ratio, 0.5)
    assert sigma > 0.0
    length = curve_length(control_points(CENTRE, END, deflection, sigma, 0.5))
    assert abs(length - 5.0 * ratio) <= 1e-12
    for smaller in sigma * np.linspace(0.0, 0.999, 40):
        shorter = curve_length(control_points(CENTRE, END, deflection, smaller, 0.5))
        assert shorter < 5.0 * ratio


def test_length_grows_with_sigma():
    """Truth (measured, relied on by nobody): L(sigma) rises for all angles, distances, omegas."""
    grid = np.geomspace(1e-3, 100, 15)
    for angle in (2.0, 20.0, 45.0, 70.0, 90.0):
        for distance in (0.3, 5.0, 40.0):
            for omega in (0.1, 0.5, 3.0):
                polygons = [
                    control_points(CENTRE, END, _at_angle(angle, distance), s, omega) for s in grid
                ]
                assert np.diff([curve_length(p) for p in polygons]).min() > -1e-13


def test_straight_when_short_and_error_when_too_long():
    """Truth: design.md §1, sigma = 0 if |A_iC| >= c_i; an unreachable length is an error."""
    deflection = _at_angle(90, 4.0)
    for length in (5.0, 4.9, 0.1):
        assert match_length(CENTRE, END, deflection, length, 0.5) == 0.0
    with pytest.raises(SceneError, match=r"template\.free_edge_length = 1000000\.0: .*span of 5"):
        match_length(CENTRE, END, deflection, 1e6, 0.5)


def test_sigma_does_not_depend_on_the_unit():
    """Truth: sigma is a ratio of lengths: mm and m give the same."""
    deflection = _at_angle(75, 4.0)
    sigma = match_length(CENTRE, END, deflection, 7.0, 0.5)
    in_metres = match_length(CENTRE / 1e3, END / 1e3, deflection / 1e3, 7e-3, 0.5)
    assert in_metres == pytest.approx(sigma, rel=1e-12)
