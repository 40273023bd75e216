"""Adaptive continuation against attempts whose outcome is known beforehand."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avneo_fem.errors import SolveError
from avneo_fem.stages.continuation import StageFailed, march


class Ladder:
    """An attempt that notes what it is asked; ``longest(value)`` is the largest step that works."""

    def __init__(self, longest: Any = lambda _value: float("inf")) -> None:
        self.longest = longest
        self.asked: list[tuple[float, float, bool]] = []

    def __call__(self, state: Any, value: float, ahead: float) -> tuple[Any, str]:
        good = ahead - value <= self.longest(value) * (1 + 1e-12)
        self.asked.append((value, ahead, good))
        return ([*state, ahead], "") if good else (None, "too far")


def test_nominal_steps() -> None:
    """Truth: with no failure the parameters are the multiples of the first step, the last one
    exactly ``stop``, each attempt starting where the last ended."""
    ladder = Ladder()
    state, steps = march([], 0.0, 1.0, ladder, 0.25, 0.01, "stage")
    assert state == [0.25, 0.5, 0.75, 1.0]
    assert steps == 4
    assert [value for value, _, _ in ladder.asked] == [0.0, 0.25, 0.5, 0.75]


def test_a_step_longer_than_the_way_is_cut() -> None:
    """Truth: one attempt, straight to ``stop``, when the first step reaches beyond it."""
    state, steps = march([], -0.1, 0.0, Ladder(), 5.0, 0.01, "stage")
    assert (state, steps) == ([0.0], 1)


def test_halving_and_doubling_back() -> None:
    """Truth: by hand. Steps above 0.3 fail before 0.5 and none after: 1 and 0.5 fail, 0.25 works
    and doubles to 0.5, which fails from 0.25; 0.25 works again; from 0.5 on, 0.5 works."""
    ladder = Ladder(lambda value: 0.3 if value < 0.5 else 9.0)
    state, steps = march([], 0.0, 2.0, ladder, 1.0, 0.01, "stage")
    assert [(a, b) for a, b, good in ladder.asked if not good] == [
        (0.0, 1.0),
        (0.0, 0.5),
        (0.25, 0.75),
    ]
    assert state == [0.25, 0.5, 1.0, 2.0]
    assert steps == 4


def test_the_smallest_step_fails() -> None:
    """Truth: nothing passes 0.5; halving 0.25 down to at most 1/64 ends with the state at 0.5, and
    the error says where, with which step and why."""
    ladder = Ladder(lambda value: 0.5 - value)
    with pytest.raises(StageFailed) as caught:
        march([], 0.0, 1.0, ladder, 0.25, 1 / 64, "stage")
    error = caught.value
    assert isinstance(error, SolveError)
    assert (error.state, error.parameter, error.steps) == ([0.25, 0.5], 0.5, 2)
    tried = [b - a for a, b, good in ladder.asked if not good]
    assert tried == [1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64]
    text = "stage: stopped at 0.5 of 1; the smallest step, 0.0156, failed: too far"
    assert str(error) == text


def test_failure_at_the_start_keeps_the_first_state() -> None:
    """Truth: when nothing works the state is the one given, no step was taken."""
    with pytest.raises(StageFailed) as caught:
        march("start", 0.2, 1.0, lambda *_: (None, "no"), 0.1, 0.1, "stage")
    assert (caught.value.state, caught.value.parameter, caught.value.steps) == ("start", 0.2, 0)


def test_nothing_to_do() -> None:
    """Truth: at ``stop`` already, no attempt is made."""
    ladder = Ladder()
    assert march([], 1.0, 1.0, ladder, 0.1, 0.1, "stage") == ([], 0)
    assert ladder.asked == []


@given(
    start=st.floats(-3, 3),
    length=st.floats(0.01, 5),
    first=st.floats(0.01, 2),
    longest=st.floats(0.003, 3),
)
def test_reaches_stop_exactly(start: float, length: float, first: float, longest: float) -> None:
    """Truth: with a bound on the steps above the smallest, ``stop`` itself is reached, parameters
    increase, no step is longer than the first, and each success starts at the last one's end."""
    ladder = Ladder(lambda _value: longest)
    stop = start + length
    state, steps = march([], start, stop, ladder, first, 1e-4, "stage")
    assert state[-1] == stop
    assert len(state) == steps == sum(good for *_, good in ladder.asked)
    path = [start, *state]
    sizes = [b - a for a, b in itertools.pairwise(path)]
    assert min(sizes) > 0
    assert max(sizes) <= min(first, longest) * (1 + 1e-8) + 1e-12
