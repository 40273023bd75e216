# %% [markdown]
# # Only what is required
#
# What is not asked for, does not act yet, or is known already should cost nothing. Each of these
# savings is measured here against the same thing without it, in one run of one process. Ratios are
# of processor time, with the saving over without it; where the same answer is promised, it is
# compared, and the script fails when it is not the same.
#
#     python demos/savings.py [--size 1.4] [--out DIR] [--quick]
#
# Written to `docs/savings.md`.

# %%
from __future__ import annotations

import argparse
import itertools
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count, cycle
from pathlib import Path
from typing import Any
from unittest import mock

import igl
import ipctk
import numpy as np

from avneo_fem.constraints import layer_pairs
from avneo_fem.constraints.clamp_penalty import ClampPenalty
from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.layer_pairs import LayerPairs, least_way
from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.equilibrium import shell_model
from avneo_fem.equilibrium.directors import start_directors
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.geometry.bezier_arcs import BezierArcs
from avneo_fem.geometry.contact_wedge import ContactWedge
from avneo_fem.geometry.root import CylinderRoot
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.record import CuspResult, StageRecord
from avneo_fem.valve.suture_valve import mesh_templates, suture_valve

DEMOS = Path(__file__).parent
Floats = np.ndarray
Task = Callable[[], Any]


# %%
@dataclass(frozen=True)
class Row:
    """One saving: costs with and without it, their unit, and what was compared."""

    what: str
    unit: str
    cost: float
    without: float
    check: str = ""
    holds: bool = True

    @property
    def line(self) -> str:
        """Of the table."""
        ratio = self.cost / self.without
        numbers = (
            f"{value:.0f}" if value >= 1000 else f"{value:.3g}"
            for value in (self.cost, self.without)
        )
        told = self.check if self.holds else f"**missed:** {self.check}"
        return f"| {self.what} | {self.unit} | {' | '.join(numbers)} | {ratio:.2g} | {told} |"


def agree(difference: float, unit: str = "") -> str:
    """How well two answers agree."""
    return "to the bit" if difference == 0.0 else f"to {difference:.1e}{unit}"


def processor_ms(*tasks: Task, repeats: int = 40) -> list[float]:
    """Least processor time of each task [ms]; they take turns, so that ratios hold."""
    times = np.empty((repeats + 1, len(tasks)))
    for row in times:
        for column, task in enumerate(tasks):
            clock = time.process_time()
            task()
            row[column] = time.process_time() - clock
    return [1e3 * float(least) for least in times[1:].min(axis=0)]


def experiment(number: int, size: float, **entries: Any) -> ValveInput:
    """One of the paper's experiments with another mesh size, and other entries."""
    data = load_scene(DEMOS / f"experiment_{number}.toml").model_dump(
        mode="json", exclude_none=True
    )
    data["mesh"]["size"] = size
    return ValveInput.from_scene(parse_scene(data | entries))


# %% [markdown]
# ## Cusps that are solved


# %%
def sutured(
    given: ValveInput, only: int | None = None
) -> tuple[list[CuspResult], float, list[CuspResult]]:
    """Results, processor seconds, and those of the results that were solved."""
    clock = time.process_time()
    results = suture_valve(given, only=only)
    seconds = time.process_time() - clock
    return results, seconds, [result for result in results if result.copied_from is None]


def iterations(results: list[CuspResult]) -> int:
    """Newton iterations of all levels."""
    return sum(record.iterations for result in results for record in result.records)


def of_congruent_cusps(size: float) -> Iterator[Row]:
    """Experiment 1: three equal cusps."""
    every, more, all_ = sutured(experiment(1, size, reuse_congruent=False))
    turned, seconds, few = sutured(experiment(1, size))
    apart = max(np.abs(a.points - b.points).max() for a, b in zip(turned, every, strict=True))
    copied = ", ".join(str(result.copied_from) for result in turned)
    failures = [result.failure for result in (*turned, *every) if result.failure]
    name = "Experiment 1, congruent cusps solved once and turned"
    same = not failures and apart < 1e-6
    check = f"nodes of all three agree {agree(apart, ' mm')}" if not failures else failures[0]
    yield Row(name, "s", seconds, more, check, same)
    check = f"`copied_from`: {copied}"
    yield Row(name, "iterations", iterations(few), iterations(all_), check, len(few) == 1)


def of_one_cusp(size: float) -> Iterator[Row]:
    """Experiment 3, cusp 0 alone."""
    given = experiment(3, size)
    alone, seconds, _ = sutured(given, only=0)
    every, more, _ = sutured(given)
    apart = float(np.abs(alone[0].points - every[0].points).max())
    name, check = "Experiment 3, cusp 0 alone", f"its nodes agree {agree(apart, ' mm')}"
    yield Row(name, "s", seconds, more, check, apart == 0.0)
    yield Row(name, "iterations", iterations(alone), iterations(every))


# %% [markdown]
# ## Terms that do not act
#
# Every call of a term, stage by stage.

# %%
WATCHED: tuple[tuple[type, tuple[str, ...], Callable[[Any], str]], ...] = (
    (ShellModel, ("residual", "tangent", "energy"), lambda _: "shell"),
    (SelfContact, ("gradient", "hessian", "energy"), lambda _: "barrier"),
    (
        SignedDistancePenalty,
        ("gradient", "hessian", "energy"),
        lambda term: "wall" if isinstance(term.field, CylinderRoot) else "wedge",
    ),
    (ClampPenalty, ("gradient", "hessian", "energy"), lambda _: "clamp"),
    (LayerPairs, ("at",), lambda _: "layers"),
    (ContactWedge, ("evaluate",), lambda _: "wedge's distances"),
)
COLUMNS = ("shell", "barrier", "wall", "clamp", "wedge", "layers", "wedge's distances")


@contextmanager
def counted(calls: Counter[str]) -> Iterator[None]:
    """Count the calls of what is watched."""

    def counting(original: Callable[..., Any], name: Callable[[Any], str]) -> Callable[..., Any]:
        def call(self: Any, *arguments: Any, **options: Any) -> Any:
            calls[name(self)] += 1
            return original(self, *arguments, **options)

        return call

    with ExitStack() as stack:
        for kind, methods, name in WATCHED:
            for method in methods:
                wrapped = counting(getattr(kind, method), name)
                stack.enter_context(mock.patch.object(kind, method, wrapped))
        yield


def calls_by_stage(given: ValveInput, index: int = 0) -> tuple[dict[str, Counter[str]], CuspResult]:
    """Calls in each stage of a cusp, levels of the same name together; and the cusp."""
    stages: dict[str, Counter[str]] = {}
    calls: Counter[str] = Counter()

    def observer(_index: int, record: StageRecord) -> None:
        stage = stages.setdefault(record.name, Counter())
        stage.update(calls)
        stage["levels"] += 1
        stage["iterations"] += record.iterations
        calls.clear()

    with counted(calls):
        result = suture_valve(given, observer, only=index)[0]
    return stages, result


#: term, and the stage from which on it acts
FIRST = {"wall": "hinged_edge", "clamp": "clamped_edge", "wedge": "contact_wedge"}


def too_early(stages: dict[str, Counter[str]]) -> list[str]:
    """Calls of terms in stages in which they do not act."""
    names = list(stages)
    ends = {**FIRST, "layers": "root_wall" if "root_wall" in names else "equilibrium"}
    return [
        f"{term} in {name}"
        for term, first in ends.items()
        for name in names[: names.index(first)]
        if stages[name][term]
    ]


def calls_table(stages: dict[str, Counter[str]]) -> list[str]:
    """Of all stages."""
    columns = ("levels", "iterations", *COLUMNS)
    lines = [f"| stage | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for name, calls in stages.items():
        lines.append(f"| {name} | {' | '.join(str(calls[column]) for column in columns)} |")
    return lines


# %%
class Solved:
    """The final state of a cusp, with everything to assemble it again."""

    def __init__(self, given: ValveInput, result: CuspResult) -> None:
        own = given.seen_from(result.index)
        args = (own.scene, own.geometry, own.wedges, 0, result.mesh)
        self.setup = CuspSetup(*args, result.points)
        self.setup.wedge.field = self.setup.wedge_field(1.0)
        self.points = result.points
        state = np.zeros(self.setup.model.size)
        state[self.setup.model.position_dofs] = result.points
        state = start_directors(self.setup.model, state)
        #: each a little farther: what terms remember of the last state must not help
        self.states = (state + 1e-9 * number for number in count())

    def assembling(self, *terms: Any) -> Task:
        """Residual and tangent with these terms."""
        system = self.setup.system

        def task() -> None:
            system.terms, state = list(terms), next(self.states)
            system.residual(state)
            system.tangent(state)

        return task

    def layers(self, clearance: float) -> LayerClearance:
        """The term for this clearance [mm]."""
        setup, options = self.setup, self.setup.scene.layers
        thickness = setup.cusp.thickness
        unrestricted = setup.scene.layers_unrestricted(thickness)
        shape = (setup.mesh, thickness, clearance, unrestricted)
        return LayerClearance(*shape, options.stiffness, options.width)

    def pairs(self) -> LayerPairs:
        """The search behind the term that acts."""
        setup, mesh, clearance = self.setup, self.setup.mesh, self.setup.layers.clearance
        thickness = setup.cusp.thickness
        return LayerPairs(
            mesh.points,
            mesh.triangles,
            mesh.distance_to_suture,
            setup.scene.layers_unrestricted(thickness),
            least_way(thickness, clearance),
            clearance + setup.layers.width / 2,
        )


def of_terms(solved: Solved) -> Iterator[Row]:
    """Residual and tangent with and without the terms that do not act yet."""
    setup = solved.setup
    wall, clamp, wedge, layers = setup.wall, setup.clamp, setup.wedge, setup.layers
    asked = layers.clearance
    terms = {
        "wall, before `hinged_edge`": wall,
        "clamp, before `clamped_edge`": clamp,
        "wedge, before `contact_wedge`": wedge,
        "layers, before `root_wall`": layers,
    }
    tasks = [solved.assembling(*list(terms.values())[:number]) for number in range(5)]
    costs = processor_ms(*tasks)
    for name, few, more in zip(terms, costs[:-1], costs[1:], strict=True):
        yield Row(f"residual and tangent without the {name}", "ms", few, more)
    yield Row("residual and tangent without all of them", "ms", costs[0], costs[-1])
    none = solved.layers(0.0)
    left = max(
        abs(none.energy(solved.points)),
        np.abs(none.gradient(solved.points)).max(),
        abs(none.hessian(solved.points)).max(),
    )
    pairs = none.active(solved.points)
    check = f"{pairs} pairs act; energy, gradient and Hessian are {left:g}"
    few, more = processor_ms(
        lambda: solved.layers(0.0).active(solved.points),
        lambda: solved.layers(asked).active(solved.points),
        repeats=5,
    )
    holds = pairs == 0 and left == 0.0
    yield Row("`layers.clearance = 0`: term built and asked once", "ms", few, more, check, holds)


# %% [markdown]
# Bending that is switched off has no unknowns and no forms.


# %%
def _built(mesh: CuspMesh, bending: bool) -> tuple[ShellModel, int]:
    """The model and how many bending forms were made for it."""
    with ExitStack() as stack:
        watched = [
            stack.enter_context(
                mock.patch.object(shell_model, name, wraps=getattr(shell_model, name))
            )
            for name in ("bending_energy_density", "bending_force_density")
        ]
        model = ShellModel(mesh, ShellParameters(bending=bending))
        return model, sum(made.call_count for made in watched)


def _compiling(mesh: CuspMesh, bending: bool) -> float:
    """Processor seconds, those of the C compiler included, to build the model from no cache."""
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.dict(os.environ, {"XDG_CACHE_HOME": folder}),
    ):
        clock = sum(os.times()[:4])
        _built(mesh, bending)
        return sum(os.times()[:4]) - clock


def of_bending(mesh: CuspMesh, quick: bool) -> Iterator[Row]:
    """A membrane against a shell."""
    (membrane, few), (shell, more) = (_built(mesh, bending) for bending in (False, True))
    yield Row("bending off: bending forms built", "forms", few, more, "", few == 0)
    yield Row("bending off: unknowns", "number", membrane.size, shell.size)
    # stretched in its plane a shell does not bend
    places = np.c_[mesh.points * [1.1, 0.9], np.zeros(len(mesh.points))]
    states, forces = [], []
    for model in (membrane, shell):
        state = np.zeros(model.size)
        state[model.position_dofs] = places
        states.append(state)
        forces.append(model.residual(state)[model.position_dofs])
    apart = float(np.abs(forces[0] - forces[1]).max() / np.abs(forces[1]).max())
    check = f"forces on a sheet stretched in its plane agree {agree(apart)}"
    for name in ("residual", "tangent"):
        tasks = [
            lambda m=model, s=state, n=name: getattr(m, n)(s)
            for model, state in zip((membrane, shell), states, strict=True)
        ]
        costs = processor_ms(*tasks)
        yield Row(f"bending off: {name}", "ms", *costs, check, apart < 1e-12)
        check = ""
    if not quick:
        off, on = (_compiling(mesh, bending) for bending in (False, True))
        yield Row("bending off: kernels compiled from nothing", "s", off, on)


# %% [markdown]
# ## Distances where they can act


# %%
def _all_pairs(arcs: BezierArcs, x: Floats, _y: Floats, _bound: Floats) -> Any:
    return np.nonzero(np.ones((arcs.deviation.size, x.size), dtype=bool))


def all_arcs() -> Any:
    """While it lasts, the contact wedge solves the quintics of all arcs."""
    return mock.patch.object(BezierArcs, "candidates", _all_pairs)


def _all_triangles(corners: Floats, _reach: float) -> Floats:
    return np.stack(np.triu_indices(len(corners), 1), axis=1)


def of_wedge(solved: Solved) -> Iterator[Row]:
    """The contact wedge's distance of all nodes."""
    field, points, wedge = solved.setup.wedge.field, solved.points, solved.setup.wedge

    def everything() -> Any:
        with all_arcs():
            return field.evaluate(points)

    found, brute = field.evaluate(points), everything()
    apart = max(float(np.abs(a - b).max()) for a, b in zip(found, brute, strict=True))
    arcs = field.section.section.arcs
    plane = np.ascontiguousarray(field.frame.project(points).T)
    left = len(arcs.candidates(*plane, np.full(len(points), np.inf))[0])
    name = "contact wedge: quintics only on arcs that can be closest"
    check = f"distances and derivatives agree {agree(apart)}"
    costs = processor_ms(lambda: field.evaluate(points), everything)
    yield Row(name, "ms", *costs, check, apart < 1e-10)
    yield Row(name, "quintics", left, len(points) * arcs.deviation.size)
    wedge.evaluate(points)
    moves = itertools.cycle(1e-3 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))

    def asked_of_all() -> Floats:
        wedge.field = field  # forgets how far each node was
        return wedge.gradient(points + next(moves))

    costs = processor_ms(lambda: wedge.gradient(points + next(moves)), asked_of_all)
    place = points + next(moves)
    known = wedge.gradient(place)
    wedge.field = field
    apart = float(np.abs(known - wedge.gradient(place)).max())
    count = np.count_nonzero(field.evaluate(points)[0] < wedge.clearance + wedge.width / 2)
    name = "contact wedge: only nodes that it may push, after a step of 1 um"
    check = f"{count} of {len(points)} nodes; forces agree {agree(apart, ' mN')}"
    yield Row(name, "ms", *costs, check, apart == 0.0)


def of_layers(solved: Solved) -> Iterator[Row]:
    """The barrier's and the layers' pairs."""
    contact, points = solved.setup.contact, np.asfortranarray(solved.points)

    def build(**how: Any) -> ipctk.NormalCollisions:
        collisions = ipctk.NormalCollisions()
        collisions.build(contact.mesh, points, contact.distance, **how)
        return collisions

    counts = [len(build()), len(build(broad_phase=ipctk.BruteForce()))]
    costs = processor_ms(build, lambda: build(broad_phase=ipctk.BruteForce()), repeats=3)
    check = f"{counts[0]} and {counts[1]} contacts"
    holds = counts[0] == counts[1]
    yield Row("barrier: boxes before distances", "ms", *costs, check, holds)

    def search(brute: bool) -> tuple[Floats, Floats]:
        with ExitStack() as stack:
            if brute:
                patch = mock.patch.object(layer_pairs, "_near_balls", _all_triangles)
                stack.enter_context(patch)
            return moved.at(next(away))

    # moved as a whole by more than the pairs' room, so that each call searches
    asked = solved.setup.layers.clearance
    away = cycle([solved.points, solved.points + 10.0])
    moved, kept = solved.pairs(), solved.pairs()
    pairs = [search(brute) for brute in (False, True)]
    same = all(np.array_equal(a, b) for a, b in zip(*pairs, strict=True))
    number = sum(len(kind) for kind in pairs[0])
    check = f"{number} pairs, {'the same' if same else 'others'}"
    costs = processor_ms(lambda: search(False), lambda: search(True), repeats=3)
    yield Row("layers: a tree of balls before distances", "ms", *costs, check, same)
    close = cycle([solved.points, solved.points + 0.01 * asked])
    costs = processor_ms(lambda: kept.at(next(close)), lambda: search(False))
    same = all(np.array_equal(a, b) for a, b in zip(kept.at(next(close)), pairs[0], strict=True))
    check = f"the {'same' if same else 'other'} pairs"
    yield Row("layers: pairs kept until a node has moved", "ms", *costs, check, same)


# %% [markdown]
# ## Analytic before sampled


# %%
def _strips(curve: Floats, axis: Floats, closed: bool) -> tuple[Floats, Floats]:
    """Vertices and triangles of the band that ``curve`` (m, 3) sweeps along +- ``axis``."""
    here = np.arange(len(curve) if closed else len(curve) - 1)
    ahead, above = (here + 1) % len(curve), len(curve)
    lower = np.c_[here, ahead, ahead + above]
    upper = np.c_[here, ahead + above, here + above]
    return np.vstack([curve - axis, curve + axis]), np.vstack([lower, upper]).astype(np.int64)


def _sampled(name: str, field: Any, points: Floats, surface: tuple[Floats, Floats]) -> Row:
    """A closed form, with two derivatives, against libigl's tree: no sign, no derivatives."""
    tree = igl.AABB()
    tree.init(*surface)
    distance, gradient, _ = field.evaluate(points)
    square, _, foot = tree.squared_distance(*surface, points)
    error = float(np.abs(np.abs(distance) - np.sqrt(square)).max())
    away = points - foot
    far = np.abs(distance) > 0.05
    along = np.einsum("nd,nd->n", away[far], gradient[far]) / np.sqrt(square[far])
    turned = float(np.degrees(np.arccos(np.clip(np.abs(along), 0, 1)).max()))
    costs = processor_ms(
        lambda: field.evaluate(points), lambda: tree.squared_distance(*surface, points)
    )
    check = f"{len(surface[1])} triangles miss {error:.1e} mm, normals {turned:.2g} degrees"
    return Row(name, "ms", *costs, check)


def of_closed_forms(given: ValveInput, points: Floats) -> Iterator[Row]:
    """Wall and wedge in closed form against triangulated ones."""
    own = given.seen_from(0)
    root, wedge = own.geometry.root, own.wedges.wedge(0, 1.0)
    for facets in (108, 768):
        angle = 2 * np.pi * np.arange(facets) / facets
        ring = root.radius * np.c_[np.cos(angle), np.sin(angle), 0 * angle]
        name = f"wall in closed form, against {facets} flat strips"
        surface = _strips(ring, np.array([0.0, 0.0, 4 * root.radius]), True)
        yield _sampled(name, root, points, surface)
    for number in (25, 200):
        curve, axis = wedge.polyline3(number, 2 * root.radius), own.geometry.commissures.normal
        surface = _strips(curve, 4 * root.radius * np.asarray(axis), False)
        name = f"contact wedge in closed form, against {len(curve) - 1} flat strips"
        yield _sampled(name, wedge, points, surface)


# %%
#: Written after reading the table.
NOTES = """## What it says

- **Congruent cusps, one cusp alone**: a third, as there are three. Every cusp is solved in a frame
  of its own, so that three congruent ones get the same numbers: agreement to the bit says that
  nothing else differs, not that the solver is invariant, which `tests/test_invariances.py` is for.
  `copied_from` in the report, and turned against solved: `tests/test_congruence.py`; one cusp:
  `tests/test_suture_valve.py`.
- **Terms before their stage** are not called once (`tests/test_savings.py`). At the end they
  nearly double the cost of residual and tangent, the wedge most of all; the wall's and the layers'
  shares are small. A solve also factorises, which does not change: of a whole run it is less.
- **Layers**: their table of neighbours is made by the first who asks, so not on coarser meshes and
  not for `quality = "approximate"`. That is the dear part of `layers.clearance`; later queries live
  on the pairs kept.
- **Bending off** has half the unknowns and takes less than a third of the assembly.
- **Culling** of arcs solves a tenth of the quintics, for two fifths of the time: the rest is spent
  on bounds, and on arrays too short for NumPy. On the 109 nodes of Experiment 3 at h = 2.8 mm it
  saves no more than a fifth to a third.
- **Not built**: wall and wedge compute their distance at all nodes, also at those that are too far
  for the penalty to act. Leaving these out would save up to a third of the wedge's distance here,
  little on coarse meshes.
- **Analytic before sampled**: the wall in closed form, in NumPy and with both derivatives, takes
  less than a tenth of what libigl's compiled tree takes for the distance alone. The contact
  wedge in closed form is *no* saving of time against few flat strips, and a small one against many;
  what it buys is derivatives that Newton's method can use: normals of strips jump, and they have no
  curvature.
- **Not separate**: pressure and free-edge force act from the first stage on and are part of the one
  compiled form; with a stiffness of zero they are still assembled.
"""


# %%
def table(rows: Sequence[Row]) -> list[str]:
    """Lines of a table of savings."""
    return [
        "| saving | unit | with | without | ratio | comparison |",
        "|---|---|---|---|---|---|",
        *(row.line for row in rows),
    ]


def main(arguments: list[str] | None = None) -> int:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(description="What is saved, each against without it")
    parser.add_argument("--size", type=float, default=1.4, help="h [mm]")
    parser.add_argument("--out", type=Path, default=DEMOS.parent / "docs")
    parser.add_argument("--quick", action="store_true", help="one cusp, nothing compiled")
    asked = parser.parse_args(arguments)
    number = 3 if asked.quick else 1
    given = experiment(number, asked.size)
    meshes = mesh_templates(given)[0]
    for bending in (True, False):
        _built(meshes[-1], bending)  # compiled, for all that follows
    rows: dict[str, list[Row]] = {}
    if not asked.quick:
        rows["Cusps that are solved"] = [*of_congruent_cusps(asked.size), *of_one_cusp(asked.size)]
    stages, result = calls_by_stage(given)
    early, solved = too_early(stages), Solved(given, result)
    acting = [*of_terms(solved), *of_bending(meshes[-1], asked.quick)]
    rows["Terms that do not act"] = acting
    rows["Distances where they can act"] = [*of_wedge(solved), *of_layers(solved)]
    rows["Analytic before sampled"] = list(of_closed_forms(given, result.points))
    spent = {name: f"{part / result.seconds:.0%}" for name, part in result.shares.items()}
    lines = [
        "# Only what is required",
        "",
        f"Written by `python demos/savings.py --size {asked.size:g}`: h = {asked.size:g} mm, one"
        " process, one thread, processor time (of what takes milliseconds the least of several"
        " turns). Ratio: with the saving over without. Where no other is named, it is"
        f" Experiment {number}, cusp 0, of {len(result.points)} nodes, at its final state; its time"
        f" went into {', '.join(f'{name} {share}' for name, share in spent.items())}.",
    ]
    for title, some in rows.items():
        lines += ["", f"## {title}", "", *table(some)]
    lines += [
        "",
        "## Calls of each term, stage by stage",
        "",
        "Wall and wedge return the last distances while no node has moved, so they are asked more"
        " often than a distance is computed. The last column counts how often that of the wedge"
        " was; once a level it is for `wedge_distance` in the results.",
        "",
        *calls_table(stages),
    ]
    if NOTES:
        lines += ["", NOTES]
    asked.out.mkdir(parents=True, exist_ok=True)
    with written_whole(asked.out / "savings.md") as temporary:
        temporary.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    missed = [row.line for some in rows.values() for row in some if not row.holds]
    missed += [f"called too early: {call}" for call in early]
    for line in missed:
        print(line, file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
