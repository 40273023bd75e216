"""Whole runs against the contract of design.md §2, judged anew from the files alone."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from matplotlib.image import imread

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.containment import outside_root_mm, outside_wedge_mm
from avneo_fem.results.crossings import cusp_intersections, min_distance, self_intersections
from avneo_fem.results.report import geometry_report, to_json
from avneo_fem.results.surfaces import read_stl
from avneo_fem.results.verification_input import constraints_of
from avneo_fem.scene import load_scene, parse_scene
from run_cases import SMALL, Run, avneo_inside, command, environment, suture_inside, written
from valve_cases import DEMOS

FILES = ["cusp_0.stl", "cusp_1.stl", "cusp_2.stl", "report.json", "valve.h5", "valve.png"]
FILES += ["valve.xdmf"]
#: Types of design.md §2's keys: [kind] is a list of any length, (3, kind) one of three.
NUMBER = (int, float)
STAGE: dict[str, Any] = {
    "name": str,
    "parameter": NUMBER,
    "iterations": int,
    "reason": str,
    "residual": float,
    "seconds": float,
}
CUSP: dict[str, Any] = {
    "index": int,
    "cells": int,
    "nodes": int,
    "dofs": int,
    "stages": [STAGE],
    "residual": float,
    "suture_error_mm": float,
    "clamp_error_deg": {"largest": float, "rms": float},
    "outside_root_mm": float,
    "outside_wedge_mm": float,
    "edges_outside_wedge_mm": float,
    "condition": float,
    "free_edge_sag_mm": float,
    "self_intersections": int,
    "copied_from": (int, type(None)),
}
REPORT: dict[str, Any] = {
    "scene": dict,
    "versions": dict,
    "fidelity": str,
    "verified": bool,
    "failures": [str],
    "geometry": {
        "commissures": (3, (3, float)),
        "normal": (3, float),
        "circumradius": float,
        "chord_lengths": (3, float),
        "commissure_lengths": (3, float),
        "contact_lengths": (3, float),
        "triple_contact_point": (3, float),
        "nu_star": float,
        "triple_point_case": str,
        "competent": bool,
        "competence_reason": str,
        "asl_length": (3, float),
        "csl_length": (3, float),
        "stitching_ratio": (3, float),
        "sigma": (3, float),
    },
    "cusps": [CUSP],
    "valve": {
        "cusp_intersections": int,
        "min_distance_mm": float,
        "min_wall_distance_mm": float,
    },
    "timing": {
        "total_s": float,
        "jit_s": float,
        "solve_s": float,
        "peak_rss_mb": float,
        "ranks": int,
    },
}


def demand(value: Any, kind: Any, where: str) -> None:
    """Fail unless a JSON value is of this kind: type, keys of an object, (length, kind), [kind]."""
    if isinstance(kind, dict):
        assert isinstance(value, dict), where
        for key, inner in kind.items():
            assert key in value, f"{where}.{key} is missing"
            demand(value[key], inner, f"{where}.{key}")
    elif isinstance(kind, list) or (isinstance(kind, tuple) and isinstance(kind[0], int)):
        assert isinstance(value, list), where
        assert isinstance(kind, list) or len(value) == kind[0], where
        for number, item in enumerate(value):
            demand(item, kind[-1], f"{where}[{number}]")
    else:
        assert isinstance(value, kind), f"{where} = {value!r}"
        assert kind in (bool, dict) or not isinstance(value, bool), where


def surfaces(run: Run) -> list[tuple[np.ndarray, np.ndarray]]:
    return [read_stl(run.folder / f"cusp_{index}.stl") for index in range(3)]


@pytest.mark.parametrize("name", ["verified_run", "failing_run", "small_run_of_ranks"])
def test_keys_types_and_shapes(name: str, request: pytest.FixtureRequest) -> None:
    """Truth: design.md §2 lists them; so for a result that is verified, one that is not, and one of
    several ranks."""
    run: Run = request.getfixturevalue(name)
    demand(run.report, REPORT, "report")
    assert len(run.report["cusps"]) == 3
    assert run.report["geometry"]["triple_point_case"] in ("interior", "edge")
    assert run.report["fidelity"] == "standard"
    assert set(run.report["versions"]) >= {"avneo_fem", "dolfinx", "petsc", "numpy", "python"}


def test_verified(verified_run: Run) -> None:
    """Truth: exit status 0, ``verified`` and no failure mean the same; the figures are within what
    the scene asks for; the stiffness had to be raised for it."""
    process, report = verified_run.process, verified_run.report
    assert process.returncode == 0
    assert (report["verified"], report["failures"]) == (True, [])
    scene = parse_scene(report["scene"])
    for cusp in report["cusps"]:
        assert cusp["residual"] <= scene.solver.tolerance == 1e-8
        assert cusp["suture_error_mm"] < 1e-12
        assert cusp["outside_root_mm"] <= 0.1
        assert cusp["outside_wedge_mm"] <= 0.1
        assert cusp["self_intersections"] == 0
        assert cusp["failure"] is None
        names = [stage["name"] for stage in cusp["stages"]]
        assert names[0] == "placement"
        assert names[-1] == "equilibrium"
        assert {"boundary", "hinged_edge", "clamped_edge", "contact_wedge"} < set(names)
    assert report["valve"]["cusp_intersections"] == 0
    assert report["valve"]["min_distance_mm"] > 0.498 - 2 * 0.1
    assert report["valve"]["min_wall_distance_mm"] > 0.25 - 0.1
    timing = report["timing"]
    assert timing["ranks"] == 1
    assert 0 < timing["solve_s"] < timing["total_s"]
    assert 50 < timing["peak_rss_mb"] < 4000


def test_scene_and_geometry(verified_run: Run) -> None:
    """Truth: the report holds the resolved scene of the file, name included, and its geometry."""
    report = verified_run.report
    scene = load_scene(verified_run.scene)
    assert report["scene"]["name"] == scene.name == "valve-1"
    assert parse_scene(report["scene"]) == scene
    given = ValveInput.from_scene(scene)
    assert report["geometry"] == json.loads(to_json(geometry_report(given.geometry, given.wedges)))


def test_files(verified_run: Run) -> None:
    """Truth: just the files of design.md §2: no checkpoint, no half-written file."""
    assert sorted(path.name for path in verified_run.folder.iterdir()) == FILES
    assert all(path.stat().st_size > 1000 for path in verified_run.folder.iterdir())


def test_surfaces_bear_the_verdict_out(verified_run: Run) -> None:
    """Truth: figures computed anew from the STL files alone equal the report's, to the files'
    single precision; nodes and triangles are as many as it says."""
    report, cusps = verified_run.report, surfaces(verified_run)
    given = ValveInput.from_scene(load_scene(verified_run.scene))
    for cusp, (points, triangles) in zip(report["cusps"], cusps, strict=True):
        index = cusp["index"]
        assert (len(points), len(triangles)) == (cusp["nodes"], cusp["cells"])
        assert self_intersections(points, triangles) == cusp["self_intersections"] == 0
        constraints = constraints_of(given.scene, given.geometry, given.wedges, index)
        for found, key in (
            (outside_root_mm(points, 12.0), "outside_root_mm"),
            (
                outside_wedge_mm(points, constraints.wedge, constraints.wedge_inside),
                "outside_wedge_mm",
            ),
        ):
            assert found == pytest.approx(cusp[key], abs=5e-6)
    assert cusp_intersections(cusps) == report["valve"]["cusp_intersections"] == 0
    pairs = [(cusps[0], cusps[1]), (cusps[1], cusps[2]), (cusps[2], cusps[0])]
    nearest = min(min_distance(*one, *two) for one, two in pairs)
    assert nearest == pytest.approx(report["valve"]["min_distance_mm"], abs=5e-6)


def test_surfaces_hang_on_their_suture_lines(verified_run: Run) -> None:
    """Truth: each cusp has nodes all along its own aortic suture line, no further apart than a
    template edge, its ends included; the free edge keeps to the plane of commissures."""
    given = ValveInput.from_scene(load_scene(verified_run.scene))
    for cusp, (points, _) in zip(given.geometry.cusps, surfaces(verified_run), strict=True):
        line = cusp.suture_line
        dense = line.point(np.linspace(0.0, line.length, 400))
        gap = np.linalg.norm(dense[:, None] - points[None], axis=2).min(axis=1)
        assert gap[[0, -1]].max() < 1e-5
        assert gap.max() < 2.6 / 2
        assert points[:, 2].max() > -0.1
        assert points[:, 2].min() > line.point([line.length / 2])[0, 2] - 6.0


def test_history_in_vtk(verified_run: Run) -> None:
    """Truth: VTK reads a time step per level of the longest cusp; the last is the result; the
    fields of design.md §2 are there and obey their definitions."""
    report = verified_run.report
    stages = report["cusps"][0]["stages"]
    reader = pyvista.XdmfReader(str(verified_run.folder / "valve.xdmf"))
    assert reader.time_values == [float(number) for number in range(len(stages))]
    start = reader.read().points
    for number in (0, 5, len(stages) - 1):
        reader.set_active_time_value(float(number))
        grid = reader.read()
        assert grid.n_points == sum(cusp["nodes"] for cusp in report["cusps"])
        assert grid.n_cells == sum(cusp["cells"] for cusp in report["cusps"])
        assert set(grid.point_data) == {
            "displacement",
            "wall_distance",
            "wedge_distance",
            "penalty_pressure",
            "cusp",
        }
        np.testing.assert_allclose(grid.point_data["displacement"], grid.points - start, atol=1e-12)
        wall = 12.0 - np.hypot(*grid.points[:, :2].T)
        np.testing.assert_allclose(grid.point_data["wall_distance"], wall, atol=1e-9)
        stretches = [grid.cell_data[f"principal_stretch_{k}"] for k in (1, 2)]
        product = grid.cell_data["thickness_stretch"] * stretches[0] * stretches[1]
        np.testing.assert_allclose(product, 1.0, rtol=1e-12)
        for k in (0, 1):
            stress = grid.cell_data[f"principal_stress_{k + 1}"]
            np.testing.assert_allclose(stress, 500.0 * (stretches[k] ** 2 - 1), atol=1e-8)
        if number == 0:
            np.testing.assert_allclose(stretches, 1.0, rtol=1e-9)
    for index, (points, _) in enumerate(surfaces(verified_run)):
        mine = grid.points[grid.point_data["cusp"] == index]
        order = [np.lexsort(np.round(p, 4).T) for p in (mine.astype(np.float32), points)]
        np.testing.assert_allclose(mine[order[0]], points[order[1]], atol=2e-4)
    assert grid.point_data["penalty_pressure"].max() > 0


def test_picture(verified_run: Run) -> None:
    """Truth: a picture of the promised size with all three views: none of them is blank, and each
    has many colours, the background only part of it."""
    image = imread(verified_run.folder / "valve.png")[:, :, :3]
    assert image.shape[:2] == (700, 2000)
    for view in range(3):
        part = image[:, 600 * view : 600 * (view + 1)]
        drawn = (np.abs(part - 1.0) > 0.02).any(axis=2)
        assert 0.1 < drawn.mean() < 0.95
        assert len(np.unique(np.round(part[drawn], 2), axis=0)) > 200


def test_plot_draws_it_again(verified_run: Run, tmp_path: Path) -> None:
    """Truth: ``avneo plot`` on a results folder without its picture gives the same picture, but for
    the single precision of the STL files; nothing else is touched."""
    copy = tmp_path / "copy"
    shutil.copytree(verified_run.folder, copy)
    (copy / "valve.png").unlink()
    before = {path.name: path.read_bytes() for path in copy.iterdir()}
    process = avneo_inside("plot", copy)
    assert (process.returncode, process.stdout) == (0, "")
    old, new = (imread(folder / "valve.png") for folder in (verified_run.folder, copy))
    assert np.abs(old - new).mean() < 1e-3
    assert {n: (copy / n).read_bytes() for n in before} == before


def test_streams(verified_run: Run, small_run: Run) -> None:
    """Truth: with ``--json`` stdout is the text of report.json and nothing else, without it is
    empty; people read of each level and the verdict on stderr."""
    text = (verified_run.folder / "report.json").read_text()
    assert verified_run.process.stdout == text
    assert small_run.process.stdout == ""
    for run in (verified_run, small_run):
        lines = run.process.stderr.splitlines()
        stages = run.report["cusps"][0]["stages"]
        assert len(lines) == len(stages) + 1
        for line, stage in zip(lines, stages, strict=False):
            assert line.startswith(f"cusp 0  {stage['name']} ")
            assert f" {stage['iterations']} it " in line
        assert lines[-1].startswith("verified in ")
        assert lines[-1].endswith(str(run.folder))


def test_not_verified(failing_run: Run) -> None:
    """Truth: exit status 1, ``verified`` false; every failure is told, with figures; what was
    reached is in the folder all the same, in equilibrium and free of crossings."""
    process, report = failing_run.process, failing_run.report
    assert process.returncode == 1
    assert report["verified"] is False
    assert len(report["failures"]) >= 3
    for index in range(3):
        assert report["failures"][index].startswith(f"cusp {index}: root_wall: ")
        assert report["cusps"][index]["failure"] in report["failures"][index]
    for failure in report["failures"]:
        assert f"not verified: {failure}\n" in process.stderr
    assert f"not verified after {report['timing']['total_s']:.0f} s" in process.stderr
    assert sorted(path.name for path in failing_run.folder.iterdir()) == FILES
    assert report["cusps"][0]["residual"] <= 1e-8
    cusps = surfaces(failing_run)
    assert [self_intersections(*cusp) for cusp in cusps] == [0, 0, 0]


def test_without_a_picture(small_run_of_all: Run) -> None:
    """Truth: a machine that cannot draw gets a warning and all other files; status 0."""
    assert small_run_of_all.process.returncode == 0
    assert "valve.png: no [display] here" in small_run_of_all.process.stderr
    found = sorted(path.name for path in small_run_of_all.folder.iterdir())
    assert found == [name for name in FILES if name != "valve.png"]


def kill_at(scene: Path, out: Path, text: str, number: int, *options: str) -> tuple[int, list[str]]:
    """Send a signal to ``avneo suture`` when a line of stderr has this text; status and lines."""
    process = subprocess.Popen(
        command("-m", "avneo_fem", "suture", scene, "-o", out, *options),
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    lines = []
    for line in process.stderr:
        lines.append(line.rstrip("\n"))
        if text in line and process.poll() is None:
            os.kill(process.pid, number)
            text = "\0"
    process.stderr.close()
    return process.wait(timeout=60), lines


def test_killed_twice_and_resumed(small_run: Run, tmp_path: Path) -> None:
    """Truth: the uninterrupted run. Interrupted from the keyboard on the boundary path, killed in
    the contact stage, gone on with each time: no report and no half-written file in between, no
    level run twice, the same end to 1e-9 mm, and no checkpoint left. Without a picture none is
    drawn, and that of an older run does not stay."""
    scene, out = written(SMALL, tmp_path), tmp_path / "out"
    status, first = kill_at(scene, out, "boundary      0.7", signal.SIGINT)
    assert status == 130
    assert first[-1] == "avneo: interrupted; --resume goes on from the last level"
    assert not any("Traceback" in line for line in first)
    assert [path.name for path in out.iterdir()] == ["checkpoints"]
    status, second = kill_at(scene, out, "contact_wedge 0.25", signal.SIGKILL, "--resume")
    assert status == -signal.SIGKILL
    assert [path.name for path in out.iterdir()] == ["checkpoints"]
    assert [path.name for path in (out / "checkpoints").iterdir()] == ["cusp_0.checkpoint"]
    (out / "valve.png").write_bytes(b"of an older run")
    third = Run(scene, out, avneo_inside("suture", scene, "-o", out, "--resume", "--no-picture"))
    assert third.process.returncode == 0
    last = third.process.stderr.splitlines()
    levels = [
        line.split(" it ")[0].rsplit(maxsplit=1)[0]
        # an interrupt while a line is printed may print it twice
        for line in [*dict.fromkeys(first), *second, *last]
        if line.startswith("cusp 0 ")
    ]
    stages = small_run.report["cusps"][0]["stages"]
    assert levels == [f"cusp 0  {s['name']:<13} {s['parameter']:<9.4g}".rstrip() for s in stages]
    assert not any("placement" in line for line in second + last)
    assert np.abs(third.points() - small_run.points()).max() < 1e-9
    kept = ("name", "parameter", "iterations", "reason", "substeps")
    resumed = third.report["cusps"][0]["stages"]
    assert [[s[k] for k in kept] for s in resumed] == [[s[k] for k in kept] for s in stages]
    assert sorted(path.name for path in out.iterdir()) == [f for f in FILES if f != "valve.png"]


def test_a_new_run_replaces_the_old_report_first(small_run: Run, tmp_path: Path) -> None:
    """Truth: a report always belongs to the files beside it: a run killed in a folder of old
    results leaves no report."""
    out = tmp_path / "out"
    shutil.copytree(small_run.folder, out)
    scene = written(SMALL, tmp_path)
    status, _ = kill_at(scene, out, "boundary      0.1", signal.SIGKILL)
    assert status == -signal.SIGKILL
    assert not (out / "report.json").exists()
    assert (out / "cusp_0.stl").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "size"), [(1, 1.4), (1, 1.0), (1, 0.7), (2, 1.4), (3, 1.4), (3, 1.0), (3, 0.7)]
)
def test_experiments(number: int, size: float, tmp_path: Path) -> None:
    """Truth: the paper's experiments come out verified: in equilibrium, on their suture lines, free
    of crossings, inside wedge and wall."""
    text = (DEMOS / f"experiment_{number}.toml").read_text()
    assert text.count("size = 0.7") == 1
    run = suture_inside(text.replace("size = 0.7", f"size = {size}"), tmp_path)
    report = run.report
    print(json.dumps({"timing": report["timing"], "valve": report["valve"]}))
    assert report["failures"] == []
    assert (run.process.returncode, report["verified"]) == (0, True)
    assert [self_intersections(*cusp) for cusp in surfaces(run)] == [0, 0, 0]
    assert cusp_intersections(surfaces(run)) == 0
