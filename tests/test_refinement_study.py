"""Orders of convergence and numbers as demos/refinement_study.py tells them."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

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
