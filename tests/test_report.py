"""The report: keys of design.md §2, plain JSON, written whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem import __version__
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.results.report import build_report, geometry_report, to_json, write_report
from avneo_fem.results.verdict import CuspVerification, ValveVerification
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.stages.record import CuspResult, StageRecord
from valve_cases import DEMOS

TABLE: dict[int, dict[str, Any]] = {
    1: {"J": [0.5315] * 3, "c": [19.5] * 3, "nu": 0.6153, "sigma": [1.2387] * 3},
    2: {
        "J": [0.3963, 0.6203, 0.3824],
        "c": [14.625, 34.125, 24.375],
        "nu": 0.6031,
        "sigma": [0.9715, 2.7451, 2.1577],
    },
    3: {
        "J": [0.8062, 0.7152, 0.7206],
        "c": [6.872, 16.036, 11.454],
        "nu": 0.9859,
        "sigma": [0.0303, 0.0860, 0.1059],
    },
}


def demo(number: int) -> ValveInput:
    return ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))


@pytest.mark.parametrize("number", [1, 2, 3])
def test_geometry(number: int) -> None:
    """Truth: the check values of design.md §1, after a round trip through JSON; A_0 on +x, M at
    z = 0; J_sl = l_a/l_c."""
    given = demo(number)
    found = json.loads(to_json(geometry_report(given.geometry, given.wedges)))
    truth = TABLE[number]
    assert found["stitching_ratio"] == pytest.approx(truth["J"], abs=0.6e-4)
    assert found["contact_lengths"] == pytest.approx(truth["c"], abs=0.6e-3)
    assert found["nu_star"] == pytest.approx(truth["nu"], abs=0.6e-4)
    assert found["sigma"] == pytest.approx(truth["sigma"], abs=0.6e-4)
    assert found["triple_point_case"] == ("edge" if number == 2 else "interior")
    assert found["competent"] is (number != 2)
    commissures = np.array(found["commissures"])
    assert commissures[0, 0] > 11.9
    np.testing.assert_allclose(commissures[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(found["normal"], [0.0, 0.0, 1.0], atol=1e-12)
    for i in range(3):
        chord = commissures[(i + 1) % 3] - commissures[(i + 2) % 3]
        assert found["chord_lengths"][i] == pytest.approx(np.linalg.norm(chord))
        ratio = found["asl_length"][i] / found["csl_length"][i]
        assert found["stitching_ratio"][i] == pytest.approx(ratio)


def result(given: ValveInput, index: int, copied_from: int | None = None) -> CuspResult:
    mesh = triangulate_template(given.geometry.cusps[index].template, 3.0)
    records = [
        StageRecord("boundary", 0.1, 12, "accepted", 1e-2, 0.5, 3),
        StageRecord("equilibrium", 32.0, 2, "converged", 1e-9, 0.1),
    ]
    points = np.zeros((len(mesh.points), 3))
    failure = "root_wall: why" if index == 2 else None
    return CuspResult(
        index, mesh, points, records, [], 1e-9, 1234 + index, failure, 3.0 + index, 7.0, copied_from
    )


def measured(residual: float = 1e-9) -> CuspVerification:
    return CuspVerification(
        residual, 1e-12, (31.0, 12.0), 0.0, 0.01, 0.02, 0.0, 0, 0.24, np.inf, 0.07
    )


def report(given: ValveInput, failures: list[str]) -> dict[str, Any]:
    valve = ValveVerification((measured(), measured(2e-9), measured()), 0, 0.31, 0.24)
    return build_report(
        given.scene,
        geometry_report(given.geometry, given.wedges),
        [result(given, 0), result(given, 1, 0), result(given, 2)],
        valve,
        failures,
        12.5,
        2,
        {"dolfinx": "0.5.2"},
    )


def test_report_states_what_was_used() -> None:
    """Truth: the scene in the report is the scene of the run, entries of its fidelity included, and
    the mesh size is what came out of it."""
    scene = load_scene(DEMOS / "experiment_1.toml", "draft", ["contact.steps=7"])
    told = json.loads(to_json(report(ValveInput.from_scene(scene), [])))
    assert parse_scene(told["scene"]) == scene
    assert told["scene"]["solver"]["quality"] == "approximate"
    assert told["scene"]["contact"]["steps"] == 7
    assert told["mesh_size_mm"] == parse_scene(told["scene"]).mesh_size == 1.4


def test_report_says_what_it_was_given() -> None:
    """Truth: every figure at the key of design.md §2; verified just when there is no failure."""
    given = demo(1)
    good, bad = report(given, []), report(given, ["one", "two"])
    assert (good["verified"], good["failures"]) == (True, [])
    assert (bad["verified"], bad["failures"]) == (False, ["one", "two"])
    assert (good["fidelity"], good["mesh_size_mm"]) == ("standard", 0.7)
    assert good["versions"] == {"avneo_fem": __version__, "dolfinx": "0.5.2"}
    cusps = good["cusps"]
    assert [cusp["index"] for cusp in cusps] == [0, 1, 2]
    assert [cusp["copied_from"] for cusp in cusps] == [None, 0, None]
    assert [cusp["failure"] for cusp in cusps] == [None, None, "root_wall: why"]
    assert [cusp["dofs"] for cusp in cusps] == [1234, 1235, 1236]
    mesh = triangulate_template(given.geometry.cusps[0].template, 3.0)
    assert (cusps[0]["cells"], cusps[0]["nodes"]) == (len(mesh.triangles), len(mesh.points))
    assert cusps[1]["residual"] == 2e-9
    assert cusps[0]["clamp_error_deg"] == {"largest": 31.0, "rms": 12.0}
    assert cusps[0]["outside_wedge_mm"] == 0.01
    assert cusps[0]["closest_layers_near_suture_mm"] == 0.07
    assert json.loads(to_json(good))["cusps"][0]["closest_layers_mm"] is None  # none near
    assert cusps[0]["stages"][0] == {
        "name": "boundary",
        "parameter": 0.1,
        "iterations": 12,
        "reason": "accepted",
        "residual": 1e-2,
        "seconds": 0.5,
        "substeps": 3,
    }
    assert good["valve"] == {
        "cusp_intersections": 0,
        "min_distance_mm": 0.31,
        "min_wall_distance_mm": 0.24,
    }
    timing = good["timing"]
    assert (timing["total_s"], timing["ranks"], timing["solve_s"]) == (12.5, 2, 21.0)
    assert timing["jit_s"] == 5.0
    assert 10 < timing["peak_rss_mb"] < 1e5


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_scene_can_be_run_again(number: int) -> None:
    """Truth: the whole resolved scene is in the report: read back from JSON it is the same."""
    given = demo(number)
    data = json.loads(to_json(report(given, [])))["scene"]
    assert data["name"] == f"experiment-{number}"
    assert parse_scene(data) == given.scene


def test_json_is_strict_and_plain() -> None:
    """Truth: NumPy numbers, tuples and keys become JSON's own; nan and infinity become null."""
    data = {
        "a": np.float64(1.5),
        "b": np.int64(3),
        "c": (np.bool_(True), [np.inf, -np.inf, np.nan]),
        "d": {"e": np.float32(0.25), "f": None, "g": "Ä"},
    }

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    text = to_json(data)
    assert text.endswith("}\n")
    assert json.loads(text, parse_constant=refuse) == {
        "a": 1.5,
        "b": 3,
        "c": [True, [None, None, None]],
        "d": {"e": 0.25, "f": None, "g": "Ä"},
    }
    assert json.loads(text)["c"][0] is True


def test_written_whole_or_not_at_all(tmp_path: Path) -> None:
    """Truth: the file is the JSON text; a report that cannot be written leaves the old one and no
    other file."""
    path = tmp_path / "report.json"
    write_report(path, {"verified": True})
    assert json.loads(path.read_text()) == {"verified": True}
    with pytest.raises(TypeError):
        write_report(path, {"verified": object()})
    assert json.loads(path.read_text()) == {"verified": True}
    assert [file.name for file in tmp_path.iterdir()] == ["report.json"]
