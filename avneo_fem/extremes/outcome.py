"""How a case ended, and whether that was right."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from avneo_fem.extremes.case import ExtremeCase

__all__ = ["Judgement", "Kind", "Outcome", "classify", "judged"]

#: largest relative distance of a valve from the same valve in other units
SAME = 1e-8


class Kind(StrEnum):
    """What a run did."""

    VERIFIED = "verified"
    REFUSED = "refused"  # exit status 2 with the entry at fault
    FAILED = "failed"  # exit status 1 with the reason
    TIMEOUT = "timeout"
    CRASH = "crash"  # a traceback, a signal, or nothing that says why
    UNVERIFIED = "unverified"  # exit status 0, but the report does not say verified
    DIFFERS = "differs"  # verified, but not the valve it must be


class Judgement(StrEnum):
    """What that means."""

    VERIFIED = "verified"
    RIGHT = "right diagnosis"
    MISSED = "not verified"  # feasible, and the reason of the failure was told
    BUG = "bug"


@dataclass(frozen=True)
class Outcome:
    """How one case ended.

    Attributes
    ----------
    name, kind
        Which case, and what its run did.
    message : str
        Why, in the program's words.
    seconds : float
        Wall clock of the process.
    iterations : int
        Newton iterations of all cusps that were solved.
    residual, clamp_degrees : float or None
        Largest relative residual, and largest rms angle to the tangent half-plane.
    stage : str
        Last stage of the first cusp that failed, or of the last cusp.
    deviation : float or None
        Largest distance from the valve that must come out, over its size.
    condition : float or None
        Largest condition number of the tangent where a cusp ended.
    """

    name: str
    kind: Kind
    message: str = ""
    seconds: float = 0.0
    iterations: int = 0
    residual: float | None = None
    clamp_degrees: float | None = None
    stage: str = ""
    deviation: float | None = None
    condition: float | None = None


def _told(errors: str) -> str:
    """What the program said after its name in the last such line, "" when it said nothing."""
    lines = [line for line in errors.splitlines() if line.startswith("avneo: ")]
    return lines[-1].removeprefix("avneo: ") if lines else ""


def _last_line(errors: str) -> str:
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    return lines[-1] if lines else "said nothing"


def _largest(values: list[float | None]) -> float | None:
    numbers = [value for value in values if value is not None]
    return max(numbers) if numbers else None


def _own_failures(report: Mapping[str, Any]) -> list[str]:
    """Failures but those that a copied cusp has from the one it was turned from."""
    copied = [f"cusp {c['index']}: " for c in report["cusps"] if c["copied_from"] is not None]
    return [text for text in report["failures"] if not text.startswith(tuple(copied))]


def _measured(report: Mapping[str, Any]) -> dict[str, Any]:
    cusps = report["cusps"]
    solved = [cusp for cusp in cusps if cusp["copied_from"] is None]
    failed = [cusp for cusp in solved if cusp["failure"]] or solved[-1:]
    return {
        "iterations": sum(stage["iterations"] for cusp in solved for stage in cusp["stages"]),
        "residual": _largest([cusp["residual"] for cusp in cusps]),
        "clamp_degrees": _largest([cusp["clamp_error_deg"]["rms"] for cusp in cusps]),
        "condition": _largest([cusp["condition"] for cusp in solved]),
        "stage": failed[0]["stages"][-1]["name"] if failed and failed[0]["stages"] else "",
    }


def classify(
    name: str,
    status: int | None,
    errors: str,
    report: Mapping[str, Any] | None,
    seconds: float,
    deviation: float | None = None,
) -> Outcome:
    """Outcome of a process ``avneo suture``.

    Parameters
    ----------
    name : str
        Of the case.
    status : int or None
        Exit status, negative for a signal; None: killed at its time limit.
    errors : str
        What it wrote on stderr.
    report : mapping or None
        Its report.json.
    seconds : float
        Wall clock.
    deviation : float or None
        Relative distance from the valve that must come out, where that is asked.
    """
    told = _told(errors)
    figures: dict[str, Any] = {} if report is None else _measured(report)

    def ended(kind: Kind, message: str) -> Outcome:
        return Outcome(name, kind, message, seconds, deviation=deviation, **figures)

    if status is None:
        return ended(Kind.TIMEOUT, f"killed; its last words: {_last_line(errors)}")
    if status < 0:
        return ended(Kind.CRASH, f"signal {-status}; its last words: {_last_line(errors)}")
    if "Traceback (most recent call last)" in errors:
        return ended(Kind.CRASH, _last_line(errors))
    failures = [] if report is None else _own_failures(report)
    if status == 0:
        if report is None or failures or report["verified"] is not True:
            return ended(Kind.UNVERIFIED, "; ".join(failures) or "no report that says verified")
        if deviation is not None and not deviation <= SAME:
            text = f"off by {deviation:.1e} of its size, allowed {SAME:.0e}"
            return ended(Kind.DIFFERS, text)
        return ended(Kind.VERIFIED, "")
    if status == 2 and told and report is None:
        return ended(Kind.REFUSED, told)
    if status == 1 and (failures or told):
        return ended(Kind.FAILED, "; ".join(failures) or told)
    return ended(Kind.CRASH, f"exit status {status}; its last words: {_last_line(errors)}")


def judged(case: ExtremeCase, outcome: Outcome) -> Judgement:
    """What an outcome means for a case whose feasibility was stated beforehand."""
    explained = outcome.kind in (Kind.REFUSED, Kind.FAILED)
    if case.feasible:
        if outcome.kind == Kind.VERIFIED:
            return Judgement.VERIFIED
        return Judgement.MISSED if outcome.kind == Kind.FAILED else Judgement.BUG
    if explained and re.search(case.diagnosis, outcome.message):
        return Judgement.RIGHT
    return Judgement.BUG
