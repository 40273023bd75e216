"""The map as a table, and what it comes down to."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from avneo_fem.extremes.case import ExtremeCase
from avneo_fem.extremes.outcome import Judgement, Outcome, judged
from avneo_fem.results.writing import written_whole

__all__ = ["Ended", "bugs", "summary", "write_table"]

#: cases with their outcomes, in the order of the map
Ended = Sequence[tuple[ExtremeCase, Outcome]]

_HEADS = (
    "case",
    "group",
    "feasible",
    "judgement",
    "outcome",
    "seconds",
    "iterations",
    "residual",
    "condition",
    "clamp_rms_degrees",
    "deviation",
    "last_stage",
    "message",
    "about",
    "why_infeasible",
)


def _figure(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def write_table(path: Path, ended: Ended) -> None:
    """Write extremes.csv, whole or not at all."""
    with written_whole(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(_HEADS)
        for case, outcome in ended:
            rows.writerow(
                [
                    case.name,
                    case.group,
                    "yes" if case.feasible else "no",
                    judged(case, outcome),
                    outcome.kind,
                    f"{outcome.seconds:.1f}",
                    outcome.iterations,
                    _figure(outcome.residual, ".1e"),
                    _figure(outcome.condition, ".1e"),
                    _figure(outcome.clamp_degrees, ".2f"),
                    _figure(outcome.deviation, ".1e"),
                    outcome.stage,
                    outcome.message,
                    case.about,
                    case.infeasible,
                ]
            )


def bugs(ended: Ended) -> list[str]:
    """One line for every case that ended neither verified nor with an honest, right reason."""
    return [
        f"{case.name}: {outcome.kind}: {outcome.message or 'stated to be infeasible'}"
        for case, outcome in ended
        if judged(case, outcome) == Judgement.BUG
    ]


def summary(ended: Ended) -> str:
    """``N of M feasible verified (...%)`` and how the infeasible ended, in one line."""
    feasible = [judged(case, outcome) for case, outcome in ended if case.feasible]
    others = [judged(case, outcome) for case, outcome in ended if not case.feasible]
    verified = feasible.count(Judgement.VERIFIED)
    share = f" ({100.0 * verified / len(feasible):.0f} %)" if feasible else ""
    return (
        f"{verified} of {len(feasible)} feasible verified{share},"
        f" {others.count(Judgement.RIGHT)} of {len(others)} infeasible rightly diagnosed,"
        f" {len(bugs(ended))} bugs"
    )
