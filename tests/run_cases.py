"""Whole runs through the command line, in processes of their own, and scenes that are quick."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

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
    "[contact]\n", "[wall]\nmaximum_stiffness = 8.0\n[contact]\nmaximum_stiffness = 16.0\n"
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


def suture(text: str, folder: Path, *options: str, ranks: int = 1, name: str = "valve-1") -> Run:
    """``avneo suture`` of a scene given as TOML text, results in ``folder``/out."""
    scene = folder / f"{name}.toml"
    scene.write_text(text)
    out = folder / "out"
    return Run(scene, out, avneo("suture", scene, "-o", out, *options, ranks=ranks))
