"""Refined meshes against counting, the true curves and the functions that they carry over."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.curve import PlanarPath
from avneo_fem.geometry.segments import Line
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.refine import nested_meshes, prolong, refine
from avneo_fem.meshing.triangulate import triangulate_template
from mesh_cases import TEMPLATES, mesh_of

COARSE = 3.0
EACH = pytest.mark.parametrize("name", TEMPLATES)


@dataclass(frozen=True)
class Polygon:
    """A template of straight edges: refining it moves no node off the old triangles."""

    suture_line: PlanarPath
    free_edge: PlanarPath


def polygon() -> Polygon:
    """A pentagon whose free edge has an apex."""
    corners = [(-5.0, 4.0), (-4.0, -1.0), (4.5, -2.0), (5.0, 4.0)]
    suture = [Line(a, b) for a, b in pairwise(corners)]
    return Polygon(
        PlanarPath(suture),
        PlanarPath([Line(corners[0], (0.0, 5.0)), Line((0.0, 5.0), corners[-1])]),
    )


def refined(name: str) -> tuple[CuspMesh, CuspMesh]:
    """A coarse mesh and its refinement."""
    mesh = mesh_of(name, COARSE)
    return mesh, refine(mesh, TEMPLATES[name])


def moved(mesh: CuspMesh) -> np.ndarray:
    """Nodes of the refinement that were put on the curve."""
    return len(mesh.points) + mesh.suture_edges


def edge_lengths(mesh: CuspMesh) -> np.ndarray:
    return np.linalg.norm(np.diff(mesh.points[mesh.edges], axis=1)[:, 0], axis=1)


@EACH
def test_counts(name: str) -> None:
    """Truth: four triangles for one, a new node in every edge, two edges for one and three in
    every triangle; Euler's formula for a disc; all nodes in use, chains twice as long less one."""
    mesh, fine = refined(name)
    nodes, edges, cells = len(mesh.points), len(mesh.edges), len(mesh.triangles)
    assert len(fine.triangles) == 4 * cells
    assert len(fine.points) == nodes + edges
    assert len(fine.edges) == 2 * edges + 3 * cells
    assert len(fine.points) - len(fine.edges) + len(fine.triangles) == 1
    np.testing.assert_array_equal(np.unique(fine.triangles), np.arange(nodes + edges))
    assert len(fine.suture_line) == len(fine.suture_arc_length) == 2 * len(mesh.suture_line) - 1
    assert len(fine.free_edge) == 2 * len(mesh.free_edge) - 1
    for array in (fine.triangles, fine.suture_line, fine.free_edge):
        assert array.dtype == np.int64


@EACH
def test_vertices_keep_their_numbers(name: str) -> None:
    """Truth: the first n points are those of the mesh, bit by bit; number n + e is the middle of
    edge e, unless it was put on the suture line."""
    mesh, fine = refined(name)
    count = len(mesh.points)
    np.testing.assert_array_equal(fine.points[:count], mesh.points)
    inside = np.setdiff1d(np.arange(len(mesh.edges)), mesh.suture_edges)
    middle = mesh.points[mesh.edges[inside]].mean(axis=1)
    np.testing.assert_array_equal(fine.points[count + inside], middle)
    np.testing.assert_array_equal(fine.suture_line[::2], mesh.suture_line)
    np.testing.assert_array_equal(fine.free_edge[::2], mesh.free_edge)


@EACH
def test_area(name: str) -> None:
    """Truth: the template's area less the segments between the arc and its chords, each
    R_s^2 (phi - sin phi) / 2; all triangles counter-clockwise; a quarter each inside."""
    mesh, fine = refined(name)
    template = TEMPLATES[name]
    start, stop = template.suture_line.breaks[1:3]
    radius = template.parameters.belly_radius
    for each in (mesh, fine):
        s = each.suture_arc_length
        step = np.diff(s[(s >= start - 1e-9) & (s <= stop + 1e-9)]) / radius
        assert step.sum() == pytest.approx((stop - start) / radius, rel=1e-12)
        missing = radius**2 / 2 * (step - np.sin(step)).sum()
        assert each.area == pytest.approx(template.area - missing, rel=1e-12)
        assert each.cell_areas.min() > 0
    children = fine.cell_areas.reshape(4, -1)
    inner = ~np.isin(mesh.cell_edges, mesh.suture_edges).any(axis=1)
    assert children[:, inner] == pytest.approx(np.tile(mesh.cell_areas[inner] / 4, (4, 1)))


@EACH
def test_boundary(name: str) -> None:
    """Truth: new nodes lie half-way along the true suture line, to rounding, and on the straight
    free edge; arc length grows from 0 to l_c; what has one triangle is suture line or free edge,
    in their order from corner to corner."""
    mesh, fine = refined(name)
    template, s = TEMPLATES[name], fine.suture_arc_length
    assert (s[0], s[-1]) == (0.0, template.suture_length)
    np.testing.assert_array_equal(s[::2], mesh.suture_arc_length)
    np.testing.assert_allclose(np.diff(s)[::2], np.diff(s)[1::2], rtol=1e-12)
    assert (np.diff(s) > 0).all()
    on_curve = template.suture_line.point(s)
    np.testing.assert_allclose(fine.points[fine.suture_line], on_curve, rtol=0, atol=1e-12)
    p = template.parameters
    edge = fine.points[fine.free_edge]
    level = p.corner_height + p.free_edge_height * (1 - 2 * np.abs(edge[:, 0]) / p.free_edge_length)
    np.testing.assert_allclose(edge[:, 1], level, atol=1e-12)
    assert (np.diff(edge[:, 0]) > 0).all()
    ends = fine.suture_line[[0, -1]]
    np.testing.assert_array_equal(fine.free_edge[[0, -1]], ends)
    np.testing.assert_array_equal(np.intersect1d(fine.suture_line, fine.free_edge), np.sort(ends))
    alone = np.flatnonzero(fine.edge_cells[:, 1] < 0)
    tagged = np.r_[fine.suture_edges, fine.edges_between(fine.free_edge)]
    np.testing.assert_array_equal(np.sort(tagged), alone)


def test_twice_is_half_way_of_half_way() -> None:
    """Truth: the second refinement has every fourth piece's ends where the mesh has them, and
    sixteen triangles in the place of one."""
    mesh, fine = refined("experiment 1")
    finer = refine(fine, TEMPLATES["experiment 1"])
    assert len(finer.triangles) == 16 * len(mesh.triangles)
    np.testing.assert_array_equal(finer.suture_arc_length[::4], mesh.suture_arc_length)
    np.testing.assert_array_equal(finer.free_edge[::4], mesh.free_edge)
    assert finer.cell_areas.min() > 0


def test_straight_edges_are_split_exactly() -> None:
    """Truth: in a polygon all four children have a quarter of the area, and lie in their parent:
    the child of each vertex at that vertex, the last one in the middle."""
    template = polygon()
    mesh = triangulate_template(template, 2.0)
    fine = refine(mesh, template)
    np.testing.assert_allclose(
        fine.cell_areas.reshape(4, -1), np.tile(mesh.cell_areas / 4, (4, 1)), rtol=1e-12
    )
    centre = fine.points[fine.triangles].mean(axis=1).reshape(4, -1, 2)
    corners = mesh.points[mesh.triangles]
    for vertex in range(3):
        expected = (
            4 * corners[:, vertex] + np.roll(corners, -vertex, axis=1)[:, 1:].sum(axis=1)
        ) / 6
        np.testing.assert_allclose(centre[vertex], expected, atol=1e-12)
    np.testing.assert_allclose(centre[3], corners.mean(axis=1), atol=1e-12)


@EACH
def test_prolonged_linear_functions(name: str) -> None:
    """Truth: a linear function, of numbers or of vectors, is itself on the finer mesh, but for the
    nodes that were moved; a constant everywhere."""
    mesh, fine = refined(name)
    kept = np.setdiff1d(np.arange(len(fine.points)), moved(mesh))
    slopes = np.random.default_rng(3).standard_normal((2, 3))
    for slope in (slopes, slopes[:, 0]):
        found = prolong(mesh, 1.5 + mesh.points @ slope)
        assert found.shape == (len(fine.points), *slope.shape[1:])
        expected = 1.5 + fine.points @ slope
        np.testing.assert_allclose(found[kept], expected[kept], atol=1e-12)
    np.testing.assert_array_equal(prolong(mesh, np.full(len(mesh.points), 0.7)), 0.7)


def test_prolonged_is_the_same_piecewise_linear_function() -> None:
    """Truth: in random points of every child triangle, barycentric interpolation of arbitrary
    values on the finer mesh and on the coarse one agree; on the nodes it keeps they are equal."""
    template, random = polygon(), np.random.default_rng(4)
    mesh = triangulate_template(template, 2.0)
    fine = refine(mesh, template)
    values = random.standard_normal((len(mesh.points), 3))
    found = prolong(mesh, values)
    np.testing.assert_array_equal(found[: len(mesh.points)], values)
    share = random.dirichlet([1.0, 1.0, 1.0], len(fine.triangles))
    place = np.einsum("mk,mkd->md", share, fine.points[fine.triangles])
    on_fine = np.einsum("mk,mkd->md", share, found[fine.triangles])
    parent = np.tile(np.arange(len(mesh.triangles)), 4)
    corners = mesh.points[mesh.triangles[parent]]
    system = np.concatenate([corners.transpose(0, 2, 1), np.ones((len(parent), 1, 3))], axis=1)
    weights = np.linalg.solve(system, np.c_[place, np.ones(len(parent))][..., None])[..., 0]
    assert weights.min() > 0
    on_coarse = np.einsum("mk,mkd->md", weights, values[mesh.triangles[parent]])
    np.testing.assert_allclose(on_fine, on_coarse, atol=1e-12)


@pytest.mark.parametrize("name", ["experiment 1", "experiment 3, cusp 1", "high apex"])
@pytest.mark.parametrize("refinements", [0, 1, 2])
def test_nested_meshes(name: str, refinements: int) -> None:
    """Truth: one mesh more than refinements, each the refinement of the one before; edges of the
    last about as long as wanted, of the first 2^refinements as long."""
    template, size = TEMPLATES[name], 0.8
    meshes = nested_meshes(template, size, refinements)
    assert len(meshes) == refinements + 1
    for level, mesh in enumerate(meshes):
        wanted = size * 2.0 ** (refinements - level)
        lengths = edge_lengths(mesh)
        assert 0.5 * wanted < lengths.min() < lengths.max() < 1.5 * wanted
        assert lengths.mean() == pytest.approx(wanted, rel=0.15)
    first = triangulate_template(template, size * 2.0**refinements)
    np.testing.assert_array_equal(meshes[0].points, first.points)
    for coarse, fine in pairwise(meshes):
        expected = refine(coarse, template)
        np.testing.assert_array_equal(fine.points, expected.points)
        np.testing.assert_array_equal(fine.triangles, expected.triangles)


def test_nested_meshes_of_a_small_template() -> None:
    """Truth: a suture line needs six pieces: as many refinements as that leaves; none is left out
    silently when that many were asked for; where not even the last mesh fits, nothing will do."""
    template = TEMPLATES["experiment 1"]
    fits = [0, 1, 2]  # l_c = 75.5 mm has 6 pieces of 2.5 2^r mm for r <= 2
    for refinements in range(6):
        meshes = nested_meshes(template, 2.5, refinements)
        assert len(meshes) - 1 == min(refinements, max(fits))
        assert edge_lengths(meshes[-1]).mean() == pytest.approx(2.5, rel=0.15)
        if refinements in fits:
            assert len(nested_meshes(template, 2.5, refinements, False)) == refinements + 1
        else:
            with pytest.raises(SceneError, match="too large") as caught:
                nested_meshes(template, 2.5, refinements, fewer_will_do=False)
            assert caught.value.key == "mesh.refinements"
    for fewer_will_do in (True, False):
        with pytest.raises(SceneError, match="too large"):
            nested_meshes(template, 40.0, 2, fewer_will_do)


@pytest.mark.parametrize("refinements", [0, 1])
def test_room_for_a_first_row_next_to_the_free_edge(refinements: int) -> None:
    """Truth: also on the coarsest mesh the straight part of the suture line has an inner node;
    refined meshes have one by being split."""
    outline = polygon()
    joints = np.array([2.0, outline.suture_line.length - 2.0])
    first = nested_meshes(outline, 3.0 / 2**refinements, refinements, joints=joints)[-1]
    between = first.suture_arc_length[(first.suture_arc_length > 0)]
    assert between[0] == pytest.approx(1.0)
    assert first.suture_arc_length[-1] - first.suture_arc_length[-2] == pytest.approx(1.0)
    assert np.isin(joints, first.suture_arc_length).all()


def test_too_coarse_is_refused_all_the_same() -> None:
    """Truth: pieces that are added at the ends of the suture line make no coarse mesh finer."""
    outline = polygon()
    joints = np.array([2.0, outline.suture_line.length - 2.0])
    with pytest.raises(SceneError, match="too large for this template"):
        nested_meshes(outline, 20.0, 0, joints=joints)
