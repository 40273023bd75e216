"""What the stages of one cusp start from, against the scene and the geometry."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.results.crossings import self_intersections
from avneo_fem.scene import Scene, parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup, clearances, near_suture
from run_cases import SMALL


def made(index: int = 1, **tables: Any) -> CuspSetup:
    """Set-up of a cusp of the small scene, with some tables replaced."""
    given = ValveInput.from_scene(parse_scene(tomllib.loads(SMALL) | tables))
    mesh = triangulate_template(given.geometry.cusps[index].template, given.scene.mesh_size)
    return CuspSetup(given.scene, given.geometry, given.wedges, index, mesh)


@pytest.fixture(scope="module")
def setup() -> CuspSetup:
    """Cusp 1 of the small scene."""
    return made()


def test_clearances_by_default() -> None:
    """Truth: design.md §1: H/2 from the wedge everywhere, H/2 min(1, s/5H)^2 from the wall, with
    the thickness of the cusp asked for."""
    scene = parse_scene({"cusp": [{}, {}, {"template": {"thickness": 0.8}}]})
    for index, thickness in ((0, 0.5), (2, 0.8)):
        s = np.array([0.0, 0.5, 1.0, 2.0, 5 * thickness, 100.0])
        wall, wedge = clearances(scene, index, s)
        np.testing.assert_array_equal(wedge, np.full(6, thickness / 2))
        expected = [thickness / 2 * min(1.0, x / (5 * thickness)) ** 2 for x in s]
        np.testing.assert_allclose(wall, expected, rtol=1e-14)


def test_clearance_from_the_wedge_near_a_close_suture(setup: CuspSetup) -> None:
    """Truth: design.md §1, "less only where the sutured edge itself lies closer": the edge's own
    distance at the edge, the full clearance beyond the taper and where the edge keeps it."""
    mesh, full = setup.mesh, np.full(len(setup.mesh.points), 0.25)
    far = np.full(len(mesh.suture_line), 3.0)
    np.testing.assert_array_equal(near_suture(full, far, mesh, 2.5), full)
    close = far.copy()
    close[:3] = 0.1, 0.2, -1.0
    eased = near_suture(full, close, mesh, 2.5)
    np.testing.assert_allclose(eased[mesh.suture_line[:4]], [0.1, 0.2, 0.0, 0.25], atol=1e-15)
    np.testing.assert_array_equal(eased[mesh.distance_to_suture >= 2.5], 0.25)
    assert ((eased >= 0.0) & (eased <= 0.25)).all()


def test_clearances_as_given() -> None:
    """Truth: entries of the scene replace the defaults; no taper means the same everywhere; the
    paper's -eta_3 = -0.25 of the wall is reachable."""
    s = np.array([0.0, 1.0, 4.0])
    scene = parse_scene({"wall": {"clearance": -0.25, "taper": 0.0}, "contact": {"clearance": 0.0}})
    wall, wedge = clearances(scene, 0, s)
    np.testing.assert_array_equal(wall, [-0.25] * 3)
    np.testing.assert_array_equal(wedge, [0.0] * 3)
    wall, _ = clearances(parse_scene({"wall": {"clearance": 0.4, "taper": 2.0}}), 0, s)
    np.testing.assert_allclose(wall, [0.0, 0.1, 0.4])


def test_start_is_the_flat_template(setup: CuspSetup) -> None:
    """Truth: the placed template is congruent with the flat one, its corners lie in the plane of
    commissures, it stands upright, does not cross itself, and k is a whole number >= 0."""
    np.testing.assert_allclose(pdist(setup.start), pdist(setup.mesh.points), rtol=1e-12)
    corners = setup.start[setup.mesh.suture_line[[0, -1]]]
    np.testing.assert_allclose(corners[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(setup.start[:, 2]), np.ptp(setup.mesh.points[:, 1]))
    assert self_intersections(setup.start, setup.mesh.triangles) == 0
    assert setup.placement_k == int(setup.placement_k) >= 0


def test_target(setup: CuspSetup) -> None:
    """Truth: the sutured nodes go to the cylinder, the first and last to the ends of the aortic
    suture line, all in its order, the gathered middle closer than on the template."""
    line = setup.cusp.suture_line
    np.testing.assert_allclose(np.hypot(*setup.target[:, :2].T), 12.0, rtol=1e-12)
    np.testing.assert_allclose(setup.target[[0, -1]], line.ends, atol=1e-12)
    angle = np.unwrap(np.arctan2(setup.target[:, 1], setup.target[:, 0]))
    assert (np.diff(angle) > -1e-9).all()
    assert 0 < angle[-1] - angle[0] < 2 * np.pi / 3
    pieces = np.linalg.norm(np.diff(setup.target, axis=0), axis=1)
    assert (pieces < 1.001 * np.diff(setup.mesh.suture_arc_length)).all()
    assert pieces.sum() == pytest.approx(line.length, rel=0.01)


def test_conormal(setup: CuspSetup) -> None:
    """Truth: b = tau x (inward normal) in the middle of each edge: a unit vector in the wall's
    tangent plane, across the line; +z at the bottom (paper §3.1)."""
    conormal = setup.conormal
    assert conormal.shape == (len(setup.mesh.suture_edges), 3)
    np.testing.assert_allclose(np.linalg.norm(conormal, axis=1), 1.0, rtol=1e-12)
    s = setup.mesh.suture_arc_length
    middle = (s[1:] + s[:-1]) / 2
    place, along = setup.cusp.sutured_position(middle), setup.cusp.sutured_tangent(middle)
    np.testing.assert_allclose(np.einsum("kd,kd->k", conormal, along), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.einsum("kd,kd->k", conormal[:, :2], place[:, :2]), 0, atol=1e-11)
    lowest = np.argmin(place[:, 2])
    assert conormal[lowest, 2] > 0.9


def test_sutured_positions_are_held(setup: CuspSetup) -> None:
    """Truth: three unknowns per sutured node are held and nothing else: the edge is a hinge; no
    penalty acts yet."""
    held = setup.model.position_dofs[setup.mesh.suture_line].ravel()
    np.testing.assert_array_equal(np.flatnonzero(setup.system.fixed), np.sort(held))
    assert setup.system.terms == []


def test_penalties_follow_the_scene() -> None:
    """Truth: widths, stiffnesses and clearances of the scene; the wall is the cylinder, the wedge
    that of this cusp at lambda = 0."""
    setup = made(2, wall={"stiffness": 3.0, "width": 0.7}, contact={"stiffness": 5.0, "width": 0.2})
    assert (setup.wall.stiffness, setup.wall.width) == (3.0, 0.7)
    assert (setup.wedge.stiffness, setup.wedge.width) == (5.0, 0.2)
    wall, wedge = clearances(setup.scene, 2, setup.mesh.distance_to_suture)
    np.testing.assert_array_equal(setup.wall.clearance, wall)
    # the sutured edge itself is 0.25 mm off the wedge but for the chord of the gap's arc
    np.testing.assert_allclose(setup.wedge.clearance, wedge, atol=2e-5)
    assert (setup.wedge.clearance <= wedge).all()
    points = np.random.default_rng(1).uniform(-11, 11, (50, 3))
    np.testing.assert_allclose(
        setup.wall.evaluate(points)[0], 12.0 - np.hypot(*points[:, :2].T), rtol=1e-12
    )
    expected = setup.wedges.wedge(2, 0.0).evaluate(points)[0]
    np.testing.assert_array_equal(setup.wedge.evaluate(points)[0], expected)
    other = setup.wedges.wedge(1, 0.0).evaluate(points)[0]
    assert np.abs(expected - other).max() > 1.0


def test_clamp_penalty(setup: CuspSetup) -> None:
    """Truth: no energy while the third node of each sutured triangle lies in its half-plane, along
    -b from the edge; the full angle when it is turned about the edge; none of it acts yet."""
    line, mesh = setup.mesh.suture_line, setup.mesh
    for edge, apex in enumerate(setup.clamp.apex):
        triangle = mesh.triangles[mesh.edge_cells[mesh.suture_edges[edge], 0]]
        assert set(triangle) == {line[edge], line[edge + 1], apex}
    assert setup.clamp.stiffness == 0.0
    along = np.diff(setup.target, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    part = np.einsum("kd,kd->k", setup.conormal, along)[:, None]
    inward = -(setup.conormal - part * along)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    middle = (setup.target[1:] + setup.target[:-1]) / 2
    unique = np.unique(setup.clamp.apex, return_index=True)[1]  # a node may belong to two edges
    for angle in (0.0, 0.7, -2.0):
        points = setup.start.copy()
        points[line] = setup.target
        turned = np.cos(angle) * inward + np.sin(angle) * np.cross(along, inward)
        points[setup.clamp.apex[unique]] = (middle + turned)[unique]
        found = setup.clamp.angles(points)[unique]
        np.testing.assert_allclose(np.abs(found), abs(angle), atol=1e-12)


def test_self_contact_follows_the_scene(setup: CuspSetup) -> None:
    """Truth: min(0.3 H, 0.2 h) by default and 0.05 E H / distance^2, or what the scene says."""
    assert setup.contact.distance == pytest.approx(min(0.3 * 0.5, 0.2 * 3.0))
    assert setup.contact.stiffness == pytest.approx(0.05 * 1000.0 * 0.5 / 0.15**2)
    solver = {"barrier_distance": 0.04, "barrier_stiffness": 2.0}
    other = made(solver=solver).contact
    assert other.distance == 0.04
    assert other.stiffness == pytest.approx(2.0 * 1000.0 * 0.5 / 0.04**2)


def test_model_follows_the_scene() -> None:
    """Truth: every constant of the model is the scene's, the thickness that of the cusp."""
    setup = made(
        2,
        diastolic_pressure=9.5,
        material={"young_modulus": 700.0},
        free_edge={"stiffness": 60.0, "width": 0.2, "clearance": -0.1},
        cusp=[{}, {}, {"template": {"thickness": 0.6}}],
    )
    p = setup.model.parameters
    assert (p.material, p.bending, p.young_modulus) == ("neo_hookean", True, 700.0)
    assert (p.thickness, p.pressure) == (0.6, 9.5)
    assert (p.free_edge_stiffness, p.free_edge_width, p.free_edge_clearance) == (60.0, 0.2, -0.1)
    assert p.plane_normal == pytest.approx((0.0, 0.0, 1.0))
    np.testing.assert_allclose(p.plane_point, setup.geometry.commissures.points[0])
    assert p.template_level == pytest.approx(11.5)
    assert setup.compile_seconds > 0
    assert isinstance(setup.scene, Scene)
