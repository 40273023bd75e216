"""Distances of triangulated surfaces on sheets and cylinders, where they are known."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.results.surface_distance import SPACING, samples, surface_distance
from sheet_cases import lifted, rolled, sheet


def test_samples() -> None:
    """Truth: a rectangle's area, and its moments to the sampling's order."""
    points, triangles = sheet(3)
    places, areas = samples(lifted(points), triangles)
    assert areas.sum() == pytest.approx(60.0)
    assert areas @ places[:, 0] == pytest.approx(0.0, abs=1e-9)
    assert areas @ places[:, 1] == pytest.approx(180.0)
    assert areas @ places[:, 0] ** 2 == pytest.approx(6.0 * 10.0**3 / 12, rel=1e-3)
    assert areas @ places[:, 1] ** 2 == pytest.approx(10.0 * 6.0**3 / 3, rel=1e-3)


def test_shifted_sheet() -> None:
    """Truth: a flat sheet shifted along its normal is that far away, on meshes that do not
    match; one shifted in its plane is 0 away but where it sticks out."""
    points, triangles = sheet(3)
    other, fine = sheet(5)
    found = surface_distance((lifted(points), triangles), (lifted(other, 0.3), fine))
    np.testing.assert_allclose(found, 0.3, rtol=1e-9)
    moved = lifted(other + np.array([2.0, 0.0]))
    mean, quantile, largest = surface_distance((lifted(points), triangles), (moved, fine))
    assert mean == pytest.approx(2.0 / 10.0 * 1.0, rel=1e-2)
    assert quantile == pytest.approx(2.0 - 0.05 * 10.0, abs=SPACING)
    assert largest == pytest.approx(2.0, abs=SPACING)


def test_chosen_triangles() -> None:
    """Truth: only the chosen triangles count, against all of the other surface."""
    points, triangles = sheet(4)
    bent = lifted(points)
    bent[points[:, 0] > 1e-9, 2] = 1.0
    flat = (points[triangles][:, :, 0] < 1e-9).all(axis=1)
    found = surface_distance((lifted(points), triangles), (bent, triangles), chosen=(flat, flat))
    np.testing.assert_allclose(found, 0.0, atol=1e-9)


def test_cylinders() -> None:
    """Truth: patches of cylinders about one axis are the difference of their radii apart, up to
    the sagitta h^2/8R of their chords."""
    points, triangles = sheet(40)
    # the outer one is longer: both span the same angle
    inner, outer = rolled(points, 5.0), rolled(points * [1.0, 5.4 / 5.0], 5.4)
    found = surface_distance((inner, triangles), (outer, triangles))
    np.testing.assert_allclose(found, 0.4, atol=0.15**2 / 8 / 5.0 + 1e-3)
