"""All chosen cases one after the other, with what is kept and told on the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from avneo_fem.errors import SceneError
from avneo_fem.extremes.case import ExtremeCase
from avneo_fem.extremes.drawing import draw_map
from avneo_fem.extremes.outcome import Judgement, Outcome, judged
from avneo_fem.extremes.running import kept_outcome, run_case
from avneo_fem.extremes.table import Ended, bugs, summary, write_table
from avneo_fem.results.pictures import PictureError

__all__ = ["run_map"]

_STYLES = {
    Judgement.VERIFIED: "green",
    Judgement.RIGHT: "blue",
    Judgement.MISSED: "yellow",
    Judgement.BUG: "bold red",
}

Runner = Callable[[ExtremeCase, Path, Path | None, float], Outcome]


def _line(case: ExtremeCase, outcome: Outcome) -> str:
    verdict = judged(case, outcome)
    style = _STYLES[verdict]
    text = f"{case.group:<9} {case.name:<26} [{style}]{verdict:<15}[/] {outcome.seconds:6.1f} s"
    text += f" {outcome.iterations:>5} it"
    if outcome.residual is not None:
        text += f"  residual {outcome.residual:.0e}"
    return text + (f"  {escape(outcome.message[:100])}" if outcome.message else "")


def _write(folder: Path, ended: Ended, console: Console) -> None:
    """Table and picture of what has ended so far, so that a killed map leaves them."""
    write_table(folder / "extremes.csv", ended)
    try:
        draw_map(folder / "extremes.png", ended)
    except PictureError as error:
        if len(ended) == 1:
            console.print(f"[yellow]{escape(str(error))}[/]")


def run_map(
    cases: Sequence[ExtremeCase],
    folder: Path,
    console: Console,
    *,
    resume: bool = False,
    limit: float = 300.0,
    run: Runner = run_case,
) -> Ended:
    """Run cases and leave ``extremes.csv``, ``extremes.png`` and a folder for each.

    Parameters
    ----------
    cases : sequence of ExtremeCase
        Those that others are compared with come before them.
    folder : Path
        Made if missing.
    console : Console
        Where progress is told.
    resume : bool
        Take over the outcomes of cases that ended in an earlier run with the same scene.
    limit : float
        Time limit of a case [s].
    run : callable
        Runs one case.

    Returns
    -------
    list of (ExtremeCase, Outcome)

    Raises
    ------
    SceneError
        When the folder cannot be written to.
    """
    ended: list[tuple[ExtremeCase, Outcome]] = []
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with Progress(*columns, TimeElapsedColumn(), console=console, transient=True) as progress:
            task = progress.add_task("", total=len(cases))
            for case in cases:
                progress.update(task, description=case.name)
                home = folder / case.name
                outcome = kept_outcome(case, home) if resume else None
                if outcome is None:
                    reference = folder / case.same_as if case.same_as else None
                    outcome = run(case, home, reference, limit)
                    progress.console.print(_line(case, outcome))
                ended.append((case, outcome))
                _write(folder, ended, console)
                progress.advance(task)
    except OSError as error:
        reason = f"cannot be used ({error.strerror})"
        raise SceneError("output folder", str(folder), reason) from None
    for bug in bugs(ended):
        console.print(f"[bold red]bug:[/] {escape(bug)}")
    console.print(summary(ended))
    return ended
