# %% [markdown]
# # How long should a free edge be?
#
# Proposition 3.2 of the paper: with free edges in proportion to the chords, L_f = alpha a, the
# valve closes from alpha = 2/sqrt(3) = 1.155 on. Below, three equal cusps are sutured for alpha
# from 1 to 2. The root, the suture lines and all else are those of Experiment 1, and the template
# is its template with another L_f; R_s keeps its proportion to it, as in section 4.4.
#
#     python demos/sweep_alpha.py [--alphas 1.0 1.2 ...] [--size 1.4] [--quality equilibrium]
#                                 [--out DIR]
#
# Written to `docs/sweep_alpha.md` and `docs/sweep_alpha.png`.

# %%
from __future__ import annotations

import argparse
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from avneo_fem.errors import AvneoError
from avneo_fem.geometry.resizing import resized_scene
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.drawing import drawing_of
from avneo_fem.results.pictures import Panel, draw_grid
from avneo_fem.results.verdict import judge
from avneo_fem.results.verification_input import constraints_of, surface_of, tolerances_of
from avneo_fem.results.verify import verify_valve
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import Scene, load_scene
from avneo_fem.stages.record import CuspResult
from avneo_fem.valve.suture_valve import suture_valve
from expected import DEMOS, changed
from refinement_study import TOUCHING, samples

matplotlib.use("Agg")
CLOSING = 2.0 / np.sqrt(3.0)
#: that of Proposition 3.2 among them
ALPHAS = [1.0, 1.1, 1.1547, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0]
PICTURED = 6


# %% [markdown]
# ## The family of valves


# %%
def sized(scene: Scene, alpha: float) -> Scene:
    """The scene with L_f = alpha a."""
    chords = ValveGeometry.from_scene(scene).commissures.chord_lengths
    return resized_scene(scene, alpha * chords)


# %% [markdown]
# ## One valve, and how it closes
#
# *Contact*: the area of a cusp that is within its clearance and 0.05 mm of the contact surface,
# where the penalty acts, that near the commissures included, which is there however short the
# cusps are. *Opening*: the free edge's least distance from the triple contact point, in plan; a
# closed valve has its clearance of 0.25 mm there.


# %%
@dataclass(frozen=True)
class Valve:
    """A valve of the family, sutured, and why it is not verified if it is not."""

    alpha: float
    given: ValveInput
    results: list[CuspResult]
    failures: list[str]

    @property
    def contact_area(self) -> float:
        """Of one cusp [mm^2]."""
        places, areas = samples(self.results[0].points, self.results[0].mesh.triangles)
        return float(areas[self._distance(places) <= self._reach].sum())

    @property
    def touching_share(self) -> float:
        """Share of the free edge's length that is in contact."""
        result = self.results[0]
        edge = result.points[result.mesh.free_edge]
        t = np.linspace(0.0, 1.0, 51)[:, None, None]
        places = (1.0 - t) * edge[:-1] + t * edge[1:]
        touches = (self._distance(places.reshape(-1, 3)) <= self._reach).reshape(51, -1)
        lengths = np.linalg.norm(np.diff(edge, axis=0), axis=1)
        return float(touches.mean(axis=0) @ lengths / lengths.sum())

    @property
    def opening(self) -> float:
        """Least distance of the free edge from the triple contact point, in plan [mm]."""
        result, centre = self.results[0], self.given.geometry.triple_contact.point
        edge = result.points[result.mesh.free_edge]
        t = np.linspace(0.0, 1.0, 51)[:, None, None]
        places = ((1.0 - t) * edge[:-1] + t * edge[1:] - centre).reshape(-1, 3)
        return float(np.hypot(places[:, 0], places[:, 1]).min())

    def _distance(self, places: np.ndarray) -> np.ndarray:
        return self.given.wedges.wedge(0, 1.0).signed_distance(places)

    @property
    def _reach(self) -> float:
        return self.given.geometry.cusps[0].thickness / 2 + TOUCHING

    @property
    def row(self) -> str:
        """Line of the table."""
        geometry, result = self.given.geometry, self.results[0]
        seconds = result.seconds + result.compile_seconds
        cells = (
            f"{self.alpha:.4g}",
            f"{geometry.commissure_lengths[0]:.2f}",
            f"{geometry.triple_contact.nu_star:.3f}",
            f"{geometry.cusps[0].stitching.stitching_ratio:.3f}",
            "yes" if geometry.competent else "no",
            f"{self.contact_area:.1f}",
            f"{self.touching_share:.0%}",
            f"{self.opening:.2f}",
            f"{result.points[:, 2].min():.1f}",
            str(sum(level.iterations for level in result.records)),
            f"{seconds:.0f}",
            "yes" if not self.failures else f"no: {self.failures[0].split(';')[0]}",
        )
        return f"| {' | '.join(cells)} |"


HEAD = (
    "| alpha | L_f [mm] | nu* | J_sl | competent | contact [mm²] | free edge in contact"
    " | opening [mm] | lowest z [mm] | iterations | s | verified |\n" + "|---" * 12 + "|"
)


def sutured(scene: Scene, alpha: float) -> Valve:
    """Suture and judge one valve of the family."""
    given = ValveInput.from_scene(sized(scene, alpha))
    results = suture_valve(given)
    found = verify_valve(
        [surface_of(given.geometry, result) for result in results],
        [constraints_of(given.scene, given.geometry, given.wedges, i) for i in range(3)],
        [result.residual for result in results],
    )
    failures = [result.failure for result in results if result.failure is not None]
    return Valve(alpha, given, results, failures + judge(found, tolerances_of(given)))


# %% [markdown]
# ## Picture and table


# %%
def draw(path: Path, scene: Scene, valves: list[Valve]) -> None:
    """Some of the valves from the aorta; below, nu* and how the valve closes, over alpha."""
    chosen = np.unique(np.linspace(0, len(valves) - 1, min(PICTURED, len(valves))).round())
    panels = []
    for valve in (valves[int(k)] for k in chosen):
        surfaces = [(result.points, result.mesh.triangles) for result in valve.results]
        verdict = "" if not valve.failures else ", not verified"
        drawing = drawing_of(valve.given.geometry, surfaces)
        panels.append(Panel(drawing, "from the aorta", f"alpha = {valve.alpha:.4g}{verdict}"))
    with tempfile.TemporaryDirectory() as folder:
        row = Path(folder) / "row.png"
        draw_grid(row, [panels], field=(400, 430))
        pixels = plt.imread(row)
    figure, axes = plt.subplot_mosaic(
        [["valves"] * 3, ["nu", "area", "opening"]],
        figsize=(13, 13 * pixels.shape[0] / pixels.shape[1] + 3.8),
        height_ratios=(13 * pixels.shape[0] / pixels.shape[1], 3.8),
        layout="constrained",
    )
    axes["valves"].imshow(pixels)
    axes["valves"].axis("off")
    fine = np.linspace(valves[0].alpha, valves[-1].alpha, 41)
    nu = [ValveGeometry.from_scene(sized(scene, a)).triple_contact.nu_star for a in fine]
    axes["nu"].plot(fine, nu)
    axes["nu"].set(ylabel="nu*")
    axes["nu"].axhline(1.0, color="0.5", lw=0.8)
    for name, values, label in (
        ("area", [valve.contact_area for valve in valves], "contact of one cusp [mm²]"),
        ("opening", [valve.opening for valve in valves], "free edge from the centre [mm]"),
    ):
        alphas = [valve.alpha for valve in valves]
        axes[name].plot(alphas, values, "-", color="C0")
        for good, style in ((True, "o"), (False, "x")):
            kept = [
                (a, v)
                for a, v, x in zip(alphas, values, valves, strict=True)
                if (not x.failures) is good
            ]
            if kept:
                told = "verified" if good else "not verified"
                axes[name].plot(*zip(*kept, strict=True), style, color="C0", label=told)
        axes[name].set(ylabel=label)
        axes[name].legend(fontsize=8)
    for name in ("nu", "area", "opening"):
        axes[name].axvline(CLOSING, color="C3", ls="--", lw=1)
        axes[name].set(xlabel="alpha = L_f / a")
        axes[name].grid(alpha=0.3)
    axes["nu"].annotate(
        "2/√3", (CLOSING, max(nu)), (4, -4), textcoords="offset points", color="C3", va="top"
    )
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=110)
    plt.close(figure)


TOLD = """\
Three equal cusps in the root of Experiment 1, with L_f = alpha a, a = {chord:.3f} mm, and R_s in
proportion; quality {quality}, h = {size:g} mm. Proposition 3.2 asks for alpha of at least 1.1547.
Contact is the area of one cusp within its clearance and 0.05 mm of the contact surface, that near
the commissures included; the opening is the least distance of the free edge from the triple
contact point, in plan (0.25 mm is the clearance). Seconds are those of a shared machine.
"""


def main(arguments: list[str] | None = None) -> int:
    """Suture the family and write table and picture."""
    parser = argparse.ArgumentParser(description="Valves of ever longer free edges")
    parser.add_argument("--alphas", type=float, nargs="+", default=ALPHAS)
    parser.add_argument("--size", type=float, default=1.4, help="h [mm]")
    parser.add_argument("--quality", default="equilibrium", help="or approximate")
    parser.add_argument("--out", type=Path, default=DEMOS.parent / "docs")
    asked = parser.parse_args(arguments)
    valves, alphas = [], sorted(asked.alphas)
    try:
        scene = changed(
            load_scene(DEMOS / "experiment_1.toml"),
            mesh={"size": asked.size},
            solver={"quality": asked.quality},
        )
        for alpha in alphas:
            valves.append(sutured(scene, alpha))
            print(valves[-1].row, file=sys.stderr, flush=True)
    except AvneoError as error:
        print(error, file=sys.stderr)
        return error.exit_status
    asked.out.mkdir(parents=True, exist_ok=True)
    chord = float(valves[0].given.geometry.commissures.chord_lengths[0])
    told = TOLD.format(chord=chord, quality=asked.quality, size=asked.size)
    text = [
        "# How long should a free edge be?",
        f"Written by `python demos/sweep_alpha.py --alphas {' '.join(f'{a:g}' for a in alphas)}`.",
        textwrap.fill(told, 100),
        "\n".join([HEAD, *(valve.row for valve in valves)]),
        "![sutured valves, nu* and contact over alpha](sweep_alpha.png)",
    ]
    draw(asked.out / "sweep_alpha.png", scene, valves)
    with written_whole(asked.out / "sweep_alpha.md") as temporary:
        temporary.write_text("\n\n".join(text) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
