"""The speed benchmark: its variants give the same answers and its report is whole.

No test asserts a time.
"""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.equilibrium.high_order_shell import shell_model
from avneo_fem.equilibrium.shell_model import ShellParameters
from kernel_speed import (
    BENDING_ALONE,
    FULL,
    SAME,
    Figure,
    Level,
    bent_states,
    disagreement,
    expected,
    measure,
    report,
    template_mesh,
)
from shell_cases import disc, taylor_orders

QUICK = Level(
    sizes=(3.0,), stock_degrees=(1,), pressures=(0.01,), flags=(), starts=False, repeats=1
)


@pytest.fixture(scope="module")
def figures() -> list[Figure]:
    """One run on a coarse mesh without compilations; it checks its variants itself."""
    return measure(QUICK)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_by_hand_as_automatic(degree: int) -> None:
    """Truth: the first variations derived by hand are those of UFL: same residual and tangent in
    a bent state with leaning directors, the bending term alone."""
    assert disagreement(disc(3, 5.0), degree, "automatic", "by hand") <= SAME


@pytest.mark.parametrize("degree", [1, 2])
def test_by_hand_is_the_derivative_of_the_energy(degree: int) -> None:
    """Truth: Taylor expansion of the energy; needs no automatic derivative to be right."""
    model = shell_model(disc(2, 5.0), ShellParameters(degree=degree, **BENDING_ALONE))
    state, _ = bent_states(model)
    way = np.random.default_rng(4).uniform(-1, 1, model.size)
    slope, change = model.residual(state) @ way, model.tangent(state) @ way
    assert taylor_orders(model.energy, slope, state, way) == pytest.approx(2, abs=0.05)
    assert taylor_orders(model.residual, change, state, way) == pytest.approx(2, abs=0.05)


def test_every_line_is_in_the_report(figures: list[Figure]) -> None:
    """Truth: the cases and variants that the level asks for, each with finite figures, except
    the deflection of a solve that failed; every one of them is a line of a table."""
    assert {(f.group, f.case, f.variant) for f in figures} == expected(QUICK)
    assert all(np.isfinite(f.value) for f in figures if f.quantity != "deflection")
    text = report(figures)
    for _, case, variant in expected(QUICK):
        assert f"| {case} | {variant} |" in text


def test_our_solver_converges_on_the_plate(figures: list[Figure]) -> None:
    """Truth: the held plate under 0.01 kPa is solvable; both degrees find the same deflection,
    the stock membrane's first matrix is singular."""
    solved = {(f.variant, f.quantity): f.value for f in figures if f.group == "Newton"}
    ours = [solved[f"ours, degree {k}", "deflection"] for k in (1, 2)]
    assert ours[0] == pytest.approx(ours[1], rel=0.01)
    assert not solved["stock, P1 membrane", "converged"]


@pytest.mark.slow
def test_full_report() -> None:
    """Truth: as above for all that docs/kernel_speed.md tells, compiler flags included."""
    level = Level(sizes=(3.0, 2.0), repeats=1)
    assert level.flags == FULL.flags
    some = measure(level)
    assert {(f.group, f.case, f.variant) for f in some} == expected(level)
    assert template_mesh(2.0).area == pytest.approx(template_mesh(1.0).area, rel=0.02)
