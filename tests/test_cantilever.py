"""Cantilever under an end force: the elastica, the published table, orders of convergence."""

from __future__ import annotations

import numpy as np
import pytest

from cantilever import (
    FULL_LOAD,
    LENGTH,
    elastica_tip,
    observed_order,
    rows,
    stretchable_tip,
    sze_table,
)

#: (P/P_max, -U, W) [mm], an independent solution of the inextensible elastica, in sze_tables.json
INDEPENDENT = sze_table("exact_elastica_3_1")


@pytest.mark.parametrize("line", INDEPENDENT, ids=lambda line: f"{line[0]:g}")
def test_elliptic_integrals_give_the_independent_elastica(line):
    """The closed form reproduces the four tabulated solutions to their four decimals."""
    found = LENGTH * np.array(elastica_tip(FULL_LOAD * line[0]))
    assert np.abs(found - line[1:]).max() <= 0.5001e-4


def test_small_forces_give_the_linear_beam():
    """W/L = P L^2/(3 EI) as the force vanishes, the textbook's cantilever."""
    assert elastica_tip(1e-4)[1] == pytest.approx(1e-4 / 3, rel=1e-6)


def test_the_stiff_line_is_the_elastica():
    """The shooting solution of a line that barely stretches is the closed form: two derivations."""
    back, rise = elastica_tip(4.0)
    assert stretchable_tip(4.0, 0.0, 1e12) == pytest.approx((1 - back, rise), abs=1e-10)


def test_the_faceted_line_under_a_moment_is_a_circle():
    """With k = t' an end moment bends without stretch: the tip of a half circle, (0, 2/pi)."""
    found = stretchable_tip(0.0, np.pi, 1200.0, faceted=True)
    assert found == pytest.approx((0.0, 2 / np.pi), abs=1e-10)


def test_a_moment_shortens_the_line_whose_curvature_counts_stretch():
    """l^2 - 1 = -4 m^2/(2 a D l^4) from dW/dl = 0: arc of radius l L/t with t = m L/(D l^2)."""
    moment, stretching = np.pi, 1200.0
    l2 = 1.0
    for _ in range(100):
        l2 = 1 - 2 * moment**2 / (stretching * l2**2)
    angle, length = moment / l2, np.sqrt(l2)
    exact = length / angle * np.array([np.sin(angle), 1 - np.cos(angle)])
    assert stretchable_tip(0.0, moment, stretching) == pytest.approx(exact, abs=1e-9)


def test_the_published_table_is_within_its_own_mesh_error():
    """Sze's 16 x 1 S4R figures lie within 0.0035 mm (and rounding) of the elastica, all loads."""
    table = sze_table("sze_3_1_cantilever_end_shear")
    exact = LENGTH * np.array([elastica_tip(FULL_LOAD * share) for share in table[:, 0]])
    assert len(table) == 20
    assert np.abs(table[:, 1:] - exact).max() <= 3.5e-3 + 0.5e-3


def test_tips_are_those_of_the_elastica_and_the_table():
    """Degrees 1 to 3, at most 400 triangles: 0.1 % of the elastica, and the published figures."""
    missed = [row for row in rows(full=False) if not row.passed]
    assert not missed


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_order_of_convergence(degree):
    """The tip converges to the stretchable line's like h^2k."""
    assert observed_order(degree) == pytest.approx(2 * degree, abs=0.5)


@pytest.mark.slow
def test_every_published_load_structured_and_unstructured():
    """All 20 loads of Sze's table 3.1, degrees 1 to 3, both kinds of mesh."""
    found = rows(full=True)
    assert len(found) == 6 * (40 + 8) + 3
    assert not [row for row in found if not row.passed]
