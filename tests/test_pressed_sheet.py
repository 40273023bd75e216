"""Penalty contact against balance of forces, membrane, rod and sampled distances."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.root import CylinderRoot
from pressed_sheet import Sheet, draw, membrane, rod, rows, shape_error
from record import Row
from sampled_distance import Lying, SampledDistance, distance_to_facets


@pytest.fixture(scope="module")
def quick() -> list[Row]:
    """The quick level."""
    return rows(full=False)


@pytest.mark.parametrize(
    "quantity",
    [
        "nodes / R",
        "penalty forces",
        "mean contact pressure",
        "order of penetration",
        "Newton's order",
        "order in the grid's step",
        "shift of the nodes",
        "order in the facets' length",
    ],
)
def test_rows(quick: list[Row], quantity: str) -> None:
    """Truth: see the list of references in the module's docstring, row by row."""
    chosen = [row for row in quick if row.quantity.startswith(quantity)]
    assert chosen
    assert [row for row in chosen if not row.passed] == []


@pytest.mark.parametrize(("degree", "columns", "least"), [(1, 32, 1.5), (2, 16, 2.5)])
def test_order_of_the_place(degree: int, columns: int, least: float) -> None:
    """Truth: from h to h/2 the nodes converge to the rod, with an order of 1.5 for degree 1 (its
    two, less what the sum over nodes loses where contact ends) and 2.5 for degree 2."""
    answer = rod(64.0, degree > 1)
    first, second = (shape_error(Sheet.of(degree, n), answer) for n in (columns, 2 * columns))
    assert np.log2(first / second) >= least


def test_membrane() -> None:
    """Truth: the closed form has unit speed along its tangent angle, lies on the wall, ends at the
    roller horizontally, and balances: P x roller distance = (P - T/R) x contact width."""
    s = np.linspace(0.0, 23.227921858900554, 4001)
    place, angle = membrane(s)
    tangent = np.gradient(place, s, axis=0)[1:-1]
    assert tangent == pytest.approx(np.c_[np.cos(angle), np.sin(angle)][1:-1], abs=1e-3)
    assert place[-1, 0] == pytest.approx(4.0, abs=1e-9)
    assert angle[-1] == pytest.approx(np.pi)
    wall = np.hypot(*place.T) > 12.0 - 1e-9
    contact = 8.0 * (1 - 6.0 / 12.0) * place[wall, 0].max()
    assert contact == pytest.approx(8.0 * 4.0, rel=2e-3)


def test_sampled_derivatives() -> None:
    """Truth: value, gradient and Hessian of the splines approach those of the cylinder with the
    orders 4, 3 and 2 of cubic interpolation, and belong together (central differences)."""
    exact = Lying(CylinderRoot(12.0))
    random = np.random.default_rng(2)
    angle, radius = random.uniform(0, 6, 4000), random.uniform(11, 12.5, 4000)
    points = np.c_[radius * np.cos(angle), 0.2 + 0 * angle, radius * np.sin(angle)]
    wanted, errors = exact.evaluate(points), []
    for step in (1.0, 0.5):
        field = SampledDistance.through(lambda p: exact.evaluate(p)[0], 13.0, 0.5, step)
        found = field.evaluate(points)
        errors.append([np.abs(a - b).max() for a, b in zip(found, wanted, strict=True)])
    assert np.all(np.log2(np.divide(*errors)) > [3.5, 2.5, 1.6])
    h = 1e-5
    for axis, unit in enumerate(np.eye(3)):
        ahead, behind = field.evaluate(points + h * unit), field.evaluate(points - h * unit)
        slopes = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
        assert slopes[0] == pytest.approx(found[1][:, axis], abs=1e-7)
        assert slopes[1] == pytest.approx(found[2][:, :, axis], abs=1e-7)


def test_distance_to_facets() -> None:
    """Truth: positive inside; the apothem R cos(pi/n) from the axis, less by that on a facet's
    foot, zero on a corner, -1 a millimetre behind it along the radius."""
    low = 12.0 * np.cos(np.pi / 8)
    foot = 5.0 * np.array([np.sin(np.pi / 8), 0.0, np.cos(np.pi / 8)])
    points = np.array([[0.0, 0.3, 0.0], foot, [0.0, 0.3, 12.0], [0.0, 0.3, 13.0]])
    expected = [low, low - 5.0, 0.0, -1.0]
    assert distance_to_facets(12.0, 8, points) == pytest.approx(expected, abs=1e-12)


def test_draw() -> None:
    """Truth: nodes over the reference in the wall, labelled axes with units."""
    axes = pytest.importorskip("matplotlib.figure").Figure().subplots()
    draw(axes)
    assert len(axes.lines) == 6
    assert "[mm]" in axes.get_xlabel()
    assert "[mm]" in axes.get_ylabel()


@pytest.mark.slow
def test_full_level() -> None:
    """Truth: the same on finer meshes and for degrees 1 to 3."""
    assert [row for row in rows(full=True) if not row.passed] == []
