# %% [markdown]
# # The paper's Figure 8, and its three experiments in one table
#
# Three columns: large equal cusps, cusps that do not suit, quasi-optimal cusps. Two rows: seen from
# the aorta and from the ventricle. Taken from the results folders of the three runs; a run that is
# missing is made. A valve that is not verified is shown as far as it came, and called that.
#
#     python demos/figure_8.py [--results out] [--size H] [--out docs]
#
# `--size` is for the runs that are missing. Written to `figure_8.png` and `experiments.md`.

# %%
from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from avneo_fem.errors import AvneoError, SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.drawing import drawing_of
from avneo_fem.results.pictures import Panel, draw_grid
from avneo_fem.results.surfaces import read_stl
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import parse_scene
from expected import DEMOS, suture, valve

TITLES = {
    1: "(a) large equal cusps",
    2: "(b) cusps of inconsistent sizes",
    3: "(c) quasi-optimal cusps",
}
VIEWS = ("from the aorta", "from the ventricle")


# %% [markdown]
# ## A run, read back


# %%
@dataclass(frozen=True)
class Result:
    """What a results folder holds of an experiment."""

    number: int
    folder: Path
    report: dict[str, Any]

    @property
    def given(self) -> ValveInput:
        """Scene and geometry of the run."""
        return ValveInput.from_scene(parse_scene(self.report["scene"]))

    def panel(self, view: str) -> Panel:
        """The valve for the picture."""
        surfaces = [read_stl(self.folder / f"cusp_{index}.stl") for index in range(3)]
        verdict = "" if self.report["verified"] else ", not verified"
        label = f"{TITLES[self.number]}\n{view}{verdict}"
        return Panel(drawing_of(self.given.geometry, surfaces), view, label)

    def stretches(self) -> list[np.ndarray]:
        """Principal stretches of every cusp at the end."""
        with h5py.File(self.folder / "valve.h5") as file:
            last = file["steps"][max(file["steps"])]
            cusp = last["node/cusp"][:][file["triangles"][:, 0]]
            both = [last[f"cell/principal_stretch_{k}"][:] for k in (1, 2)]
        stretches = np.column_stack(both)
        return [stretches[cusp == index] for index in range(3)]


def read(number: int, folder: Path, size: float | None) -> Result:
    """The results of an experiment; it is run when there are none.

    Raises
    ------
    SceneError
        When the folder holds the results of something else.
    """
    file = folder / "report.json"
    if not file.exists():
        suture(valve(f"experiment_{number}.toml", size), folder)
    try:
        report = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SceneError("--results", str(folder), f"no readable report.json ({error})") from None
    if report["scene"]["name"] != f"experiment-{number}" or len(report["cusps"]) != 3:
        wanted = f"must hold a run of all cusps of experiment_{number}.toml"
        raise SceneError("--results", str(folder), wanted)
    return Result(number, folder, report)


# %% [markdown]
# ## Table
#
# One column an experiment; three figures stand for cusps 0, 1 and 2.


# %%
def cell(value: Any, text: Callable[[Any], str]) -> str:
    """A figure, or three that differ; null in a report is infinite or not a number."""
    if isinstance(value, list):
        told = [cell(one, text) for one in value]
        return told[0] if len(set(told)) == 1 else ", ".join(told)
    return "none" if value is None else text(value)


def column(result: Result) -> dict[str, str]:
    """Figures of one experiment by their names."""
    report, geometry = result.report, result.report["geometry"]
    cusps, found = report["cusps"], report["valve"]

    def of(key: str) -> list[Any]:
        return [cusp[key] for cusp in cusps]

    def three(value: float) -> str:
        return f"{value:.3g}"

    clamp = [cusp["clamp_error_deg"]["rms"] for cusp in cusps]
    iterations = [sum(level["iterations"] for level in cusp["stages"]) for cusp in cusps]
    size, stretches = result.given.scene.mesh_size, result.stretches()
    return {
        "h [mm]": f"{size:g}",
        "triangles": cell(of("cells"), str),
        "J_sl": cell(geometry["stitching_ratio"], lambda x: f"{x:.4f}"),
        "nu*": cell(geometry["nu_star"], lambda x: f"{x:.4f}"),
        "sigma*": cell(geometry["sigma"], lambda x: f"{x:.4f}"),
        "competent": "yes" if geometry["competent"] else "no",
        "residual": cell(of("residual"), lambda x: f"{x:.1e}"),
        "crossings in a cusp": cell(of("self_intersections"), str),
        "crossings of cusps": str(found["cusp_intersections"]),
        "separation of cusps [mm]": cell(found["min_distance_mm"], three),
        "separation of layers [mm]": cell(of("closest_layers_mm"), three),
        "distance from the wall [mm]": cell(found["min_wall_distance_mm"], three),
        "outside the root [mm]": cell(of("outside_root_mm"), lambda x: f"{x:.3f}"),
        "outside the wedge [mm]": cell(of("outside_wedge_mm"), lambda x: f"{x:.3f}"),
        "edges between nodes [mm]": cell(of("edges_outside_wedge_mm"), lambda x: f"{x:.3f}"),
        "sag of the free edge [mm]": cell(of("free_edge_sag_mm"), lambda x: f"{x:.3f}"),
        "clamp error, rms [degrees]": cell(clamp, lambda x: f"{x:.1f}"),
        "principal stretches": cell([f"{x.min():.1g} to {x.max():.2f}" for x in stretches], str),
        "98 % of them": cell(
            ["{:.2f} to {:.2f}".format(*np.percentile(x, (1, 99))) for x in stretches], str
        ),
        "iterations": cell(iterations, str),
        "seconds": f"{report['timing']['total_s']:.0f}",
        "verified": "yes" if report["verified"] else "no",
    }


TOLD = """\
Three figures are those of cusps 0, 1 and 2, one figure that of all; "none" is no two layers near
each other. Residuals are those of the undamped equations over the pressure load. Separations are
distances of mid-surfaces, those of layers away from the suture; the thickness is 0.5 mm.
Outside root and wedge are nodes; the line below says how deep the edges between them cut the wedge.
Stretches are principal stretches of triangles, the squeezed ones of the first row at the suture
included: the gather of 3 to 1 prescribes 0.33 there. Seconds are those of one run on a shared
machine, all cusps after each other (Experiment 1 solves one and turns it).
"""


def text_of(results: list[Result]) -> str:
    """The page."""
    columns = [column(result) for result in results]
    head = ["", *(f"Experiment {result.number}" for result in results)]
    rows = [[name, *(one[name] for one in columns)] for name in columns[0]]
    lines = [head, ["---"] * len(head), *rows]
    parts = [
        "# The three experiments",
        "Written by `python demos/figure_8.py`.",
        textwrap.fill(TOLD, 100),
        "\n".join(f"| {' | '.join(line)} |" for line in lines),
    ]
    for result in results:
        if not result.report["verified"]:
            reasons = "\n".join(f"- {reason}" for reason in result.report["failures"])
            parts.append(f"Experiment {result.number} is not verified:\n\n{reasons}")
    parts.append("![the three valves from the aorta and from the ventricle](figure_8.png)")
    return "\n\n".join(parts) + "\n"


# %%
def main(arguments: list[str] | None = None) -> int:
    """Read or run the experiments; write picture and table."""
    parser = argparse.ArgumentParser(description="The paper's Figure 8 and a table")
    parser.add_argument("--results", type=Path, default=DEMOS.parent / "out")
    parser.add_argument("--size", type=float, help="h [mm] of runs that are missing")
    parser.add_argument("--out", type=Path, default=DEMOS.parent / "docs")
    asked = parser.parse_args(arguments)
    try:
        results = [
            read(number, asked.results / f"experiment-{number}", asked.size) for number in TITLES
        ]
        asked.out.mkdir(parents=True, exist_ok=True)
        rows = [[result.panel(view) for result in results] for view in VIEWS]
        draw_grid(asked.out / "figure_8.png", rows, field=(640, 680))
    except AvneoError as error:
        print(error, file=sys.stderr)
        return error.exit_status
    with written_whole(asked.out / "experiments.md") as temporary:
        temporary.write_text(text_of(results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
