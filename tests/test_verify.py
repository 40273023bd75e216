"""The independent judge: crossings, distances, containment, edges and the verdict."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import hypothesis.extra.numpy as hnp
import hypothesis.strategies as st
import ipctk
import numpy as np
import pytest
from hypothesis import given, settings
from scipy.optimize import linprog, nnls

import avneo_fem.results
from avneo_fem.errors import SolveError
from avneo_fem.results.containment import wedge_distance
from avneo_fem.results.proximity import near_boxes, triangle_distance
from avneo_fem.results.verify import (
    Constraints,
    CuspSurface,
    CuspVerification,
    Tolerances,
    ValveVerification,
    clamp_error_deg,
    cusp_intersections,
    edges_outside_wedge_mm,
    free_edge_sag_mm,
    judge,
    min_distance,
    min_wall_distance,
    outside_root_mm,
    outside_wedge_mm,
    self_intersections,
    suture_error_mm,
    verify_valve,
    wall_excess,
)

PAIR = np.array([[0, 1, 2], [3, 4, 5]])


def sheet(n: int, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Flat square of n × n cells, each halved, counter-clockwise seen from +z."""
    u = np.linspace(0.0, size, n + 1)
    x, y = np.meshgrid(u, u, indexing="ij")
    node = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (q.ravel() for q in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return points, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def rigid(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A rotation and a shift."""
    random = np.random.default_rng(seed)
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q)), random.normal(size=3)


def exact_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Distance of two convex hulls by non-negative least squares, weights summing to one."""
    weight = 1e5
    matrix = np.vstack([np.hstack([a.T, -b.T]), np.kron(np.eye(2), np.full(3, weight))])
    return float(nnls(matrix, np.array([0.0, 0.0, 0.0, weight, weight]))[1])


# --- crossings -----------------------------------------------------------------------------------


def test_triangles_meet_where_convex_combinations_agree():
    """Truth: linear programming finds a common point. Small integers make touching common."""
    random = np.random.default_rng(1)
    seen = set()
    for _ in range(100):
        corners = random.integers(-2, 3, size=(6, 3)).astype(float)
        corners[:, 2] *= random.integers(0, 2)  # half of the pairs are coplanar
        a, b = corners[:3], corners[3:]
        equal = np.vstack([np.hstack([a.T, -b.T]), np.kron(np.eye(2), np.ones(3))])
        found = linprog(np.zeros(6), A_eq=equal, b_eq=[0, 0, 0, 1, 1], method="highs").status == 0
        assert self_intersections(corners, PAIR) == found, corners
        seen.add((found, bool(corners[:, 2].any())))
    assert len(seen) == 4


def test_triangle_distance_against_least_squares():
    """Truth: non-negative least squares on the convex combinations of both corners."""
    random = np.random.default_rng(2)
    a, b = random.normal(size=(2, 200, 3, 3))
    b += random.normal(size=(200, 1, 3))
    b[:20, 2] = 0.5 * (b[:20, 0] + b[:20, 1])  # without area
    expected = [exact_distance(p, q) for p, q in zip(a, b, strict=True)]
    np.testing.assert_allclose(triangle_distance(a, b), expected, atol=1e-6)


@pytest.mark.parametrize("n", [1, 3, 10])
def test_known_number_of_crossings(n):
    """Truth: a plane x = const between grid lines cuts both halves of the n cells it passes."""
    points, triangles = sheet(n)
    x = 0.37 / n
    blade = np.array([[x, -5.0, -1.0], [x, 5.0, -1.0], [x, 0.5, 9.0]])
    assert cusp_intersections([(points, triangles), (blade, PAIR[:1])]) == 2 * n
    joined = np.vstack([triangles, PAIR[:1] + len(points)])
    assert self_intersections(np.vstack([points, blade]), joined) == 2 * n
    assert (
        cusp_intersections([(points, triangles), (blade + np.array([5.0, 0.0, 0.0]), PAIR[:1])])
        == 0
    )
    three = [
        (points, triangles),
        (blade, PAIR[:1]),
        (blade + np.array([0.1 / n, 0.0, 0.0]), PAIR[:1]),
    ]
    assert cusp_intersections(three) == 4 * n


def test_touching_counts_and_neighbours_do_not():
    """Truth: by construction; a vertex on a face, a copy in the same plane, a hinge folded flat."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    tip = np.array([[0.2, 0.2, 0.0], [0.2, 0.3, 1.0], [0.3, 0.2, 1.0]])
    assert self_intersections(np.vstack([flat, tip]), PAIR) == 1
    assert self_intersections(np.vstack([flat, tip + np.array([0.0, 0.0, 1e-6])]), PAIR) == 0
    assert self_intersections(np.vstack([flat, 0.1 * flat + 0.1 * flat.sum(axis=0)]), PAIR) == 1
    assert self_intersections(np.vstack([flat, flat + np.array([2.0, 0.0, 0.0])]), PAIR) == 0
    hinge = np.vstack([flat, [[0.1, 0.1, 0.0]]])
    assert self_intersections(hinge, np.array([[0, 1, 2], [1, 0, 3]])) == 0


def test_zero_or_not_agrees_with_ipctk_and_is_invariant():
    """Truth: ipctk's own intersection test; rigid motion and numbering change no count."""
    seen = set()
    flat, triangles = sheet(12)
    for seed in range(12):
        random = np.random.default_rng(seed)
        points = flat + random.normal(size=flat.shape) * 0.006 * (1 + seed)
        count = self_intersections(points, triangles)
        edges = ipctk.edges(triangles.astype(np.int32))
        collision_mesh = ipctk.CollisionMesh(points, edges, triangles.astype(np.int32))
        assert (count > 0) == ipctk.has_intersections(collision_mesh, points)
        rotation, shift = rigid(seed)
        mixed = random.permutation(triangles)[:, [1, 2, 0]]
        assert self_intersections(points @ rotation.T + shift, mixed) == count
        seen.add(count > 0)
    assert seen == {True, False}


@settings(deadline=None, max_examples=60)
@given(
    hnp.arrays(float, (7, 3), elements=st.floats(-3, 3)),
    hnp.arrays(float, (9, 3), elements=st.floats(-3, 3)),
    hnp.arrays(float, (16,), elements=st.floats(0, 4)),
    st.floats(0, 1),
)
def test_near_boxes_against_all_pairs(lower_a, lower_b, size, reach):
    """Truth: comparing every box with every other; sizes differ, so size classes are crossed."""
    sizes = 10.0 ** (size[:, None] - 3.0)
    upper_a, upper_b = lower_a + sizes[:7], lower_b + sizes[7:]
    gap = np.maximum(lower_a[:, None] - upper_b, lower_b - upper_a[:, None]).max(axis=2)
    found = near_boxes(lower_a, upper_a, lower_b, upper_b, reach)
    assert sorted(map(tuple, found)) == sorted(map(tuple, np.argwhere(gap <= reach)))


# --- distances -----------------------------------------------------------------------------------


def test_min_distance_closed_forms():
    """Truth: parallel sheets; two skew edges; surfaces that cross; both orders agree."""
    points, triangles = sheet(6)
    for height in (0.05, 3.0):
        above = points + np.array([0.03, 0.02, height])
        assert min_distance(points, triangles, above, triangles) == pytest.approx(height)
    a = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    b = np.array([[0.0, -1.0, 0.25], [0.0, 1.0, 0.25], [0.0, 0.0, 2.0]])
    assert min_distance(a, PAIR[:1], b, PAIR[:1]) == pytest.approx(0.25)
    assert min_distance(a, PAIR[:1], b - [0.0, 0.0, 0.5], PAIR[:1]) == 0.0


def test_min_distance_against_all_pairs():
    """Truth: least squares over all pairs of triangles, on crumpled sheets; spare nodes ignored."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        flat, triangles = sheet(3)
        a = flat + random.normal(size=flat.shape) * 0.1
        b = flat @ rigid(seed)[0].T + [0.0, 0.0, 1.2] + random.normal(size=flat.shape) * 0.1
        expected = min(exact_distance(p, q) for p in a[triangles] for q in b[triangles])
        padded = np.vstack([a, b[:1]])
        assert min_distance(padded, triangles, b, triangles) == pytest.approx(expected, abs=1e-6)
        assert min_distance(b, triangles, a, triangles) == pytest.approx(expected, abs=1e-6)


# --- wall and wedge ------------------------------------------------------------------------------


def test_wall_distances():
    """Truth: points at known radii; the taper leaves out what is near the suture."""
    radii, angle = np.array([3.0, 11.0, 12.0, 12.7]), np.array([0.3, 2.0, 4.0, 5.5])
    points = np.column_stack([radii * np.cos(angle), radii * np.sin(angle), [1.0, -3.0, 0.0, 9.0]])
    np.testing.assert_allclose(wall_excess(points, 12.0), radii - 12.0, atol=1e-12)
    assert outside_root_mm(points, 12.0) == pytest.approx(0.7)
    assert outside_root_mm(points[:2], 12.0) == 0.0
    away = np.array([9.0, 2.5, 0.0, 1.0])
    assert min_wall_distance(points, 12.0, away, 2.5) == pytest.approx(1.0)
    assert min_wall_distance(points, 12.0, away, 0.0) == pytest.approx(-0.7)
    assert min_wall_distance(points, 12.0, away, 99.0) == np.inf


@pytest.mark.parametrize("opening", [40.0, 120.0, 180.0, 260.0])
@pytest.mark.parametrize("extended", [False, True])
def test_wedge_of_two_straight_arms(opening, extended):
    """Truth: a corner's distance in closed form, also near and behind the apex."""
    half = np.radians(opening / 2.0)
    arms = np.array([[np.cos(half), np.sin(half)], [np.cos(half), -np.sin(half)]])
    along = np.linspace(100.0 if extended else 2.0, 0.0, 40)[:, None]
    curve = np.vstack([along * arms[0], (along * arms[1])[::-1][1:]])
    random = np.random.default_rng(0)
    radius, angle = 10.0 ** random.uniform(-6, 1, 400), random.uniform(-np.pi, np.pi, 400)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 7.0 * angle])
    off = np.abs(np.abs(angle) - half)  # angle from the nearer arm
    truth = radius * np.where(off < np.pi / 2.0, np.sin(off), 1.0)
    truth *= np.where(np.abs(angle) < half, 1.0, -1.0)
    inside = np.array([1e-3, 0.0])
    found = wedge_distance(points, curve, inside)
    np.testing.assert_allclose(found, truth, atol=1e-11)
    np.testing.assert_allclose(wedge_distance(points, curve[::-1], inside), found, atol=1e-11)
    np.testing.assert_allclose(wedge_distance(points, curve, [-9.0, 0.0]), -found, atol=1e-11)
    assert outside_wedge_mm(points, curve, inside) == pytest.approx(-truth.min())
    assert outside_wedge_mm(points[truth > 0], curve, inside) == 0.0


def test_edges_cut_a_corner():
    """Truth: nodes on both arms' sides of a reflex corner are inside; the middle of the edge
    between them is as deep outside as the corner sticks out, and where nothing is near no edge is
    outside."""
    curve = np.array([[0.0, 5.0], [0.0, 0.0], [0.0, 0.0], [5.0, 0.0]])
    inside = np.array([-1.0, -1.0])
    points = np.array([[-0.2, 1.0, 0.0], [1.0, -0.2, 0.0], [-9.0, -9.0, 0.0], [-9.0, -8.0, 1.0]])
    assert outside_wedge_mm(points, curve, inside) == 0.0
    # halfway the edge is at (0.4, 0.4)
    found = edges_outside_wedge_mm(points, np.array([[0, 1, 2]]), curve, inside)
    assert found == pytest.approx(0.4)
    assert edges_outside_wedge_mm(points, np.array([[0, 2, 3]]), curve, inside) == 0.0


def test_wedge_along_a_winding_curve():
    """Truth: a step along the normal, shorter than the radius of curvature, is the distance."""
    t = np.linspace(-3.0, 3.0, 2001)
    curve = np.column_stack([t, np.sin(2.0 * t)])
    tangent = np.column_stack([np.ones_like(t), 2.0 * np.cos(2.0 * t)])
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for step in (-0.2, -1e-3, 1e-3, 0.2):
        points = np.column_stack([curve + step * normal, t])[100:-100:17]
        assert wedge_distance(points, curve, [0.0, 50.0]) == pytest.approx(step, abs=1e-5)


def test_wedge_rejects_a_reference_on_the_curve():
    """Truth: a point on the curve is on neither side; one point is no curve."""
    with pytest.raises(ValueError, match="lies on the wedge curve"):
        wedge_distance(np.zeros((1, 3)), np.array([[0.0, 0.0], [1.0, 0.0]]), [5.0, 0.0])
    with pytest.raises(ValueError, match="two different points"):
        wedge_distance(np.zeros((1, 3)), np.zeros((3, 2)), [5.0, 0.0])


# --- edges ---------------------------------------------------------------------------------------


def test_suture_error():
    """Truth: one node shifted by (3, 4, 12)·1e-7."""
    targets = np.random.default_rng(0).normal(size=(5, 3))
    moved = targets.copy()
    moved[3] += np.array([3.0, 4.0, 12.0]) * 1e-7
    assert suture_error_mm(moved, targets) == pytest.approx(1.3e-6)
    with pytest.raises(ValueError, match="targets"):
        suture_error_mm(moved, targets[:2])


@pytest.mark.parametrize("degrees", [0.0, 5.0, -90.0, 179.0])
def test_clamp_error_is_the_angle_about_the_edge(degrees):
    """Truth: a flat sheet whose prescribed conormals were turned about its edges; -y is outward.

    Parts along the edge, length of the conormal and sense of the edge do not count.
    """
    points, triangles = sheet(3)
    edges = np.array([[0, 4], [8, 4], [8, 12]])  # y = 0, one of them backwards
    turn = np.radians(degrees) * np.array([0.5, -1.0, 0.0])
    prescribed = np.column_stack([[0.7, -2.0, 0.0], -np.cos(turn), np.sin(turn)]) * 3.0
    rotation, shift = rigid(3)
    largest, rms = clamp_error_deg(
        points @ rotation.T + shift, triangles, edges, prescribed @ rotation.T
    )
    assert largest == pytest.approx(abs(degrees), abs=1e-6)
    assert rms == pytest.approx(abs(degrees) * np.sqrt(1.25 / 3.0), abs=1e-6)


def test_clamp_error_of_a_curved_cusp_is_half_the_turn_of_one_triangle():
    """Truth: the chord of an arc leaves its tangent by half the arc's angle."""
    points, triangles = sheet(10)
    bend = 0.8  # curvature
    y = points[:, 1]
    rolled = np.column_stack([points[:, 0], np.sin(bend * y) / bend, (1 - np.cos(bend * y)) / bend])
    edges = np.array([[0, 11], [11, 22]])
    outward = np.tile([0.0, -1.0, 0.0], (2, 1))
    largest, _ = clamp_error_deg(rolled, triangles, edges, outward)
    assert largest == pytest.approx(np.degrees(bend * 0.1 / 2.0), rel=1e-9)


def test_clamp_error_rejects_what_has_no_angle():
    """Truth: interior edges, no edges, conormals along the edge have no angle; no area is nan."""
    points, triangles = sheet(3)
    down = np.array([[0.0, -1.0, 0.0]])
    for edges in ([[1, 5]], [[0, 15]], np.empty((0, 2), int)):
        with pytest.raises(ValueError, match="exactly one triangle"):
            clamp_error_deg(points, triangles, np.array(edges), down[: len(edges)])
    with pytest.raises(ValueError, match="along its suture edge"):
        clamp_error_deg(points, triangles, np.array([[0, 4]]), np.array([[1.0, 0.0, 0.0]]))
    assert np.isnan(clamp_error_deg(points * [1, 0, 1], triangles, np.array([[0, 4]]), down)).all()


def test_free_edge_sag():
    """Truth: heights over a tilted plane, built from it."""
    rotation, origin = rigid(5)
    height, asked = np.array([0.0, 1.0, 2.4]), np.array([0.0, 1.2, 2.5])
    across = np.random.default_rng(0).normal(size=(3, 2))
    points = origin + np.column_stack([across, height]) @ rotation.T
    normal = rotation[:, 2]
    assert free_edge_sag_mm(points, asked, origin, normal, 0.0) == pytest.approx(0.2)
    assert free_edge_sag_mm(points, asked, origin, normal, 0.3) == pytest.approx(0.5)
    assert free_edge_sag_mm(points, asked, origin, normal, -1.0) == 0.0


# --- the whole valve -----------------------------------------------------------------------------


def patch(height: float) -> CuspSurface:
    """A flat square "cusp" at z = height, sutured along y = 0, its free edge at y = 1."""
    points, triangles = sheet(4)
    template, y = points[:, :2], points[:, 1].copy()
    points = points + np.array([0.0, 0.0, height])
    sutured, free = np.flatnonzero(y == 0.0), np.flatnonzero(y == 1.0)
    return CuspSurface(
        points=points,
        template_points=template,
        triangles=triangles,
        suture_nodes=sutured,
        suture_targets=points[sutured],
        suture_edges=np.column_stack([sutured[:-1], sutured[1:]]),
        prescribed_conormals=np.tile([0.0, -1.0, 0.0], (len(sutured) - 1, 1)),
        free_edge_nodes=free,
        template_height=np.full(len(free), 0.5),
        distance_to_suture=y,
        thickness=0.1,
    )


BOUNDS = Constraints(
    radius=2.0,
    wedge=np.array([[1.25, -1.0], [1.25, 1.0]]),
    wedge_inside=np.array([0.0, 0.0]),
    plane_point=np.zeros(3),
    plane_normal=np.array([0.0, 0.0, 1.0]),
    free_edge_clearance=0.1,
    taper=0.5,
    layer_clearance=0.05,
    unrestricted=0.4,
)


def test_verify_valve_of_flat_patches():
    """Truth: three parallel squares at z = 0.2, 1 and 2.5, by hand."""
    surfaces = [patch(0.2), patch(1.0), patch(2.5)]
    valve = verify_valve(surfaces, [BOUNDS] * 3, [1e-9, 2e-9, 3e-9])
    assert [cusp.residual for cusp in valve.cusps] == [1e-9, 2e-9, 3e-9]
    assert [cusp.free_edge_sag_mm for cusp in valve.cusps] == pytest.approx([0.4, 0.0, 0.0])
    for cusp in valve.cusps:
        assert (cusp.suture_error_mm, cusp.outside_root_mm, cusp.outside_wedge_mm) == (0, 0, 0)
        assert (cusp.clamp_error_deg, cusp.self_intersections) == ((0.0, 0.0), 0)
        assert (cusp.closest_layers_mm, cusp.closest_layers_near_suture_mm) == (np.inf, np.inf)
    assert (valve.cusp_intersections, valve.min_distance_mm) == (0, pytest.approx(0.8))
    assert valve.min_wall_distance_mm == pytest.approx(2.0 - np.sqrt(2.0))
    upside_down = replace(surfaces[0], distance_to_suture=1.0 - surfaces[0].distance_to_suture)
    only_lower_half = verify_valve([upside_down], [BOUNDS], [0.0])
    assert only_lower_half.min_wall_distance_mm == pytest.approx(2.0 - np.sqrt(1.25))
    assert only_lower_half.min_distance_mm == np.inf
    [failure] = judge(valve, Tolerances(residual=1e-8))
    assert failure == "cusp 0: free edge sags by 0.4 mm, allowed 0.1 mm"


def test_verify_valve_of_a_folded_patch():
    """Truth: the patch folded at x = 1/2 into layers 0.02 apart, 4 H from the suture and nearer;
    asked for 0.05 less the tolerance it fails where no suture excuses it."""
    surface = patch(1.0)
    x = surface.points[:, 0]
    upper = x > 0.6
    points = surface.points.copy()
    points[upper, 0] = 1.0 - x[upper]
    points[upper, 2] += 0.02
    points[(x > 0.4) & ~upper, 2] += 0.01
    folded = replace(surface, points=points)
    [cusp] = verify_valve([folded], [BOUNDS], [0.0]).cusps
    assert cusp.closest_layers_mm == pytest.approx(0.02, abs=2e-3)
    assert cusp.closest_layers_near_suture_mm == pytest.approx(0.02, abs=2e-3)
    [cusp] = verify_valve([folded], [replace(BOUNDS, unrestricted=2.0)], [0.0]).cusps
    assert cusp.closest_layers_mm == np.inf
    asked = Tolerances(residual=1.0, sag_mm=9.0, inside_mm=0.01, layer_distance_mm=0.05)
    failures = judge(verify_valve([folded], [BOUNDS], [0.0]), asked)
    assert sum(text.startswith("cusp 0: layers come within 0.0") for text in failures) == 1


def test_verify_valve_of_crossing_patches():
    """Truth: copies in one place meet everywhere, are 0 mm apart and beyond a shifted wedge."""
    tight = replace(BOUNDS, wedge=BOUNDS.wedge - [0.5, 0.0], radius=1.0)
    valve = verify_valve([patch(1.0), patch(1.0)], [BOUNDS, tight], [0.0, 0.0])
    assert valve.cusp_intersections >= 32
    assert valve.min_distance_mm == 0.0
    assert valve.cusps[1].outside_wedge_mm == pytest.approx(0.25)
    assert valve.cusps[1].outside_root_mm == pytest.approx(np.sqrt(2.0) - 1.0)
    text = "\n".join(judge(valve, Tolerances(residual=1e-8)))
    for part in (
        "cusps cross each other",
        "cusp 1: beyond its contact wedge by 0.25 mm",
        "cusp 1: outside the root by 0.414 mm",
        "distance from the wall -0.414 mm",
    ):
        assert part in text
    assert "cusp 0" not in text
    with pytest.raises(ValueError, match="zip"):
        verify_valve([patch(1.0)], [BOUNDS] * 2, [0.0])


GOOD = CuspVerification(1e-9, 1e-12, (9.0, 4.0), 0.01, 0.02, 0.04, 0.05, 0, 0.24, 0.21, 0.001)
LIMITS = Tolerances(
    residual=1e-8,
    clamp_deg=5.0,
    cusp_distance_mm=0.5,
    wall_distance_mm=0.25,
    layer_distance_mm=0.25,
)


@pytest.mark.parametrize(
    ("field", "value", "part"),
    [
        ("residual", 2e-8, "residual 2e-08, allowed 1e-08"),
        ("suture_error_mm", 2e-6, "off its line by 2e-06 mm"),
        ("clamp_error_deg", (9.0, 5.1), "clamp off its half-plane (rms) by 5.1 degrees"),
        ("outside_root_mm", 0.06, "outside the root by 0.06 mm, allowed 0.05 mm"),
        ("outside_wedge_mm", 0.07, "contact wedge by 0.07 mm"),
        ("free_edge_sag_mm", 0.11, "sags by 0.11 mm"),
        ("self_intersections", 3, "crosses itself in 3 pairs"),
        ("closest_layers_mm", 0.19, "layers come within 0.19 mm, required 0.2 mm"),
        ("closest_layers_mm", np.nan, "layers come within nan mm"),
        ("residual", np.nan, "residual nan"),
    ],
)
def test_judge_names_each_failure_of_a_cusp(field, value, part):
    """Truth: one figure beyond its tolerance gives exactly one line, with cusp and figure."""
    valve = ValveVerification((GOOD, GOOD), 0, 0.45, 0.24)
    assert judge(valve, LIMITS) == []
    [failure] = judge(replace(valve, cusps=(GOOD, replace(GOOD, **{field: value}))), LIMITS)
    assert failure.startswith("cusp 1: ")
    assert part in failure


@pytest.mark.parametrize(
    ("field", "value", "part"),
    [
        ("cusp_intersections", 7, "cross each other in 7 pairs"),
        ("min_distance_mm", 0.39, "distance of cusps 0.39 mm, required 0.4 mm"),
        ("min_wall_distance_mm", 0.19, "distance from the wall 0.19 mm, required 0.2 mm"),
        ("min_distance_mm", np.nan, "distance of cusps nan"),
    ],
)
def test_judge_names_each_failure_of_the_valve(field, value, part):
    """Truth: as for a cusp; the clearances may be missed by the inside tolerance, or twice it."""
    valve = ValveVerification((GOOD, GOOD), 0, 0.45, 0.24)
    [failure] = judge(replace(valve, **{field: value}), LIMITS)
    assert part in failure


def test_inputs_that_cannot_be_judged():
    """Truth: lost nodes are a solver failure; shapes that do not fit, tolerances < 0 are bugs."""
    surface = patch(0.0)
    lost = surface.points.copy()
    lost[3, 1] = np.nan
    with pytest.raises(SolveError, match="1 of 25"):
        replace(surface, points=lost)
    with pytest.raises(ValueError, match="template_height"):
        replace(surface, template_height=np.zeros(2))
    with pytest.raises(ValueError, match="sag_mm"):
        Tolerances(residual=1.0, sag_mm=np.nan)


def test_the_judge_shares_nothing_with_the_solver():
    """Truth: the import statements of verify.py and, transitively, of all it imports: nothing
    but avneo_fem.errors and the results package, no finite-element library."""
    folder = Path(avneo_fem.results.__file__).parent
    waiting, seen = ["verify"], set()
    while waiting:
        module = waiting.pop()
        seen.add(module)
        for node in ast.walk(ast.parse((folder / f"{module}.py").read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or "."] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert not name.startswith((".", "dolfinx", "petsc4py", "ufl", "mpi4py")), module
                package = ".".join(name.split(".")[:2])
                assert package in {"avneo_fem.errors", "avneo_fem.results"} or not name.startswith(
                    "avneo_fem"
                ), (module, name)
                if package == "avneo_fem.results" and name.split(".")[2] not in seen:
                    waiting.append(name.split(".")[2])
    assert {"crossings", "containment", "layers", "measures", "verdict"} <= seen
