"""The schema, its file and its errors against the paper's Experiment 1 and what users mistype."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from avneo_fem.errors import AvneoError, SceneError, SolveError
from avneo_fem.scene import FIDELITIES, Mesh, Scene, Solver, load_scene, parse_scene

DEMOS = Path(__file__).parents[1] / "demos"
NUMBERS = {
    (table, key)
    for table, entries in Scene().model_dump().items()
    if isinstance(entries, dict)
    for key, value in entries.items()
    if isinstance(value, float) or value is None
} | {("template", key) for key in Scene().cusp[0].template.model_dump()}


def refused(data: Any) -> SceneError:
    """The error a scene raises; it must be one line that holds key, value and advice."""
    with pytest.raises(SceneError) as caught:
        parse_scene(data)
    error, text = caught.value, str(caught.value)
    assert len(text.splitlines()) == 1
    assert text.startswith(f"{error.key} = ")
    assert text.endswith(f": {error.valid}")
    assert error.valid
    return error


def test_defaults_are_experiment_1() -> None:
    """Truth: sections 4.1 and 4.2 and Table 1 of the paper, as design.md section 1 reads them."""
    scene = Scene()
    assert parse_scene({}) == scene
    assert (scene.root.radius, scene.commissures.gap, scene.diastolic_pressure) == (12.0, 0.5, 8.0)
    assert scene.commissures.chord_ratio == (1.0, 1.0, 1.0)
    template, line = scene.cusp[0].template, scene.cusp[0].suture_line
    assert list(template.model_dump().values()) == [39.0, 2.5, 11.5, 16.5, 0.5]
    assert (line.type, line.commissure_height, line.belly_depth) == ("A", 2.5, 10.0)
    assert (line.skew, line.ellipse_end_degrees) == (0.8, 135.0)
    assert scene.stitching.gather_ratio == 3.0
    assert scene.material.young_modulus == 1000.0
    assert (scene.free_edge.stiffness, scene.free_edge.width) == (80.0, 0.1)
    assert (scene.contact.stiffness, scene.contact.width, scene.contact.omega) == (16.0, 0.1, 0.5)
    # not Table 1's 8 kPa and 0.5 mm: docs/scene.md says why
    assert (scene.wall.stiffness, scene.wall.width) == (64.0, 0.1)
    assert (scene.mesh.size, scene.contact.steps) == (0.7, 10)
    assert (scene.layer_clearance(0.5), scene.layers_unrestricted(0.5)) == (0.25, 2.0)
    assert (scene.placement.c0, scene.placement.c1) == (1.0, 0.1)
    assert (scene.competence.minimum_nu, scene.competence.maximum_nu) == (0.5, 1.05)
    assert scene.cusp[1] == scene.cusp[2] == scene.cusp[0]


def test_demos_load() -> None:
    """Truth: the demo of Experiment 1 is the default scene but for its name; 2 and 3 are read."""
    first = load_scene(DEMOS / "experiment_1.toml")
    assert first == Scene(name="experiment-1")
    second = load_scene(DEMOS / "experiment_2.toml")
    assert [cusp.template.free_edge_length for cusp in second.cusp] == [58.5, 39.0, 48.75]
    assert {cusp.suture_line.type for cusp in second.cusp} == {"B"}
    third = load_scene(DEMOS / "experiment_3.toml")
    assert third.commissures.chord_ratio == (6.0, 4.0, 5.0)
    assert {cusp.template.corner_height for cusp in third.cusp} == {11.5}


@pytest.mark.parametrize(
    ("data", "key", "near"),
    [
        ({"rooot": {}}, "rooot", "root"),
        ({"templat": {}}, "templat", "template"),
        ({"suture_lines": {}}, "suture_lines", "suture_line"),
        ({"root": {"radios": 1.0}}, "root.radios", "radius"),
        ({"template": {"thicknes": 1.0}}, "template.thicknes", "thickness"),
        ({"suture_line": {"typ": "A"}}, "suture_line.typ", "type"),
        ({"cusp": [{}, {"tmplate": {}}, {}]}, "cusp.1.tmplate", "template"),
        (
            {"cusp": [{}, {}, {"template": {"bely_radius": 1.0}}]},
            "cusp.2.template.bely_radius",
            "belly_radius",
        ),
    ],
)
def test_unknown_key_suggests_the_nearest(data: dict[str, Any], key: str, near: str) -> None:
    """Truth: what the user most likely meant, at every depth of the file."""
    error = refused(data)
    assert (error.key, error.valid) == (key, f"unknown key; did you mean {near!r}?")


@pytest.mark.parametrize(
    ("data", "known"),
    [
        ({"zzz": 1}, ["root", "template", "suture_line", "cusp", "name"]),
        ({"template": {"zzz": 1}}, ["belly_radius", "thickness"]),
        ({"cusp": [{"zzz": 1}, {}, {}]}, ["suture_line", "template"]),
        ({"root": {'a\n"b': 1}}, ["radius"]),
    ],
)
def test_unknown_key_without_a_near_one(data: dict[str, Any], known: list[str]) -> None:
    """Truth: with nothing near, the keys of that table are listed; odd keys stay on one line."""
    listed = refused(data).valid.removeprefix("unknown key; known keys: ").split(", ")
    assert set(known) <= set(listed)
    assert listed == sorted(listed)


@pytest.mark.parametrize(
    ("data", "key", "value", "valid"),
    [
        ({"root": {"radius": "12"}}, "root.radius", "12", "a finite number > 0 (R,"),
        ({"root": {"radius": True}}, "root.radius", True, "a finite number > 0"),
        ({"root": {"radius": -1}}, "root.radius", -1, "a finite number > 0"),
        ({"root": {"radius": 0.0}}, "root.radius", 0.0, "a finite number > 0"),
        ({"root": {"radius": "a\nb"}}, "root.radius", "a\nb", "a finite number > 0"),
        ({"root": 3}, "root", 3, "a table"),
        ({"template": 3}, "template", 3, "a table"),
        ({"cusp": [{}, {"template": 3}, {}]}, "cusp.1.template", 3, "a table"),
        ({"cusp": [{}, 3, {}]}, "cusp.1", 3, "a [[cusp]] table"),
        ({"cusp": [{}, {}]}, "cusp", [{}, {}], "exactly three [[cusp]] tables"),
        ({"cusp": {"template": {}}}, "cusp", {"template": {}}, "exactly three [[cusp]] tables"),
        ({"template": {"thickness": -1}}, "template.thickness", -1, "a finite number > 0 (H,"),
        (
            {"cusp": [{}, {}, {"template": {"thickness": 0}}]},
            "cusp.2.template.thickness",
            0,
            "a finite number > 0",
        ),
        (
            {"commissures": {"chord_ratio": [1, 2]}},
            "commissures.chord_ratio",
            [1, 2],
            "an array of 3, each a finite number > 0",
        ),
        (
            {"commissures": {"chord_ratio": [1, 2, 3, 4]}},
            "commissures.chord_ratio",
            [1, 2, 3, 4],
            "an array of 3",
        ),
        ({"commissures": {"chord_ratio": 3}}, "commissures.chord_ratio", 3, "an array of 3"),
        (
            {"commissures": {"chord_ratio": [1, "a", 3]}},
            "commissures.chord_ratio.1",
            "a",
            "a finite number > 0",
        ),
        ({"commissures": {"gap": -0.1}}, "commissures.gap", -0.1, "a finite number >= 0"),
        ({"suture_line": {"skew": 0.5}}, "suture_line.skew", 0.5, "> 0.5 and < 1"),
        ({"suture_line": {"type": "C"}}, "suture_line.type", "C", '"A" or "B"'),
        ({"contact": {"steps": 1.5}}, "contact.steps", 1.5, "an integer >= 1"),
        ({"contact": {"steps": 0}}, "contact.steps", 0, "an integer >= 1"),
        ({"contact": {"clearance": -1}}, "contact.clearance", -1, ">= 0, or left out"),
        ({"layers": {"unrestricted": -1}}, "layers.unrestricted", -1, ">= 0, or left out"),
        ({"material": {"bending": 1}}, "material.bending", 1, "true or false"),
        ({"fidelity": "best"}, "fidelity", "best", '"draft" or "standard"'),
        ({"name": ""}, "name", "", "letters, digits"),
        ({"name": "../x"}, "name", "../x", "letters, digits"),
        ({"solver": {"smallest_step": 1.5}}, "solver.smallest_step", 1.5, "> 0 and <= 1"),
        ([], "scene", [], "must be a table"),
    ],
)
def test_wrong_values(data: Any, key: str, value: object, valid: str) -> None:
    """Truth: key as the user wrote it, the value itself, and the range the schema allows."""
    error = refused(data)
    assert (error.key, error.value) == (key, value)
    assert valid in error.valid


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("table", "key"), sorted(NUMBERS))
def test_numbers_are_finite(table: str, key: str, value: float) -> None:
    """Truth: no length, stress or ratio may be nan or infinite; none slips through a bound."""
    assert refused({table: {key: value}}).key == f"{table}.{key}"


def test_long_values_are_cut_in_the_message() -> None:
    """Truth: the message stays readable, the value itself is kept whole."""
    error = refused({"root": {"radius": 10**400}})
    assert error.value == 10**400
    assert len(str(error)) < 250


def test_overrides_merge() -> None:
    """Truth: a cusp's table replaces single entries of the common one, which replace defaults."""
    scene = parse_scene(
        {
            "template": {"belly_radius": 15.0, "thickness": 0.4},
            "suture_line": {"type": "B"},
            "cusp": [
                {},
                {"template": {"thickness": 0.6}},
                {"suture_line": {"type": "A", "belly_depth": 9.0}},
            ],
        }
    )
    assert [cusp.template.belly_radius for cusp in scene.cusp] == [15.0] * 3
    assert [cusp.template.thickness for cusp in scene.cusp] == [0.4, 0.6, 0.4]
    assert [cusp.template.corner_height for cusp in scene.cusp] == [11.5] * 3
    assert [cusp.suture_line.type for cusp in scene.cusp] == ["B", "B", "A"]
    assert [cusp.suture_line.belly_depth for cusp in scene.cusp] == [10.0, 10.0, 9.0]


def test_input_is_left_alone() -> None:
    """Truth: parsing does not change the dictionaries it is given."""
    data = {"template": {"thickness": 0.4}, "cusp": [{}, {"template": {"thickness": 1.0}}, {}]}
    before = json.dumps(data)
    parse_scene(data)
    assert json.dumps(data) == before


positive = st.floats(1e-3, 1e3)


@given(st.tuples(positive, positive, positive), positive, st.none() | positive, st.booleans())
def test_round_trip(
    ratio: tuple[float, float, float], size: float, clearance: float | None, bending: bool
) -> None:
    """Truth: a dumped scene, also by way of JSON, parses to an equal scene."""
    scene = parse_scene(
        {
            "name": "round-trip_1.0",
            "commissures": {"chord_ratio": list(ratio)},
            "cusp": [{}, {"template": {"thickness": size}}, {"suture_line": {"type": "B"}}],
            "wall": {"clearance": clearance},
            "material": {"bending": bending},
        }
    )
    assert parse_scene(scene.model_dump()) == scene
    assert parse_scene(json.loads(scene.model_dump_json())) == scene


@pytest.mark.parametrize("demo", sorted(DEMOS.glob("*.toml")), ids=lambda path: path.stem)
def test_round_trip_of_demos(demo: Path) -> None:
    """Truth: what a report stores of a demo is that demo."""
    scene = load_scene(demo)
    assert parse_scene(json.loads(scene.model_dump_json())) == scene


def test_scenes_are_immutable_and_built_in_code() -> None:
    """Truth: a scene in use cannot be changed; the constructor applies the same checks."""
    scene = Scene(mesh=Mesh(size=1.0))
    with pytest.raises(ValidationError, match="frozen"):
        scene.mesh.size = 2.0  # type: ignore[misc]
    with pytest.raises(ValidationError, match="greater than 0"):
        Mesh(size=-1.0)


def test_fidelity_scales_the_mesh(tmp_path: Path) -> None:
    """Truth: draft, standard, fine, reference are h times 2, 1, 0.7, 0.5; the argument wins."""
    path = tmp_path / "some_valve.toml"
    path.write_text('fidelity = "fine"\nmesh.size = 0.8\n', encoding="utf-8")
    assert load_scene(path).mesh_size == pytest.approx(0.56)
    sizes = {name: load_scene(path, name).mesh_size for name in FIDELITIES}
    expected = {"draft": 1.6, "standard": 0.8, "fine": 0.56, "reference": 0.4}
    assert sizes == pytest.approx(expected)
    with pytest.raises(SceneError, match="fidelity = 'best'"):
        load_scene(path, "best")


def test_a_bundle_gives_defaults_only(tmp_path: Path) -> None:
    """Truth: what a scene states wins over its fidelity, in a file, by tables in code and by
    ``--set``; the rest of the bundle holds."""
    table, entries = next(iter(FIDELITIES["draft"].entries.items()))
    key, value = next(iter(entries.items()))
    assert (table, key, value) == ("solver", "quality", "approximate")
    assert parse_scene({"fidelity": "draft"}).solver.quality == "approximate"
    assert Scene(fidelity="draft").solver.quality == "approximate"
    stated = {"fidelity": "draft", "solver": {"quality": "equilibrium"}}
    assert parse_scene(stated).solver.quality == "equilibrium"
    in_code = Scene(fidelity="draft", solver=Solver(tolerance=1e-6))
    assert (in_code.solver.quality, in_code.solver.tolerance) == ("approximate", 1e-6)
    in_code = Scene(fidelity="draft", solver=Solver(quality="equilibrium"))
    assert in_code.solver.quality == "equilibrium"
    path = tmp_path / "valve.toml"
    path.write_text("", encoding="utf-8")
    scene = load_scene(path, "draft", ["solver.quality=equilibrium", "mesh.size=1.0"])
    assert (scene.solver.quality, scene.mesh_size) == ("equilibrium", 2.0)


@pytest.mark.parametrize("name", FIDELITIES)
def test_a_dumped_scene_of_any_fidelity_is_that_scene(name: str) -> None:
    """Truth: no factor and no default is applied twice, and every entry of a bundle exists."""
    scene = parse_scene({"fidelity": name, "mesh": {"size": 0.8}})
    again = parse_scene(json.loads(scene.model_dump_json()))
    assert (again, again.mesh_size) == (scene, scene.mesh_size)
    for table, entries in FIDELITIES[name].entries.items():
        assert scene.model_dump()[table] | dict(entries) == scene.model_dump()[table]
    plain = Scene().model_dump()
    assert all(plain[t][k] != v for t, e in FIDELITIES[name].entries.items() for k, v in e.items())


@pytest.mark.parametrize("data", [{"solver": 3}, {"fidelity": []}, {"fidelity": "best"}])
def test_a_bundle_hides_no_error(data: dict[str, Any]) -> None:
    """Truth: a table that is none, or a fidelity that does not exist, is named as written."""
    key, value = next(iter(data.items()))
    for fidelity in ({"fidelity": "draft"}, {}):
        error = refused({**fidelity, **data})
        assert error.key == key
        assert error.value in (value, tuple(value) if isinstance(value, list) else value)


def test_a_file_without_a_name_is_named_after_itself(tmp_path: Path) -> None:
    """Truth: the stem of the file, underscores as hyphens; a name inside the file wins."""
    path = tmp_path / "some_valve.toml"
    path.write_text("", encoding="utf-8")
    assert load_scene(path).name == "some-valve"
    path.write_text('name = "other"', encoding="utf-8")
    assert load_scene(str(path)).name == "other"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"radius = ", "not valid TOML"),
        (b"[root]\nradius = 1\nradius = 2\n", "not valid TOML"),
        (b"name = '\xff'", "not valid TOML"),
        (b"mesh.size = 1" + b"0" * 5000, "not valid TOML"),
        (None, "No such file"),
    ],
)
def test_unreadable_files(tmp_path: Path, content: bytes | None, words: str) -> None:
    """Truth: missing files, broken TOML and broken text are one line that names the file."""
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SceneError, match=words) as caught:
        load_scene(path)
    assert caught.value.value == str(path)
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(SceneError, match="cannot be read"):
        load_scene(tmp_path)


def test_errors_carry_their_exit_status() -> None:
    """Truth: 2 for bad input, 1 for a failed solve (design.md section 2); errors can be sent."""
    assert (AvneoError.exit_status, SolveError.exit_status, SceneError.exit_status) == (1, 1, 2)
    error = SceneError("root.radius", -1.0, "must be positive")
    assert str(error) == "root.radius = -1.0: must be positive"
    copy = pickle.loads(pickle.dumps(error))
    assert (copy.key, copy.value, copy.valid) == ("root.radius", -1.0, "must be positive")
    assert str(copy) == str(error)
