"""The levels of a cusp, counted and put in order by hand."""

from __future__ import annotations

from itertools import groupby, pairwise
from typing import Any

import numpy as np
import pytest

from avneo_fem.scene import Scene, parse_scene
from avneo_fem.stages.levels import Level, levels_of
from mesh_cases import mesh_of

LAMBDAS = (0.0, 0.25, 0.5, 0.75, 1.0)
FINER = [mesh_of("experiment 1", 3.0)] * 2


def scene(bending: bool = True, **solver: Any) -> Scene:
    """A scene with or without bending."""
    return parse_scene({"material": {"bending": bending}, "solver": solver})


def counts(levels: list[Level]) -> list[tuple[str, int]]:
    """Stages in their order, with the number of their levels."""
    return [(name, len(list(group))) for name, group in groupby(level.name for level in levels)]


@pytest.mark.parametrize("refinements", [0, 1, 2])
@pytest.mark.parametrize("bending", [True, False])
def test_order_and_counts(bending: bool, refinements: int) -> None:
    """Truth: paper §3.2 and §3.4: placed, stitched in ten steps, hinged, clamped, wedge closed,
    then each refinement, and last the first row; nothing is clamped in a membrane."""
    levels = levels_of(scene(bending, clamp_steps=3), 4, LAMBDAS, FINER[:refinements])
    clamped = [("clamped_edge", 3)] if bending else []
    refined = [("refinement", refinements)] if refinements else []
    laid = [("first_row", 2)] if bending else []
    assert counts(levels) == [
        ("placement", 1),
        ("boundary", 10),
        ("hinged_edge", 1),
        *clamped,
        ("contact_wedge", 5),
        *refined,
        *laid,
    ]


@pytest.mark.parametrize("bending", [True, False])
def test_parameters(bending: bool) -> None:
    """Truth: each stage goes from 0 to 1 without a gap (the search to its k), the wedge from a
    level before 0, at which it appears, through every lambda."""
    levels = levels_of(scene(bending), 4, LAMBDAS, FINER)
    for name, group in groupby(levels, key=lambda level: level.name):
        stage = list(group)
        if name == "refinement":
            assert [(level.start, level.stop) for level in stage] == [(0.0, 1.0)] * 2
            continue
        first, last = {"placement": (0.0, 4.0), "contact_wedge": (-0.25, 1.0)}.get(name, (0.0, 1.0))
        assert (stage[0].start, stage[-1].stop) == (first, last)
        assert all(a.stop == pytest.approx(b.start, abs=1e-15) for a, b in pairwise(stage))
        steps = np.diff([first, *(level.stop for level in stage)])
        np.testing.assert_allclose(steps, (last - first) / len(stage))
    assert tuple(level.stop for level in levels if level.name == "contact_wedge") == LAMBDAS


@pytest.mark.parametrize("bending", [True, False])
def test_meshes(bending: bool) -> None:
    """Truth: all on the first mesh up to the refinements, each of which enters the next one; the
    first row is laid on the last; the mesh never goes back."""
    for refinements in range(3):
        levels = levels_of(scene(bending), 0, LAMBDAS, FINER[:refinements])
        refined = [level.mesh for level in levels if level.name == "refinement"]
        assert refined == list(range(1, refinements + 1))
        for level in levels:
            if level.name == "first_row":
                assert level.mesh == refinements
            elif level.name != "refinement":
                assert level.mesh == 0
        assert all(a.mesh <= b.mesh for a, b in pairwise(levels))


def test_fixed_wedge() -> None:
    """Truth: contact planes are there at once: one level, from 0 to 1."""
    levels = levels_of(scene(), 0, (1.0,))
    wedge = [level for level in levels if level.name == "contact_wedge"]
    assert wedge == [Level("contact_wedge", 0.0, 1.0)]


def test_levels_of_equal_input_are_equal() -> None:
    """Truth: levels are values; a checkpoint that counts them means the same in the next run."""
    assert levels_of(scene(), 3, LAMBDAS, FINER) == levels_of(scene(), 3, LAMBDAS, FINER)
    assert Level("boundary", 0.0, 0.1) != Level("boundary", 0.0, 0.1, 1)


def test_unloading() -> None:
    """Truth: where the way needs more pressure than P, it is let down on the last mesh, once all
    nodes are in place."""
    given = parse_scene({"diastolic_pressure": 0.0})
    names = [level.name for level in levels_of(given, 0, (0.0, 1.0), unloads=True)]
    assert names[-4:] == ["first_row", "first_row", "unloading", "unloading"]
    assert "unloading" not in [level.name for level in levels_of(given, 0, (0.0, 1.0))]
