"""Contact planes: the wedges of contact.method = "virtual_planes" and "symmetry_planes"."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.containment import wedge_distance
from avneo_fem.results.report import geometry_report
from avneo_fem.results.verification_input import constraints_of
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.valve.congruence import representatives
from contact_wedge_cases import EXPERIMENTS, commissures, inputs
from valve_cases import DEMOS, SCENES

PLANES = ("virtual_planes", "symmetry_planes")


def family(number: int, method: str = "virtual_planes") -> ContactWedgeFamily:
    flat, centre, lengths = inputs(number)
    return ContactWedgeFamily(CommissurePlane(flat), centre, lengths, method=method)


def probes(seed: int, count: int = 3000) -> np.ndarray:
    random = np.random.default_rng(seed)
    points = random.uniform(-16, 16, (count, 3))
    points[::3] *= [1e-3, 1e-3, 1.0]  # about the circumcentre too
    return points


def sector_distance(points: np.ndarray, apex: np.ndarray, first: np.ndarray, second: np.ndarray):
    """Closed form: d of the sector between the half-lines apex-first and apex-second, which runs
    counter-clockwise from the one to the other; they go on beyond their points for ever."""
    offset = points[:, :2] - apex
    legs = [(end - apex) / np.hypot(*(end - apex)) for end in (first, second)]
    away = []
    for leg in legs:
        along = np.maximum(offset @ leg, 0.0)
        away.append(np.hypot(*(offset - along[:, None] * leg).T))
    side = [leg[0] * offset[:, 1] - leg[1] * offset[:, 0] for leg in legs]
    turn = legs[0][0] * legs[1][1] - legs[0][1] * legs[1][0]
    left, right = side[0] > 0, side[1] < 0
    inside = left & right if turn > 0 else left | right
    return np.where(inside, 1.0, -1.0) * np.minimum(*away)


@pytest.mark.parametrize("number", EXPERIMENTS)
@pytest.mark.parametrize("cusp", [0, 1, 2])
def test_virtual_planes_in_closed_form(number: int, cusp: int) -> None:
    """Truth: distance, gradient and Hessian of the planar sector A_(i+1) - C - A_(i+2) with its
    extensions; in Experiment 2 C is on a side, which makes cusp 1's a half-plane."""
    ends, centre = commissures(EXPERIMENTS[number][0]), inputs(number)[1][:2]
    points = probes(number + cusp)
    points[1::3, :2] = centre + points[1::3, :2] * 1e-6  # and next to the apex
    wedge = family(number).wedge(cusp, 1.0)
    first, second = ends[(cusp + 1) % 3], ends[(cusp + 2) % 3]
    exact = sector_distance(points, centre, first, second)
    distance, gradient, hessian = wedge.evaluate(points)
    np.testing.assert_allclose(distance, exact, atol=3e-14)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-14)
    assert not gradient[:, 2].any()
    foot = points[:, :2] - distance[:, None] * gradient[:, :2]
    np.testing.assert_allclose(sector_distance(foot, centre, first, second), 0.0, atol=1e-13)
    at_apex = np.linalg.norm(foot - centre, axis=1) < 1e-12
    np.testing.assert_allclose(hessian[~at_apex], 0.0, atol=1e-13)
    trace = np.trace(hessian, axis1=1, axis2=2)
    np.testing.assert_allclose((trace * distance)[at_apex], 1.0, atol=1e-6)


@pytest.mark.parametrize("cusp", [0, 1, 2])
def test_symmetry_planes_in_closed_form(cusp: int) -> None:
    """Truth: the sector of 120 degrees from the axis; the same as the virtual planes, since there
    C is the circumcentre (Remark 3.1)."""
    ends, points = commissures((1, 1, 1)), probes(cusp)
    first, second = ends[(cusp + 1) % 3], ends[(cusp + 2) % 3]
    found = family(1, "symmetry_planes").wedge(cusp, 1.0).signed_distance(points)
    np.testing.assert_allclose(
        found, sector_distance(points, np.zeros(2), first, second), atol=3e-14
    )
    virtual = family(1).wedge(cusp, 1.0).signed_distance(points)
    np.testing.assert_allclose(found, virtual, atol=1e-13)


def test_symmetry_planes_are_mirrors() -> None:
    """Truth: reflection in the half-plane at A_i exchanges the two cusps that meet there."""
    points, planes = probes(5), family(1, "symmetry_planes")
    for i in range(3):
        along = commissures((1, 1, 1))[i] / np.hypot(*commissures((1, 1, 1))[i])
        mirror = np.diag([0.0, 0.0, 1.0])
        mirror[:2, :2] = 2.0 * np.outer(along, along) - np.eye(2)
        one = planes.wedge((i + 1) % 3, 1.0).signed_distance(points)
        other = planes.wedge((i + 2) % 3, 1.0).signed_distance(points @ mirror)
        np.testing.assert_allclose(one, other, atol=1e-13)


@pytest.mark.parametrize("method", PLANES)
def test_planes_are_there_at_once(method: str) -> None:
    """Truth: the literature's planes have no path: every lambda gives the same wedge and one level
    is left; the paper's curves (3.5) keep theirs."""
    planes, points = family(1, method), probes(9, 200)
    assert planes.is_fixed
    assert planes.sigma is None
    assert planes.levels(10) == (1.0,)
    last = planes.wedge(0, 1.0)
    for lam in (0.0, 0.3):
        wedge = planes.wedge(0, lam)
        assert wedge.lam == 1.0
        np.testing.assert_array_equal(wedge.signed_distance(points), last.signed_distance(points))
    with pytest.raises(SceneError, match="lam"):
        planes.wedge(0, 1.5)
    curves = family(1, "bezier")
    assert not curves.is_fixed
    assert curves.levels(4) == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert np.abs(curves.wedge(0, 0.3).signed_distance(points) - last.signed_distance(points)).max()


@pytest.mark.parametrize("number", EXPERIMENTS)
def test_planes_tile_space(number: int) -> None:
    """Truth: neighbours share a half-plane: one positive distance, the next its negative."""
    points = probes(number)
    distance = np.sort([family(number).wedge(i, 1.0).signed_distance(points) for i in range(3)], 0)
    assert np.array_equal((distance > 0).sum(axis=0), np.ones(len(points)))
    np.testing.assert_allclose(distance[2], -distance[1], atol=1e-13)


@settings(max_examples=10, deadline=None)
@given(
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    number=st.sampled_from(sorted(EXPERIMENTS)),
    shift=st.sampled_from([0, 1, 2]),
)
def test_cyclic_renumbering_and_rotation(
    angles: tuple[float, float, float], number: int, shift: int
) -> None:
    """Truth: the valve turned in space and its commissures counted from another one: cusp i + shift
    becomes cusp i, and its distance, gradient and Hessian turn with the valve."""
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    flat, centre, lengths = inputs(number)
    points = probes(number, 300)
    for method in PLANES if number == 1 else PLANES[:1]:
        moved = ContactWedgeFamily(
            CommissurePlane(np.roll(flat, -shift, 0) @ turn.T + 7.0),
            turn @ centre + 7.0,
            np.roll(lengths, -shift),
            method=method,
        )
        for cusp in range(3):
            there = family(number, method).wedge((cusp + shift) % 3, 1.0).evaluate(points)
            here = moved.wedge(cusp, 1.0).evaluate(points @ turn.T + 7.0)
            np.testing.assert_allclose(here[0], there[0], atol=1e-12)
            steady = np.abs(there[0]) > 1e-6
            steady &= np.linalg.norm(here[1] - there[1] @ turn.T, axis=1) < 1.0  # medial axis
            assert steady.mean() > 0.97
            np.testing.assert_allclose(here[1][steady], (there[1] @ turn.T)[steady], atol=1e-7)


@pytest.mark.parametrize(
    ("number", "method"), [(1, PLANES[0]), (2, PLANES[0]), (3, PLANES[0]), (1, PLANES[1])]
)
def test_the_judge_measures_against_the_planes(number: int, method: str) -> None:
    """Truth: the distance to the polyline that the judge is given is that of the sector in closed
    form, and not that of the paper's curves."""
    tables = load_scene(DEMOS / f"experiment_{number}.toml").model_dump()
    tables["contact"]["method"] = method
    given_input = ValveInput.from_scene(parse_scene(tables))
    points = probes(3, 300)
    ends, centre = commissures(EXPERIMENTS[number][0]), inputs(number)[1][:2]
    for i in range(3):
        judge = constraints_of(given_input.scene, given_input.geometry, given_input.wedges, i)
        found = wedge_distance(points, judge.wedge, judge.wedge_inside)
        exact = sector_distance(points, centre, ends[(i + 1) % 3], ends[(i + 2) % 3])
        np.testing.assert_allclose(found, exact, atol=1e-5)  # the demos round their L_f
        curved = family(number, "bezier").wedge(i, 1.0).signed_distance(points)
        assert np.abs(found - curved).max() > 0.05


@pytest.mark.parametrize("method", PLANES)
def test_scene_report_and_congruence(method: str) -> None:
    """Truth: the scene's method is the wedges'; sigma is null in the report; equal cusps stay
    congruent, those of Experiment 2 do not become so."""
    given_input = ValveInput.from_scene(parse_scene({"contact": {"method": method}}))
    assert given_input.wedges.method == method
    report: dict[str, Any] = geometry_report(given_input.geometry, given_input.wedges)
    assert report["sigma"] is None
    assert report["contact_method"] == method
    assert representatives(given_input.scene, given_input.geometry, given_input.wedges) == (0, 0, 0)
    other = ValveInput.from_scene(parse_scene(SCENES[2] | {"contact": {"method": PLANES[0]}}))
    assert representatives(other.scene, other.geometry, other.wedges) == (0, 1, 2)
