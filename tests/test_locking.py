"""Membrane locking: the deflection of ever thinner strips under loads relative to their EI."""

from __future__ import annotations

import pytest

from cantilever import elastica_tip
from locking import CASES, MISSED, Grid, deflection_ratio, exact_deflection, missed, rows

LARGE, CURVED = CASES[1:]


def test_the_reference_of_a_thin_strip_is_the_elastica():
    """At L/H = 2000 stretch is negligible: elliptic integrals give the large deflection."""
    exact = elastica_tip(LARGE.force)[1]
    assert exact_deflection(LARGE, 2000, False) == pytest.approx(exact, rel=1e-5)


def test_thin_strips_bend_as_they_should():
    """Degrees 1 to 3, unstructured, L/H = 2000: within 1 %, straight and curved."""
    assert not [row for row in rows(full=False) if not row.passed]


def test_degree_1_does_not_depend_on_thickness():
    """Loads scale with H^3, so the ratio to the exact deflection stays the same: no locking."""
    grid = Grid(64, 4, 0.1)
    thick, thin = (deflection_ratio(1, grid, LARGE, slender) for slender in (20, 2000))
    assert thin == pytest.approx(thick, abs=1e-3)


def test_degree_2_owes_it_to_the_projection():
    """Curved, L/H = 2000: without the projection both quadratures lock (0.198, 0.602 measured)."""
    grid = Grid(32, 2, 0.1)
    full, reduced = (deflection_ratio(2, grid, CURVED, 2000, False, q) for q in (4, 2))
    assert full < reduced < 0.9
    assert deflection_ratio(2, grid, CURVED, 2000) == pytest.approx(1, abs=1e-3)


@pytest.mark.slow
def test_every_thickness_mesh_and_load_where_the_figure_is_claimed():
    """1 % on all of FULL: structured, unstructured and stretched meshes, degrees 1 to 3."""
    assert not [row for row in rows(full=True) if not row.passed]


@pytest.mark.slow
def test_known_misses_of_degree_1():
    """Every mesh listed as missing 1 % does miss it somewhere; one that no longer does moves up."""
    found = missed()
    for _, grid, _ in MISSED:
        assert not all(row.passed for row in found if str(grid) in row.case)
