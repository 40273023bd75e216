"""One row per setting: what it cost, whether it was verified, and how far it is from the
reference."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from avneo_fem.results.writing import written_whole
from avneo_fem.tradeoff.measured import Errors
from avneo_fem.tradeoff.runs import Run
from avneo_fem.tradeoff.settings import Setting

__all__ = ["Row", "row_of", "write_csv"]


@dataclass(frozen=True)
class Row:
    """A setting that was run.

    Attributes
    ----------
    name, overrides : str
        The setting, and its entries of the scene.
    verdict : str
        ``verified``, ``not verified``, ``stopped`` (time limit) or ``failed`` (no result).
    reason : str
        Why it is not verified, empty when it is.
    runs : int
        How often it was run.
    seconds, spread, cpu_seconds, cpu_spread : float
        Least wall clock and processor time of these runs, and largest less least [s].
    iterations, triangles : int or None
        Of the cusps that were solved, copies apart.
    errors : Errors or None
        From the reference; None when it or the reference left no result.
    """

    name: str
    overrides: str
    verdict: str
    reason: str
    runs: int
    seconds: float
    spread: float
    cpu_seconds: float
    cpu_spread: float
    iterations: int | None
    triangles: int | None
    errors: Errors | None

    @property
    def verified(self) -> bool:
        """Whether its result was verified."""
        return self.verdict == "verified"


def row_of(setting: Setting, runs: Sequence[Run], errors: Errors | None) -> Row:
    """The row of a setting from its runs (at least one); the first one's result counts."""
    first, report = runs[0], runs[0].report
    wall, cpu = [run.seconds for run in runs], [run.cpu_seconds for run in runs]
    solved = [c for c in (report or {"cusps": []})["cusps"] if c["copied_from"] is None]
    iterations = sum(stage["iterations"] for cusp in solved for stage in cusp["stages"])
    if first.status is None:
        verdict, reason = "stopped", first.message
    elif report is None:
        verdict, reason = "failed", first.message or f"exit status {first.status}"
    elif report["verified"]:
        verdict, reason = "verified", ""
    else:
        verdict, reason = "not verified", "; ".join(report["failures"])
    return Row(
        setting.name,
        " ".join(setting.overrides),
        verdict,
        reason,
        len(runs),
        min(wall),
        max(wall) - min(wall),
        min(cpu),
        max(cpu) - min(cpu),
        iterations if solved else None,
        sum(cusp["cells"] for cusp in solved) if solved else None,
        errors,
    )


def write_csv(path: Path, rows: Sequence[Row], dominated: dict[str, str]) -> None:
    """Write the rows as CSV; figures that do not exist are empty.

    Parameters
    ----------
    path : Path
    rows : sequence of Row
    dominated : dict
        By the name of a setting that of one which is faster and no worse.
    """
    names = [field.name for field in fields(Errors)]
    head = ["setting", "overrides", "verdict", "reason", "runs", "wall_s", "wall_spread_s"]
    head += ["cpu_s", "cpu_spread_s", "iterations", "triangles", *names, "dominated_by"]
    with written_whole(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(head)
        for row in rows:
            # one run has no spread
            spreads = ["" if row.runs == 1 else f"{x:.1f}" for x in (row.spread, row.cpu_spread)]
            times = f"{row.seconds:.1f}", spreads[0], f"{row.cpu_seconds:.1f}", spreads[1]
            errors = [
                "" if row.errors is None else _shown(getattr(row.errors, name)) for name in names
            ]
            cells = [row.name, row.overrides, row.verdict, row.reason, row.runs]
            cells += times
            cells += ["" if x is None else x for x in (row.iterations, row.triangles)]
            writer.writerow([*cells, *errors, dominated.get(row.name, "")])


def _shown(value: float) -> str:
    return "" if value != value else f"{value:.4f}"
