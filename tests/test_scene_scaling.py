"""Scenes in other units: every entry times its unit, nothing left to a default."""

from __future__ import annotations

import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.scene import Scene, parse_scene, scaled_scene
from avneo_fem.scene_fields import entry_schema
from avneo_fem.scene_scaling import unit_of
from avneo_fem.valve.suture_valve import mesh_templates


def test_units_of_entries() -> None:
    """Truth: units as docs/scene.md has them; a number in brackets is no unit."""
    for path, unit in (
        (("template", "thickness"), "mm"),
        (("cusp", 1, "suture_line", "belly_depth"), "mm"),
        (("clamp", "stiffness"), "mN"),
        (("clamp", "tolerance_degrees"), "degrees"),
        (("layers", "stiffness"), "kPa"),
        (("contact", "method"), ""),
        (("solver", "barrier_stiffness"), ""),
        (("diastolic_pressure",), "kPa"),
    ):
        assert unit_of(entry_schema(path) or {}) == unit


def test_nothing_is_left_to_a_default() -> None:
    """Truth: what follows from H and h is stated, and scales; the scaled scene is valid."""
    scene = parse_scene({"mesh": {"size": 1.5}})
    data = scaled_scene(scene, 1e-3, 1e3)
    scaled = parse_scene(data)
    for table in ("contact", "wall", "layers", "solver", "mesh"):
        assert None not in getattr(scaled, table).model_dump().values()
    assert scaled.contact.clearance == pytest.approx(0.25e-3)
    assert scaled.wall.taper == pytest.approx(3e-3)  # 2 h, more than 5 H
    assert scaled.layers.unrestricted == pytest.approx(2e-3)
    assert scaled.solver.barrier_distance == pytest.approx(0.15e-3)
    assert scaled.inside_tolerance(1.0) == pytest.approx(5e-6)
    assert scaled.refinements == scene.refinements == 1
    assert scaled.clamp.stiffness == pytest.approx(1e4 * 1e3 * 1e-6)
    assert scaled.solver.tolerance == scene.solver.tolerance


def test_there_and_back() -> None:
    """Truth: times 2^k and back again is the same scene, to the last bit."""
    scene = parse_scene(scaled_scene(Scene()))
    there = parse_scene(scaled_scene(scene, 2.0**10, 2.0**-3))
    assert there.root.radius == 12.0 * 2.0**10
    assert parse_scene(scaled_scene(there, 2.0**-10, 2.0**3)) == scene


def test_cusps_of_several_thicknesses() -> None:
    """Truth: their clearances have no common number, so that is an error."""
    cusps = [{"template": {"thickness": h}} for h in (0.5, 0.5, 0.4)]
    with pytest.raises(SceneError, match="must be the same for all cusps"):
        scaled_scene(parse_scene({"cusp": cusps}), 2.0)


@pytest.mark.parametrize("length", [1e-3, 0.0254, 1e3, 2.0**-10])
def test_meshes_scale(length: float) -> None:
    """Truth: nested meshes of the same template in another unit: same triangles, same points."""
    scene = parse_scene({"mesh": {"size": 1.5}})
    other = parse_scene(scaled_scene(scene, length))
    first, second = (mesh_templates(ValveInput.from_scene(each))[0] for each in (scene, other))
    for mesh, scaled in zip(first, second, strict=True):
        assert (scaled.triangles == mesh.triangles).all()
        assert scaled.points / length == pytest.approx(mesh.points, abs=1e-12)
