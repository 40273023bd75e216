"""By how much penalties are raised."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.stages.raising import raising_factor


def test_first_raise() -> None:
    """Truth: a miss that goes with 1/stiffness is gone after a factor of miss/allowed; 30 % more
    than that, but no more than the largest factor."""
    assert raising_factor((2.0, 0.3), 0.1, None, 10.0) == pytest.approx(1.3 * 3.0)
    assert raising_factor((2.0, 30.0), 0.1, None, 10.0) == 10.0


@pytest.mark.parametrize("power", [1.0, 0.5, 0.2])
def test_what_helped_less_is_raised_more(power: float) -> None:
    """Truth: when misses go with stiffness^-power, the next raise reaches what is allowed with 30 %
    to spare in stiffness."""

    def missed(stiffness: float) -> float:
        return float(5.0 * stiffness**-power)

    allowed, before, now = missed(1000.0), 10.0, 100.0
    factor = raising_factor((now, missed(now)), allowed, (before, missed(before)), np.inf)
    assert factor * now == pytest.approx(1.3 * 1000.0)


@pytest.mark.parametrize("after", [0.3, 0.299999, 0.4])
def test_a_raise_that_did_not_help(after: float) -> None:
    """Truth: then by as much as is allowed."""
    assert raising_factor((20.0, after), 0.1, (10.0, 0.3), 7.0) == 7.0
