"""Adaptive continuation in one parameter: a step that fails is halved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SolveError

__all__ = ["Attempt", "StageFailed", "march"]

Floats = NDArray[np.float64]

#: (state, parameter, next parameter) -> (new state or None, reason)
Attempt = Callable[[Any, float, float], tuple[Any, str]]


class StageFailed(SolveError):
    """A stage could not be completed even in its smallest steps.

    Attributes
    ----------
    state : array
        The last good state.
    parameter : float
        How far the stage got.
    steps : int
        Steps taken.
    """

    def __init__(self, message: str, state: Any, parameter: float, steps: int) -> None:
        super().__init__(message)
        self.state, self.parameter, self.steps = state, parameter, steps


def march(
    state: Any,
    start: float,
    stop: float,
    attempt: Attempt,
    first_step: float,
    smallest_step: float,
    name: str,
) -> tuple[Any, int]:
    """Take a state from parameter ``start`` to ``stop`` > ``start``.

    ``attempt(state, value, next_value)`` returns the new state, or None and why it failed. A
    failed step is halved; after a success the next one is doubled, up to ``first_step``.

    Returns
    -------
    (state, int)
        State at ``stop`` and the number of steps taken.

    Raises
    ------
    StageFailed
        When a step of ``smallest_step`` or less failed.
    """
    value, step, steps = start, first_step, 0
    while value < stop:
        ahead = stop if stop - value <= step * (1 + 1e-9) else value + step
        result, reason = attempt(state, value, ahead)
        if result is not None:
            state, value, steps = result, ahead, steps + 1
            step = min(2 * step, first_step)
            continue
        tried = ahead - value
        step = tried / 2
        if tried <= smallest_step * (1 + 1e-9):
            message = (
                f"{name}: stopped at {value:.6g} of {stop:.6g}; the smallest step,"
                f" {tried:.3g}, failed: {reason}"
            )
            raise StageFailed(message, state, value, steps)
    return state, steps
