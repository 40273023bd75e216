"""What is handed to the judge, against the geometry and the solver's own constraints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.results.containment import wedge_distance
from avneo_fem.results.measures import clamp_error_deg, free_edge_sag_mm, suture_error_mm
from avneo_fem.results.verification_input import constraints_of, surface_of, tolerances_of
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.stages.record import CuspResult
from valve_cases import DEMOS


def demo(number: int) -> ValveInput:
    return ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))


def result(given: ValveInput, index: int) -> CuspResult:
    """The flat template in the plane x = 0, upright, corners at z = 0; it never moved."""
    template = given.geometry.cusps[index].template
    mesh = triangulate_template(template, 2.0)
    points = np.c_[np.zeros(len(mesh.points)), mesh.points[:, 0], mesh.points[:, 1] - 11.5]
    return CuspResult(index, mesh, points, [], [], 0.5, 99, None, 1.0, 2.0)


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("index", [0, 2])
def test_surface(number: int, index: int) -> None:
    """Truth: a cusp whose sutured nodes are put on the suture line by hand has no suture error, one
    that is moved by d has d; the upright flat template has no sag, lowered by d it sags by d; each
    sutured edge is one of the boundary, in order."""
    given = demo(number)
    flat = result(given, index)
    surface = surface_of(given.geometry, flat)
    cusp, mesh = given.geometry.cusps[index], flat.mesh
    assert surface.thickness == 0.5
    np.testing.assert_array_equal(surface.points, flat.points)
    np.testing.assert_array_equal(surface.triangles, mesh.triangles)
    np.testing.assert_array_equal(surface.template_points, mesh.points)
    share = mesh.suture_arc_length
    by_hand = cusp.suture_line.point(cusp.stitching.annulus_arc_length(share))
    assert suture_error_mm(by_hand, surface.suture_targets) == 0.0
    assert suture_error_mm(
        by_hand + np.array([0.3, 0, 0]), surface.suture_targets
    ) == pytest.approx(0.3)
    np.testing.assert_allclose(surface.suture_targets[[0, -1]], cusp.suture_line.ends, atol=1e-12)
    assert surface.suture_edges.tolist() == [
        [a, b] for a, b in zip(mesh.suture_line[:-1], mesh.suture_line[1:], strict=True)
    ]
    np.testing.assert_allclose(surface.template_height[[0, -1]], 0.0, atol=1e-12)
    assert surface.template_height.max() == pytest.approx(2.5)
    for lowered in (0.0, 0.7):
        edge = flat.points[mesh.free_edge] - [0.0, 0.0, lowered]
        plane, normal = np.zeros(3), np.array([0.0, 0.0, 1.0])
        sag = free_edge_sag_mm(edge, surface.template_height, plane, normal, 0.0)
        assert sag == pytest.approx(lowered, abs=1e-12)


def test_conormals() -> None:
    """Truth: a band along the suture line that leaves the wall along -b, triangle by triangle, has
    no clamp error; one that hangs straight down in the wall's tangent plane, turned by 180 degrees,
    has one of 180."""
    given = demo(1)
    flat = result(given, 0)
    surface = surface_of(given.geometry, flat)
    line = surface.suture_targets
    middle = (line[1:] + line[:-1]) / 2
    for sign, expected in ((-1.0, 0.0), (1.0, 180.0)):
        points = np.vstack([line, middle + sign * surface.prescribed_conormals])
        k = len(line)
        first = np.arange(k - 1)
        triangles = np.c_[first, first + 1, k + first]
        edges = np.c_[first, first + 1]
        along = line[1:] - line[:-1]
        along /= np.linalg.norm(along, axis=1)[:, None]
        part = np.einsum("kd,kd->k", surface.prescribed_conormals, along)[:, None]
        across = surface.prescribed_conormals - part * along
        points[k:] = middle + sign * across
        largest, _ = clamp_error_deg(points, triangles, edges, surface.prescribed_conormals)
        assert largest == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_constraints_agree_with_the_solvers(number: int) -> None:
    """Truth: the judge's brute-force distance to the polyline handed over is that of the exact
    wedge the solver pushes against, lambda = 1, to the polyline's chord error; also the side."""
    given = demo(number)
    radius = given.scene.root.radius
    random = np.random.default_rng(number)
    points = random.uniform(-1.2 * radius, 1.2 * radius, (400, 3))
    for index in range(3):
        constraints = constraints_of(given.scene, given.geometry, given.wedges, index)
        assert constraints.radius == radius
        assert constraints.taper == 2.5
        np.testing.assert_allclose(np.abs(constraints.plane_normal), [0.0, 0.0, 1.0], atol=1e-12)
        assert constraints.plane_point[2] == pytest.approx(0.0, abs=1e-12)
        found = wedge_distance(points, constraints.wedge, constraints.wedge_inside)
        exact = given.wedges.wedge(index, 1.0).evaluate(points)[0]
        np.testing.assert_allclose(found, exact, atol=1e-3)
        assert (np.sign(found) == np.sign(exact))[np.abs(exact) > 1e-3].all()


def test_constraints_follow_the_scene() -> None:
    """Truth: radius, taper and the clearances as given; by default the taper is 5 H of the cusp,
    layers keep H/2 beyond 4 H."""
    tables: dict[str, Any] = {
        "root": {"radius": 13.0},
        "free_edge": {"clearance": -0.2},
        "cusp": [{}, {"template": {"thickness": 0.4}}, {}],
    }
    given = ValveInput.from_scene(parse_scene(tables))
    found = [constraints_of(given.scene, given.geometry, given.wedges, i) for i in (0, 1)]
    assert [c.taper for c in found] == [2.5, 2.0]
    assert (found[0].radius, found[0].free_edge_clearance) == (13.0, -0.2)
    assert [c.layer_clearance for c in found] == [0.25, 0.2]
    assert [c.unrestricted for c in found] == [2.0, 1.6]
    given = ValveInput.from_scene(parse_scene({"layers": {"clearance": 0.0, "unrestricted": 0.0}}))
    nothing = constraints_of(given.scene, given.geometry, given.wedges, 0)
    assert (nothing.layer_clearance, nothing.unrestricted) == (0.0, 0.0)
    given = ValveInput.from_scene(parse_scene({"wall": {"taper": 0.75}}))
    assert constraints_of(given.scene, given.geometry, given.wedges, 0).taper == 0.75


THIN_AND_THICK = [{"template": {"thickness": h}} for h in (0.4, 0.6, 0.5)]


@pytest.mark.parametrize(
    ("tables", "layers"),
    [
        ({}, 0.25),
        ({"cusp": THIN_AND_THICK}, 0.2),
        ({"layers": {"clearance": 0.0}}, 0.0),
        ({"layers": {"clearance": 0.4}}, 0.4),
    ],
)
def test_layer_tolerance(tables: dict[str, Any], layers: float) -> None:
    """Truth: half the thickness of the thinnest cusp, or what the scene asks."""
    scene = parse_scene(tables)
    found = tolerances_of(ValveInput.from_scene(scene))
    assert found.layer_distance_mm == pytest.approx(layers)


@pytest.mark.parametrize(
    ("tables", "cusps", "wall"),
    [
        ({}, 24 * np.sin(0.5 / 24), 0.25),  # the edges are no further apart than the gap's chord
        ({"commissures": {"gap": 2.0}}, 0.5, 0.25),
        ({"commissures": {"gap": 0.0}}, 0.0, 0.25),
        ({"commissures": {"gap": 2.0}, "cusp": THIN_AND_THICK}, 0.2 + 0.25, 0.2),
        ({"commissures": {"gap": 2.0}, "contact": {"clearance": 0.1}}, 0.2, 0.25),
        ({"wall": {"clearance": 0.4}}, 24 * np.sin(0.5 / 24), 0.4),
        ({"wall": {"clearance": -0.25}}, 24 * np.sin(0.5 / 24), 0.0),
    ],
)
def test_tolerances(tables: dict[str, Any], cusps: float, wall: float) -> None:
    """Truth: by hand: mid-surfaces of two cusps keep the sum of their clearances, but no more than
    their sutured ends are apart (2 R sin(gap/2R)); the wall its clearance."""
    scene = parse_scene(tables | {"solver": {"tolerance": 1e-7, "inside_tolerance": 0.03}})
    found = tolerances_of(ValveInput.from_scene(scene))
    assert found.cusp_distance_mm == pytest.approx(cusps, rel=1e-12)
    assert found.wall_distance_mm == pytest.approx(wall)
    assert (found.residual, found.inside_mm) == (1e-7, 0.03)
    assert found.suture_mm == pytest.approx(8e-8 * scene.root.radius)
    assert found.sag_mm == scene.free_edge.width
    assert found.clamp_deg == 5.0


def test_the_clamp_is_judged_with_bending_only() -> None:
    """Truth: the scene's limit; a membrane cannot be clamped."""
    for bending, expected in ((True, 3.0), (False, np.inf)):
        tables = {"clamp": {"tolerance_degrees": 3.0}, "material": {"bending": bending}}
        scene = parse_scene(tables)
        assert tolerances_of(ValveInput.from_scene(scene)).clamp_deg == expected


def test_the_index_of_the_result_decides() -> None:
    """Truth: the same mesh as cusp 2 is asked onto cusp 2's line: that of cusp 0, turned by 240
    degrees."""
    given = demo(1)
    flat = result(given, 0)
    first = surface_of(given.geometry, flat).suture_targets
    third = surface_of(given.geometry, replace(flat, index=2)).suture_targets
    cosine, sine = np.cos(4 * np.pi / 3), np.sin(4 * np.pi / 3)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(third, first @ turn.T, atol=1e-11)
