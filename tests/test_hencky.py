"""A circular membrane blown up: Hencky's series, and the equations of large inflation."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from numpy.typing import NDArray

import hencky
from cell_fields import observed_order
from hencky import MATERIALS, hencky_case, hencky_series, inflated, inflation_case, rows
from record import Row

Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def quick() -> list[Row]:
    return rows()


@pytest.mark.parametrize("benchmark", ["Hencky's membrane", "Inflated membrane"])
def test_quick_rows(quick: list[Row], benchmark: str) -> None:
    """Truth: Hencky's series (nu = 0; Fichter's b_0 for others) and the axisymmetric equations of
    a finitely strained membrane."""
    chosen = [row for row in quick if row.benchmark == benchmark]
    assert chosen
    assert [row for row in chosen if not row.passed] == []


def test_the_series_solves_henckys_equations() -> None:
    """Truth: rho d/drho (2 N + rho N') = -8 rho^2/N^2 and dw/drho = -2 rho/N all over the disc,
    and no movement of the rim, d(rho N)/drho = nu N."""
    for ratio in (0.0, 0.3):
        stress, deflection = hencky_series(ratio)
        powers = 2 * np.arange(len(stress))
        rho = np.linspace(0.1, 1.0, 7)[:, None]
        n = (stress * rho**powers).sum(axis=1)
        left = (stress * (2 + powers) * powers * rho**powers).sum(axis=1)
        np.testing.assert_allclose(left, -8 * rho[:, 0] ** 2 / n**2, rtol=1e-12)
        slope = -(deflection * (powers + 2) * rho ** (powers + 1)).sum(axis=1)
        np.testing.assert_allclose(slope, -2 * rho[:, 0] / n, rtol=1e-12)
        assert stress @ (powers + 1 - ratio) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("material", MATERIALS)
def test_the_reference_obeys_the_energy_balance(material: str) -> None:
    """Truth: dU = q dV along the equilibria: energy and volume come from different integrals."""
    low, middle, high = (inflated(material, stretch) for stretch in (1.399, 1.4, 1.401))

    def volume(shape: Floats) -> float:
        """Sum of frustums."""
        (inner, outer), drop = (shape[:-1, 0], shape[1:, 0]), -np.diff(shape[:, 1])
        return float(np.pi / 3 * (drop * (inner**2 + inner * outer + outer**2)).sum())

    work = middle.pressure * (volume(high.profile) - volume(low.profile))
    assert high.energy - low.energy == pytest.approx(work, rel=1e-4)


@pytest.mark.parametrize(("degree", "rings", "order"), [(1, (8, 16), 2), (2, (4, 8), 3)])
def test_order_of_convergence_small(degree: int, rings: tuple[int, ...], order: int) -> None:
    """Truth: the finite-strain equations at Hencky's load; stored energy converges with order 2
    of linear triangles, 3 of quadratic ones (straight sides limit it), rim force likewise."""
    pairs = [hencky_case(count, degree) for count in rings]
    for quantity in ("energy", "rim_force"):
        errors = np.array([abs(getattr(b, quantity) / getattr(a, quantity) - 1) for a, b in pairs])
        assert observed_order(1 / np.array(rings), errors) > order - 0.3


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize(("degree", "rings", "order"), [(1, (8, 16), 2), (2, (4, 8), 3)])
def test_order_of_convergence_large(
    material: str, degree: int, rings: tuple[int, ...], order: int
) -> None:
    """Truth: axisymmetric equations at a pole stretch of 1.5."""
    pairs = [inflation_case(count, degree, material, 1.5) for count in rings]
    errors = np.array([abs(found.energy / exact.energy - 1) for exact, found in pairs])
    assert observed_order(1 / np.array(rings), errors) > order - 0.3


def test_inflated_shape_is_round() -> None:
    """Truth: every node of the irregular mesh lies on the meridian of the equations."""
    exact, found = inflation_case(8, 2, MATERIALS[1], 2.0)
    radius, height = np.linalg.norm(found.positions[:, :2], axis=1), found.positions[:, 2]
    ways = np.c_[radius, height][:, None] - exact.profile[None]
    assert np.linalg.norm(ways, axis=2).min(axis=1).max() < 0.02  # half a spacing of the profile


def test_drawing() -> None:
    """Truth: the picture has its axes named with units."""
    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    hencky.draw(axes)
    assert "[mm]" in axes.get_xlabel()
    assert "[mm]" in axes.get_ylabel()
    assert len(axes.lines) == 14


@pytest.mark.slow
def test_all_rows() -> None:
    """Truth: as the quick rows, on all meshes and degrees, up to a pole stretch of 2.4."""
    assert [row for row in rows(full=True) if not row.passed] == []
