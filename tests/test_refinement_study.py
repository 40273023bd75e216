"""The measures of demos/refinement_study.py on surfaces whose distances are known."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from valve_cases import DEMOS

pytest.importorskip("matplotlib")


def load() -> ModuleType:
    """The demo as a module; it is no package."""
    spec = importlib.util.spec_from_file_location("refinement_study", DEMOS / "refinement_study.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


study = load()


def sheet(n: int, width: float = 10.0, height: float = 6.0) -> tuple[Any, Any]:
    """(points (m, 2), triangles) of a rectangle with its lower edge's middle at the origin."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 2 * n + 1), np.linspace(0.0, 1.0, n + 1))
    at = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (k.ravel() for k in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    points = np.column_stack([width * x.ravel(), height * y.ravel()])
    return points, np.vstack([np.c_[a, b, c], np.c_[a, c, d]])


def lifted(points: Any, z: float = 0.0) -> Any:
    """The flat points in space."""
    return np.column_stack([points, np.full(len(points), z)])


def rolled(points: Any, radius: float) -> Any:
    """The sheet rolled onto a cylinder about the x axis."""
    angle = points[:, 1] / radius
    return np.column_stack([points[:, 0], radius * np.sin(angle), -radius * np.cos(angle)])


def test_samples() -> None:
    """Truth: a rectangle's area, and its moments to the sampling's order."""
    points, triangles = sheet(3)
    places, areas = study.samples(lifted(points), triangles)
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
    found = study.surface_distance((lifted(points), triangles), (lifted(other, 0.3), fine))
    np.testing.assert_allclose(found, 0.3, rtol=1e-9)
    moved = lifted(other + np.array([2.0, 0.0]))
    mean, quantile, largest = study.surface_distance((lifted(points), triangles), (moved, fine))
    assert mean == pytest.approx(2.0 / 10.0 * 1.0, rel=1e-2)
    assert quantile == pytest.approx(2.0 - 0.05 * 10.0, abs=study.SPACING)
    assert largest == pytest.approx(2.0, abs=study.SPACING)


def test_chosen_triangles() -> None:
    """Truth: only the chosen triangles count, against all of the other surface."""
    points, triangles = sheet(4)
    bent = lifted(points)
    bent[points[:, 0] > 1e-9, 2] = 1.0
    flat = (points[triangles][:, :, 0] < 1e-9).all(axis=1)
    found = study.surface_distance(
        (lifted(points), triangles), (bent, triangles), chosen=(flat, flat)
    )
    np.testing.assert_allclose(found, 0.0, atol=1e-9)


def test_cylinders() -> None:
    """Truth: patches of cylinders about one axis are the difference of their radii apart, up to
    the sagitta h^2/8R of their chords."""
    points, triangles = sheet(40)
    # the outer one is longer: both span the same angle
    inner, outer = rolled(points, 5.0), rolled(points * [1.0, 5.4 / 5.0], 5.4)
    found = study.surface_distance((inner, triangles), (outer, triangles))
    np.testing.assert_allclose(found, 0.4, atol=0.15**2 / 8 / 5.0 + 1e-3)


def test_mid_line() -> None:
    """Truth: the mid-line of a rolled sheet is an arc, its sag R (1 - cos(angle/2))."""
    points, triangles = sheet(40)
    line = study.mid_line(points, triangles, rolled(points, 5.0))
    np.testing.assert_allclose(line[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(line[:, 1], line[:, 2]), 5.0, atol=1e-3)
    np.testing.assert_allclose(line[[0, -1]], rolled(np.array([[0, 0], [0, 6]]), 5.0), atol=1e-12)
    assert study.sag(line) == pytest.approx(5.0 * (1.0 - np.cos(0.6)), abs=1e-3)
    assert study.sag(lifted(points[: 2 * 40 + 1])) == pytest.approx(0.0, abs=1e-12)


def test_along() -> None:
    """Truth: places go by arc length in the template, however the curve is stretched."""
    template = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 9.0]])
    positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 7.0]])
    found = study.along(template, positions, 5)
    expected = [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [1, 0, 3.5], [1, 0, 7]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_contact_curve() -> None:
    """Truth: the lowest place above every piece of a straight wedge; none where nothing is."""
    wedge = np.column_stack([np.linspace(0.0, 4.0, 401), np.zeros(401)])
    x = np.linspace(0.01, 1.99, 100)
    high = np.column_stack([x, 0.1 + 0.0 * x, x])
    found = study.contact_curve(np.vstack([high, high + np.array([0.0, 0.0, 5.0])]), wedge, 1.0)
    np.testing.assert_allclose(found[:2], [0.01, 1.01], atol=0.02)
    assert np.isnan(found[2:]).all()


@pytest.mark.parametrize("p", [1.0, 2.0, 3.3])
def test_order(p: float) -> None:
    """Truth: limit + c h^p gives p, whatever the ratio of the sizes."""
    sizes = [1.4, 1.0, 0.7]
    assert study.order(sizes, [5.0 - 0.3 * h**p for h in sizes]) == pytest.approx(p)


@pytest.mark.parametrize(
    "values",
    [[1.0, 2.0, 1.5], [1.0, 2.0, 3.5], [1.0, 1.0, 1.0], [1.0, 2.0, 2.0], [0, 1e6, 1e6 + 1]],
)
def test_no_order(values: list[float]) -> None:
    """Truth: neither a zigzag nor growing differences nor a constant nor a jump has an order."""
    assert study.order([1.4, 1.0, 0.7], values) is None


def test_shown() -> None:
    """Truth: numbers as a reader wants them."""
    assert study.shown(217.536) == "217.5"
    assert study.shown(5.3e-11) == "5.3e-11"
    assert study.shown(0.0) == "0"
    assert study.shown(np.inf) == "none near"
