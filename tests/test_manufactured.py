"""Manufactured solutions: observed orders of convergence, and that a mistake would be noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import manufactured
from cell_fields import observed_order, sampled, sampled_on_cells, value_at
from manufactured_membrane import membrane_errors
from meshes import strip
from record import Row
from solving import Problem, start


@pytest.fixture(scope="module")
def table() -> list[Row]:
    return manufactured.rows(full=False)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_membrane_converges_at_full_order(table: list[Row], degree: int) -> None:
    """Order k + 1 in L2 and k in the gradient, +- 0.2, on unstructured meshes."""
    chosen = [row for row in table if row.case.startswith(f"membrane, degree {degree}")]
    assert len(chosen) == 2
    assert [row for row in chosen if not row.passed] == []


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_plate_converges_at_full_order(table: list[Row], degree: int) -> None:
    """Order k in the moments and k + 1 (2 for k = 1) in the deflection, +- 0.2."""
    chosen = [row for row in table if row.case.startswith(f"plate, degree {degree}")]
    assert len(chosen) == 2
    assert [row for row in chosen if not row.passed] == []


def test_a_load_one_per_cent_off_spoils_the_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check can fail: degree 2 should reach 3, and with a wrong load stays below 1.5."""
    right = Problem.surface_load
    monkeypatch.setattr(Problem, "surface_load", lambda *given: 1.01 * right(*given))
    columns = (4, 8, 16)
    errors = [membrane_errors(2, n, True, "neo_hookean")[0] for n in columns]
    assert observed_order(1 / np.array(columns), np.array(errors)) < 1.5


def cubic(places: Any) -> Any:
    """A polynomial of degree 3 with two components at places (..., 2)."""
    x, y = places[..., 0], places[..., 1]
    return np.stack([1 + x - 2 * y + x**2 * y, x * y - y**3], axis=-1)


def test_fields_are_rebuilt_exactly() -> None:
    """A cubic given by its nodal values comes back at every place, with its gradient."""
    model = start(strip(3, 2, 1.0, 1.0, False), 3, force_scale=1.0, bending=False).model
    values = cubic(model.node_points)
    samples = sampled(model, values, 4)
    x, y = samples.points[..., 0], samples.points[..., 1]
    slopes = np.stack(
        [np.stack([1 + 2 * x * y, x**2 - 2], -1), np.stack([y, x - 3 * y**2], -1)], axis=-2
    )
    np.testing.assert_allclose(samples.values, cubic(samples.points), atol=1e-12)
    np.testing.assert_allclose(samples.gradients, slopes, atol=1e-11)
    place = np.array([0.37, 0.81])
    np.testing.assert_allclose(value_at(model, values, (0.37, 0.81)), cubic(place), atol=1e-12)


def test_norms_are_integrated_exactly() -> None:
    """int (x y)^2 over the unit square is 1/9, and a field of degree 0 has its cells' areas."""
    model = start(strip(3, 2, 1.0, 1.0, False), 1, force_scale=1.0, bending=False).model
    ones = sampled_on_cells(model, np.ones((12, 1, 1)), 0, 4)
    assert ones.norm(ones.values) == pytest.approx(1.0, rel=1e-12)
    product = ones.points.prod(axis=2)
    assert ones.norm(product) == pytest.approx(1 / 3, rel=1e-12)


@pytest.mark.slow
def test_all_manufactured_solutions() -> None:
    """Every row: four meshes, structured and unstructured, both materials."""
    assert [row for row in manufactured.rows(full=True) if not row.passed] == []
