"""Arc length and tangents of planar paths against closed forms and independent quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ellipe, ellipeinc

from avneo_fem.geometry.curve import PlanarPath
from avneo_fem.geometry.segments import Arc, Bezier, Line

QUARTIC = Bezier(((0.0, 0.0), (1.0, -2.0), (4.0, -3.0), (6.0, 1.0), (5.0, 4.0)))


def mixed_path() -> PlanarPath:
    """Line, elliptic arc, quartic Bezier curve, line; with corners at the joints."""
    arc = Arc((3.0, 0.0), (3.0, 1.0), np.pi, 1.7 * np.pi)
    end = tuple(arc.point(np.ones(1))[0])
    shifted = Bezier(tuple((x + end[0], y + end[1]) for x, y in QUARTIC.control))
    last = (end[0] + 5.0, end[1] + 4.0)
    return PlanarPath([Line((0.0, 2.0), (0.0, 0.0)), arc, shifted, Line(last, (20.0, 9.0))])


def test_line_and_circle_lengths() -> None:
    """Truth: Pythagoras and 2 pi r; points at equal arc length are equally spaced on both."""
    path = PlanarPath([Line((1.0, 2.0), (4.0, 6.0)), Arc((4.0, 0.0), (6.0, 6.0), np.pi / 2, 0.0)])
    assert path.length == pytest.approx(5.0 + 3.0 * np.pi, rel=1e-15)
    assert path.breaks == pytest.approx([0.0, 5.0, 5.0 + 3.0 * np.pi], rel=1e-15)
    assert path.point([2.5])[0] == pytest.approx([2.5, 4.0], abs=1e-14)
    quarter = path.point([5.0 + 1.5 * np.pi])[0]
    assert quarter == pytest.approx([4.0 + 6.0 * np.sqrt(0.5), 6.0 * np.sqrt(0.5)], abs=1e-13)
    assert path.tangent([2.5])[0] == pytest.approx([0.6, 0.8], abs=1e-15)


@pytest.mark.parametrize(("a", "b"), [(12.0, 10.0), (3.0, 10.0), (30.0, 0.05), (1.0, 1e-4)])
def test_half_ellipse_length(a: float, b: float) -> None:
    """Truth: complete elliptic integral of the second kind, also for very flat ellipses."""
    major, minor = max(a, b), min(a, b)
    exact = 2.0 * major * ellipe(1.0 - (minor / major) ** 2)
    path = PlanarPath([Arc((1.0, -2.0), (a, b), np.pi, 2.0 * np.pi)])
    assert path.length == pytest.approx(exact, rel=1e-13)


def test_ellipse_point_at_arc_length() -> None:
    """Truth: incomplete elliptic integral; the inverse of arc length returns the parameter."""
    a, b = 10.0, 4.0
    path = PlanarPath([Arc((0.0, 0.0), (b, a), 0.0, np.pi / 2)])  # u = 0 is the minor axis' end
    u = np.linspace(0.0, np.pi / 2, 41)
    s = a * ellipeinc(u, 1.0 - (b / a) ** 2)
    expected = np.column_stack([b * np.cos(u), a * np.sin(u)])
    assert np.abs(path.point(np.minimum(s, path.length)) - expected).max() < 1e-12


def test_quadratic_bezier_is_a_parabola() -> None:
    """Truth: y = x^2 from x = 0 to 1 has length sqrt(5)/2 + asinh(2)/4."""
    path = PlanarPath([Bezier(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))])
    assert path.length == pytest.approx(np.sqrt(5.0) / 2.0 + np.arcsinh(2.0) / 4.0, rel=1e-14)
    points = path.point(np.linspace(0.0, path.length, 50))
    assert points[:, 1] == pytest.approx(points[:, 0] ** 2, abs=1e-14)


def test_quartic_bezier_against_casteljau_and_quadrature() -> None:
    """Truth: de Casteljau's construction; adaptive quadrature of |dy/dt| from differences of it."""

    def casteljau(t: float) -> np.ndarray:
        rows = np.array(QUARTIC.control)
        while len(rows) > 1:
            rows = (1.0 - t) * rows[:-1] + t * rows[1:]
        return rows[0]

    def speed(t: float) -> float:
        rows = 4.0 * np.diff(np.array(QUARTIC.control), axis=0)
        while len(rows) > 1:
            rows = (1.0 - t) * rows[:-1] + t * rows[1:]
        return float(np.hypot(*rows[0]))

    path = PlanarPath([QUARTIC])
    for t in (0.1, 0.37, 0.5, 0.93):
        s = quad(speed, 0.0, t, epsabs=1e-13, epsrel=1e-13)[0]
        assert path.point([s])[0] == pytest.approx(casteljau(t), abs=1e-12)


def test_unit_speed_and_tangent() -> None:
    """Truth: in arc length the derivative of the point is the tangent and has length one."""
    path = mixed_path()
    s = np.linspace(0.0, path.length, 400)[1:-1]
    h = 1e-5
    s = s[np.abs(s[:, None] - path.breaks).min(axis=1) > h]
    slope = (path.point(s + h) - path.point(s - h)) / (2.0 * h)
    assert np.abs(slope - path.tangent(s)).max() < 1e-8
    assert np.abs(np.linalg.norm(path.tangent(s), axis=1) - 1.0).max() < 1e-15


def test_continuity_and_exact_ends() -> None:
    """Truth: a chain is continuous and hits its ends exactly; a joint has the later tangent."""
    path = mixed_path()
    for s in path.breaks[1:-1]:
        around = path.point([s - 1e-9, s, s + 1e-9])
        assert np.abs(np.diff(around, axis=0)).max() < 2e-9
    assert path.point([0.0, path.length]).tolist() == [[0.0, 2.0], [20.0, 9.0]]
    corner = PlanarPath([Line((0.0, 0.0), (1.0, 0.0)), Line((1.0, 0.0), (1.0, 1.0))])
    assert corner.tangent(corner.breaks).tolist() == [[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]]


@settings(deadline=None)
@given(
    angle=st.floats(-3.0, 3.0),
    shift=st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)),
    factor=st.floats(0.01, 100.0),
)
def test_similarity(angle: float, shift: tuple[float, float], factor: float) -> None:
    """Truth: a rotated, scaled, shifted curve has the scaled length and the moved points."""
    turn = factor * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = Bezier(tuple(tuple(row) for row in np.array(QUARTIC.control) @ turn.T + shift))
    one, two = PlanarPath([QUARTIC]), PlanarPath([moved])
    assert two.length == pytest.approx(factor * one.length, rel=1e-10)
    share = np.linspace(0.0, 1.0, 7)
    expected = one.point(share * one.length) @ turn.T + shift
    assert np.abs(two.point(share * two.length) - expected).max() < 1e-9 * (1.0 + factor)


def test_zero_length_segments_are_dropped() -> None:
    """Truth: an arc of angle zero and a point-like line change neither breaks nor points."""
    line = Line((0.0, 0.0), (2.0, 0.0))
    empty = Arc((2.0, -1.0), (1.0, 1.0), np.pi / 2, np.pi / 2)
    path = PlanarPath([Line((0.0, 0.0), (0.0, 0.0)), line, empty])
    assert path.breaks == pytest.approx([0.0, 2.0], rel=1e-15)
    assert path.tangent([path.length]).tolist() == [[1.0, 0.0]]
    with pytest.raises(ValueError, match="positive length"):
        PlanarPath([empty])


def test_misuse_is_refused() -> None:
    """Truth: gaps, values that are not finite and arc lengths off the path are errors."""
    with pytest.raises(ValueError, match="do not meet"):
        PlanarPath([Line((0.0, 0.0), (1.0, 0.0)), Line((1.0, 0.1), (2.0, 0.0))])
    with pytest.raises(ValueError, match="finite"):
        PlanarPath([Line((0.0, 0.0), (np.nan, 0.0))])
    path = PlanarPath([Line((0.0, 0.0), (1.0, 0.0))])
    for wrong in ([-0.1], [1.1], [np.nan], [[0.5]]):
        with pytest.raises(ValueError, match="arc lengths"):
            path.point(wrong)
    with pytest.raises(ValueError, match="no tangent"):
        PlanarPath([Bezier(((0.0, 0.0), (0.0, 0.0), (1.0, 0.0)))]).tangent([0.0])
