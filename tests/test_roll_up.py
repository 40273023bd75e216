"""Strip rolled up by an end moment: R = EI/M, the closed circle, and two ways of Newton."""

from __future__ import annotations

import numpy as np
import pytest

from cantilever import sze_table
from roll_up import (
    FULL_MOMENT,
    exact_tip,
    line_search,
    plain_newton,
    rolled,
    rows,
    solve,
    steps_needed,
)

SMALL = (1, (32, 1, True))


def test_closed_form_is_the_published_exact_column():
    """U = L - R sin(L/R), W = R (1 - cos(L/R)) give Sze's exact columns to their 3 decimals."""
    table = sze_table("sze_3_2_cantilever_end_moment")
    exact = np.array([exact_tip(share) for share in table[:, 0]])
    assert len(table) == 20
    assert np.abs(exact - table[:, [2, 4]]).max() <= 0.501e-3


def test_full_moment_closes_the_circle():
    """M_max = 2 pi EI/L: the exact tip is back at the clamp."""
    assert exact_tip(1.0) == pytest.approx((12.0, 0.0), abs=1e-12)


def test_moment_load_does_the_work_of_a_moment():
    """The load vector sums to M_max (degree 1: one number a loaded edge, about -y here)."""
    _, moment, _ = rolled(*SMALL)
    assert abs(moment.sum()) == pytest.approx(FULL_MOMENT, rel=1e-12)


def test_tips_follow_the_exact_arc():
    """0.1 % of L at each load and for the closed circle; degrees 1 and 2, unstructured."""
    assert not [row for row in rows(full=False) if not row.passed]


def test_line_search_and_plain_newton_agree():
    """Both find the same equilibrium, the exact circle, at half of the full moment and at it."""
    plain, line = (solve(*SMALL, 10, solver)[0] for solver in (plain_newton, line_search))
    assert np.allclose(plain, line, atol=1e-6)


def test_plain_newton_closes_the_circle_in_few_steps():
    """Five equal load steps suffice for full Newton steps without line search or damping."""
    assert steps_needed(*SMALL)[0] <= 5


def test_a_failed_solve_leaves_the_problem_as_it_was():
    """The whole moment at once is too much for plain Newton; the state is still the flat one."""
    problem, moment, _ = rolled(*SMALL)
    state, directors = problem.state.copy(), problem.model.directors.copy()
    problem.system.dead_load = moment
    with pytest.raises(RuntimeError, match="did not converge"):
        plain_newton(problem, largest=20)
    assert np.array_equal(problem.state, state)
    assert np.array_equal(problem.model.directors, directors)


@pytest.mark.slow
def test_every_published_load_structured_and_unstructured():
    """All 20 loads of Sze's table 3.2, degrees 1 to 3, and the stretchable line above degree 1."""
    found = rows(full=True)
    assert len(found) == 6 * 41 + 8
    assert not [row for row in found if not row.passed]
