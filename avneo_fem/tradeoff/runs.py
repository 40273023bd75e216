"""Running settings as processes of their own, so that a killed study goes on where it was.

Every run is ``python -m avneo_fem suture``: its time is what a user waits, nothing is shared, and
one that crashes is a row of the table. What a run left is kept in a folder of its own, and
``run.json`` is written there last: a folder without it holds a run that did not end.
"""

from __future__ import annotations

import hashlib
import json
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from avneo_fem import __version__
from avneo_fem.errors import SceneError
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import load_scene
from avneo_fem.tradeoff.settings import Setting

__all__ = ["Run", "Study", "kept_run", "run_setting"]


@dataclass(frozen=True)
class Run:
    """One run of a setting that has ended.

    ``status`` is its exit status, None when it was stopped at the time limit; ``message`` its last
    line; ``seconds`` its wall clock and ``cpu_seconds`` its processor time, which other processes
    on the machine disturb less; ``key`` says of what scene and version it was.
    """

    setting: str
    repeat: int
    status: int | None
    seconds: float
    cpu_seconds: float
    message: str
    key: str
    folder: Path

    @property
    def report(self) -> dict[str, Any] | None:
        """What the run wrote into report.json, None when it did not get so far."""
        try:
            report = json.loads((self.folder / "report.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return report if isinstance(report, dict) else None


@dataclass(frozen=True)
class Study:
    """What a study runs.

    Attributes
    ----------
    scene : Path
        Scene file.
    folder : Path
        Where the runs are kept, each in ``runs/SETTING/REPEAT``.
    overrides : tuple of str
        ``KEY=VALUE`` for all settings; a setting's own come later and win.
    limit : float or None
        Wall clock after which a run is stopped [s].
    """

    scene: Path
    folder: Path
    overrides: tuple[str, ...] = ()
    limit: float | None = None

    def overrides_of(self, setting: Setting) -> tuple[str, ...]:
        """All overrides of a setting."""
        return (*self.overrides, *setting.overrides)

    def run_folder(self, setting: Setting, repeat: int) -> Path:
        """Where a run is kept."""
        return self.folder / "runs" / setting.slug / str(repeat)

    def key(self, setting: Setting) -> str:
        """What a kept run must have been of: the resolved scene and the version.

        Raises
        ------
        SceneError
            When the setting's entries make no scene.
        """
        scene = load_scene(self.scene, overrides=self.overrides_of(setting))
        text = json.dumps([scene.model_dump(mode="json"), __version__], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def clear(self, settings: Sequence[Setting]) -> None:
        """Remove what earlier studies kept of these settings."""
        for setting in settings:
            shutil.rmtree(self.run_folder(setting, 0).parent, ignore_errors=True)


def kept_run(study: Study, setting: Setting, repeat: int) -> Run | None:
    """A run of this very scene that is kept from before, None when there is none.

    One that was stopped counts only for a time limit that is no longer.
    """
    folder = study.run_folder(setting, repeat)
    try:
        data = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        run = Run(**{**data, "folder": folder})
    except (OSError, ValueError, TypeError):
        return None
    if run.key != study.key(setting):
        return None
    enough = study.limit is not None and study.limit <= run.seconds
    return run if run.status is not None or enough else None


def run_setting(
    study: Study,
    setting: Setting,
    repeat: int,
    execute: Callable[[Sequence[str], float | None], tuple[int | None, str]] | None = None,
) -> Run:
    """Run a setting once more, from scratch, and keep what it left.

    Parameters
    ----------
    study, setting, repeat
        What to run, and the how-manieth time, from 0.
    execute : callable
        Runs a command line within a time limit and gives exit status (None: stopped) and standard
        error; by default a process.

    Raises
    ------
    SceneError
        When the folder cannot be written to, or the setting makes no scene.
    """
    folder, key = study.run_folder(setting, repeat), study.key(setting)
    shutil.rmtree(folder, ignore_errors=True)
    command = [sys.executable, "-m", "avneo_fem", "suture", str(study.scene), "-o", str(folder)]
    for text in study.overrides_of(setting):
        command += ["--set", text]
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        reason = f"cannot be used ({error.strerror})"
        raise SceneError("output folder", str(study.folder), reason) from None
    clock, used = time.perf_counter(), _children_seconds()
    status, told = (execute or _process)(command, study.limit)
    seconds, used = time.perf_counter() - clock, _children_seconds() - used
    shutil.rmtree(folder / "checkpoints", ignore_errors=True)
    lines = told.strip().splitlines()
    message = f"stopped after {seconds:.0f} s" if status is None else (lines or [""])[-1]
    run = Run(setting.name, repeat, status, seconds, used, message, key, folder)
    with written_whole(folder / "run.json") as temporary:
        data = {name: value for name, value in asdict(run).items() if name != "folder"}
        temporary.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    return run


def _children_seconds() -> float:
    """Processor time of all processes that were started here and have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _process(command: Sequence[str], limit: float | None) -> tuple[int | None, str]:
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            timeout=limit,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None, ""
    return done.returncode, done.stderr
