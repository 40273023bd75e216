"""Lines, elliptic arcs and Bezier curves against implicit equations and constructions."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.segments import Arc, Bezier, Line, Segment

LINE = Line((0.1, -2.0), (4.7, 6.3))
ARC = Arc((1.0, -2.0), (7.0, 3.0), 0.4, 4.1)
QUARTIC = Bezier(((0.0, 0.0), (1.0, -2.0), (4.0, -3.0), (6.0, 1.0), (5.0, 4.0)))
T = np.linspace(0.0, 1.0, 41)


@pytest.mark.parametrize("segment", [LINE, ARC, QUARTIC, Bezier(((1.0, 2.0), (3.0, -1.0)))])
def test_derivative(segment: Segment) -> None:
    """Truth: fourth-order central differences of ``point``."""
    h = 1e-3
    inner = T[1:-1]
    steps = [segment.point(inner + k * h) for k in (-2.0, -1.0, 1.0, 2.0)]
    slope = (steps[0] - 8.0 * steps[1] + 8.0 * steps[2] - steps[3]) / (12.0 * h)
    assert np.abs(segment.derivative(inner) - slope).max() < 1e-8
    assert segment.point(T).shape == segment.derivative(T).shape == (41, 2)


def test_ends_are_exact() -> None:
    """Truth: lines and Bezier curves start and end in the given points, bit for bit."""
    ends = np.array([0.0, 1.0])
    assert LINE.point(ends).tolist() == [[0.1, -2.0], [4.7, 6.3]]
    assert QUARTIC.point(ends).tolist() == [[0.0, 0.0], [5.0, 4.0]]


def test_arc_lies_on_its_ellipse() -> None:
    """Truth: the implicit equation, and the angle of the auxiliary circle grows linearly."""
    x, y = ((ARC.point(T) - ARC.centre) / ARC.semi_axes).T
    assert np.abs(x**2 + y**2 - 1.0).max() < 1e-14
    assert np.unwrap(np.arctan2(y, x)) == pytest.approx(0.4 + 3.7 * T, abs=1e-13)


def test_bezier_by_repeated_interpolation() -> None:
    """Truth: de Casteljau's construction; the end tangents point along the control polygon."""
    rows = np.tile(np.array(QUARTIC.control), (41, 1, 1))
    while rows.shape[1] > 1:
        rows = (1.0 - T)[:, None, None] * rows[:, :-1] + T[:, None, None] * rows[:, 1:]
    assert np.abs(QUARTIC.point(T) - rows[:, 0]).max() < 1e-14
    ends = QUARTIC.derivative(np.array([0.0, 1.0]))
    assert ends == pytest.approx(np.array([[4.0, -8.0], [-4.0, 12.0]]), abs=1e-14)
