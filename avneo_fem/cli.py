"""The command line: results in files, people on stderr, ``--json`` on stdout.

Exit status 0: verified; 1: a failed solve or verification, with what was reached kept; 2: bad
input.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from avneo_fem.cli_options import Fidelity, Json, Scene, Set
from avneo_fem.cli_options import people as _people
from avneo_fem.cli_tables import show_geometry, show_sizes
from avneo_fem.cli_tradeoff import tradeoff
from avneo_fem.errors import AvneoError, SceneError
from avneo_fem.scene import load_scene

__all__ = ["app", "main"]

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Virtual suturing for aortic valve neocuspidization (lengths mm, stresses kPa).",
)
app.command()(tradeoff)


@app.command()
def check(scene: Scene, fidelity: Fidelity = None, set_: Set = None, json: Json = False) -> None:
    """Geometry and competence of a scene, without solving anything."""
    from avneo_fem.geometry.valve_input import ValveInput
    from avneo_fem.results.report import geometry_report, to_json

    loaded = load_scene(scene, fidelity, set_ or ())
    given = ValveInput.from_scene(loaded)
    geometry = geometry_report(given.geometry, given.wedges)
    show_geometry(_people, geometry)
    _forewarn(given)
    if json:
        sys.stdout.write(to_json(geometry))


@app.command()
def size(scene: Scene, json: Json = False) -> None:
    """Quasi-optimal free-edge lengths (Prop. 3.2) for the commissures of a scene."""
    from avneo_fem.geometry.resizing import resize
    from avneo_fem.results.report import sizing_report, to_json

    sizes = sizing_report(resize(load_scene(scene)))
    show_sizes(_people, sizes)
    if json:
        sys.stdout.write(to_json(sizes))
    if not sizes["verified"]:
        raise typer.Exit(1)


def _forewarn(given: Any) -> None:
    from avneo_fem.results.forewarnings import forewarnings

    for text in forewarnings(given):
        _people.print(f"[yellow]{escape(text)}[/]")


def _observer(rank: int) -> Any:
    def tell(index: int, record: Any) -> None:
        _people.print(
            f"cusp {index}  {record.name:<13} {record.parameter:<9.4g}"
            f" {record.iterations:>4} it  residual {record.residual:.1e}"
            f"  {record.seconds:6.1f} s" + (f"  (rank {rank})" if rank else "")
        )

    return tell


@app.command()
def suture(
    scene: Scene,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="default: out/NAME")
    ] = None,
    fidelity: Fidelity = None,
    set_: Set = None,
    cusp: Annotated[int | None, typer.Option(min=0, max=2, help="this cusp only")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="go on after a killed run")] = False,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="valve.png; avneo plot draws it later")
    ] = True,
    json: Json = False,
) -> None:
    """Suture the cusps of a scene and write the results to DIR."""
    from avneo_fem.geometry.valve_input import ValveInput

    loaded = load_scene(scene, fidelity, set_ or ())
    given = ValveInput.from_scene(loaded)
    if not given.geometry.competent:
        _people.print(f"[yellow]not competent:[/] {escape(given.geometry.competence_reason)}")
    _forewarn(given)
    from avneo_fem.compat import MPI, install_abort_on_error
    from avneo_fem.results.report import to_json
    from avneo_fem.run import run_scene

    install_abort_on_error()
    rank = MPI.COMM_WORLD.rank
    folder = Path("out") / loaded.name if output is None else output
    try:
        report = run_scene(
            given,
            folder,
            resume=resume,
            only=cusp,
            picture=picture,
            observer=_observer(rank),
            warn=lambda text: _people.print(f"[yellow]{escape(text)}[/]"),
        )
    except KeyboardInterrupt:
        _people.print("[bold red]avneo:[/] interrupted; --resume goes on from the last level")
        raise typer.Exit(130) from None
    except AvneoError as error:
        if MPI.COMM_WORLD.size == 1:
            raise
        # the other ranks may be waiting for this one
        _tell_error(error)
        MPI.COMM_WORLD.Abort(error.exit_status)
        raise
    if rank == 0:
        if json:
            sys.stdout.write(to_json(report))
        for failure in report["failures"]:
            _people.print(f"[red]not verified:[/] {escape(failure)}")
        seconds = report["timing"]["total_s"]
        if report["verified"]:
            _people.print(f"[green]verified[/] in {seconds:.0f} s: {escape(str(folder))}")
        else:
            _people.print(f"[red]not verified[/] after {seconds:.0f} s: {escape(str(folder))}")
    if not report["verified"]:
        raise typer.Exit(1)


@app.command()
def plot(folder: Annotated[Path, typer.Argument(metavar="DIR", help="results of a run")]) -> None:
    """Draw valve.png of a results folder again."""
    import json as json_module

    from avneo_fem.geometry.valve_input import ValveInput
    from avneo_fem.results.surfaces import read_stl
    from avneo_fem.run import draw_results
    from avneo_fem.scene import parse_scene

    try:
        report = json_module.loads((folder / "report.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SceneError("DIR", str(folder), f"holds no readable report.json ({error})") from None
    try:
        scene, indices = report["scene"], [int(cusp["index"]) for cusp in report["cusps"]]
    except (KeyError, TypeError, ValueError):
        raise SceneError("DIR", str(folder), "its report.json is not that of a run") from None
    given = ValveInput.from_scene(parse_scene(scene))
    surfaces = [read_stl(folder / f"cusp_{index}.stl") for index in indices]
    draw_results(given, folder / "valve.png", surfaces)


@app.command()
def extremes(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="results of every case")
    ] = Path("out/extremes"),
    only: Annotated[
        str, typer.Option(metavar="PATTERN", help="cases or groups that match this expression")
    ] = "",
    with_long: Annotated[bool, typer.Option("--long", help="fine meshes, too")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="keep cases that have ended")] = False,
    time_limit: Annotated[
        float, typer.Option(min=1.0, metavar="S", help="processor time of a case [s]")
    ] = 300.0,
) -> None:
    """Suture scenes far from the paper's and say how each ends; status 1 if one shows a bug."""
    from avneo_fem.extremes.campaign import run_map
    from avneo_fem.extremes.cases import all_cases, selected
    from avneo_fem.extremes.table import bugs

    cases = selected(all_cases(), only, with_long)
    if bugs(run_map(cases, output, _people, resume=resume, limit=time_limit)):
        raise typer.Exit(1)


def _tell_error(error: AvneoError) -> None:
    _people.print(f"[bold red]avneo:[/] {escape(str(error))}")
    sys.stderr.flush()


def main() -> None:
    """Run the command line; every foreseen error is one line."""
    try:
        app(standalone_mode=True)
    except AvneoError as error:
        _tell_error(error)
        sys.exit(error.exit_status)
