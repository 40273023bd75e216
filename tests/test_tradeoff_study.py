"""``avneo tradeoff`` from end to end: its files, resuming, failures as rows, bad input."""

from __future__ import annotations

import csv
import itertools
import json
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from avneo_fem.tradeoff import plot, runs
from avneo_fem.tradeoff.settings import REFERENCE, SECOND_PATH
from run_cases import SMALL, Run, avneo, avneo_inside, written
from tradeoff_cases import copying, errors, row


def table(folder: Path) -> dict[str, dict[str, str]]:
    """Rows of tradeoff.csv by their setting."""
    with (folder / "tradeoff.csv").open(newline="", encoding="utf-8") as stream:
        return {found["setting"]: found for found in csv.DictReader(stream)}


def study(scene: Path, folder: Path, *options: str, execute: Any) -> Any:
    """The command with a stand-in for its processes."""
    with (
        mock.patch.object(runs, "_process", execute),
        mock.patch.object(runs, "_children_seconds", mock.Mock(side_effect=itertools.count(1.0))),
    ):
        return avneo_inside("tradeoff", scene, "-o", folder, *options)


def test_study(small_run: Run, tmp_path: Path) -> None:
    """Truth: equal results are 0 apart; a setting that crashes is a row with its last line, is run
    once and leaves the rest alone; every other setting is run twice, the second path once; with
    ``--resume`` nothing is run again. Exit status 0: the reference was verified."""
    scene, folder = written(SMALL, tmp_path), tmp_path / "out"
    report = small_run.report
    report.update(verified=True, failures=[])
    (tmp_path / "kept").mkdir()
    for path in small_run.folder.glob("*.stl"):
        (tmp_path / "kept" / path.name).write_bytes(path.read_bytes())
    (tmp_path / "kept" / "report.json").write_text(json.dumps(report))
    execute = mock.Mock(side_effect=copying(tmp_path / "kept", "material.bending=false"))
    names = ("standard", "standard, no bending")
    options = [text for name in names for text in ("--settings", name)]
    process = study(scene, folder, *options, execute=execute)
    assert process.returncode == 0, process.stderr
    assert process.stdout == ""
    assert 'advice: for 0.1 mm use "standard" (0.00 mm in 1 s)' in process.stderr
    found = table(folder)
    crashed = found.pop("standard, no bending")
    assert (crashed["verdict"], crashed["reason"], crashed["runs"]) == ("failed", "boom", "1")
    assert (crashed["surface_mean_mm"], crashed["cpu_spread_s"]) == ("", "")
    assert (found["standard"]["cpu_s"], found["standard"]["cpu_spread_s"]) == ("1.0", "0.0")
    assert {r["verdict"] for r in found.values()} == {"verified"}
    assert {r["surface_mean_mm"] for r in found.values()} == {"0.0000"}
    assert {name: r["runs"] for name, r in found.items() if r["runs"] != "2"} == {SECOND_PATH: "1"}
    assert execute.call_count == 2 * len(found) - 1 + 1
    assert (folder / "tradeoff.png").read_bytes().startswith(b"\x89PNG")
    again = study(
        scene, folder, *options, "--resume", execute=mock.Mock(side_effect=AssertionError)
    )
    assert again.returncode == 0
    assert table(folder).keys() - {"standard, no bending"} == found.keys()
    assert again.stderr.count("(kept)") == execute.call_count


def test_study_goes_on(small_run: Run, tmp_path: Path) -> None:
    """Truth: killed in its third run, it goes on with that one; not for another scene, and without
    ``--resume`` from the start. An unverified reference measures nothing: exit status 1."""
    scene, folder = written(SMALL, tmp_path), tmp_path / "out"
    options = ("--settings", "draft", "--settings", "own: contact.steps=3", "--repeats", "1")
    copy, count = copying(small_run.folder), 0

    def killed(command: Any, limit: Any) -> Any:
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return copy(command, limit)

    process = study(scene, folder, *options, execute=killed)
    assert process.returncode == 130
    assert "--resume" in process.stderr
    assert not (folder / "tradeoff.csv").exists()
    for more, expected in (
        ((), 4),
        (("--resume",), 0),
        (("--resume", "--set", "root.radius=12.1"), 4),
    ):
        execute = mock.Mock(side_effect=copy)
        process = study(scene, folder, *options, *more, execute=execute)
        assert execute.call_count == expected
    count = 0
    study(scene, folder, *options, execute=killed)
    execute = mock.Mock(side_effect=copy)
    process = study(scene, folder, *options, "--resume", execute=execute)
    assert execute.call_count == 2
    verified = small_run.report["verified"]
    assert process.returncode == (0 if verified else 1)
    assert list(table(folder)) == ["draft", "own", REFERENCE, SECOND_PATH]


def test_bad_input(tmp_path: Path) -> None:
    """Truth: status 2 in one line, and nothing run or written."""
    scene = written(SMALL, tmp_path)
    for options, why in (
        (["--settings", "best"], "must be one of draft; standard"),
        (["--settings", "own: contact.step=3"], "did you mean 'steps'"),
        (["--set", "contact.step=3"], "did you mean 'steps'"),
    ):
        process = study(scene, tmp_path / "out", *options, execute=mock.Mock())
        assert (process.returncode, len(process.stderr.splitlines())) == (2, 1)
        assert why in process.stderr
    assert avneo_inside("tradeoff", tmp_path / "missing.toml").returncode == 2
    assert not (tmp_path / "out").exists()


def test_picture(tmp_path: Path) -> None:
    """Truth: it is drawn with and without scatter, failures and front; no matplotlib is told."""
    rows = [
        row("draft", 10.0, 0.5),
        row("standard", 80.0, 0.2, spread=5.0),
        row("wrong", 5.0, 0.4, verdict="not verified"),
        row("crashed", 1.0, None, verdict="failed"),
        row(REFERENCE, 600.0, 0.0),
    ]
    for number, (shown, scatter) in enumerate(((rows, errors(0.2)), (rows[3:4], None))):
        path = tmp_path / f"{number}.png"
        plot.draw_tradeoff(path, shown, scatter, "title")
        assert path.read_bytes().startswith(b"\x89PNG")
    with (
        mock.patch.dict("sys.modules", {"matplotlib.figure": None}),
        pytest.raises(plot.PictureError, match="no picture without matplotlib"),
    ):
        plot.draw_tradeoff(tmp_path / "none.png", rows, None, "title")
    assert not (tmp_path / "none.png").exists()


@pytest.mark.slow
def test_real_study(tmp_path: Path) -> None:
    """Truth: real processes: the reference is verified, a setting with too few iterations is not,
    and both are rows; the advice is one line."""
    scene, folder = written(SMALL, tmp_path), tmp_path / "out"
    bad = "bad: solver.maximum_iterations=1"
    process = avneo("tradeoff", scene, "-o", folder, "--settings", bad, "--repeats", "1")
    found = table(folder)
    assert (found["bad"]["verdict"], found[REFERENCE]["verdict"]) == ("not verified", "verified")
    assert "iteration limit of 1 reached" in found["bad"]["reason"]
    assert float(found["bad"]["surface_mean_mm"]) > float(found[SECOND_PATH]["surface_mean_mm"]) > 0
    assert process.returncode == 0
    assert process.stderr.splitlines()[-1].startswith("advice: ")
