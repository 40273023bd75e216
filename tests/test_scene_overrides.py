"""``--set KEY=VALUE``: what it replaces, and what it says of what it cannot read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from avneo_fem.errors import SceneError
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.scene_overrides import overridden, parse_overrides
from run_cases import avneo_inside
from valve_cases import DEMOS


def with_set(data: dict[str, Any], *texts: str) -> Any:
    """The nested dictionaries with these overrides."""
    return overridden(data, parse_overrides(texts))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a.b=0.5", 0.5),
        ("a.b = 3", 3),
        ("a.b=true", True),
        ('a.b="B"', "B"),
        ("a.b=B", "B"),
        ("a.b=st_venant_kirchhoff", "st_venant_kirchhoff"),
        ("a.b=[8, 9, 6]", [8, 9, 6]),
        ("a.b={c = 1}", {"c": 1}),
        ("a.b='x=y'", "x=y"),
    ],
)
def test_values(text: str, value: Any) -> None:
    """Truth: values are TOML's; a word without quotes is text."""
    assert parse_overrides([text]) == [(("a", "b"), value)]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "mesh.size",
        "=1",
        "mesh..size=1",
        ".a=1",
        "a b=1",
        "a=",
        "a=1 2",
        "a=two words",
        "a=1\nb=2",
    ],
)
def test_unreadable(text: str) -> None:
    """Truth: what is no KEY=VALUE is bad input, shown as it was given."""
    with pytest.raises(SceneError) as caught:
        parse_overrides([text])
    assert (caught.value.key, caught.value.value) == ("--set", text)
    assert "KEY=VALUE" in str(caught.value)


def test_overridden() -> None:
    """Truth: entries are replaced or added in order, others stay, the given tables too."""
    data = {"mesh": {"size": 0.7, "refinements": 1}, "name": "x"}
    found = with_set(data, "mesh.size=1.0", "solver.quality=approximate", "mesh.size=2.0")
    assert found == {
        "mesh": {"size": 2.0, "refinements": 1},
        "name": "x",
        "solver": {"quality": "approximate"},
    }
    assert data == {"mesh": {"size": 0.7, "refinements": 1}, "name": "x"}


def test_one_cusp() -> None:
    """Truth: an index means that cusp, whether or not the scene has [[cusp]] tables."""
    for data in ({}, {"cusp": [{}, {"template": {"corner_height": 11.0}}, {}]}):
        scene = parse_scene(with_set(data, "cusp.1.template.thickness=0.4"))
        assert [cusp.template.thickness for cusp in scene.cusp] == [0.5, 0.4, 0.5]
        assert scene.cusp[1].template.corner_height == (11.0 if data else 11.5)
    with pytest.raises(SceneError, match="exactly three"):
        parse_scene(with_set({}, "cusp.3.template.thickness=0.4"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh.siz=0.5", "mesh.siz = 0.5: unknown key; did you mean 'size'?"),
        ("mesh.size=-1", "mesh.size = -1: must be a finite number > 0"),
        ("mesh.size.x=1", "mesh.size = {'x': 1}: must be"),
        ("solver.quality=best", "solver.quality = 'best': must be \"equilibrium\""),
        ("mesh=3", "mesh = 3: must be a table"),
    ],
)
def test_bad_entries_are_named(text: str, message: str) -> None:
    """Truth: an entry from the command line is checked as one of the file."""
    with pytest.raises(SceneError) as caught:
        load_scene(DEMOS / "experiment_1.toml", overrides=[text])
    assert str(caught.value).startswith(message)


def test_command_line(tmp_path: Path) -> None:
    """Truth: ``--set`` wins over the file; what it breaks is one line and status 2."""
    scene = DEMOS / "experiment_1.toml"
    found = avneo_inside("check", scene, "--json", "--set", "root.radius=13.0")
    assert found.returncode == 0
    path = tmp_path / "larger.toml"
    path.write_text(scene.read_text().replace("radius = 12.0 # R", "radius = 13.0"))
    assert found.stdout == avneo_inside("check", path, "--json").stdout
    assert found.stdout != avneo_inside("check", scene, "--json").stdout
    for text, why in (("rot.radius=1", "did you mean 'root'"), ("root.radius", "KEY=VALUE")):
        for command in ("check", "suture"):
            process = avneo_inside(command, scene, "--set", text)
            assert (process.returncode, process.stdout) == (2, "")
            assert why in process.stderr
            assert len(process.stderr.splitlines()) == 1
