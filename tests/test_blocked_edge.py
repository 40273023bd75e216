"""Sutured edges that lead into the neighbour, against rays, closed forms and a collision test."""

from __future__ import annotations

import tomllib
from functools import cache
from typing import Any

import ipctk
import numpy as np
import pytest

from avneo_fem.constraints.contact_pairs import collision_mesh
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.refine import nested_meshes
from avneo_fem.scene import parse_scene
from avneo_fem.stages.blocked_edge import LaidRow, may_be_missed
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.valve.suture_valve import mesh_templates
from valve_cases import DEMOS

RADIUS = 12.0
#: 0.4 of inside_tolerance, which is 1 % of the thickness
SLACK = 0.002
#: edge lengths and refinements
MESHES = ((2.0, 0), (1.4, 0), (1.4, 1))


@cache
def made(
    size: float = 2.0, refinements: int = 0, number: int = 1, index: int = 0, **changes: Any
) -> CuspSetup:
    """Set-up of a cusp of a demo, which has a commissural gap of 0.5 mm unless told otherwise."""
    data = tomllib.loads((DEMOS / f"experiment_{number}.toml").read_text())
    data["mesh"]["size"] = size
    data["commissures"]["gap"] = changes.get("gap", 0.5)
    if "method" in changes:
        data["contact"] = {"method": changes["method"]}
    given = ValveInput.from_scene(parse_scene(data))
    mesh = nested_meshes(given.geometry.cusps[index].template, size, refinements, False)[-1]
    return CuspSetup(given.scene, given.geometry, given.wedges, index, mesh)


def laid(setup: CuspSetup) -> np.ndarray:
    """All nodes: sutured ones and the row in their places."""
    points, row = setup.start.copy(), setup.row
    points[setup.mesh.suture_line] = setup.target
    points[row.nodes] = row.on_the_way(points[row.nodes], 1.0)
    return points


def frames(setup: CuspSetup) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of every sutured triangle: share of the edge at which it has its height, height, length of
    the edge in place, and unit vector along -b, made orthogonal to the edge."""
    mesh, line = setup.mesh, setup.mesh.suture_line
    start, stop = mesh.points[line[:-1]], mesh.points[line[1:]]
    arm, side = mesh.points[setup.clamp.apex] - start, stop - start
    length = np.hypot(*side.T)
    height = np.abs(side[:, 0] * arm[:, 1] - side[:, 1] * arm[:, 0]) / length
    share = np.einsum("kd,kd->k", arm, side) / length**2
    along = np.diff(setup.target, axis=0)
    inward = -np.cross(along, np.cross(setup.conormal, along))
    return share, height, along, inward / np.linalg.norm(inward, axis=1)[:, None]


@pytest.mark.parametrize(("size", "refinements"), MESHES)
@pytest.mark.parametrize("gap", [0.3, 0.5, 1.0])
def test_blocked_where_the_half_plane_runs_into_the_wedge(
    size: float, refinements: int, gap: float
) -> None:
    """Truth: a ray from every suture edge into its half-plane, looked at in steps of 1/4000 of the
    triangle's height: it is blocked when the ray comes nearer to the closed wedge than its
    clearance, less 0.4 of the tolerance, before half the height. Those are edges next to the
    commissures, as many at both ends."""
    setup = made(size, refinements, gap=gap)
    share, height, along, inward = frames(setup)
    apex, mesh = setup.clamp.apex, setup.mesh
    foot = setup.target[:-1] + np.clip(share, 0, 1)[:, None] * along
    steps = np.linspace(0.0, 1.0, 2001)[1:] * 0.5
    samples = foot[:, None] + (steps * height[:, None])[..., None] * inward[:, None]
    # the free edge's node stands higher, which a wedge along the axis does not notice
    distance = setup.wedges.wedge(0, 1.0).signed_distance(samples.reshape(-1, 3))
    needed = setup.wedge.clearance[apex][:, None] - SLACK
    runs_in = (distance.reshape(len(apex), -1) < needed).any(axis=1)
    runs_in &= ~np.isin(apex, mesh.suture_line)
    blocked = setup.row.is_blocked
    np.testing.assert_array_equal(blocked, np.isin(apex, apex[runs_in]))
    assert blocked[[0, -1]].all()
    first, last = np.argmin(blocked), np.argmin(blocked[::-1])
    assert first == last
    assert not blocked[first : len(blocked) - last].any()
    np.testing.assert_array_equal(np.sort(setup.row.nodes), np.unique(apex[blocked]))
    assert not np.isin(setup.row.nodes, mesh.suture_line).any()
    np.testing.assert_array_equal(setup.clamp.active, ~blocked)


@pytest.mark.parametrize(("size", "refinements"), MESHES)
def test_equal_counts_at_both_ends(size: float, refinements: int) -> None:
    """Truth: cusp and suture line are their own mirror images: as many edges at either end."""
    setup = made(size, refinements)
    blocked = np.flatnonzero(setup.row.is_blocked)
    count = len(setup.row.is_blocked)
    np.testing.assert_array_equal(blocked, np.sort(count - 1 - blocked))


@pytest.mark.parametrize("gap", [0.5, 0.6, 0.8])
def test_reach_in_closed_form(gap: float) -> None:
    """Truth: symmetry planes go through the axis, and the first 2.5 mm of the suture line go down:
    a ray along the wall's tangent has the distance R sin d - t cos d, d = gap/2R, and so t at most
    (R sin d - d_0 + slack) / cos d; the reach is that, less at most 1/40 of the triangle's height,
    and no less than the slack, as the edge is further than twice that from the wedge."""
    setup = made(gap=gap, method="symmetry_planes")
    row = setup.row
    straight = np.isclose(np.abs(row.tangent[:, 2]), 1.0, atol=1e-12)
    assert np.count_nonzero(straight) >= 2
    turn = gap / 2 / RADIUS
    clearance = setup.wedge.clearance[row.nodes[straight]]
    longest = (RADIUS * np.sin(turn) - clearance + SLACK) / np.cos(turn)
    height = np.array([frames(setup)[1][setup.clamp.apex == n].max() for n in row.nodes[straight]])
    reach = row.reach[straight]
    assert (reach <= np.maximum(longest, SLACK) + 1e-9).all()
    assert (reach >= np.maximum(longest - height / 40, SLACK) - 1e-6).all()
    assert (reach >= SLACK * (1 - 1e-4)).all()


@pytest.mark.parametrize(("number", "index"), [(1, 0), (2, 0), (2, 2), (3, 1)])
@pytest.mark.parametrize("gap", [0.0, 0.5, 1.0])
def test_places(number: int, index: int, gap: float) -> None:
    """Truth: each place lies in the half-plane of a suture edge that the node belongs to, above
    the edge (the free edge's node: above the corner), at its reach - but for what keeps it inside
    the round root, reach^2/2R; it keeps its clearance from the closed wedge less what may be
    missed, or where the edge itself has less, that less as much."""
    setup = made(2.0, 0, number, index, gap=gap)
    row, wedge = setup.row, setup.wedges.wedge(index, 1.0)
    places = laid(setup)[row.nodes]
    _, _, along, inward = frames(setup)
    on_free_edge = np.isin(row.nodes, setup.mesh.free_edge)
    assert len(places) >= 4
    for j, node in enumerate(row.nodes):
        own = np.flatnonzero(setup.clamp.apex == node)
        edge = own[np.argmin(np.abs(inward[own] - row.inward[j]).max(axis=1))]
        off = 1.05 * row.reach[j] / (2 * RADIUS) + 1e-12  # reach^2/2R at a distance of reach
        np.testing.assert_allclose(row.inward[j], inward[edge], atol=2 * off)
        frame = np.stack([row.tangent[j], row.inward[j], row.normal[j]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        length = np.linalg.norm(along[edge])
        arm = places[j] - setup.target[edge]
        across = np.cross(along[edge] / length, inward[edge])
        assert abs(arm @ across) <= 2 * off * row.reach[j] + 1e-12
        assert arm @ inward[edge] == pytest.approx(row.reach[j], rel=2 * off, abs=1e-12)
        if not on_free_edge[j]:
            slack = 2 * off * row.reach[j] + 1e-12
            assert -slack <= arm @ along[edge] / length <= length + slack
    assert setup.geometry.root.signed_distance(places).min() > -1e-12
    at_foot = wedge.signed_distance(row.foot)
    kept = np.minimum(setup.wedge.clearance[row.nodes], at_foot)
    missed = may_be_missed(kept, SLACK)
    pushed = row.reach**2 / RADIUS
    assert (wedge.signed_distance(places) - kept + missed + pushed).min() > -1e-12
    assert (row.reach >= missed * (1 - 1e-4)).all()


def test_what_may_be_missed() -> None:
    """Truth: two neighbours that each miss half of their clearance still do not touch."""
    clearance = np.array([0.5, 0.02, 0.004, 0.0])
    np.testing.assert_allclose(may_be_missed(clearance, 0.01), [0.01, 0.01, 0.002, 0.001])


CASES = (
    (1, 0, 3.0, 0),
    (1, 0, 2.0, 0),
    (1, 0, 1.4, 1),
    (2, 0, 2.0, 0),
    (2, 2, 1.4, 1),
    (3, 1, 1.4, 0),
)
#: with its node at the free edge lifted past the bend of the next suture edge: see test_orientation


def held_cells(setup: CuspSetup) -> np.ndarray:
    """Triangles all of whose nodes are sutured or laid."""
    held = np.r_[setup.mesh.suture_line, setup.row.nodes]
    cells = setup.mesh.triangles[np.isin(setup.mesh.triangles, held).all(axis=1)]
    assert len(cells) >= np.count_nonzero(setup.row.is_blocked)
    return cells


@pytest.mark.parametrize("case", CASES, ids=str)
@pytest.mark.parametrize("gap", [0.0, 0.5, 1.0])
def test_no_crossings(case: tuple[int, int, float, int], gap: float) -> None:
    """Truth: ipctk finds no crossing among the triangles that the row and the sutured edge hold."""
    number, index, size, refinements = case
    setup = made(size, refinements, number, index, gap=gap)
    points = laid(setup)
    used, local = np.unique(held_cells(setup), return_inverse=True)
    mesh = collision_mesh(points[used], local.reshape(-1, 3))
    assert not ipctk.has_intersections(mesh, np.asfortranarray(points[used]))


@pytest.mark.parametrize("gap", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("case", CASES, ids=str)
def test_orientation(case: tuple[int, int, float, int], gap: float) -> None:
    """Truth: the row lies along the wall, which the cusp crosses over to the neighbour's side: all
    held triangles show the axis the same side, none is turned inside out or without area."""
    number, index, size, refinements = case
    setup = made(size, refinements, number, index, gap=gap)
    corners = laid(setup)[held_cells(setup)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    towards_axis = np.einsum("kd,kd->k", normal, -corners.mean(axis=1) * [1.0, 1.0, 0.0])
    assert towards_axis.min() > 0


@pytest.mark.parametrize(
    ("number", "index", "size", "count"), [(1, 0, 0.7, 1), (1, 0, 1.4, 0), (2, 0, 2.0, 0)]
)
def test_free_edge_keeps_its_height(number: int, index: int, size: float, count: int) -> None:
    """Truth: (1.6) wants the free edge above the plane of commissures what it is above its corners
    in the template, H_f (1 - 2|x|/L_f); a laid node of the free edge is just there. (The first
    sutured edge is vertical: where it leans, the reach adds its share. Where the suture line bends
    at the end of that edge, the node is left free.)"""
    setup = made(size, 0, number, index)
    row, plane = setup.row, setup.geometry.commissures
    on_free_edge = np.isin(row.nodes, setup.mesh.free_edge)
    assert np.count_nonzero(on_free_edge) == count
    np.testing.assert_allclose(row.inward[on_free_edge, 2], 0.0, atol=1e-12)
    p = setup.cusp.template.parameters
    x = setup.mesh.points[row.nodes[on_free_edge], 0]
    wanted = p.free_edge_height * (1 - 2 * np.abs(x) / p.free_edge_length)
    places = laid(setup)[row.nodes[on_free_edge]]
    np.testing.assert_allclose((places - plane.points[0]) @ plane.normal, wanted, atol=1e-12)


@pytest.mark.parametrize(("size", "refinements"), MESHES)
def test_nothing_is_blocked_by_a_wide_gap(size: float, refinements: int) -> None:
    """Truth: with 6 mm between neighbours there are 2.7 mm of room for every triangle of at most
    3 mm, more than half its height: nothing is blocked, nothing held, every edge clamped."""
    setup = made(size, refinements, gap=6.0)
    row = setup.row
    assert not row.is_blocked.any()
    assert len(row.is_blocked) == len(setup.mesh.suture_edges)
    assert setup.clamp.active.all()
    assert len(row.nodes) == len(row.reach) == 0
    assert row.on_the_way(np.empty((0, 3)), 0.5).shape == (0, 3)


@pytest.fixture
def row() -> LaidRow:
    """Three nodes with random frames."""
    random = np.random.default_rng(11)
    frame = np.linalg.qr(random.standard_normal((3, 3, 3)))[0]
    tangent, inward = frame[:, 0], frame[:, 1]
    normal = np.cross(tangent, -inward)
    foot, reach = random.standard_normal((3, 3)), np.array([0.002, 0.1, 0.3])
    all_edges = np.ones(3, dtype=bool)
    return LaidRow(np.arange(3), foot, tangent, inward, normal, reach, all_edges, ~all_edges)


def placed(row: LaidRow, radius: np.ndarray, angle: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Points given by cylinder coordinates about the suture line."""
    across = np.cos(angle)[:, None] * row.inward + np.sin(angle)[:, None] * row.normal
    return row.foot + radius[:, None] * across + rest[:, None] * row.tangent


ANGLES = np.array([[0.2, -1.1, 2.9], [-3.0, 0.0, 1.6]])


@pytest.mark.parametrize("angle", ANGLES)
def test_both_ends_of_the_way(row: LaidRow, angle: np.ndarray) -> None:
    """Truth: share 0 is the start, share 1 the place: at the reach, along -b from the foot."""
    start = placed(row, np.array([0.8, 1.2, 0.5]), angle, np.array([0.3, -0.4, 0.0]))
    np.testing.assert_allclose(row.on_the_way(start, 0.0), start, atol=1e-14)
    place = row.foot + row.reach[:, None] * row.inward
    np.testing.assert_allclose(row.on_the_way(start, 1.0), place, atol=1e-14)
    np.testing.assert_allclose(row.on_the_way(place, 0.4), place, atol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_half_way(row: LaidRow, angle: np.ndarray) -> None:
    """Truth: cylinder coordinates about the suture line: half the angle, half the offset along it,
    the geometric mean of the distances."""
    radius, rest = np.array([0.8, 1.2, 0.5]), np.array([0.3, -0.4, 0.0])
    found = row.on_the_way(placed(row, radius, angle, rest), 0.5)
    expected = placed(row, np.sqrt(radius * row.reach), angle / 2, rest / 2)
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_way_closes_in(row: LaidRow, angle: np.ndarray) -> None:
    """Truth: distance from the line, angle and offset fall all the way, none changes its sign; no
    node ever touches the line."""
    start = placed(row, np.array([0.8, 1.2, 0.5]), angle, np.array([0.3, -0.4, 0.1]))
    seen = []
    for share in np.linspace(0.0, 1.0, 21):
        arm = row.on_the_way(start, share) - row.foot
        x, y, z = (np.einsum("jd,jd->j", arm, a) for a in (row.inward, row.normal, row.tangent))
        seen.append((np.hypot(x, y), np.arctan2(y, x), z))
    radius, turn, rest = np.array(seen).transpose(1, 0, 2)
    assert (np.diff(radius, axis=0) < 0).all()
    assert (radius >= row.reach - 1e-14).all()
    for part in (turn, rest):
        assert (np.diff(np.abs(part), axis=0) <= 1e-14).all()
        assert (part * part[0] >= -1e-14).all()


@pytest.mark.parametrize("angle", ANGLES)
def test_steps_of_the_way_add_up(row: LaidRow, angle: np.ndarray) -> None:
    """Truth: a share of the way and a share of the rest lead where both together do; so halved
    steps of a level end in the same places."""
    start = placed(row, np.array([0.8, 1.2, 0.5]), angle, np.array([0.3, -0.4, 0.1]))
    found = row.on_the_way(row.on_the_way(start, 0.3), 0.4)
    np.testing.assert_allclose(found, row.on_the_way(start, 1 - 0.7 * 0.6), atol=1e-14)


def test_a_corner_that_cannot_be_laid_down() -> None:
    """Truth: Experiment 2's cusp 0 has no room at its corners; on a mesh that has no node where the
    suture line begins to turn, that turn is nearer than the row can follow, so the corner's edges
    are left: neither laid down nor clamped. With a node there the line is straight up to it, and
    they are laid down."""
    left = made(1.4, 1, 2).row
    assert np.flatnonzero(left.is_left).tolist() == [0, len(left.is_left) - 1]
    assert not (left.is_left & left.is_blocked).any()
    assert not made(1.4, 1, 2).clamp.active[[0, -1]].any()
    np.testing.assert_array_equal(left.has_room, ~(left.is_blocked | left.is_left))
    data = tomllib.loads((DEMOS / "experiment_2.toml").read_text()) | {"mesh": {"size": 1.4}}
    given = ValveInput.from_scene(parse_scene(data))
    mesh = mesh_templates(given)[0][-1]
    joints = given.geometry.cusps[0].suture_joints()
    np.testing.assert_allclose(given.geometry.cusps[0].sutured_position(joints)[:, 2], -2.5)
    assert np.isin(joints, mesh.suture_arc_length).all()
    row = CuspSetup(given.scene, given.geometry, given.wedges, 0, mesh).row
    assert not row.is_left.any()
    assert row.is_blocked[[0, -1]].all()
