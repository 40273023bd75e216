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


def same_input(first: ValveInput, second: ValveInput) -> None:
    """Every number that a cusp is computed from is the same, to the last bit."""
    assert first.scene == second.scene
    for i in range(3):
        one, two = first.geometry.cusps[i], second.geometry.cusps[i]
        s = np.linspace(0.0, one.template.suture_length, 50)
        for name in ("sutured_position", "sutured_tangent", "sutured_conormal"):
            np.testing.assert_array_equal(getattr(one, name)(s), getattr(two, name)(s))
        points = np.random.default_rng(1).uniform(-11, 11, (50, 3))
        for lam in (0.0, 0.5, 1.0):
            fields = [given_.wedges.wedge(i, lam).evaluate(points) for given_ in (first, second)]
            for a, b in zip(*fields, strict=True):
                np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(
        first.geometry.commissures.points, second.geometry.commissures.points
    )
    np.testing.assert_array_equal(
        first.geometry.triple_contact.point, second.geometry.triple_contact.point
    )


def demo(number: int) -> ValveInput:
    """Input of one of the paper's experiments."""
    return ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))


def test_equal_cusps_see_the_same() -> None:
    """Truth: the three cusps of Experiment 1 are one cusp, turned: from each of them the valve is
    the same input bit by bit, which three cusps 120 degrees apart in one frame are not."""
    valve = demo(1)
    for index in range(3):
        same_input(valve.seen_from(index), valve)


@pytest.mark.parametrize("number", [2, 3])
def test_seen_from_itself_and_all_round(number: int) -> None:
    """Truth: cusp 0 sees the valve as it is; from cusp 1 and again from the next but one it is
    seen as at first; the chords and cusps come in the order in which they follow."""
    valve = demo(number)
    assert valve.seen_from(0) is valve
    same_input(valve.seen_from(1).seen_from(2), valve)
    same_input(valve.seen_from(1).seen_from(1), valve.seen_from(2))
    chords, cusps = valve.scene.commissures.chord_ratio, valve.scene.cusp
    for index in range(3):
        seen = valve.seen_from(index).scene
        for i in range(3):
            assert seen.commissures.chord_ratio[i] == chords[(index + i) % 3]
            assert seen.cusp[i] == cusps[(index + i) % 3]
        assert seen.root == valve.scene.root


@pytest.mark.parametrize("index", [1, 2])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_seen_from_a_cusp_it_is_the_same_valve(number: int, index: int) -> None:
    """Truth: a turn about the axis, found from the corners of the suture lines, takes the valve as
    a cusp sees it to the valve: all suture lines, commissures, C, and the distances to all wedges
    of all points; the templates are those of the cusps that follow."""
    valve = demo(number)
    seen = valve.seen_from(index)
    corner = [
        np.arctan2(*each.suture_line.ends[0, 1::-1])
        for each in (seen.geometry.cusps[0], valve.geometry.cusps[index])
    ]
    c, s = np.cos(corner[1] - corner[0]), np.sin(corner[1] - corner[0])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    points = np.random.default_rng(3).uniform(-11, 11, (200, 3))
    for i in range(3):
        own, true = seen.geometry.cusps[i], valve.geometry.cusps[(index + i) % 3]
        arc = np.linspace(0.0, own.template.suture_length, 60)
        for name in ("sutured_position", "sutured_tangent", "sutured_conormal"):
            np.testing.assert_allclose(
                getattr(own, name)(arc) @ turn.T, getattr(true, name)(arc), atol=1e-12
            )
        assert own.template.parameters == true.template.parameters
        np.testing.assert_allclose(
            turn @ seen.geometry.commissures.points[i],
            valve.geometry.commissures.points[(index + i) % 3],
            atol=1e-12,
        )
        for lam in (0.0, 0.4, 1.0):
            np.testing.assert_allclose(
                seen.wedges.wedge(i, lam).evaluate(points)[0],
                valve.wedges.wedge((index + i) % 3, lam).evaluate(points @ turn.T)[0],
                atol=1e-9,
            )
    np.testing.assert_allclose(
        turn @ seen.geometry.triple_contact.point,
        valve.geometry.triple_contact.point,
        atol=1e-9,
    )


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
