# %% [markdown]
# # Refinement study: what a finer mesh changes, and what it does not
#
# Cusp 0 of Experiment 1 sutured on three meshes, each verified, and their free edges, bellies,
# contact curves and surfaces measured against the finest. Written to `docs/refinement_study.md`
# and `docs/refinement_study.png`.
#
#     python demos/refinement_study.py [SCENE] [--sizes 1.4 1.0 0.7] [--out FOLDER]
#
# The default sizes 1.4 and 0.7 start from one first mesh (2.8 mm), split once and twice: the
# contact wedge closes on that first mesh, so both inherit its folds. 1.0 starts from its own, 2.0
# mm. Every size is sutured a second time from a first mesh of half the edge length ("other
# path"): what differs between the two is not h, but the triangulation and the way there.

# %%
from __future__ import annotations

import argparse
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from avneo_fem.errors import AvneoError, SolveError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.cusp_curves import BIN, TOUCHING, along, contact_curve, mid_line, sag
from avneo_fem.results.fields import principal_stretches
from avneo_fem.results.surface_distance import samples, surface_distance
from avneo_fem.results.verdict import judge
from avneo_fem.results.verification_input import constraints_of, surface_of, tolerances_of
from avneo_fem.results.verify import verify_valve
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import Scene, load_scene
from avneo_fem.stages.record import CuspResult
from avneo_fem.valve.suture_valve import suture_valve

matplotlib.use("Agg")

Floats = NDArray[np.float64]
DEMOS = Path(__file__).parent


# %% [markdown]
# ## Measures
#
# Those of curves and surfaces are in `avneo_fem.results`; this one needs several meshes.


# %%
def order(sizes: list[float], values: list[float]) -> float | None:
    """p of value = limit + c h^p from three sizes; None unless monotone and 0.5 <= p <= 4."""
    (a, b, c), (first, second) = sizes, -np.diff(values)
    if first * second <= 0.0:
        return None

    def excess(p: float) -> float:
        return (a**p - b**p) / (b**p - c**p) - first / second

    return float(brentq(excess, 0.5, 4.0)) if excess(0.5) <= 0.0 <= excess(4.0) else None


# %% [markdown]
# ## Suturing and measuring


# %%
@dataclass(frozen=True)
class Run:
    """A verified cusp and the closest approach of its layers, away from and near the suture."""

    name: str
    result: CuspResult
    layers: tuple[float, float]


def suture(scene: Scene, size: float, refinements: int | None = None) -> Run:
    """Suture and verify cusp 0 at one mesh size.

    Raises
    ------
    SolveError
        When it is not verified.
    """
    data = scene.model_dump()
    data["mesh"] = {**data["mesh"], "size": size, "refinements": refinements}
    given = ValveInput.from_scene(Scene.model_validate(data))
    result = suture_valve(given, only=0)[0]
    surface = surface_of(given.geometry, result)
    constraints = constraints_of(given.scene, given.geometry, given.wedges, 0)
    found = verify_valve([surface], [constraints], [result.residual])
    failures = [result.failure] if result.failure else judge(found, tolerances_of(given))
    name = f"{size:g}" + ("" if refinements is None else ", other path")
    if failures:
        raise SolveError(f"h = {name}: not verified, so not measured: {'; '.join(failures)}")
    cusp = found.cusps[0]
    return Run(name, result, (cusp.closest_layers_mm, cusp.closest_layers_near_suture_mm))


def near_suture(given: ValveInput, result: CuspResult) -> NDArray[np.bool_]:
    """Triangles with a node nearer to the suture than where layers are unrestricted."""
    mesh, thickness = result.mesh, given.geometry.cusps[0].thickness
    near = mesh.distance_to_suture < given.scene.layers_unrestricted(thickness)
    return np.asarray(near[mesh.triangles].any(axis=1))


def measure(given: ValveInput, run: Run) -> tuple[dict[str, float], dict[str, Floats]]:
    """Figures of one cusp by their label in the table, and its curves."""
    result, mesh = run.result, run.result.mesh
    wedge = given.wedges.wedge(0, 1.0)
    clearance = given.scene.contact.clearance
    reach = given.geometry.cusps[0].thickness / 2 if clearance is None else clearance
    reach += TOUCHING
    places, areas = samples(result.points, mesh.triangles)
    touch = wedge.signed_distance(places) <= reach
    edge = along(mesh.points[mesh.free_edge], result.points[mesh.free_edge], 2001)
    pieces = np.linalg.norm(np.diff(edge, axis=0), axis=1)
    middle = (edge[1:] + edge[:-1]) / 2
    plane = given.geometry.commissures
    height = (edge - plane.points[0]) @ plane.normal
    curves = {
        "free edge": edge,
        "mid-line": mid_line(mesh.points, mesh.triangles, result.points),
        "contact": contact_curve(places[touch], wedge.polyline3(500, 0.0)[:, :2]),
    }
    stretches = principal_stretches(mesh.points, mesh.triangles, result.points)
    thicker = 1.0 / stretches.prod(axis=1)
    away = ~near_suture(given, result)
    figures = {
        "triangles": len(mesh.triangles),
        "free edge: length [mm]": pieces.sum(),
        "free edge: mean height over M [mm]": height.mean(),
        "free edge: greatest height over M [mm]": height.max(),
        "free edge: length that touches the wedge [mm]": pieces[
            wedge.signed_distance(middle) <= reach
        ].sum(),
        "free edge: greatest distance from the wedge [mm]": wedge.signed_distance(edge).max(),
        "belly: lowest z [mm]": result.points[:, 2].min(),
        "belly: lowest z of the mid-line [mm]": curves["mid-line"][:, 2].min(),
        "belly: sag of the mid-line under its chord [mm]": sag(curves["mid-line"]),
        "contact: area [mm²]": areas[touch].sum(),
        "contact: lowest z [mm]": places[touch, 2].min(),
        "contact: highest z [mm]": places[touch, 2].max(),
        "surface: area [mm²]": areas.sum(),
        "thickness stretch away from the suture: smallest": thicker[away].min(),
        "thickness stretch away from the suture: largest": thicker[away].max(),
        "thickness stretch: largest anywhere": thicker.max(),
        "share of the template over twice as thick [%]": 100.0
        * mesh.cell_areas[thicker > 2.0].sum()
        / mesh.area,
        "closest layers away from the suture [mm]": run.layers[0],
        "closest layers near the suture [mm]": run.layers[1],
        "residual": result.residual,
        "iterations": sum(record.iterations for record in result.records),
        "seconds": result.seconds,
    }
    return {key: float(value) for key, value in figures.items()}, curves


def compare(
    given: ValveInput, a: Run, b: Run, first: dict[str, Floats], second: dict[str, Floats]
) -> dict[str, tuple[float, ...]]:
    """Distances of one cusp (and its curves) from another by their label in the table."""
    found: dict[str, tuple[float, ...]] = {}
    for name in ("free edge", "mid-line"):
        gap = np.linalg.norm(first[name] - second[name], axis=1)
        found[f"{name}: mean, largest distance [mm]"] = (gap.mean(), gap.max())
    sides = (first["free edge"], second["free edge"])
    gap = np.concatenate([cKDTree(x).query(y)[0] for x, y in (sides, sides[::-1])])
    found["free edge as curves: mean, largest distance [mm]"] = (gap.mean(), gap.max())
    gap = np.abs(first["contact"] - second["contact"])
    found["contact curve: mean, largest difference in z [mm]"] = (np.nanmean(gap), np.nanmax(gap))
    surfaces = [(run.result.points, run.result.mesh.triangles) for run in (a, b)]
    near = [near_suture(given, run.result) for run in (a, b)]
    for where, chosen in (("away from", [~x for x in near]), ("near", near)):
        label = f"surface {where} the suture: mean, 95 %, largest distance [mm]"
        found[label] = surface_distance(surfaces[0], surfaces[1], (chosen[0], chosen[1]))
    return found


# %% [markdown]
# ## Report


# %%
def table(heads: list[str], rows: dict[str, list[str]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [f"| {' | '.join(['', *heads])} |", "|---|" + "---:|" * len(heads)]
    return lines + [f"| {label} | {' | '.join(cells)} |" for label, cells in rows.items()]


def shown(value: float) -> str:
    """Four digits, small numbers as powers of ten; layers that are nowhere near are infinite."""
    if not np.isfinite(value):
        return "none near"
    return f"{value:.1e}" if 0.0 < abs(value) < 1e-3 else f"{value:.4g}"


def write(
    folder: Path,
    given: ValveInput,
    sizes: list[float],
    figures: dict[str, dict[str, float]],
    distances: dict[str, dict[str, tuple[float, ...]]],
) -> None:
    """The tables, and for the default run what they say."""
    rows, half = {}, len(sizes)
    for key in next(iter(figures.values())):
        values = [found[key] for found in figures.values()]
        scatter = max(abs(a - b) for a, b in zip(values[:half], values[half:], strict=True))
        p = order(sizes, values[:half]) if half == 3 and "[mm" in key else None
        told = p is not None and abs(values[1] - values[2]) > 2.0 * scatter
        rows[key] = [*map(shown, values), f"{p:.1f}" if told else ""]
    apart = {
        key: [", ".join(f"{x:.2f}" for x in found[key]) for found in distances.values()]
        for key in next(iter(distances.values()))
    }
    text = HEAD.format(name=given.scene.name, sizes=" ".join(f"{h:g}" for h in sizes))
    lines = [text, *table([*figures, "order"], rows), "", "Distances between cusps:", ""]
    lines += [*table(list(distances), apart), "", "![curves](refinement_study.png)"]
    if given.scene.name == "experiment-1" and sizes == SIZES:
        gather = 1.0 / given.geometry.cusps[0].stitching.stitching_ratio
        lines += ["", discussion(gather, figures, distances)]
    with written_whole(folder / "refinement_study.md") as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw(path: Path, given: ValveInput, curves: dict[str, dict[str, Floats]]) -> None:
    """Free edges from above, mid-lines from the side, lower ends of the contact."""
    figure, (above, side, contact) = plt.subplots(
        1, 3, figsize=(13, 5), layout="constrained", width_ratios=(1, 0.8, 1.3)
    )
    wedge = given.wedges.wedge(0, 1.0).polyline3(500, 0.0)
    above.plot(wedge[:, 0], wedge[:, 1], "k--", lw=1, label="contact wedge")
    for k, (name, found) in enumerate(curves.items()):
        style: dict[str, Any] = {
            "color": f"C{k % (len(curves) // 2)}",
            "label": f"h = {name}",
            "lw": 1.5,
        }
        style["ls"] = ":" if "path" in name else "-"
        above.plot(*found["free edge"][:, :2].T, **style)
        side.plot(*found["mid-line"][:, [0, 2]].T, **style)
        places = (np.arange(len(found["contact"])) + 0.5) * BIN
        contact.plot(places, found["contact"], **style)
    for axes, title, x, y in (
        (above, "free edge from above", "x [mm]", "y [mm]"),
        (side, "mid-line of the cusp", "x [mm]", "z [mm]"),
        (contact, "lowest contact", "along the contact wedge [mm]", "z [mm]"),
    ):
        axes.set(title=title, xlabel=x, ylabel=y)
        axes.grid(alpha=0.3)
    above.set_aspect("equal")
    side.set_aspect("equal")
    above.legend(loc="upper right", fontsize=8)
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=110)
    plt.close(figure)


HEAD = """# Refinement study: {name}, cusp 0

Written by `python demos/refinement_study.py --sizes {sizes}` (quality equilibrium, every cusp
verified). Columns are mesh sizes h in mm; "other path" starts from a first mesh of half the edge
length (twice, where none is coarser), so it is another triangulation of the same h, reached
another way. An order of convergence stands only where the three sizes give one between 0.5 and 4
and the last change is more than twice the largest difference between two paths to the same h. A
place touches the wedge when it is within the clearance and the 0.05 mm over which the penalty
acts; "near the suture" is nearer than the distance from which layers keep their clearance (4 H).
The free edge and the mid-line are compared at the same places of the template, "as curves" at
the nearest ones. Seconds are those of a shared machine.
"""


WRITTEN = "Written after a run of the default sizes; its figures are filled in by the script."
DISCUSSION = """\
**The same on every mesh.** The height of the free edge over the plane M, which (1.6) prescribes
(mean {height} mm). From h = 1 on also the lowest point of the belly, to two tenths of a
millimetre (z = {lowest} mm); at 1.4 a fold through it makes more of a difference.

**Depends on h.** The free edge from above: h = 1.4 and 1 are {fe_14} and {fe_10} mm in the mean
from h = 0.7, while two paths to the same h differ by {fe_p14} (1.4), {fe_p10} (1) and {fe_p07}
mm (0.7). So this is mostly h, and the path matters less the finer the mesh. Much of it is the
edge sliding along itself: as curves h = 1.4 and 1 are {curve_14} and {curve_10} mm from 0.7. The
edge cuts the outer bend of its wedge and reaches farther out on a finer mesh (greatest distance
from the wedge {reach} mm). The steps do not shrink reliably from mesh to mesh: there is no order
to claim, and the error left at 0.7 is not known. The length of the edge ({length} mm), the sag
of the mid-line ({sag} mm) and the largest thickness stretch away from the suture ({thick})
change with h about as much as between the paths to one h: no convergence can be read from them
either.

**Does not converge, and need not.** The edge of the cusp is {gather} times as long as the line
it is sutured to, and folds; which folds is a choice among many equilibria, each solved to the
residual above. Away from the suture the surfaces at h = 1.4 and 1 are {s_14} and {s_10} mm from
the one at 0.7 in the mean, 95 % within {q_14} and {q_10} mm, up to {m_14} and {m_10} mm at a
fold. But two paths to the same h are as far apart: {s_p14}, {s_p10} and {s_p07} mm, 95 % within
{q_p14}, {q_p10} and {q_p07} mm, up to {m_p14}, {m_p10} and {m_p07} mm. So this is the folds,
which run from the suture into the belly, and h has next to no share in it. A change of the
solver, however small, may choose other folds too. For the same reason the mid-line, which may
meet a fold, differs by up to {mid_p07} mm between the paths to 0.7, and the lower end of the
contact by {c_p07} mm in the mean, {cm_p07} mm at worst.

**Contact.** The area within reach of the wedge is {area} mm², the length of the free edge there
{touching} mm. The two largest of each belong to the runs whose wedge closed on the last mesh
itself (other paths to 1.4 and 1): here the path counts for more than h. Along the second half of
the wedge only the part near the commissure touches, on every mesh (third picture).

**Sharing the first mesh.** h = 1.4 and 0.7 come from the same 2.8 mm mesh, 1 does not. It does
not make their folds alike: 1.4 is no nearer to 0.7 than 1 is.

**Not a result.** Some triangles of the first row at the suture collapse, to thickness stretches
of {worst}, and layers there come within {near} mm, as they may by default (away from the suture
they keep {far} mm). That says how far such a triangle can be squeezed, not how thick tissue
gets. The share of the template that is more than twice as thick is {share} %.

So the height of the free edge can be taken from any of these meshes to a few hundredths of a
millimetre, the depth of the belly from h = 1 to two tenths; the free edge in plan from h = 0.7
to some tenths, whose error this study does not bound; the surface to {s_p07} mm in the mean and
no better than about two millimetres at a fold; the coapting area to some 20 %. A single fold is
not a prediction.
"""


def discussion(
    gather: float,
    figures: dict[str, dict[str, float]],
    distances: dict[str, dict[str, tuple[float, ...]]],
) -> str:
    """What the default run says, with its figures."""

    def all_of(label: str) -> str:
        key = next(key for key in figures["0.7"] if key.startswith(label))
        values = [shown(found[key]) for found in figures.values()]
        return f"{', '.join(values[:3])}; other paths {', '.join(values[3:])}"

    given: dict[str, str] = {
        "height": all_of("free edge: mean height"),
        "lowest": all_of("belly: lowest z ["),
        "reach": all_of("free edge: greatest distance"),
        "length": all_of("free edge: length ["),
        "sag": all_of("belly: sag"),
        "thick": all_of("thickness stretch away from the suture: largest"),
        "area": all_of("contact: area"),
        "worst": all_of("thickness stretch: largest"),
        "near": all_of("closest layers near"),
        "far": all_of("closest layers away"),
        "share": all_of("share"),
        "touching": all_of("free edge: length that"),
        "gather": f"{gather:.2g}",
    }
    tags = ("14", "10", "p14", "p10", "p07")
    for found, tag in zip(distances.values(), tags, strict=True):
        for label, keys in (
            ("free edge: ", ("fe", "")),
            ("free edge as", ("curve", "")),
            ("mid-line", ("", "mid")),
            ("contact curve", ("c", "cm")),
            ("surface away", ("s", "q", "m")),
        ):
            values = next(v for key, v in found.items() if key.startswith(label))
            given |= {f"{k}_{tag}": f"{v:.2f}" for k, v in zip(keys, values, strict=True)}
    paragraphs = DISCUSSION.format(**given).split("\n\n")
    filled = [textwrap.fill(text, 100, break_on_hyphens=False) for text in paragraphs]
    return "\n\n".join(["## What it says", WRITTEN, *filled])


# %%
SIZES = [1.4, 1.0, 0.7]


def other_path(scene: Scene, size: float) -> int:
    """One refinement fewer than by default, or one more where there is none."""
    mesh = scene.mesh.model_copy(update={"size": size, "refinements": None})
    usual = scene.model_copy(update={"mesh": mesh}).refinements
    return usual - 1 if usual else 1


def reported(run: Run) -> Run:
    """The same, said on stderr."""
    print(f"h = {run.name}: {run.result.seconds:.1f} s", file=sys.stderr, flush=True)
    return run


def main(arguments: list[str] | None = None) -> int:
    """Suture, measure, write."""
    parser = argparse.ArgumentParser(description="Mesh refinement study of cusp 0 of a scene")
    parser.add_argument("scene", nargs="?", type=Path, default=DEMOS / "experiment_1.toml")
    parser.add_argument("--sizes", type=float, nargs="+", default=SIZES, help="h [mm]")
    parser.add_argument("--out", type=Path, default=DEMOS.parent / "docs")
    asked = parser.parse_args(arguments)
    sizes = sorted(set(asked.sizes), reverse=True)
    try:
        scene = load_scene(asked.scene, "standard", ["solver.quality=equilibrium"])
        given = ValveInput.from_scene(scene)
        asked.out.mkdir(parents=True, exist_ok=True)
        runs = [reported(suture(scene, size)) for size in sizes]
        runs += [reported(suture(scene, size, other_path(scene, size))) for size in sizes]
    except AvneoError as error:
        print(error, file=sys.stderr)
        return error.exit_status
    found = {run.name: measure(given, run) for run in runs}
    curves = {name: pair[1] for name, pair in found.items()}
    half = len(sizes)
    pairs = {f"{run.name} from {sizes[-1]:g}": (run, runs[half - 1]) for run in runs[: half - 1]}
    for run, other in zip(runs[:half], runs[half:], strict=True):
        pairs[f"paths to {run.name}"] = (run, other)
    distances = {
        name: compare(given, a, b, curves[a.name], curves[b.name]) for name, (a, b) in pairs.items()
    }
    write(asked.out, given, sizes, {name: pair[0] for name, pair in found.items()}, distances)
    draw(asked.out / "refinement_study.png", given, curves)
    return 0


if __name__ == "__main__":
    sys.exit(main())
