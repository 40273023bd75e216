"""A scene with its geometry: what belongs together, and that nothing impossible gets through."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.scene import load_scene, parse_scene
from valve_cases import DEMOS


@pytest.mark.parametrize("number", [1, 2, 3])
def test_wedges_are_those_of_the_geometry(number: int) -> None:
    """Truth: design.md §1's sigma*; the curves end in the commissures and meet in C; lambda = 1
    joins A_(i+1), C and A_(i+2)."""
    given_input = ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))
    expected = {1: [1.2387] * 3, 2: [0.9715, 2.7451, 2.1577], 3: [0.0303, 0.0860, 0.1059]}[number]
    np.testing.assert_allclose(given_input.wedges.sigma, expected, atol=1e-4)
    points = given_input.geometry.commissures.points
    centre = given_input.geometry.triple_contact.point
    for i in range(3):
        joints = np.array([points[(i + 1) % 3], centre, points[(i + 2) % 3]])
        distance = given_input.wedges.wedge(i, 1.0).evaluate(joints)[0]
        np.testing.assert_allclose(distance, 0.0, atol=1e-9)


def test_omega_is_the_scenes() -> None:
    """Truth: sigma* depends on omega, which the scene gives."""
    default = ValveInput.from_scene(parse_scene({}))
    other = ValveInput.from_scene(parse_scene({"contact": {"omega": 0.3}}))
    assert other.wedges.omega == 0.3
    assert np.abs(other.wedges.sigma - default.wedges.sigma).min() > 1e-3


def test_wedges_that_cross_are_found_at_once() -> None:
    """Truth: half way the two contact curves of cusp 0 of this valve cross, which leaves no room
    for it; `avneo check` has to say so, not a run after minutes."""
    sizes = ((33.5, 15.05), (38.84, 17.45), (51.56, 20.57))
    scene = {
        "commissures": {"chord_ratio": [5.32, 4.7, 8.85]},
        "cusp": [{"template": {"free_edge_length": x, "belly_radius": r}} for x, r in sizes],
    }
    with pytest.raises(SceneError, match=r"free_edge_length = .* cross each other at lambda"):
        ValveInput.from_scene(parse_scene(scene))


@st.composite
def scenes(draw: Any) -> dict[str, Any]:
    """Whatever the schema allows, plausible or not."""

    def numbers(low: float, high: float) -> float:
        return draw(st.floats(low, high))

    cusps = [
        {
            "template": {
                "free_edge_length": numbers(5, 80),
                "belly_radius": numbers(2, 40),
                "free_edge_height": numbers(-15, 10),
                "corner_height": numbers(1, 20),
            },
            "suture_line": {
                "type": draw(st.sampled_from("AB")),
                "belly_depth": numbers(1, 20),
                "skew": numbers(0.55, 0.95),
                "ellipse_end_degrees": numbers(95, 175),
            },
        }
        for _ in range(3)
    ]
    return {
        "commissures": {
            "chord_ratio": [numbers(0.5, 2) for _ in range(3)],
            "gap": numbers(0, 3),
        },
        "stitching": {"gather_ratio": numbers(1.1, 6)},
        "cusp": cusps,
    }


@settings(max_examples=150, deadline=None)
@given(scenes())
def test_anything_is_either_built_or_a_scene_error(data: dict[str, Any]) -> None:
    """Truth: no other exception and no warning for any scene that the schema allows; what is built
    is finite and has a wedge for every lambda of the run."""
    built: ValveInput | SceneError
    try:
        built = ValveInput.from_scene(parse_scene(data))
    except SceneError as error:
        built = error
    if isinstance(built, SceneError):
        assert built.key
        assert built.valid
        assert "\n" not in str(built)
        return
    assert np.isfinite(built.geometry.triple_contact.point).all()
    assert np.isfinite(built.wedges.sigma).all()
    lowest = np.array([[0.0, 0.0, -5.0]])
    for i in range(3):
        for lam in (0.0, 0.3, 1.0):
            assert np.isfinite(built.wedges.wedge(i, lam).evaluate(lowest)[0]).all()
