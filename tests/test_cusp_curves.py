"""Mid-line, sag, contact curve and places along an edge against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.results.cusp_curves import along, contact_curve, length, mid_line, sag
from sheet_cases import lifted, rolled, sheet


def test_mid_line() -> None:
    """Truth: the mid-line of a rolled sheet is an arc, its sag R (1 - cos(angle/2))."""
    points, triangles = sheet(40)
    line = mid_line(points, triangles, rolled(points, 5.0))
    np.testing.assert_allclose(line[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(line[:, 1], line[:, 2]), 5.0, atol=1e-3)
    np.testing.assert_allclose(line[[0, -1]], rolled(np.array([[0, 0], [0, 6]]), 5.0), atol=1e-12)
    assert sag(line) == pytest.approx(5.0 * (1.0 - np.cos(0.6)), abs=1e-3)
    assert sag(lifted(points[: 2 * 40 + 1])) == pytest.approx(0.0, abs=1e-12)


def test_along() -> None:
    """Truth: places go by arc length in the template, however the curve is stretched."""
    template = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 9.0]])
    positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 7.0]])
    found = along(template, positions, 5)
    expected = [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [1, 0, 3.5], [1, 0, 7]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_contact_curve() -> None:
    """Truth: the lowest place above every piece of a straight wedge; none where nothing is."""
    wedge = np.column_stack([np.linspace(0.0, 4.0, 401), np.zeros(401)])
    x = np.linspace(0.01, 1.99, 100)
    high = np.column_stack([x, 0.1 + 0.0 * x, x])
    found = contact_curve(np.vstack([high, high + np.array([0.0, 0.0, 5.0])]), wedge, 1.0)
    np.testing.assert_allclose(found[:2], [0.01, 1.01], atol=0.02)
    assert np.isnan(found[2:]).all()


def test_length() -> None:
    """Truth: 3-4-5 triangles; a single place has no length."""
    assert length(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 9.0]])) == pytest.approx(10.0)
    assert length(np.zeros((1, 3))) == 0.0
