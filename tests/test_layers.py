"""The judge's closest approach of the layers of one surface, on folds drawn by hand."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.results.layers import closest_layers, least_way_between_layers, search_radius
from layer_cases import THICKNESS, cylinder, fold, strip
from shell_cases import rotation

CLEARANCE = 0.25


def closest(
    points: np.ndarray, mesh: CuspMesh, unrestricted: float = 2.0, clearance: float = CLEARANCE
) -> tuple[float, float]:
    """H = 0.5 mm."""
    return closest_layers(
        points,
        mesh.points,
        mesh.triangles,
        mesh.distance_to_suture,
        unrestricted,
        THICKNESS,
        clearance,
    )


def test_definition() -> None:
    """Truth: max(2 H, pi/2 c) and max(4 H/pi, c), by hand."""
    assert least_way_between_layers(0.5, 0.25) == 1.0
    assert least_way_between_layers(0.5, 2.0) == pytest.approx(np.pi)
    assert search_radius(0.5, 0.25) == pytest.approx(0.6366, abs=1e-4)
    assert search_radius(0.5, 2.0) == pytest.approx(2.0)


@pytest.mark.parametrize("gap", [1e-4, 0.1, 0.25, 0.4])
@pytest.mark.parametrize("size", [0.2, 0.5])
def test_fold_of_a_strip(gap: float, size: float) -> None:
    """Truth: two parallel layers, half of the strip each, are as far apart as they were drawn.

    The fold is at x = 6 of a strip sutured at x = 0: away from the suture up to 5 mm, near it when
    that counts as far as 6.
    """
    mesh = strip(size)
    points = fold(mesh, gap)
    for unrestricted in (0.0, 2.0, 4.0):
        beyond, near = closest(points, mesh, unrestricted)
        assert beyond == pytest.approx(gap, abs=1e-12)
        if unrestricted:
            assert near == pytest.approx(gap, abs=1e-12)
        else:
            assert near == np.inf
    beyond, near = closest(points, mesh, 6.1)
    assert (beyond, near) == (np.inf, pytest.approx(gap, abs=1e-12))


def test_nothing_on_flat_and_gently_curved_sheets() -> None:
    """Truth: Schur's theorem: curved no more tightly than the half circle of 2 H, radius 2 H/pi,
    a sheet has none; a roll of 2 mm radius, nearly closed, brings its ends together."""
    mesh = strip(0.25)
    assert closest(np.c_[mesh.points, np.zeros(len(mesh.points))], mesh) == (np.inf, np.inf)
    for radius in (20.0, 4.0, 2.1):
        assert closest(cylinder(mesh, radius), mesh) == (np.inf, np.inf)
    ends = 2 * 2.0 * np.sin(np.pi - 12.0 / 4.0)
    assert closest(cylinder(mesh, 2.0), mesh) == (np.inf, pytest.approx(ends, abs=2e-3))
    for gap in (0.64, 1.01):
        assert closest(fold(mesh, gap), mesh) == (np.inf, np.inf)


@pytest.mark.parametrize("clearance", [0.25, 0.9, 2.0])
def test_bending_to_the_clearance_does_not_fail(clearance: float) -> None:
    """Truth: Schur's theorem: half a circle around a gap of the clearance, and the layers beyond
    it, are nowhere nearer than the clearance, but for the sagitta of the triangles' chords;
    clearances below 4 H/pi = 0.64 are found themselves."""
    mesh = strip(0.1)
    radius = clearance / 2
    sagitta = radius - radius * np.cos(0.05 / radius)
    beyond, _ = closest(fold(mesh, clearance), mesh, clearance=clearance)
    assert beyond >= clearance - 2 * sagitta
    assert clearance > 0.64 or beyond == pytest.approx(clearance, abs=1e-12)
    # tighter than that it does
    assert closest(fold(mesh, 0.9 * clearance), mesh, clearance=clearance)[0] < 0.91 * clearance


def two_triangles(second: list[list[float]], apart: float) -> tuple[np.ndarray, CuspMesh]:
    """Triangles far or near in the template, ``apart`` along x; the first lies in z = 0."""
    first = np.array([[0.0, 0, 0], [2, 0, 0], [1, 2, 0]])
    flat = np.vstack([first[:, :2], first[:, :2] + [2 + apart, 0]])
    mesh = CuspMesh(
        flat,
        np.array([[0, 1, 2], [3, 4, 5]]),
        np.array([0, 1]),
        np.array([0.0, 2.0]),
        np.array([5]),
    )
    return np.vstack([first, second]), mesh


def test_edges_and_faces_count() -> None:
    """Truth: by hand: the middle of an edge above the middle of another one, no node being near;
    a node above a face; a triangle through the other."""
    ridge = [[1.0, -1, 0.3], [1, 1, 0.3], [1, 0, 5]]  # above the edge y = 0
    assert closest(*two_triangles(ridge, 1.0), 0.0)[0] == pytest.approx(0.3)
    tip = [[1.0, 0.5, 0.2], [1.2, 0.5, 5], [1, 0.7, 5]]
    assert closest(*two_triangles(tip, 1.0), 0.0)[0] == pytest.approx(0.2)
    blade = [[1.0, 0.5, -2], [1.2, 0.5, 5], [1, 0.7, 5]]
    assert closest(*two_triangles(blade, 1.0), 0.0)[0] == pytest.approx(0.0, abs=1e-15)


def test_neighbours_in_the_template_are_no_layers() -> None:
    """Truth: the definition: all of one triangle at least 2 H from all of the other."""
    tip = [[1.0, 0.5, 0.2], [1.2, 0.5, 5], [1, 0.7, 5]]
    assert closest(*two_triangles(tip, 0.99), 0.0) == (np.inf, np.inf)
    points, mesh = two_triangles(tip, 1.01)
    assert closest(points, mesh, 0.0) == (pytest.approx(0.2), np.inf)
    # the first has its side y = 0 on the suture
    assert closest(points, mesh, 0.1) == (np.inf, pytest.approx(0.2))


def test_a_hinge_folded_shut_is_no_pair_of_layers() -> None:
    """Truth: triangles that share a node are 0 apart in the template."""
    flat = np.array([[0.0, 0], [2, 0], [1, 2], [1, -2]])
    mesh = CuspMesh(
        flat, np.array([[0, 1, 2], [0, 3, 1]]), np.array([0, 3]), np.array([0.0, 2]), np.array([2])
    )
    points = np.array([[0.0, 0, 0], [2, 0, 0], [1, 2, 0], [1, 2, 0.01]])
    assert closest(points, mesh, 0.0) == (np.inf, np.inf)


def test_rigid_motions_and_numbering() -> None:
    """Truth: distances stay when the fold is turned and shifted, and triangles are reordered."""
    mesh = strip()
    random = np.random.default_rng(4)
    points = fold(mesh, 0.3) + random.uniform(-0.05, 0.05, (len(mesh.points), 3))
    found = closest(points, mesh)
    assert found[0] < 0.3
    moved = points @ rotation(5).T + [100.0, -20.0, 3.0]
    assert closest(moved, mesh) == pytest.approx(found, abs=1e-11)
    order = random.permutation(len(mesh.triangles))
    other = CuspMesh(
        mesh.points,
        np.roll(mesh.triangles[order], 1, axis=1),
        mesh.suture_line,
        mesh.suture_arc_length,
        mesh.free_edge,
    )
    assert closest(points, other) == pytest.approx(found, abs=1e-12)
