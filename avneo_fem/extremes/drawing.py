"""The map as a picture: a row of cells for every axis, coloured by how the case ended."""

from __future__ import annotations

import textwrap
from itertools import groupby
from pathlib import Path
from typing import Any

from avneo_fem.extremes.outcome import Judgement, Kind, judged
from avneo_fem.extremes.table import Ended, summary
from avneo_fem.results.pictures import PictureError
from avneo_fem.results.writing import written_whole

__all__ = ["draw_map"]

_COLOURS = {
    Judgement.VERIFIED: "#a6d8a8",
    Judgement.RIGHT: "#b8cbe4",
    Judgement.MISSED: "#f6c77e",
    Judgement.BUG: "#ee8a80",
}
_MEANING = {
    Judgement.VERIFIED: "verified",
    Judgement.RIGHT: "infeasible, and told why",
    Judgement.MISSED: "feasible, not verified, and told why",
    Judgement.BUG: "bug: crash, timeout, wrong diagnosis or different valve",
}
_PER_ROW = 12


def _figures(outcome: Any) -> str:
    if outcome.kind == Kind.REFUSED:
        return "refused"
    lines = [] if outcome.kind == Kind.VERIFIED else [str(outcome.kind)]
    if outcome.kind != Kind.VERIFIED and outcome.stage:
        lines.append(outcome.stage)
    if outcome.iterations:
        lines.append(f"{outcome.iterations} it")
    if outcome.residual is not None:
        lines.append(f"res {outcome.residual:.0e}")
    if outcome.condition is not None:
        lines.append(f"cond {outcome.condition:.0e}")
    if outcome.deviation is not None:
        lines.append(f"off {outcome.deviation:.0e}")
    return "\n".join(lines)


def _rows(ended: Ended) -> list[tuple[str, list[Any]]]:
    """Rows of at most twelve cells, the first of a group with its name."""
    rows = []
    for group, members in groupby(ended, key=lambda pair: pair[0].group):
        cells = list(members)
        for start in range(0, len(cells), _PER_ROW):
            rows.append(("" if start else group, cells[start : start + _PER_ROW]))
    return rows


def draw_map(path: Path, ended: Ended) -> None:
    """Draw the outcomes, with iterations, residual and condition number, to a PNG file.

    Raises
    ------
    PictureError
        Without Matplotlib.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch, Rectangle
    except ImportError as error:
        raise PictureError(f"{path.name}: not drawn, Matplotlib is missing ({error})") from None
    rows = _rows(ended)
    height = 1.15 * len(rows) + 1.3
    figure = Figure(figsize=(15.0, height))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.06, 0.0, 0.935, 1.0 - 1.1 / height))
    axes.set(xlim=(0, _PER_ROW), ylim=(-len(rows), 0.0))
    axes.set_axis_off()
    for number, (group, cells) in enumerate(rows):
        axes.text(-0.05, -number - 0.5, group, ha="right", va="center", fontsize=11, weight="bold")
        for column, (case, outcome) in enumerate(cells):
            colour = _COLOURS[judged(case, outcome)]
            place = (column + 0.02, -number - 0.97)
            axes.add_patch(Rectangle(place, 0.96, 0.94, facecolor=colour, edgecolor="none"))
            middle = column + 0.5
            label = "\n".join(
                part for line in case.label.split("\n") for part in textwrap.wrap(line, 14)
            )
            axes.text(middle, -number - 0.07, label, ha="center", va="top", fontsize=9)
            text = _figures(outcome)
            axes.text(middle, -number - 0.93, text, ha="center", va="bottom", fontsize=7.5)
    handles = [Patch(color=_COLOURS[kind], label=text) for kind, text in _MEANING.items()]
    figure.legend(handles=handles, loc="upper center", ncols=4, frameon=False, fontsize=10)
    figure.text(0.5, 1.0 - 0.62 / height, summary(ended), ha="center", fontsize=12)
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=110)
