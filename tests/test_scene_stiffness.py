"""Stiffnesses that are not stated follow E."""

from __future__ import annotations

import pytest

from avneo_fem.scene import Scene, parse_scene, scaled_scene
from avneo_fem.scene_method import Material, Wall


def test_table_1_as_it_stands() -> None:
    """Truth: with Table 1's E = 1000 kPa the defaults are those of the schema."""
    assert parse_scene({"material": {"young_modulus": 1000.0}}) == Scene()
    assert Scene().free_edge.stiffness == 80.0


def test_same_valve_in_other_units_of_stress() -> None:
    """Truth: E and P a hundred times as large, all else left out, is the same scene in other
    units, every stiffness included."""
    stiff = parse_scene({"diastolic_pressure": 800.0, "material": {"young_modulus": 1e5}})
    assert scaled_scene(stiff) == scaled_scene(Scene(), stress=100.0)


@pytest.mark.parametrize("in_code", [True, False])
def test_what_is_stated_stays(in_code: bool) -> None:
    """Truth: a stated stiffness wins, also where it equals the schema's default; others follow."""
    if in_code:
        scene = Scene(material=Material(young_modulus=10.0), wall=Wall(stiffness=64.0))
    else:
        scene = parse_scene({"material": {"young_modulus": 10.0}, "wall": {"stiffness": 64.0}})
    assert scene.wall.stiffness == 64.0
    assert scene.wall.maximum_stiffness == pytest.approx(1e4)
    assert scene.clamp.stiffness == pytest.approx(100.0)
    assert parse_scene(scene.model_dump(mode="json")) == scene
