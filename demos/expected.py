"""What the pages of the experiments share: figures that must come out, and how they are asked for.

A page states figures beside what was found; :func:`demand` prints them and raises
:class:`FigureMissed` when one is missed. Lengths in mm, angles in degrees.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from avneo_fem.errors import AvneoError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.run import run_scene
from avneo_fem.scene import Scene, load_scene, parse_scene
from avneo_fem.stages.record import StageRecord

__all__ = [
    "DEMOS",
    "Asked",
    "Figure",
    "FigureMissed",
    "asked",
    "changed",
    "demand",
    "equal",
    "geometry_figures",
    "largest",
    "smallest",
    "suture",
    "sutured_figures",
    "valve",
]

DEMOS = Path(__file__).parent


class FigureMissed(Exception):
    """A figure did not come out as the page says; the message names it, expected and got."""


@dataclass(frozen=True)
class Figure:
    """One figure: its name, what the page says it is, what was found, and whether that holds."""

    name: str
    expected: str
    got: str
    holds: bool


def equal(name: str, got: Any, expected: Any) -> Figure:
    """A figure that must be met exactly, or, given as text like "0.6153", to its last digit."""
    if isinstance(expected, str) and not isinstance(got, str):
        digits = len(expected.partition(".")[2])
        holds = abs(got - float(expected)) <= 0.5 * 10.0**-digits
        return Figure(name, expected, f"{got:.{digits + 2}f}", bool(holds))
    return Figure(name, str(expected), str(got), got == expected)


def largest(name: str, got: float | None, limit: float) -> Figure:
    """A figure that must not exceed a limit; None (not a number in a report) misses it."""
    holds = got is not None and got <= limit
    return Figure(name, f"at most {limit:g}", "none" if got is None else f"{got:.3g}", holds)


def smallest(name: str, got: float | None, limit: float) -> Figure:
    """A figure that must reach a limit. None stands for infinite in a report: nothing is near."""
    holds = got is None or got >= limit
    return Figure(name, f"at least {limit:g}", "none near" if got is None else f"{got:.4g}", holds)


def demand(title: str, figures: Sequence[Figure]) -> None:
    """Print the figures.

    Raises
    ------
    FigureMissed
        When some are missed; the message has a line for each.
    """
    table = Table("figure", "expected", "got", "", title=title, title_justify="left")
    for figure in figures:
        cells = (figure.name, figure.expected, figure.got, "" if figure.holds else "missed")
        table.add_row(*map(escape, cells))  # [mm] is no markup
    Console().print(table)
    missed = [figure for figure in figures if not figure.holds]
    if missed:
        lines = [f"  {f.name}: expected {f.expected}, got {f.got}" for f in missed]
        raise FigureMissed("\n".join([f"{title}, {len(missed)} of {len(figures)} missed:", *lines]))


def geometry_figures(
    given: ValveInput,
    stitching: Sequence[str],
    contact: Sequence[str],
    nu_star: str,
    sigma: Sequence[str],
    competent: bool,
) -> list[Figure]:
    """J_sl, c [mm], nu* and sigma* as text with as many digits as are known, and the verdict."""
    geometry, figures = given.geometry, []
    assert given.wedges.sigma is not None  # planes have none
    rows = zip(geometry.cusps, geometry.contact_lengths, given.wedges.sigma, strict=True)
    for i, (cusp, c, s) in enumerate(rows):
        figures += [
            equal(f"J_sl of cusp {i}", cusp.stitching.stitching_ratio, stitching[i]),
            equal(f"c_{i} [mm]", c, contact[i]),
            equal(f"sigma* of curve {i}", s, sigma[i]),
        ]
    return [
        *figures,
        equal("nu*", geometry.triple_contact.nu_star, nu_star),
        equal("competent", geometry.competent, competent),
    ]


def sutured_figures(report: dict[str, Any], cusps_apart: float) -> list[Figure]:
    """What a sutured valve must show, whatever the program's own verdict is; and that verdict.

    Parameters
    ----------
    report : dict
        What ``run_scene`` returns.
    cusps_apart : float
        Least distance between mid-surfaces of different cusps [mm].
    """
    thickness = report["scene"]["cusp"][0]["template"]["thickness"]
    short = 0.01 * thickness  # by which a clearance may be missed
    figures = []
    for cusp in report["cusps"]:
        of = f"of cusp {cusp['index']}"
        figures += [
            largest(f"residual {of}", cusp["residual"], 1e-8),
            equal(f"crossings {of} with itself", cusp["self_intersections"], 0),
            largest(f"sag of the free edge {of} [mm]", cusp["free_edge_sag_mm"], 0.1),
            largest(f"distance {of} from its suture line [mm]", cusp["suture_error_mm"], 1e-6),
            largest(f"clamp error (rms) {of} [degrees]", cusp["clamp_error_deg"]["rms"], 5.0),
            largest(f"depth {of} outside the root [mm]", cusp["outside_root_mm"], short),
            largest(f"depth {of} outside its wedge [mm]", cusp["outside_wedge_mm"], short),
            smallest(
                f"layers {of} [mm]", _finite(cusp["closest_layers_mm"]), thickness / 2 - short
            ),
        ]
    found = report["valve"]
    wall = found["min_wall_distance_mm"]
    return [
        *figures,
        equal("crossings between cusps", found["cusp_intersections"], 0),
        smallest("distance between cusps [mm]", _finite(found["min_distance_mm"]), cusps_apart),
        smallest("distance from the wall [mm]", _finite(wall), thickness / 2 - short),
        equal("verified", report["verified"], True),
    ]


def _finite(value: float | None) -> float | None:
    return None if value is None or np.isposinf(value) else value


# -- scene and run -------------------------------------------------------------------------------
@dataclass(frozen=True)
class Asked:
    """What the command line of a page asks for."""

    size: float | None
    out: Path
    geometry_only: bool

    def end_of_geometry(self) -> None:
        """Leave the page here when no more was asked for."""
        if self.geometry_only:
            raise SystemExit(0)


def asked(what: str, out: str) -> Asked:
    """``[--size H] [--out DIR] [--geometry]``; by default the scene's h, and ``out``/NAME.

    From here on a missed figure or a bad scene ends the script with its message alone.
    """
    sys.excepthook = _tell
    parser = argparse.ArgumentParser(description=what)
    parser.add_argument("--size", type=float, help="h [mm], default that of the scene")
    parser.add_argument("--out", type=Path, default=DEMOS.parent / "out" / out)
    parser.add_argument("--geometry", action="store_true", help="suture nothing: about a second")
    found = parser.parse_args()
    return Asked(found.size, found.out, found.geometry)


def _tell(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if isinstance(error, AvneoError | FigureMissed):
        print(error, file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)


def changed(scene: Scene, **tables: dict[str, Any]) -> Scene:
    """The scene with other entries in some tables, checked again: ``mesh={"size": 1.4}``.

    Raises
    ------
    SceneError
        When one of them is no valid entry.
    """
    data = scene.model_dump(mode="json", exclude_none=True)
    for table, entries in tables.items():
        data[table] = {**data[table], **entries}
    return parse_scene(data)


def valve(file: str, size: float | None = None) -> ValveInput:
    """The valve of a scene file beside this one, at another h [mm]."""
    scene = load_scene(DEMOS / file)
    return ValveInput.from_scene(scene if size is None else changed(scene, mesh={"size": size}))


def suture(given: ValveInput, folder: Path) -> dict[str, Any]:
    """Suture, verify, leave the results in ``folder``; the report. Levels are told as they end."""

    def tell(index: int, level: StageRecord) -> None:
        print(
            f"cusp {index}  {level.name:<13} {level.parameter:<9.4g} {level.iterations:>4} it",
            flush=True,
        )

    folder.parent.mkdir(parents=True, exist_ok=True)
    return run_scene(given, folder, observer=tell, warn=print)
