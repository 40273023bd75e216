"""One case as a process of its own: ``python -m avneo_fem suture`` with a time limit."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from math import ceil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from avneo_fem.extremes.case import ExtremeCase, scene_text
from avneo_fem.extremes.outcome import Kind, Outcome, classify
from avneo_fem.results.writing import written_whole

__all__ = ["deviation", "kept_outcome", "run_case"]

_SCENE, _OUTCOME, _ERRORS, _RESULTS = "case.toml", "outcome.json", "stderr.txt", "results"


def _environment() -> dict[str, str]:
    """Ours, less what MPI may have left in it, and one thread."""
    kept = {
        key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX"))
    }
    return kept | {"OMP_NUM_THREADS": "1", "COLUMNS": "200"}


def _final_points(folder: Path) -> NDArray[np.float64]:
    """(n, 3) positions of all cusps at the end of a run [mm]."""
    with h5py.File(folder / _RESULTS / "valve.h5") as file:
        steps = file["steps"]
        return np.asarray(steps[sorted(steps)[-1]]["points"][:])


def deviation(folder: Path, reference: Path, unit: float) -> float | None:
    """Largest distance of a valve from ``unit`` times another, over the latter's size.

    None when there is no such other; infinite when they are not the same mesh.
    """
    try:
        found, wanted = _final_points(folder), unit * _final_points(reference)
    except OSError:
        return None
    if found.shape != wanted.shape:
        return float("inf")
    size = float(np.ptp(wanted, axis=0).max())
    return float(np.linalg.norm(found - wanted, axis=1).max()) / size


def kept_outcome(case: ExtremeCase, folder: Path) -> Outcome | None:
    """What an earlier run of the same scene left in the case's folder, None if nothing."""
    try:
        if (folder / _SCENE).read_text(encoding="utf-8") != scene_text(case):
            return None
        data = json.loads((folder / _OUTCOME).read_text(encoding="utf-8"))
        return Outcome(**{**data, "kind": Kind(data["kind"])})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _report(folder: Path) -> dict[str, Any] | None:
    try:
        data: dict[str, Any] = json.loads((folder / _RESULTS / "report.json").read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return data


#: wall clock that a case may take, in units of its limit: the machine may be busy
_BUSY = 10.0


def _limited(seconds: float) -> Callable[[], None]:
    """What the child does first: have itself ended after so much processor time."""
    limit = ceil(seconds)

    def restrict() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    return restrict


def run_case(case: ExtremeCase, folder: Path, reference: Path | None, limit: float) -> Outcome:
    """Suture a case and keep scene, stderr, results and outcome in ``folder``.

    Parameters
    ----------
    case : ExtremeCase
    folder : Path
        Of this case; what is in it from earlier runs is removed.
    reference : Path or None
        Folder of the case that it must agree with.
    limit : float
        Processor time after which the process is killed, times the case's ``patience`` [s]; ten
        times that by the wall clock.

    Raises
    ------
    OSError
        When the folder cannot be written to.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    scene = folder / _SCENE
    with written_whole(scene) as temporary:
        temporary.write_text(scene_text(case), encoding="utf-8")
    command = [sys.executable, "-m", "avneo_fem", "suture", str(scene), "--json"]
    command += ["-o", str(folder / _RESULTS), "--no-picture"]
    if case.cusp is not None:
        command += ["--cusp", str(case.cusp)]
    clock = time.perf_counter()
    with (folder / _ERRORS).open("w", encoding="utf-8") as errors:
        process = subprocess.Popen(
            command,
            env=_environment(),
            stdout=subprocess.DEVNULL,
            stderr=errors,
            preexec_fn=_limited(limit * case.patience),
        )
        status: int | None
        try:
            status = process.wait(_BUSY * limit * case.patience)
            if status == -signal.SIGXCPU:
                status = None
        except subprocess.TimeoutExpired:
            status = None
        finally:
            # a map that is interrupted leaves nothing running
            if process.poll() is None:
                process.kill()
                process.wait()
    seconds = time.perf_counter() - clock
    off = None
    if status == 0 and reference is not None:
        off = deviation(folder, reference, case.unit)
    text = (folder / _ERRORS).read_text(encoding="utf-8", errors="replace")
    outcome = classify(case.name, status, text, _report(folder), seconds, off)
    with written_whole(folder / _OUTCOME) as temporary:
        temporary.write_text(json.dumps(asdict(outcome), indent=2) + "\n", encoding="utf-8")
    return outcome
