"""Error against time as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from avneo_fem.results.pictures import PictureError
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import FIDELITIES
from avneo_fem.tradeoff.advice import front
from avneo_fem.tradeoff.measured import Errors
from avneo_fem.tradeoff.rows import Row
from avneo_fem.tradeoff.settings import SECOND_PATH

__all__ = ["PictureError", "draw_tradeoff"]

_DEFAULT = "standard"


def draw_tradeoff(path: Path, rows: Sequence[Row], scatter: Errors | None, title: str) -> None:
    """Draw mean surface distance over processor time, with Pareto front and scatter band.

    Fidelities are filled, the default is a star, what was not verified is a cross; numbers lead to
    the legend. Settings without a result are named there only.

    Raises
    ------
    PictureError
        Without matplotlib.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
    except ImportError as error:
        raise PictureError(f"{path}: no picture without matplotlib ({error})") from error
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    shown = [row for row in rows if row.errors is not None]
    if scatter is not None:
        label = f"scatter: two equally fine solutions ({scatter.surface_mean_mm:.2f} mm)"
        axes.axhspan(0.0, scatter.surface_mean_mm, color="0.88", zorder=0, label=label)
    best = front(rows)
    if best:
        line = [(row.cpu_seconds, row.errors.surface_mean_mm) for row in best if row.errors]
        axes.step(*zip(*line, strict=True), where="post", color="C0", lw=1, label="Pareto front")
    for number, row in enumerate(shown, 1):
        assert row.errors is not None
        place = row.cpu_seconds, row.errors.surface_mean_mm
        fidelity = row.name in FIDELITIES
        marker = "*" if row.name == _DEFAULT else ("o" if fidelity else "s")
        color = "C0" if fidelity else ("0.3" if row.name == SECOND_PATH else "C1")
        if not row.verified:
            marker, color = "x", "C3"
        default = ", the default" if row.name == _DEFAULT else ""
        verdict = "" if row.verified else f" ({row.verdict})"
        axes.plot(
            *place,
            marker,
            ms=13 if marker == "*" else 7,
            color=color,
            ls="none",
            label=f"{number}  {row.name}{default}{verdict}: {row.cpu_seconds:.0f} s",
        )
        axes.hlines(place[1], place[0], place[0] + row.cpu_spread, color=color, lw=1)
        axes.annotate(str(number), place, xytext=(6, 5), textcoords="offset points", fontsize=9)
    for row in rows:
        if row.errors is None:
            label = f"–  {row.name} ({row.verdict}): {row.cpu_seconds:.0f} s"
            axes.plot([], [], "x", color="C3", label=label)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("processor time [s]")
    axes.set_ylabel("mean distance from the reference's surface [mm]")
    axes.set_title(title)
    axes.grid(alpha=0.3, which="both")
    figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=110)
