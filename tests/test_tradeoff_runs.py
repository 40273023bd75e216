"""Runs of a study: what is kept, what counts as the same, and what ends them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from avneo_fem.errors import SceneError
from avneo_fem.tradeoff import runs
from avneo_fem.tradeoff.runs import Study, kept_run, run_setting
from avneo_fem.tradeoff.settings import Setting
from tradeoff_cases import Execute

SETTING = Setting("a name, a b", ("contact.steps=5",))


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """A study of the default scene."""
    scene = tmp_path / "valve.toml"
    scene.write_text("", encoding="utf-8")
    return Study(scene, tmp_path / "out", ("mesh.size=1.0",))


def told(text: str, status: int | None = 0) -> Execute:
    """A stand-in for a process."""

    def execute(command: Sequence[str], limit: float | None) -> tuple[int | None, str]:
        return status, text

    return execute


def test_command_and_what_is_kept(study: Study) -> None:
    """Truth: the command line is that of ``avneo suture``, the setting's entries after the
    study's; a run that has ended is found again, equal, in a folder of its own."""
    commands = []

    def execute(command: Sequence[str], limit: float | None) -> tuple[int | None, str]:
        commands.append(list(command))
        return 0, "one\nverified in 3 s\n"

    run = run_setting(study, SETTING, 1, execute)
    folder = study.folder / "runs" / "a-name-a-b" / "1"
    start = [sys.executable, "-m", "avneo_fem", "suture", str(study.scene), "-o", str(folder)]
    assert commands == [[*start, "--set", "mesh.size=1.0", "--set", "contact.steps=5"]]
    assert (run.status, run.message, run.folder) == (0, "verified in 3 s", folder)
    assert kept_run(study, SETTING, 1) == run
    assert kept_run(study, SETTING, 0) is None
    study.clear([Setting("another", ())])
    assert kept_run(study, SETTING, 1) == run
    study.clear([SETTING])
    assert kept_run(study, SETTING, 1) is None


def test_what_is_not_kept(study: Study) -> None:
    """Truth: not for another scene, other entries or a broken file; a run without run.json did
    not end."""
    run = run_setting(study, SETTING, 0, told("done"))
    assert kept_run(replace(study, overrides=()), SETTING, 0) is None
    assert kept_run(study, replace(SETTING, overrides=()), 0) is None
    study.scene.write_text("root.radius = 13.0", encoding="utf-8")
    assert kept_run(study, SETTING, 0) is None
    study.scene.write_text("", encoding="utf-8")
    assert kept_run(study, SETTING, 0) == run
    for text in ("{", "[]", "{}"):
        (run.folder / "run.json").write_text(text, encoding="utf-8")
        assert kept_run(study, SETTING, 0) is None
    (run.folder / "run.json").unlink()
    assert kept_run(study, SETTING, 0) is None


def test_a_run_starts_from_scratch(study: Study) -> None:
    """Truth: nothing is left of one that did not end; checkpoints of one that was stopped go."""
    folder = study.run_folder(SETTING, 0)
    folder.mkdir(parents=True)
    (folder / "report.json").write_text("{}")

    def execute(command: Sequence[str], limit: float | None) -> tuple[int | None, str]:
        assert not list(folder.iterdir())
        (folder / "checkpoints").mkdir()
        return None, ""

    run = run_setting(study, SETTING, 0, execute)
    assert [path.name for path in folder.iterdir()] == ["run.json"]
    assert run.message == "stopped after 0 s"
    assert run.report is None


def test_a_stopped_run_counts_for_shorter_limits_only(study: Study) -> None:
    """Truth: with more time, or without a limit, it could end."""
    short = replace(study, limit=1e-9)
    run = run_setting(short, SETTING, 0, told("", None))
    assert kept_run(short, SETTING, 0) == run
    assert kept_run(replace(study, limit=1e3), SETTING, 0) is None
    assert kept_run(study, SETTING, 0) is None


def test_processes() -> None:
    """Truth: exit status and standard error of a process, processor time while it works; one that
    takes too long is stopped."""
    before = runs._children_seconds()
    script = "import sys; x = [k * k for k in range(3 * 10**6)]; sys.stderr.write('é'); sys.exit(3)"
    assert runs._process([sys.executable, "-c", script], None) == (3, "é")
    assert runs._children_seconds() > before
    script = "import time; time.sleep(60)"
    assert runs._process([sys.executable, "-c", script], 0.2) == (None, "")


def test_bad_input(study: Study, tmp_path: Path) -> None:
    """Truth: entries that do not exist, and a folder that is a file, are told before a run."""
    with pytest.raises(SceneError, match="did you mean 'steps'"):
        run_setting(study, Setting("x", ("contact.step=5",)), 0, told(""))
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="output folder"):
        run_setting(replace(study, folder=tmp_path / "file"), SETTING, 0, told(""))
