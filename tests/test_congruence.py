"""Congruent cusps: which they are, how a result is turned, and that turning equals solving."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.stages.record import CuspResult, Snapshot, StageRecord
from avneo_fem.valve.congruence import representatives, rotate_result, to_its_place
from run_cases import SMALL, Run
from valve_cases import DEMOS


def of(scene: dict[str, Any]) -> tuple[int, int, int]:
    given = ValveInput.from_scene(parse_scene(scene))
    return representatives(given.scene, given.geometry, given.wedges)


@pytest.mark.parametrize(("number", "expected"), [(1, (0, 0, 0)), (2, (0, 1, 2)), (3, (0, 1, 2))])
def test_experiments(number: int, expected: tuple[int, int, int]) -> None:
    """Truth: Experiment 1 has three equal cusps 120 degrees apart, 2 and 3 have none alike."""
    given = ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))
    assert representatives(given.scene, given.geometry, given.wedges) == expected


@pytest.mark.parametrize(
    ("odd", "expected"), [(0, (0, 1, 1)), (1, (0, 1, 0)), (2, (0, 0, 2)), (None, (0, 0, 0))]
)
@pytest.mark.parametrize("change", [{"thickness": 0.4}, {"belly_radius": 16.0}])
def test_two_equal_cusps(odd: int | None, expected: tuple[int, ...], change: dict) -> None:
    """Truth: one cusp of another thickness or belly leaves the commissures, C and the contact
    curves alone: the other two stay congruent. With none changed all three are."""
    cusps = [{"template": change if i == odd else {}} for i in range(3)]
    assert of({"cusp": cusps}) == expected


def test_equal_cusps_in_unequal_places() -> None:
    """Truth: of an isosceles valve two cusps are mirror images, which a turn does not map on each
    other; with one longer free edge the contact curves of the other two are mirror images; and
    with one other suture line that cusp differs."""
    isosceles = {"commissures": {"chord_ratio": [1.2, 1.0, 1.0]}}
    assert of(isosceles) == (0, 1, 2)
    assert of({"cusp": [{"template": {"free_edge_length": 41.0}}, {}, {}]}) == (0, 1, 2)
    assert of({"cusp": [{"suture_line": {"belly_depth": 9.0}}, {}, {}]}) == (0, 1, 1)


def test_almost_equal_is_not_congruent() -> None:
    """Truth: a thousandth of a millimetre is a difference."""
    assert of({"cusp": [{}, {"template": {"belly_radius": 16.501}}, {}]}) == (0, 1, 0)
    assert of({"commissures": {"chord_ratio": [1.0, 1.0, 1.0001]}}) == (0, 1, 2)


@pytest.mark.parametrize("copy", [1, 2])
def test_rotated_result(copy: int) -> None:
    """Truth: positions on the suture line of cusp 0 come to lie on that of the copy, what is below
    A_0 below A_copy, the distances to wall and wedge stay; records and mesh are the same; nothing
    was computed for it."""
    given = ValveInput.from_scene(parse_scene({}))
    geometry = given.geometry
    mesh = triangulate_template(geometry.cusps[0].template, 3.0)
    arc = mesh.suture_arc_length
    points = np.random.default_rng(1).uniform(-9, 9, (len(mesh.points), 3))
    points[mesh.suture_line] = geometry.cusps[0].sutured_position(arc)
    points[mesh.free_edge[2]] = geometry.commissures.points[0] - [0.0, 0.0, 3.0]
    fields = {"wall_distance": np.arange(len(points)) * 1.0}
    records = [StageRecord("placement", 0.0, 0, "placed", 1.0, 0.1)]
    shots = [Snapshot("placement", 0.0, points - 1.0, fields), Snapshot("x", 1.0, points, fields)]
    source = CuspResult(0, mesh, points, records, shots, 1e-9, 77, "why", 5.0, 9.0)
    found = rotate_result(geometry, source, copy)
    np.testing.assert_allclose(
        found.points[mesh.suture_line], geometry.cusps[copy].sutured_position(arc), atol=1e-12
    )
    below = geometry.commissures.points[copy] - [0.0, 0.0, 3.0]
    np.testing.assert_allclose(found.points[mesh.free_edge[2]], below, atol=1e-12)
    for lam in (0.0, 1.0):
        np.testing.assert_allclose(
            given.wedges.wedge(copy, lam).evaluate(found.points)[0],
            given.wedges.wedge(0, lam).evaluate(points)[0],
            atol=1e-9,
        )
    np.testing.assert_allclose(found.points[:, 2], points[:, 2], atol=1e-14)
    assert (found.index, found.copied_from) == (copy, 0)
    assert (found.compile_seconds, found.seconds) == (0.0, 0.0)
    assert found.records is records
    assert found.mesh is mesh
    assert (found.residual, found.dofs, found.failure) == (1e-9, 77, "why")
    assert [(shot.name, shot.parameter) for shot in found.snapshots] == [("placement", 0), ("x", 1)]
    np.testing.assert_array_equal(found.snapshots[1].points, found.points)
    assert found.snapshots[0].fields is fields
    assert source.index == 0
    assert source.copied_from is None


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_to_its_place(number: int, index: int) -> None:
    """Truth: nodes on the suture line that a cusp sees as its own, as cusp 0, come to lie on the
    true one; all distances to wall and wedge stay, also with unequal chords; everything but the
    positions is as it was, and the cusp was not copied."""
    given = ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))
    own = given.seen_from(index)
    mesh = triangulate_template(own.geometry.cusps[0].template, 3.0)
    arc = mesh.suture_arc_length
    points = np.random.default_rng(1).uniform(-8, 8, (len(mesh.points), 3))
    points[mesh.suture_line] = own.geometry.cusps[0].sutured_position(arc)
    fields = {"wall_distance": np.arange(len(points)) * 1.0}
    records = [StageRecord("placement", 0.0, 0, "placed", 1.0, 0.1)]
    shots = [Snapshot("placement", 0.0, points - 1.0, fields), Snapshot("x", 1.0, points, fields)]
    source = CuspResult(index, mesh, points, records, shots, 1e-9, 77, None, 5.0, 9.0)
    found = to_its_place(own.geometry, given.geometry, source)
    true = given.geometry.cusps[index]
    np.testing.assert_allclose(
        found.points[mesh.suture_line], true.sutured_position(arc), rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(pdist(found.points), pdist(points), rtol=1e-12)
    np.testing.assert_array_equal(found.points[:, 2], points[:, 2])
    for lam in (0.0, 0.5, 1.0):
        np.testing.assert_allclose(
            given.wedges.wedge(index, lam).evaluate(found.points)[0],
            own.wedges.wedge(0, lam).evaluate(points)[0],
            atol=1e-9,
        )
    wall = [
        g.root.evaluate(p)[0] for g, p in ((given.geometry, found.points), (own.geometry, points))
    ]
    np.testing.assert_allclose(*wall, atol=1e-12)
    assert (found.index, found.copied_from) == (index, None)
    assert (found.residual, found.dofs, found.failure) == (1e-9, 77, None)
    assert (found.compile_seconds, found.seconds) == (5.0, 9.0)
    assert found.mesh is mesh
    assert found.records is records
    np.testing.assert_array_equal(found.snapshots[1].points, found.points)
    np.testing.assert_allclose(pdist(found.snapshots[0].points), pdist(points), rtol=1e-12)
    assert found.snapshots[0].fields is fields


def test_turning_equals_solving(small_run: Run, small_run_of_all: Run) -> None:
    """Truth: the run that solved all three cusps: every node of every level within 1e-6 mm, the
    same levels and verdicts; only one of them says that cusps were copied."""
    turned, solved = small_run.report, small_run_of_all.report
    assert [cusp["copied_from"] for cusp in turned["cusps"]] == [None, 0, 0]
    assert [cusp["copied_from"] for cusp in solved["cusps"]] == [None, None, None]
    for step in (0, 5, 11, 15, -1):
        difference = small_run.points(step) - small_run_of_all.points(step)
        assert np.abs(difference).max() < 1e-6
    assert turned["verified"] is solved["verified"] is True
    for one, two in zip(turned["cusps"], solved["cusps"], strict=True):
        levels = [[(s["name"], s["parameter"]) for s in cusp["stages"]] for cusp in (one, two)]
        assert levels[0] == levels[1]
        assert one["outside_wedge_mm"] == pytest.approx(two["outside_wedge_mm"], abs=1e-6)
    assert turned["valve"]["min_distance_mm"] == pytest.approx(
        solved["valve"]["min_distance_mm"], abs=1e-6
    )
    assert "cusp 1" not in small_run.process.stderr
    assert small_run_of_all.process.stderr.count("cusp 1  boundary") == 10
    assert parse_scene(turned["scene"]).reuse_congruent
    assert "reuse_congruent" not in SMALL
