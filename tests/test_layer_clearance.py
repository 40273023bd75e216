"""The penalty between layers: folded strips, Taylor's theorem, balance, and where it is nothing."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.layer_pairs import LayerPairs
from avneo_fem.constraints.pair_distance import pair_distance
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.results.layers import closest_layers, least_way_between_layers
from avneo_fem.results.proximity import (
    point_triangle_distance,
    segment_distance,
    triangle_distance,
)
from layer_cases import THICKNESS, cylinder, fold, strip
from shell_cases import rotation
from term_cases import check_derivatives

CLEARANCE, UNRESTRICTED, STIFFNESS, WIDTH = 0.25, 2.0, 30.0, 0.1


def term(mesh: CuspMesh, **changes: float) -> LayerClearance:
    """H = 0.5, c = 0.25 beyond 2 mm, eta_1 = 30 kPa, eta_2 = 0.1 mm."""
    values = {
        "thickness": THICKNESS,
        "clearance": CLEARANCE,
        "unrestricted": UNRESTRICTED,
        "stiffness": STIFFNESS,
        "width": WIDTH,
        **changes,
    }
    return LayerClearance(mesh, **values)


def crumpled(mesh: CuspMesh, gap: float, seed: int) -> np.ndarray:
    """A fold whose upper layer is turned a little, with rough layers: pairs of every kind act."""
    points = fold(mesh, gap)
    upper = mesh.points[:, 0] > 7.0
    points[upper, :2] += [0.11, 0.07]
    return points + np.random.default_rng(seed).uniform(-0.04, 0.04, points.shape)


@pytest.mark.parametrize("gap", [0.05, 0.15, 0.2499])
def test_shortfall_of_a_fold(gap: float) -> None:
    """Truth: parallel layers ``gap`` apart miss the clearance by c - gap."""
    mesh = strip()
    penalty = term(mesh)
    assert penalty.shortfall(fold(mesh, gap)) == pytest.approx(CLEARANCE - gap, abs=1e-12)


def test_energy_of_parallel_layers() -> None:
    """Truth: by hand: nodes above nodes; each sees all triangles at its foot, at the gap, and
    those farther off at theirs; edges that cross or whose ends lie above each other too. Checked
    through its derivative: the force between the layers is dE/d(gap)."""
    mesh = strip()
    penalty = term(mesh)
    points = fold(mesh, 0.2)
    lift = np.zeros_like(points)
    lift[points[:, 2] > 0.199, 2] = 1.0
    step = 1e-6
    change = penalty.energy(points + step * lift) - penalty.energy(points - step * lift)
    assert np.vdot(penalty.gradient(points), lift) == pytest.approx(change / (2 * step), rel=1e-6)
    assert change < 0


def test_one_node_above_a_triangle() -> None:
    """Truth: the formula, eta_1 A eta_2/4 f(d)^2 and the force eta_1 A f(d), by hand.

    Two triangles that share no node, far apart in the template; a corner of the second is d above
    the first, all else is far.
    """
    d, area = 0.22, 2.0
    flat = np.array([[0.0, 0], [2, 0], [0, 2], [10, 0], [12, 0], [10, 2]])
    mesh = CuspMesh(
        flat,
        np.array([[0, 1, 2], [3, 4, 5]]),
        np.array([0, 1]),
        np.array([0.0, 2.0]),
        np.array([5]),
    )
    upper = [[0.5, 0.5, d], [0.7, 0.5, 5.0], [0.5, 0.7, 5.0]]
    points = np.vstack([np.c_[flat[:3], np.zeros(3)], upper])
    penalty = term(mesh, unrestricted=0.0)
    ramp = 1 - 2 * (d - CLEARANCE) / WIDTH
    node = area / 3
    assert penalty.active(points) == 1
    assert penalty.energy(points) == pytest.approx(STIFFNESS * WIDTH / 4 * node * ramp**2)
    force = -penalty.gradient(points)
    assert force[3] == pytest.approx([0.0, 0.0, STIFFNESS * node * ramp])
    assert force[:3, 2] == pytest.approx(-STIFFNESS * node * ramp * np.array([0.5, 0.25, 0.25]))
    assert penalty.shortfall(points) == pytest.approx(CLEARANCE - d)
    penalty.stiffness = 2 * STIFFNESS
    assert -penalty.gradient(points)[3, 2] == pytest.approx(2 * STIFFNESS * node * ramp)


@pytest.mark.parametrize("seed", range(4))
def test_gradient_and_hessian(seed: int) -> None:
    """Truth: Taylor's theorem, remainders of order two for energy and gradient.

    The direction is short, so that no pair changes the kind of its nearest places or leaves the
    ramp: there second derivatives jump. A wide ramp, so that many pairs act.
    """
    mesh = strip()
    points = crumpled(mesh, 0.3, seed)
    penalty = term(mesh, width=0.4, clearance=0.4)
    assert penalty.active(points) > 200
    kinds = {group.is_edges for group in penalty._at(points)}
    assert kinds == {False, True}
    direction = 5e-5 * np.random.default_rng(seed + 20).normal(size=points.shape)
    check_derivatives(penalty, points, direction)


def test_gradient_is_continuous_through_parallel_edges() -> None:
    """Truth: the energy is differentiable where edges become parallel: a perfectly regular fold,
    where all are, has the mean of the slopes to both sides, for any direction."""
    mesh = strip()
    points = fold(mesh, 0.22)
    penalty = term(mesh)
    for seed in range(5):
        way = np.random.default_rng(seed).normal(size=points.shape)
        step = 1e-7
        change = (penalty.energy(points + step * way) - penalty.energy(points)) / step
        back = (penalty.energy(points) - penalty.energy(points - step * way)) / step
        slope = np.vdot(penalty.gradient(points), way)
        size = np.linalg.norm(penalty.gradient(points))
        assert [change, back] == pytest.approx([slope] * 2, abs=1e-3 * size)


def test_projection() -> None:
    """Truth: eigenvalues; on demand no pair's Hessian has negative ones."""
    mesh = strip(0.5)
    points = crumpled(mesh, 0.15, 1)
    penalty = term(mesh)
    exact = np.linalg.eigvalsh(penalty.hessian(points).toarray())
    penalty.project = True
    projected = np.linalg.eigvalsh(penalty.hessian(points).toarray())
    assert exact[0] < -1e-3 * exact[-1]
    assert projected[0] > -1e-10 * projected[-1]


def test_rigid_motions() -> None:
    """Truth: energy and shortfall stay, forces turn; forces and moments are in balance."""
    mesh = strip()
    points = crumpled(mesh, 0.2, 2)
    penalty = term(mesh)
    turn = rotation(3)
    moved = points @ turn.T + [30.0, -8.0, 5.0]
    gradient, energy, short = (
        penalty.gradient(points),
        penalty.energy(points),
        penalty.shortfall(points),
    )
    assert energy > 0
    assert penalty.energy(moved) == pytest.approx(energy, rel=1e-9)
    assert penalty.shortfall(moved) == pytest.approx(short, abs=1e-9)
    size = np.abs(gradient).max()
    np.testing.assert_allclose(penalty.gradient(moved), gradient @ turn.T, atol=1e-8 * size)
    assert np.abs(gradient.sum(axis=0)).max() < 1e-12 * np.abs(gradient).sum()
    assert np.abs(np.cross(points, gradient).sum(axis=0)).max() < 1e-11 * np.abs(gradient).sum()


def nothing(penalty: LayerClearance, points: np.ndarray) -> None:
    """Energy, force, stiffness and shortfall are zero, the matrix is empty."""
    assert penalty.active(points) == 0
    assert penalty.energy(points) == 0.0
    assert not penalty.gradient(points).any()
    hessian = penalty.hessian(points)
    assert hessian.shape == (points.size, points.size)
    assert hessian.nnz == 0
    assert penalty.shortfall(points) == 0.0


def test_nothing_on_a_flat_or_gently_curved_sheet() -> None:
    """Truth: a sheet curved no more tightly than a fold around the clearance has no layers, even
    where the ramp reaches; one just beyond reach of the ramp is left alone as well."""
    mesh = strip(0.2)
    penalty = term(mesh)
    nothing(penalty, np.c_[mesh.points, np.zeros(len(mesh.points))])
    nothing(penalty, cylinder(mesh, 4.0))
    nothing(penalty, fold(mesh, CLEARANCE + WIDTH / 2 + 1e-6))
    assert term(mesh).active(fold(mesh, CLEARANCE + WIDTH / 2 - 1e-3)) > 0


def test_nothing_near_the_suture() -> None:
    """Truth: pairs with a node nearer to the suture than asked are free; 0 clearance asks nothing.

    The fold's lower layer is x < 6, so no lower triangle is beyond 6 mm.
    """
    mesh = strip()
    points = fold(mesh, 0.1)
    nothing(term(mesh, unrestricted=6.1), points)
    nothing(term(mesh, clearance=0.0), points)
    assert term(mesh, unrestricted=4.0).shortfall(points) == pytest.approx(0.15)
    beyond = term(mesh, unrestricted=4.0)
    beyond.energy(points)
    pushed = np.flatnonzero(beyond.gradient(points).any(axis=1))
    assert mesh.distance_to_suture[pushed].min() >= 4.0


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_the_judge(seed: int) -> None:
    """Truth: the judge, which shares no code, finds the same closest approach on rough layers."""
    mesh = strip()
    points = crumpled(mesh, 0.16, seed)
    beyond, _ = closest_layers(
        points,
        mesh.points,
        mesh.triangles,
        mesh.distance_to_suture,
        UNRESTRICTED,
        THICKNESS,
        CLEARANCE,
    )
    assert term(mesh).shortfall(points) == pytest.approx(CLEARANCE - beyond, abs=1e-12)
    assert beyond < 0.2


def test_kept_pairs_follow_the_points() -> None:
    """Truth: a fresh term at every place of a way that opens and closes the fold; also when the
    array is changed in place."""
    mesh = strip()
    penalty = term(mesh)
    points = crumpled(mesh, 0.3, 5)
    places = [crumpled(mesh, gap, 5) for gap in (0.3, 0.27, 0.2, 0.5, 1.5, 0.2)]
    energies = []
    for place in (*places, cylinder(mesh, 4.0), places[0]):
        points[:] = place
        energies.append(penalty.energy(points))
        assert energies[-1] == pytest.approx(term(mesh).energy(points), rel=1e-12)
    assert energies[2] > energies[1] > energies[0] > 0
    assert energies[6] == 0


def test_pairs_are_those_of_the_judges_definition() -> None:
    """Truth: brute force with the judge's distances over all pairs of triangles: those at least
    ``way`` apart in the template, all nodes beyond 2 mm; of their points, faces and edges exactly
    those within reach, each once; the list may hold farther ones."""
    mesh = strip(0.5)
    points = crumpled(mesh, 0.2, 3)
    way, reach = least_way_between_layers(THICKNESS, CLEARANCE), 0.3
    away = mesh.triangles[(mesh.distance_to_suture[mesh.triangles] >= 2.0).all(axis=1)]
    i, j = (k.ravel() for k in np.indices((len(away), len(away))))
    flat = np.c_[mesh.points, np.zeros(len(mesh.points))][away]
    layers = triangle_distance(flat[i], flat[j]) >= way
    first, second = away[i[layers]], away[j[layers]]
    corner = np.vstack([np.c_[first[:, k], second] for k in range(3)])
    near = point_triangle_distance(points[corner[:, 0]], points[corner[:, 1:]]) < reach
    expected_points = {tuple(row) for row in corner[near]}
    sides = [(0, 1), (1, 2), (2, 0)]
    edge = np.vstack([np.c_[first[:, a], second[:, b]] for a in sides for b in sides])
    near = segment_distance(*(points[edge[:, k]] for k in range(4))) < reach
    expected_edges = {
        tuple(sorted((tuple(sorted(row[:2])), tuple(sorted(row[2:]))))) for row in edge[near]
    }
    pairs = LayerPairs(mesh.points, mesh.triangles, mesh.distance_to_suture, 2.0, way, reach)
    nodes, edges = pairs.at(points)
    found = pair_distance(points[nodes], False)[0] < reach
    assert sorted(map(tuple, nodes[found])) == sorted(expected_points)
    found = pair_distance(points[edges], True)[0] < reach
    assert sorted((tuple(r[:2]), tuple(r[2:])) for r in edges[found]) == sorted(expected_edges)
    assert min(len(expected_points), len(expected_edges)) > 50
