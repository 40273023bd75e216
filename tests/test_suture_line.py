"""Aortic suture lines against closed forms and the construction of design.md section 1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ellipe

from avneo_fem.errors import SceneError
from avneo_fem.geometry.suture_line import AorticSutureLine
from avneo_fem.scene import SutureLine

WIDTH = 8.0 * np.pi - 0.5  # Experiment 1


def line(kind: str, **changes: float) -> AorticSutureLine:
    """A line of the given type on the paper's root, starting at 0.3 rad."""
    width = changes.pop("width", WIDTH)
    return AorticSutureLine(12.0, 0.3, width, SutureLine(type=kind, **changes))


@settings(deadline=None)
@given(width=st.floats(1.0, 60.0), depth=st.floats(1.0, 30.0), height=st.floats(0.5, 10.0))
def test_type_a_length(width: float, depth: float, height: float) -> None:
    """Truth: l_a = 2 H_c + half the circumference of the ellipse (complete elliptic integral)."""
    asl = line("A", width=width, belly_depth=depth, commissure_height=height)
    major, minor = max(width / 2.0, depth), min(width / 2.0, depth)
    exact = 2.0 * height + 2.0 * major * ellipe(1.0 - (minor / major) ** 2)
    assert asl.length == pytest.approx(exact, rel=1e-13)
    assert asl.breaks == pytest.approx([0.0, height, exact - height, exact], rel=1e-13)
    bottom = asl.unfolded.point([asl.length / 2.0])[0]
    assert bottom == pytest.approx([0.0, -height - depth], abs=1e-10)


@pytest.mark.parametrize(
    ("skew", "theta", "meets_top"),
    [(0.8, 135.0, True), (0.95, 175.0, True), (0.6, 110.0, False), (0.8, 120.0, False)],
)
def test_type_b_construction(skew: float, theta: float, meets_top: bool) -> None:
    """Truth: quartic through the control points of design.md, by de Casteljau, and its length.

    T is found as the meeting point of two lines, in both of its cases: the tangent at D meets
    z = -H_c (as with the paper's values) or s = w/2 first.
    """
    asl = line("B", skew=skew, ellipse_end_degrees=theta)
    half, top, depth, angle = WIDTH / 2.0, -2.5, 10.0, np.radians(theta)
    centre, axis = -(1.0 - skew) * half, skew * half
    d = np.array([centre - axis * np.cos(angle), top - depth * np.sin(angle)])
    slope = np.array([axis * np.sin(angle), -depth * np.cos(angle)])
    at_side = d + slope * (half - d[0]) / slope[0]
    at_top = d + slope * (top - d[1]) / slope[1]
    t = at_side if at_side[1] < at_top[1] else at_top
    assert (t is at_top) == meets_top
    control = np.array(
        [
            d,
            d + (t - d) / 3.0,
            [d[0] + 2.0 * (t[0] - d[0]) / 3.0, top - depth],
            [half, d[1] + 2.0 * (t[1] - d[1]) / 3.0],
            [half, top],
        ]
    )

    def casteljau(rows: np.ndarray, u: float) -> np.ndarray:
        while len(rows) > 1:
            rows = (1.0 - u) * rows[:-1] + u * rows[1:]
        return rows[0]

    def speed(u: float) -> float:
        return float(np.hypot(*casteljau(4.0 * np.diff(control, axis=0), u)))

    def ellipse_speed(u: float) -> float:
        return float(np.hypot(axis * np.sin(u), depth * np.cos(u)))

    arc = quad(ellipse_speed, 0.0, angle, epsabs=1e-13, epsrel=1e-13)[0]
    bezier = quad(speed, 0.0, 1.0, epsabs=1e-13, epsrel=1e-13)[0]
    assert asl.breaks == pytest.approx(np.cumsum([0.0, 2.5, arc, bezier, 2.5]), rel=1e-12)
    for u in (0.0, 0.2, 0.5, 0.9):
        s = 2.5 + arc + quad(speed, 0.0, u, epsabs=1e-13, epsrel=1e-13)[0]
        assert asl.unfolded.point([s])[0] == pytest.approx(casteljau(control, u), abs=1e-10)
    s = 2.5 + quad(ellipse_speed, 0.0, np.pi / 2.0, epsabs=1e-13, epsrel=1e-13)[0]
    assert asl.unfolded.point([s])[0] == pytest.approx([centre, top - depth], abs=1e-10)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_continuous_tangent_at_every_joint(kind: str) -> None:
    """Truth: both types are continuous with continuous tangent, at D and M of type B as well."""
    asl = line(kind)
    assert len(asl.breaks) == (4 if kind == "A" else 5)
    for s in asl.breaks[1:-1]:
        before, after = s - 1e-7, s + 1e-7
        step = np.diff(asl.point([before, after]), axis=0)
        assert np.linalg.norm(step) == pytest.approx(2e-7, rel=1e-5)
        assert np.linalg.norm(np.diff(asl.tangent([before, after]), axis=0)) < 1e-6


@pytest.mark.parametrize("kind", ["A", "B"])
def test_wrap_is_isometric_and_on_the_wall(kind: str) -> None:
    """Truth: x^2 + y^2 = R^2; an inscribed space polygon is shorter than l_a by a hair."""
    asl = line(kind)
    points = asl.point(np.linspace(0.0, asl.length, 20001))
    assert np.abs(np.hypot(points[:, 0], points[:, 1]) - 12.0).max() < 1e-13
    polygon = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert 0.0 < asl.length - polygon < 1e-6


@pytest.mark.parametrize("kind", ["A", "B"])
def test_ends_and_sense(kind: str) -> None:
    """Truth: P_0 and P_1 at the given angles in z = 0; below it between; never clockwise."""
    asl = line(kind)
    for end, angle in zip(asl.ends, (0.3, 0.3 + WIDTH / 12.0), strict=True):
        expected = [12.0 * np.cos(angle), 12.0 * np.sin(angle), 0.0]
        assert end == pytest.approx(expected, abs=1e-12)
    points = asl.point(np.linspace(0.0, asl.length, 2001))
    assert np.all(points[1:-1, 2] < 0.0)
    assert points[:, 2].min() >= -12.5 - 1e-12
    angles = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert np.all(np.diff(angles) > -1e-12)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_frame(kind: str) -> None:
    """Truth: tau by differences; n towards the axis; (tau, n, b) right-handed and orthonormal."""
    asl, h = line(kind), 1e-5
    s = np.linspace(0.0, asl.length, 301)[1:-1]
    s = s[np.abs(s[:, None] - asl.breaks).min(axis=1) > 2.0 * h]
    slope = (asl.point(s + h) - asl.point(s - h)) / (2.0 * h)
    assert np.abs(slope - asl.tangent(s)).max() < 1e-8
    radial = asl.point(s) * [1.0, 1.0, 0.0]
    assert np.abs(asl.inward_normal(s) + radial / 12.0).max() < 1e-13
    frame = np.stack([asl.tangent(s), asl.inward_normal(s), asl.conormal(s)], axis=1)
    assert np.abs(frame @ frame.transpose(0, 2, 1) - np.eye(3)).max() < 1e-13
    assert np.abs(np.linalg.det(frame) - 1.0).max() < 1e-13


@pytest.mark.parametrize("kind", ["A", "B"])
def test_conormal_at_bottom_and_commissures(kind: str) -> None:
    """Truth: b = +e_z at the lowest point, along the wall into the cusp's arc at both ends."""
    asl = line(kind)
    s = np.linspace(0.0, asl.length, 4001)
    lowest = s[np.argmin(asl.point(s)[:, 2])]
    assert asl.conormal([lowest])[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-2)
    start, end = asl.conormal([0.0, asl.length])
    first, last = 0.3, 0.3 + WIDTH / 12.0
    assert start == pytest.approx([-np.sin(first), np.cos(first), 0.0], abs=1e-12)
    assert end == pytest.approx([np.sin(last), -np.cos(last), 0.0], abs=1e-12)


@pytest.mark.parametrize("width", [0.0, -0.7, 24.0 * np.pi, np.nan])
def test_impossible_width(width: float) -> None:
    """Truth: a line needs a width in (0, 2 pi R); where it is not positive the gap is blamed."""
    with pytest.raises(SceneError) as caught:
        AorticSutureLine(12.0, 0.0, width, SutureLine(), key="cusp.2.suture_line")
    assert caught.value.key == "cusp.2.suture_line.width"
    assert ("commissures.gap" in caught.value.valid) == (width <= 0.0)
