"""Whole runs through the command line, inside pytest or as processes, and scenes that are quick."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import h5py
import numpy as np
from numpy.typing import NDArray

from avneo_fem.cli import main

Floats = NDArray[np.float64]

#: Coarse, little gathered: seconds. Wall and wedge need not be kept to more than its edge lengths
#: allow.
SMALL = """
[template]
free_edge_length = 28.0
belly_radius = 11.8
[contact]
steps = 4
[mesh]
size = 3.0
[solver]
clamp_steps = 2
boundary_steps = 10
inside_tolerance = 0.3
"""
#: The same with every cusp solved on its own.
SMALL_ALL = "reuse_congruent = false\n" + SMALL
#: More gathered and finer: the clearances hold to 0.1 mm, after the stiffness was raised.
VERIFIED = (
    SMALL.replace("28.0", "31.0")
    .replace("11.8", "13.12")
    .replace("size = 3.0", "size = 2.5")
    .replace("0.3", "0.1")
)
#: Clearances that cannot be had: the penalties start as stiff as they may become.
FAILING = SMALL.replace("inside_tolerance = 0.3", "inside_tolerance = 0.001").replace(
    "[contact]\n",
    "[wall]\nmaximum_stiffness = 64.0\n[clamp]\nmaximum_stiffness = 1e4\n"
    "[contact]\nmaximum_stiffness = 16.0\n",
)


def environment() -> dict[str, str]:
    """Ours, less what MPI left in it: a process that has initialised MPI could not start mpirun."""
    inherited = {
        name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX_"))
    }
    return inherited | {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",  # Open MPI 5
        "COLUMNS": "200",
    }


def command(*arguments: str | Path, ranks: int = 1) -> list[str]:
    """Command line of ``python -m avneo_fem`` or of a script, in one or several processes."""
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return [*start, sys.executable, *map(str, arguments)]


def avneo(*arguments: str | Path, ranks: int = 1) -> subprocess.CompletedProcess[str]:
    """Run ``avneo ARGUMENTS`` to its end."""
    return subprocess.run(
        command("-m", "avneo_fem", *arguments, ranks=ranks),
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


def avneo_inside(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The same without a new process, which saves seconds of imports; errors show up here."""
    out, errors, status = io.StringIO(), io.StringIO(), 0
    with (
        mock.patch.object(sys, "argv", ["avneo", *map(str, arguments)]),
        mock.patch.object(sys, "excepthook", sys.excepthook),  # typer sets its own
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(errors),
    ):
        try:
            main()
        except SystemExit as end:
            status = int(end.code or 0)
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), errors.getvalue())


@dataclass(frozen=True)
class Run:
    """An ``avneo suture`` that has ended, and its results folder."""

    scene: Path
    folder: Path
    process: subprocess.CompletedProcess[str]

    @property
    def report(self) -> dict[str, Any]:
        """What report.json says."""
        data: dict[str, Any] = json.loads((self.folder / "report.json").read_text())
        return data

    def points(self, step: int = -1) -> Floats:
        """(n, 3) positions of all cusps' nodes in double precision, at the end of a level [mm]."""
        with h5py.File(self.folder / "valve.h5") as file:
            steps = file["steps"]
            points: Floats = steps[sorted(steps)[step]]["points"][:]
            return points


def written(text: str, folder: Path, name: str = "valve-1") -> Path:
    """Scene file of this TOML text."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def suture(text: str, folder: Path, *options: str, ranks: int = 1) -> Run:
    """``avneo suture`` of a scene in processes of its own, results in ``folder``/out."""
    scene, out = written(text, folder), folder / "out"
    return Run(scene, out, avneo("suture", scene, "-o", out, *options, ranks=ranks))


def suture_inside(text: str, folder: Path, *options: str) -> Run:
    """The same inside pytest."""
    scene, out = written(text, folder), folder / "out"
    return Run(scene, out, avneo_inside("suture", scene, "-o", out, *options))
