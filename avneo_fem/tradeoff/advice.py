"""Which settings are worth their time, and in one line which one to take.

Two equally fine solutions that were reached differently differ, too, because the cusp folds
differently: what lies below this scatter is no error. So a figure counts as the scatter where it
is smaller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields

from avneo_fem.tradeoff.measured import Errors
from avneo_fem.tradeoff.rows import Row
from avneo_fem.tradeoff.settings import REFERENCE, SECOND_PATH

__all__ = ["advice", "dominated_settings", "front", "usable"]

#: figures by which settings are ranked; the largest distances are those of single folds
_RANKED = [field.name for field in fields(Errors) if field.name != "surface_largest_mm"]


def usable(rows: Sequence[Row]) -> list[Row]:
    """Verified rows with errors, other than the reference's own two."""
    own = (REFERENCE, SECOND_PATH)
    return [row for row in rows if row.verified and row.errors and row.name not in own]


def _mean(row: Row) -> float:
    assert row.errors is not None
    return row.errors.surface_mean_mm


def front(rows: Sequence[Row]) -> list[Row]:
    """The Pareto front of processor time and mean surface distance, from the fastest on."""
    found: list[Row] = []
    for row in sorted(usable(rows), key=lambda row: (row.cpu_seconds, _mean(row))):
        if not found or _mean(row) < _mean(found[-1]):
            found.append(row)
    return found


def dominated_settings(rows: Sequence[Row], scatter: Errors | None) -> dict[str, str]:
    """By name of a setting, the fastest one that is faster and in no figure worse.

    Faster means beyond the spread of both timings; figures below the scatter count as the scatter.
    Settings that are not verified are not compared.
    """
    found = {}
    for row in usable(rows):
        better = [
            other
            for other in usable(rows)
            if other.cpu_seconds + max(row.cpu_spread, other.cpu_spread) < row.cpu_seconds
            and all(_figure(other, n, scatter) <= _figure(row, n, scatter) for n in _RANKED)
        ]
        if better:
            found[row.name] = min(better, key=lambda other: other.cpu_seconds).name
    return found


def _figure(row: Row, name: str, scatter: Errors | None) -> float:
    """A figure of a row, at least the scatter; infinite where the row has none."""
    value = getattr(row.errors, name)
    if math.isnan(value):
        return math.inf
    least = 0.0 if scatter is None else getattr(scatter, name)
    return value if math.isnan(least) else max(value, least)


def advice(rows: Sequence[Row], scatter: Errors | None, target: float | None = None) -> str:
    """One line: the fastest verified setting within ``target`` of the reference.

    Parameters
    ----------
    rows : sequence of Row
    scatter : Errors or None
        How far the reference is from its second path, None when that is not known.
    target : float or None
        Mean surface distance [mm]; by default the scatter, rounded up to a tenth.
    """
    reference = next((row for row in rows if row.name == REFERENCE), None)
    if reference is None or not reference.verified:
        return "no advice: the reference was not verified, so nothing is known of the errors"
    if not usable(rows):
        return "no advice: no other setting was verified"
    floor = None if scatter is None else scatter.surface_mean_mm
    limits = "the scatter of equally fine solutions is not known"
    if floor is not None:
        limits = f"equally fine solutions differ by {floor:.2f} mm, so less cannot be told apart"
    nearest = min(usable(rows), key=lambda row: (_mean(row), row.cpu_seconds))
    if target is None:
        least = _mean(nearest) if floor is None else floor
        target = max(0.1, math.ceil(round(10 * least, 6)) / 10)
    if floor is not None and target < floor:
        return f"no advice for {target:g} mm: {limits}"
    near = [row for row in usable(rows) if _mean(row) <= target]
    if not near:
        return (
            f"no setting is within {target:g} mm of the reference; the nearest is"
            f' "{nearest.name}" with {_mean(nearest):.2f} mm in {_told(nearest)}; {limits}'
        )
    best = min(near, key=lambda row: row.cpu_seconds)
    faster = [
        f"{row.cpu_seconds / best.cpu_seconds:.1f}x faster than {row.name}"
        for row in rows
        if row.name in ("standard", "fine", REFERENCE) and row.cpu_seconds > best.cpu_seconds
    ]
    than = f": {', '.join(faster)}" if faster else ""
    told = f'use "{best.name}" ({_mean(best):.2f} mm in {_told(best)})'
    return f"for {target:g} mm {told}{than}; {limits}"


def _told(row: Row) -> str:
    return f"{row.cpu_seconds:.0f} s"
