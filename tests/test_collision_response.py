"""Crossings taken out of a step: impulses, rigid impact zones, and what they must not change.

Freedom from crossings is judged by ``results.crossings``, which shares nothing with the resolver.
"""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from avneo_fem.constraints.collision_response import (
    CrossingsRemain,
    Resolution,
    apply_impulses,
    resolve,
)
from avneo_fem.constraints.contact_pairs import (
    Contacts,
    colliding_pairs,
    collision_mesh,
    nearest_weights,
)
from avneo_fem.constraints.impact_zones import ImpactZones, rigid_motion
from avneo_fem.results.crossings import self_intersections
from avneo_fem.results.proximity import point_triangle_distance, segment_distance
from shell_cases import Floats, Ints, hairpin, rotation, strip

THICKNESS = 0.1
Step = tuple[Ints, Floats, Floats]  # triangles, before, after


def resolved(step: Step, **options: object) -> Resolution:
    """Result with unit masses and no held nodes unless ``options`` say otherwise."""
    count = len(step[1])
    values = {"mass": np.ones(count), "held": np.zeros(count, bool), "thickness": THICKNESS}
    return resolve(*step, **{**values, **options})  # type: ignore[arg-type]


def assert_sound(step: Step, result: Resolution) -> None:
    """No crossing at the end nor on the way, and the correction as reported."""
    triangles, before, after = step
    assert self_intersections(result.points, triangles) == 0
    for share in np.linspace(0.1, 0.9, 9):
        assert self_intersections(before + share * (result.points - before), triangles) == 0
    correction = np.linalg.norm(result.points - after, axis=1).max()
    assert result.largest_correction == pytest.approx(correction, rel=1e-12)


def soup(seed: int) -> Step:
    """Sixteen loose triangles, each asked to go through the centre to the other side."""
    rng = np.random.default_rng(seed)
    centres = 1.6 * np.stack(np.meshgrid(*[[-1, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    corners = np.concatenate([centres, 0.45 * centres]) + 0.3 * rng.normal(size=(16, 3, 3))
    before = corners.reshape(-1, 3)
    triangles = np.arange(48).reshape(-1, 3)
    assert self_intersections(before, triangles) == 0
    return triangles, before, -before + 0.2 * rng.normal(size=before.shape)


def crumple(seed: int, start: Floats, triangles: Ints) -> Step:
    """A sheet asked to crumple: squeezed by a tenth, waves of random direction, and noise."""
    rng = np.random.default_rng(seed)
    after = 0.9 * start
    for _ in range(4):
        waves, phase = 0.5 * rng.normal(size=(3, 3)), rng.uniform(0, 6, 3)
        after = after + np.sin(start @ waves.T + phase)
    return triangles, start, after + 0.1 * rng.normal(size=start.shape)


def sheet() -> tuple[Floats, Ints]:
    """Unstructured flat square of 15 mm, (100, 3) nodes."""
    mesh = strip(9, 9, 15.0, 15.0)
    return np.c_[mesh.points, np.zeros(len(mesh.points))], mesh.triangles


def tip_over_floor(gap: float, end: float) -> Step:
    """Node 3, tip of a triangle, ``gap`` above the centre of another; asked to go to z = end."""
    before = np.array(
        [[0, 0, 0], [3, 0, 0], [0, 3, 0], [1, 1, gap], [1.5, 1, 3], [1, 1.5, 3]], dtype=float
    )
    after = before.copy()
    after[3, 2] = end
    return np.arange(6).reshape(2, 3), before, after


def crossed_edges(gap: float) -> Step:
    """Edge 0-1 along x at z = 0, edge 3-4 along y at z = ``gap``, each asked to go 1 mm past."""
    before = np.array(
        [[-1, 0, 0], [1, 0, 0], [0, 0, -3], [0, -1, gap], [0, 1, gap], [0, 0, gap + 3]]
    )
    after = before.copy()
    after[:2, 2] += 1.0
    after[3:5, 2] -= 1.0
    return np.arange(6).reshape(2, 3), before, after


@pytest.mark.parametrize("is_edges", [False, True])
def test_nearest_points(is_edges: bool) -> None:
    """Truth: distances of the verification's own formulas; weights of each part sum to one."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(2000, 4, 3))
    corners[:500] = corners[:500].round()  # parallel, touching, degenerate
    weights = nearest_weights(corners, is_edges)
    found = np.linalg.norm(np.einsum("kn,kni->ki", weights, corners), axis=1)
    if is_edges:
        exact = segment_distance(*(corners[:, k] for k in range(4)))
    else:
        exact = point_triangle_distance(corners[:, 0], corners[:, 1:])
    first = 2 if is_edges else 1
    assert found == pytest.approx(exact, abs=1e-7)
    assert weights[:, :first].sum(axis=1) == pytest.approx(1.0)
    assert weights[:, first:].sum(axis=1) == pytest.approx(-1.0)
    assert (weights[:, :first] >= -1e-12).all()
    assert (weights[:, first:] <= 1e-12).all()


@pytest.mark.parametrize(("gap", "left"), [(0.04, 0.04), (0.1, 0.1), (1.5, 0.1)])
def test_point_on_a_held_triangle(gap: float, left: float) -> None:
    """Truth: the approach is taken out; what began farther than the thickness stops there."""
    step = tip_over_floor(gap, -2.0)
    held = np.array([1, 1, 1, 0, 1, 1], bool)
    far_rest = np.where(np.arange(6)[:, None] < 3, step[1] - [0, 0, gap], step[1])
    result = resolved(step, held=held, rest=step[1] if gap < THICKNESS else far_rest)
    assert_sound(step, result)
    assert result.points[3] == pytest.approx([1, 1, left], abs=1e-9)
    assert np.array_equal(result.points[held], step[2][held])
    assert (result.rounds, result.zones, result.zone_nodes) == (1, 0, 0)


def test_point_on_a_free_triangle() -> None:
    """Truth: weights 1/3: the tip of mass m, corners of mass M share the approach v as

    J = v / (1/m + 3/(9 M)), the tip gives way by J/m, each corner by J/(3 M).
    """
    step = tip_over_floor(THICKNESS, THICKNESS - 2.0)
    mass = np.array([3.0, 3.0, 3.0, 2.0, 1.0, 1.0])
    result = resolved(step, mass=mass, held=np.arange(6) > 3)
    impulse = 2.0 / (1 / 2 + 1 / 9)
    assert result.points[3, 2] == pytest.approx(THICKNESS - 2 + impulse / 2, rel=1e-9)
    assert result.points[:3, 2] == pytest.approx(-impulse / 9, rel=1e-9)
    assert_sound(step, result)


def test_two_crossing_edges() -> None:
    """Truth: equal masses moving at each other stop half-way, the thickness apart."""
    step = crossed_edges(0.6)
    result = resolved(step)
    assert_sound(step, result)
    assert result.points[:2, 2] == pytest.approx(0.3 - THICKNESS / 2, abs=1e-9)
    assert result.points[3:5, 2] == pytest.approx(0.3 + THICKNESS / 2, abs=1e-9)
    assert np.array_equal(result.points[[2, 5]], step[2][[2, 5]])


def test_repulsion() -> None:
    """Truth: a tenth of what lacks, added once; less where the rest state is as near."""
    step = tip_over_floor(0.04, 0.04)
    held = np.array([1, 1, 1, 0, 1, 1], bool)
    assert resolved(step, held=held).points[3, 2] == pytest.approx(0.04 + 0.1 * 0.06)
    near = step[1] + np.where(np.arange(6)[:, None] == 3, [0, 0, 0.01], 0)
    assert resolved(step, held=held, rest=near).points[3, 2] == pytest.approx(0.04 + 0.1 * 0.01)
    assert np.array_equal(resolved(step, held=held, rest=step[1]).points, step[2])
    gone = tip_over_floor(0.04, 0.5)
    assert np.array_equal(resolved(gone, held=held).points, gone[2])


def test_nothing_changes_when_nothing_collides() -> None:
    """Truth: ``after``, bit for bit, for a large step without contact."""
    before, triangles = sheet()
    rng = np.random.default_rng(1)
    after = before @ rotation(1).T + 0.05 * rng.normal(size=before.shape) + [5, 0, 40]
    result = resolved((triangles, before, after))
    assert np.array_equal(result.points, after)
    assert (result.rounds, result.impulses, result.zones, result.zone_nodes) == (0, 0, 0, 0)
    assert result.largest_correction == 0.0


@pytest.mark.parametrize("rounds", [10, 1, 0])
@pytest.mark.parametrize("seed", range(3))
def test_momentum(seed: int, rounds: int) -> None:
    """Truth: without held nodes neither impulses nor zones change the sum of mass times place."""
    step = soup(seed)
    mass = np.random.default_rng(seed).uniform(0.2, 5.0, 48)
    result = resolved(step, mass=mass, rounds=rounds)
    assert_sound(step, result)
    assert result.largest_correction > 0.5
    assert mass @ result.points == pytest.approx(mass @ step[2], abs=1e-10)


def test_impulses_of_one_pair_have_no_moment() -> None:
    """Truth: they act along the line through the nearest points, in the state of touch."""
    rng = np.random.default_rng(8)
    corners = rng.normal(size=(4, 3))
    mass = rng.uniform(0.5, 2.0, 4)
    weights = nearest_weights(corners[None], False)
    normal = np.einsum("kn,kni->ki", weights, corners[None])
    normal /= np.linalg.norm(normal)
    pair = Contacts(np.arange(4)[None], weights, normal, np.array([9.0]))
    points, given = apply_impulses(corners, pair, 1 / mass)
    change = mass[:, None] * (points - corners)
    assert given == 1
    assert np.einsum("kn,kni,ki->k", weights, points[None], normal) == pytest.approx([9.0])
    assert np.cross(corners, change).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize("rounds", [10, 1])
def test_hairpin_pushed_through_itself(rounds: int) -> None:
    """Truth: layers 0.4 mm apart asked to change places end uncrossed and in their old order."""
    mesh = strip(24, 4, 24.0, 4.0)
    before = hairpin(mesh, 0.4)
    step = (mesh.triangles, before, before * [1.0, 1.0, -0.5])
    assert self_intersections(step[2], mesh.triangles) == 0  # through, and out on the other side
    step[2][:, 2] += 0.1 * np.sin(before[:, 0])
    rest = np.c_[mesh.points, np.zeros(len(before))]
    result = resolved(step, rest=rest, rounds=rounds)
    assert_sound(step, result)
    assert result.impulses > 50
    layers = before[:, 2] == 0, before[:, 2] > 0.4 - 1e-9
    lower, upper = (result.points[layer, 2].mean() for layer in layers)
    assert upper > lower


@pytest.mark.parametrize("seed", range(4))
def test_crumpling(seed: int) -> None:
    """Truth: five steps in a row, each asked to cross itself, each ends and moves uncrossed."""
    flat, triangles = sheet()
    points, asked = flat, 0
    for k in range(5):
        step = crumple(10 * seed + k, points, triangles)
        asked += self_intersections(step[2], triangles)
        result = resolved(step, rest=flat)
        assert_sound(step, result)
        points = result.points
    assert asked > 50


@pytest.mark.parametrize("rounds", [0, 1])
def test_zones_take_over_from_impulses(rounds: int) -> None:
    """Truth: with too few rounds the same crumpling still ends uncrossed, by rigid zones."""
    flat, triangles = sheet()
    points = flat
    zones = 0
    for seed in range(4):
        step = crumple(seed, points, triangles)
        result = resolved(step, rest=flat, rounds=rounds)
        assert_sound(step, result)
        zones += result.zones
        assert result.zone_nodes >= 4 * result.zones
        assert result.rounds <= rounds
        points = result.points
    assert zones > 0


def press(plate_mass: float) -> tuple[Step, Floats]:
    """Five light squares on a held floor, 0.1 mm apart, and a plate asked to go through all.

    The squares are turned against each other; returns the step and the masses.
    """
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    layers = []
    for k in range(7):
        angle = 0.5 * k
        c, s = np.cos(angle), np.sin(angle)
        layers.append(square @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [0, 0, 0.1 * k])
    before = np.concatenate(layers)
    triangles = np.concatenate([[[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]
                                for k in range(7)])  # fmt: skip
    after = before.copy()
    after[24:, 2] -= 5.0
    return (triangles, before, after), np.repeat([1.0] * 6 + [plate_mass], 4)


def test_a_heavy_plate_needs_a_zone() -> None:
    """Truth: impulses hand a 1e6 times heavier plate's momentum to the floor too slowly.

    It ends in one zone with the held floor and does not move at all. A light plate needs none.
    """
    held = np.arange(28) < 4
    step, mass = press(1e6)
    result = resolved(step, mass=mass, held=held)
    assert_sound(step, result)
    assert (result.rounds, result.zones) == (10, 1)
    assert np.array_equal(result.points[24:], step[1][24:])
    step, mass = press(1.0)
    light = resolved(step, mass=mass, held=held)
    assert light.zones == 0
    assert_sound(step, light)


def test_held_nodes_go_where_they_are_told() -> None:
    """Truth: a held plate pushes free squares before it; its nodes end exactly at ``after``."""
    (triangles, before, after), mass = press(1.0)
    held = np.arange(28) >= 24
    for rounds in (10, 0):
        step = triangles, before, after
        result = resolved(step, mass=mass, held=held, rounds=rounds)
        assert_sound(step, result)
        assert np.array_equal(result.points[held], after[held])
        heights = result.points[:, 2].reshape(7, 4).mean(axis=1)
        assert (np.diff(heights) > 0).all()  # corners may tip up beside the plate
        assert (result.zones > 0) == (rounds == 0)


def test_held_nodes_that_collide_are_an_error() -> None:
    """Truth: when both sides are prescribed there is no solution; the error says how many."""
    (triangles, before, after), mass = press(1.0)
    held = (np.arange(28) < 4) | (np.arange(28) >= 24)
    with pytest.raises(CrossingsRemain, match="pairs still meet") as caught:
        resolved((triangles, before, after), mass=mass, held=held)
    assert caught.value.pairs > 0
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.pairs) == (str(caught.value), caught.value.pairs)


@pytest.mark.parametrize("rounds", [10, 0])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_motions_of_the_whole(mirror: float, rounds: int) -> None:
    """Truth: turned, shifted and mirrored together, the problem has the same solution."""
    flat, triangles = sheet()
    first = resolved(crumple(5, flat, triangles), rest=flat)
    step = crumple(6, first.points, triangles)
    turn = rotation(7) * mirror
    shift = np.array([3.0, -8.0, 5.0])
    there = [points @ turn.T + shift for points in (step[1], step[2], flat)]
    plain = resolved(step, rest=flat, rounds=rounds)
    moved = resolved((triangles, *there[:2]), rest=there[2], rounds=rounds)
    assert plain.largest_correction > 0.01
    assert moved.points == pytest.approx(plain.points @ turn.T + shift, abs=1e-5)
    assert (moved.rounds, moved.zone_nodes) == (plain.rounds, plain.zone_nodes)


def test_units_of_mass_and_length() -> None:
    """Truth: ten times the masses change nothing, ten times the lengths scale the result."""
    step = soup(1)
    plain = resolved(step)
    heavy = resolved(step, mass=np.full(48, 10.0))
    large = resolved((step[0], 10 * step[1], 10 * step[2]), thickness=10 * THICKNESS)
    assert heavy.points == pytest.approx(plain.points, abs=1e-6)
    assert large.points == pytest.approx(10 * plain.points, abs=1e-5)


def test_looking_only_at_what_changed() -> None:
    """Truth: the pairs found are those of the full search that have a changed node."""
    triangles, before, after = soup(2)
    mesh = collision_mesh(before, triangles)
    every = colliding_pairs(mesh, before, after, THICKNESS).nodes
    changed = np.random.default_rng(0).uniform(size=48) < 0.1
    some = colliding_pairs(mesh, before, after, THICKNESS, changed).nodes
    assert 0 < len(some) < len(every)
    assert np.array_equal(some, every[changed[every].any(axis=1)])


def test_rigid_motion() -> None:
    """Truth: a rigid motion is found again; one node only shifts, two turn the short way."""
    rng = np.random.default_rng(4)
    start, mass = rng.normal(size=(9, 3)), rng.uniform(0.1, 3, 9)
    turn = rotation(2)
    assert np.trace(turn) > 1 + 2 * np.cos(2.6)  # below the largest turn allowed
    found, shift = rigid_motion(start, start @ turn.T + [1, 2, 3], mass)
    assert found == pytest.approx(turn, abs=1e-8)
    assert shift == pytest.approx([1, 2, 3], abs=1e-8)
    half, _ = rigid_motion(start, start * [-1, -1, 1], mass)
    angle = np.arccos((np.trace(half) - 1) / 2)
    assert angle == pytest.approx(2.6)  # a turn by 180 degrees would flatten it half-way
    thin = start * [1, 1, 1e-4]
    thin -= mass @ thin / mass.sum()
    mirrored, _ = rigid_motion(thin, thin * [1, 1, -1], mass)
    assert mirrored == pytest.approx(np.eye(3), abs=1e-3)  # not the mirror image
    one, shift = rigid_motion(start[:1], start[:1] + 2.0, mass[:1])
    assert one == pytest.approx(np.eye(3))
    assert shift == pytest.approx(2.0)
    two, _ = rigid_motion(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0.0, 0, 0], [0, 1, 0]]),
                          np.ones(2))  # fmt: skip
    assert two == pytest.approx(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-5)


def test_zones_keep_momentum_and_merge() -> None:
    """Truth: the correction has neither momentum nor moment about the final places."""
    rng = np.random.default_rng(9)
    before, mass = rng.normal(size=(12, 3)), rng.uniform(0.1, 3, 12)
    after = before + 0.3 * rng.normal(size=(12, 3))
    zones = ImpactZones(before, mass, np.zeros(12, bool))
    assert zones.merge(np.array([[0, 1, 2, 3], [6, 7, 8, 9]]))
    assert zones.size() == (2, 8)
    assert not zones.merge(np.array([[0, 3, 1, 2]]))
    assert zones.merge(np.array([[3, 4, 5, 6]]))
    assert zones.size() == (1, 10)
    moved = zones.moved(after)
    change = mass[:, None] * (moved - after)
    assert np.array_equal(moved[10:], after[10:])
    assert change.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    assert np.cross(moved, change).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-8)
    lengths = [np.linalg.norm(x[:10, None] - x[:10], axis=2) for x in (before, moved)]
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-12)


def test_bad_input() -> None:
    """Truth: a start that crosses itself or a weightless free node is refused."""
    triangles, before, after = tip_over_floor(-0.5, 0.5)
    with pytest.raises(ValueError, match="before"):
        resolved((triangles, before, after))
    with pytest.raises(ValueError, match="mass"):
        resolved(tip_over_floor(0.5, 0.4), mass=np.zeros(6))
