"""Topology and measures of triangulated templates against counting and brute force."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from avneo_fem.meshing.cusp_mesh import CuspMesh
from mesh_cases import TEMPLATES, mesh_of

SQUARE = CuspMesh(
    points=np.array([[0.0, 2.0], [0.0, 0.0], [3.0, 0.0], [3.0, 2.0]]),
    triangles=np.array([[0, 1, 2], [0, 2, 3]]),
    suture_line=np.array([0, 1, 2, 3]),
    suture_arc_length=np.array([0.0, 2.0, 5.0, 7.0]),
    free_edge=np.array([0, 3]),
)


def test_square_by_hand() -> None:
    """Truth: a rectangle of two triangles, drawn on paper."""
    assert SQUARE.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert SQUARE.cell_edges.tolist() == [[3, 1, 0], [4, 2, 1]]
    assert [sorted(row) for row in SQUARE.edge_cells.tolist()] == [
        [-1, 0],
        [0, 1],
        [-1, 1],
        [-1, 0],
        [-1, 1],
    ]
    assert SQUARE.cell_areas.tolist() == [3.0, 3.0]
    assert SQUARE.area == 6.0
    assert SQUARE.node_areas.tolist() == [2.0, 1.0, 2.0, 1.0]
    assert SQUARE.suture_edges.tolist() == [0, 3, 4]
    assert SQUARE.distance_to_suture.tolist() == [0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", TEMPLATES)
def test_edges_by_counting(name: str) -> None:
    """Truth: sides of all triangles, counted in Python; Euler's formula for a disc."""
    mesh = mesh_of(name, 2.0)
    cells_of: dict[tuple[int, int], set[int]] = {}
    for cell, corners in enumerate(mesh.triangles.tolist()):
        for local in range(3):
            side = tuple(sorted({*corners} - {corners[local]}))
            cells_of.setdefault(side, set()).add(cell)
            assert tuple(mesh.edges[mesh.cell_edges[cell, local]]) == side
    assert list(map(tuple, mesh.edges.tolist())) == sorted(cells_of)
    for edge, cells in zip(mesh.edges.tolist(), mesh.edge_cells.tolist(), strict=True):
        assert set(cells) - {-1} == cells_of[tuple(edge)]
        assert cells[0] != -1
    assert len(mesh.points) - len(mesh.edges) + len(mesh.triangles) == 1


@pytest.mark.parametrize("name", TEMPLATES)
def test_tags_cover_the_boundary_exactly(name: str) -> None:
    """Truth: sides with one triangle are the suture line and the free edge; only corners shared."""
    mesh = mesh_of(name, 2.0)
    alone = Counter(map(tuple, mesh.edges[mesh.edge_cells[:, 1] < 0].tolist()))
    suture = [tuple(sorted(pair)) for pair in pairwise(mesh.suture_line.tolist())]
    free = [tuple(sorted(pair)) for pair in pairwise(mesh.free_edge.tolist())]
    assert Counter(suture) + Counter(free) == alone
    assert set(mesh.suture_line.tolist()) & set(mesh.free_edge.tolist()) == {
        mesh.suture_line[0],
        mesh.suture_line[-1],
    }
    assert mesh.free_edge[[0, -1]].tolist() == mesh.suture_line[[0, -1]].tolist()
    assert list(map(tuple, mesh.edges[mesh.suture_edges].tolist())) == suture


def test_areas_add_up() -> None:
    """Truth: the shoelace formula of the boundary polygon, for cells and for node shares."""
    mesh = mesh_of("experiment 1", 2.0)
    outline = mesh.points[np.r_[mesh.suture_line, mesh.free_edge[-2:0:-1]]]
    x, y = outline.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert mesh.area == pytest.approx(shoelace, rel=1e-13)
    assert mesh.node_areas.sum() == pytest.approx(shoelace, rel=1e-13)
    node = len(mesh.points) - 1
    around = mesh.cell_areas[(mesh.triangles == node).any(axis=1)]
    assert mesh.node_areas[node] == pytest.approx(around.sum() / 3.0, rel=1e-13)


@pytest.mark.parametrize("name", ["experiment 1", "experiment 3, cusp 1", "high apex"])
def test_distance_to_suture_by_brute_force(name: str) -> None:
    """Truth: the nearest of 400 points on each piece of the suture polyline."""
    mesh = mesh_of(name, 3.0)
    line = mesh.points[mesh.suture_line]
    share = np.linspace(0.0, 1.0, 401)[:, None, None]
    samples = ((1.0 - share) * line[:-1] + share * line[1:]).reshape(-1, 2)
    gaps = np.linalg.norm(mesh.points[:, None] - samples[None], axis=2).min(axis=1)
    # the nearest sample is at most half a spacing along the line from the foot of the distance
    spacing = np.linalg.norm(np.diff(line, axis=0), axis=1).max() / 400
    exact = mesh.distance_to_suture
    assert np.all(gaps >= exact - 1e-12)
    assert np.all(gaps <= np.hypot(exact, spacing / 2) + 1e-12)
    assert np.all(exact[mesh.suture_line] < 1e-12)
    assert np.count_nonzero(exact < 1e-9) == len(mesh.suture_line)


def test_edges_between_by_hand() -> None:
    """Truth: the rectangle's edges, numbered on paper, along chains in either direction and across;
    a single node has none."""
    assert SQUARE.edges_between(np.array([0, 1, 2, 3, 0])).tolist() == [0, 3, 4, 2]
    assert SQUARE.edges_between(np.array([3, 2, 0])).tolist() == [4, 1]
    assert SQUARE.edges_between(np.array([2])).tolist() == []


@pytest.mark.parametrize("name", TEMPLATES)
def test_edges_between(name: str) -> None:
    """Truth: the edge with just these two ends, for the free edge, for it backwards, and for the
    two sides of every edge; along the free edge each has one triangle."""
    mesh = mesh_of(name, 2.0)
    found = mesh.edges_between(mesh.free_edge)
    pairs = [sorted(pair) for pair in pairwise(mesh.free_edge.tolist())]
    assert mesh.edges[found].tolist() == pairs
    assert (mesh.edge_cells[found, 1] < 0).all()
    np.testing.assert_array_equal(mesh.edges_between(mesh.free_edge[::-1]), found[::-1])
    for number, edge in enumerate(mesh.edges):
        assert mesh.edges_between(edge).tolist() == [number]
        assert mesh.edges_between(edge[::-1]).tolist() == [number]
