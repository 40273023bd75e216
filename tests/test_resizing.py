"""Quasi-optimal sizes of a scene's cusps, and the valve rebuilt with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from avneo_fem.errors import SceneError
from avneo_fem.geometry.resizing import Resizing, resize, resized_scene
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import load_scene, parse_scene
from test_sizing import dilation
from test_valve_input import scenes
from valve_cases import DEMOS, SCENES


def sizes_of(tables: dict[str, Any]) -> Resizing:
    return resize(parse_scene(tables))


@pytest.mark.parametrize("number", [1, 2, 3])
def test_quasi_optimal_and_rebuilt(number: int) -> None:
    """Truth: L_f = 2 a / sqrt(3) with R_s in proportion (§4.4); nu* of the rebuilt valve is alpha
    sqrt(3)/2 with alpha in closed form, and that of the shortest lengths is 1."""
    scene = load_scene(DEMOS / f"experiment_{number}.toml")
    found = resize(scene)
    chords = ValveGeometry.from_scene(scene).commissures.chord_lengths
    np.testing.assert_allclose(found.quasi_optimal, 2.0 * chords / np.sqrt(3.0), rtol=1e-14)
    np.testing.assert_allclose(
        found.radii / found.quasi_optimal, found.present_radii / found.present
    )
    np.testing.assert_array_equal(found.rebuilt.commissure_lengths, found.quasi_optimal)
    expected = dilation(chords) * np.sqrt(3.0) / 2.0
    assert found.rebuilt.triple_contact.nu_star == pytest.approx(expected, rel=1e-12)
    assert found.verified
    shortest = ValveGeometry.from_scene(resized_scene(scene, found.closing))
    assert shortest.triple_contact.nu_star == pytest.approx(1.0, rel=1e-12)
    assert shortest.competent
    assert found.present_nu == pytest.approx({1: 0.6153, 2: 0.6031, 3: 0.9859}[number], abs=6e-5)


def test_experiment_3_is_quasi_optimal() -> None:
    """Truth: the paper's Experiment 3 was sized by Proposition 3.2: nothing to change."""
    found = resize(load_scene(DEMOS / "experiment_3.toml"))
    np.testing.assert_allclose(found.quasi_optimal, found.present, atol=1e-8)
    np.testing.assert_allclose(found.radii, found.present_radii, atol=1e-8)


def test_all_else_is_kept() -> None:
    """Truth: resizing changes L_f, R_s and the policy, whatever else the scene says."""
    tables = SCENES[2] | {"competence": {"policy": "error"}, "mesh": {"size": 0.3}}
    scene = parse_scene(tables)
    other = resized_scene(scene, [30.0, 20.0, 25.0])
    back = resized_scene(other, [58.5, 39.0, 48.75]).model_dump()
    back["competence"]["policy"] = "error"
    for cusp in back["cusp"]:
        cusp["template"]["belly_radius"] = pytest.approx(cusp["template"]["belly_radius"])
    assert scene.model_dump() == back
    assert [cusp.template.free_edge_length for cusp in other.cusp] == [30.0, 20.0, 25.0]
    assert other.cusp[0].template.belly_radius == pytest.approx(24.75 * 30.0 / 58.5)


def test_scale_invariance() -> None:
    """Truth: a valve of twice the size has cusps of twice the size and the same nu*."""
    small, large = (
        sizes_of(
            {
                "root": {"radius": 12.0 * u},
                "commissures": {"chord_ratio": [6, 4, 5], "gap": 0.5 * u},
                "template": {
                    "free_edge_length": 39.0 * u,
                    "free_edge_height": 2.5 * u,
                    "corner_height": 11.5 * u,
                    "belly_radius": 16.5 * u,
                },
                "suture_line": {"commissure_height": 2.5 * u, "belly_depth": 10.0 * u},
            }
        )
        for u in (1.0, 2.0)
    )
    for name in ("chord_lengths", "quasi_optimal", "closing", "radii"):
        np.testing.assert_allclose(getattr(large, name), 2.0 * getattr(small, name), rtol=1e-12)
    assert large.rebuilt.triple_contact.nu_star == pytest.approx(
        small.rebuilt.triple_contact.nu_star, rel=1e-12
    )
    assert large.present_nu == pytest.approx(small.present_nu, rel=1e-12)


def test_present_cusps_need_not_be_possible() -> None:
    """Truth: sizes are asked for when the present ones do not work: too long for the suture line;
    one free edge longer than the other two together, which is said."""
    long = sizes_of({"template": {"free_edge_length": 130.0, "belly_radius": 55.0}})
    assert long.verified
    assert long.present_nu == pytest.approx(0.6153 * 39.0 / 130.0, abs=1e-4)
    odd = sizes_of(
        {"cusp": [{"template": {"free_edge_length": 90.0, "belly_radius": 40.0}}, {}, {}]}
    )
    assert odd.present_nu is None
    assert odd.present_problem is not None
    assert "cusp.0.template.free_edge_length = 90.0" in odd.present_problem
    assert odd.verified


def test_limits_of_the_scene_decide() -> None:
    """Truth: nu* = 0.9859 of Experiment 3's root is below a nu_min of 0.99: not verified."""
    ratio = {"commissures": {"chord_ratio": [6.0, 4.0, 5.0]}}
    assert sizes_of(ratio | {"competence": {"minimum_nu": 0.98}}).verified
    assert not sizes_of(ratio | {"competence": {"minimum_nu": 0.99, "policy": "error"}}).verified
    # nu* = 1 but for rounding is within a nu_max of 1
    assert sizes_of({"competence": {"maximum_nu": 1.0}}).verified


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"template": {"corner_height": 2.0}}, "change corner_height or belly_radius"),
        ({"template": {"corner_height": 90.0}}, "is the quasi-optimal size"),
        ({"commissures": {"chord_ratio": [1.0, 1.0, 3.0]}}, "must form a triangle"),
        ({"commissures": {"gap": 26.0}}, "leaves no room"),
    ],
)
def test_errors(tables: dict[str, Any], words: str) -> None:
    """Truth: a root without room, and quasi-optimal cusps that would not fit, in one line."""
    with pytest.raises(SceneError, match=words) as caught:
        sizes_of(tables)
    assert "\n" not in str(caught.value)


@settings(max_examples=60, deadline=None)
@given(scenes())
def test_anything_is_either_sized_or_a_scene_error(data: dict[str, Any]) -> None:
    """Truth: Proposition 3.2 for every root that the schema allows: nu* <= 1 inside the triangle,
    whatever the present cusps are; else one line says why not."""
    found: Resizing | SceneError
    try:
        found = sizes_of(data)
    except SceneError as error:
        found = error
    if isinstance(found, SceneError):
        assert "\n" not in str(found)
        return
    triple = found.rebuilt.triple_contact
    assert triple.case == "interior"
    assert np.sqrt(3.0) / 2.0 - 1e-9 <= triple.nu_star <= 1.0 + 1e-9
    assert found.verified
    assert (found.present_nu is None) == (found.present_problem is not None)
    assert np.all(found.closing <= found.quasi_optimal * (1.0 + 1e-9))
