"""Symmetry planes are refused where the valve has no such symmetry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.scene import load_scene, parse_scene
from contact_wedge_cases import EXPERIMENTS, commissures
from valve_cases import DEMOS

METHOD = {"contact": {"method": "symmetry_planes"}}


def refused(tables: dict[str, Any]) -> str:
    with pytest.raises(SceneError) as caught:
        ValveInput.from_scene(parse_scene(tables | METHOD))
    assert caught.value.key == "contact.method"
    assert caught.value.value == "symmetry_planes"
    assert '"virtual_planes"' in caught.value.valid
    assert "\n" not in str(caught.value)
    return caught.value.valid


@pytest.mark.parametrize("number", [2, 3])
def test_experiments_without_symmetry(number: int) -> None:
    """Truth: chords 8 : 9 : 6 and 6 : 4 : 5 are not equal; the message names them and the
    templates' first difference."""
    tables = load_scene(DEMOS / f"experiment_{number}.toml").model_dump()
    said = refused(tables)
    ends = commissures(EXPERIMENTS[number][0])
    chords = np.linalg.norm(np.roll(ends, -1, 0) - np.roll(ends, -2, 0), axis=1)
    assert f"chords ({', '.join(f'{a:.6g}' for a in chords)}) mm" in said
    assert "template.free_edge_length (" in said


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"commissures": {"chord_ratio": [1.0, 1.0, 1.0001]}}, "chords ("),
        ({"cusp": [{}, {"template": {"thickness": 0.4}}, {}]}, "template.thickness (0.5, 0.4, 0.5"),
        ({"cusp": [{}, {}, {"suture_line": {"type": "B"}}]}, "suture_line.type (A, A, B)"),
    ],
)
def test_one_difference_is_enough(change: dict[str, Any], words: str) -> None:
    """Truth: a valve that is symmetric but for one entry is refused for that entry alone."""
    said = refused(change)
    assert words in said
    assert " and its " not in said


def test_symmetric_valves() -> None:
    """Truth: chords that are equal but for rounding, and equal cusps given one by one, will do."""
    for change in ({}, {"commissures": {"chord_ratio": [0.1 + 0.2, 0.3, 0.3]}}, {"cusp": [{}] * 3}):
        assert ValveInput.from_scene(parse_scene(change | METHOD)).wedges.is_fixed


def test_other_methods_ask_for_no_symmetry() -> None:
    """Truth: Experiment 2 has a valve by the other two methods."""
    tables = load_scene(DEMOS / "experiment_2.toml").model_dump()
    for method in ("bezier", "virtual_planes"):
        ValveInput.from_scene(parse_scene(tables | {"contact": {"method": method}}))
