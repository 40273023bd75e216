"""``avneo tradeoff``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from avneo_fem.cli_options import Scene, Set, people
from avneo_fem.scene import load_scene

__all__ = ["tradeoff"]


def tradeoff(
    scene: Scene,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="default: out/NAME-tradeoff"),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TEXT",
            help='a default setting by name, or "NAME: KEY=VALUE ..." (repeatable; default: all)',
        ),
    ] = None,
    set_: Set = None,
    repeats: Annotated[int, typer.Option(min=1, help="runs of each setting, for its timing")] = 2,
    limit: Annotated[
        float | None, typer.Option(min=1.0, metavar="SECONDS", help="stop a run that takes longer")
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="MM", help="mean surface distance to give advice for"),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="keep the runs that are there")] = False,
) -> None:
    """Error against time: run a set of settings and measure them against the reference."""
    from avneo_fem.geometry.valve_input import ValveInput

    loaded = load_scene(scene, overrides=set_ or ())
    ValveInput.from_scene(loaded)
    from avneo_fem.tradeoff.plot import PictureError
    from avneo_fem.tradeoff.runs import Study
    from avneo_fem.tradeoff.settings import REFERENCE
    from avneo_fem.tradeoff.study import evaluate, plan, run_study, write_study

    folder = Path("out") / f"{loaded.name}-tradeoff" if output is None else output
    study = Study(scene, folder, tuple(set_ or ()), limit)
    chosen = plan(study, settings or ())
    try:
        runs = run_study(study, chosen, repeats, resume, lambda text: people.print(escape(text)))
    except KeyboardInterrupt:
        people.print("[bold red]avneo:[/] interrupted; --resume goes on from the last run")
        raise typer.Exit(130) from None
    outcome = evaluate(runs, target)
    try:
        write_study(folder, outcome, f"{loaded.name}: error against time")
    except PictureError as error:
        people.print(f"[yellow]{escape(str(error))}[/]")
    people.print(f"written: {escape(str(folder))}")
    people.print(f"[bold]advice:[/] {escape(outcome.advice)}")
    if not any(row.name == REFERENCE and row.verified for row in outcome.rows):
        raise typer.Exit(1)
