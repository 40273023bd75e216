"""Speed of the kernels: what a residual, a tangent, a factorisation and a compilation cost.

The template of Experiment 1 (demos/experiment_1.toml) is meshed with edges of 1.4 and 0.7 mm and
bent smoothly; shells of degree 1 and 2 (neo-Hookean, E = 1000 kPa, H = 0.5 mm) are assembled and
factorised there, in one run, in these variants:

- *automatic*: the same shells with the bending energy differentiated twice by UFL
  (``automatic``);
- *by hand*: the package itself, whose first variations are derived by hand
  (``mechanics.edge_turn``);
- *bare loop*: nothing but DOLFINx's assembly of the same or of the stock form into a PETSc
  matrix, and its LU factorisation by MUMPS;
- *stock*: what one would write first, an energy and DOLFINx's own Newton solver: the linear
  membrane, and a quadratic Kirchhoff-Love shell with interior penalty (C0-IP), energy
  1/2 D kappa : kappa in the cells, -D {kappa_nn} theta + 5 D/(2 h) theta^2 on the edges.

The problem that is solved is the flat template, held along its suture line (free to turn there),
under a follower pressure of 0.0001 to 1 kPa, each in one step from flat.
Variants of the same element must agree to 1e-10; ``measure`` raises if they do not. Times are
the least CPU time of several repeats in which the variants take turns, for machines that are
busy; starts are also given in wall clock. Trust ratios, not seconds.

    python demos/verification/kernel_speed.py --write docs/kernel_speed.md
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from automatic import automatic_shell
from avneo_fem import compat
from avneo_fem.compat import PETSc, fem, fem_petsc, ufl
from avneo_fem.equilibrium.directors import start_directors
from avneo_fem.equilibrium.factorization import Factorization
from avneo_fem.equilibrium.high_order_shell import HighOrderShell, shell_model
from avneo_fem.equilibrium.newton import NewtonSettings, NewtonSolver
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.geometry.template import CuspTemplate
from avneo_fem.mechanics.hybrid_bending import moment_force_on_edges
from avneo_fem.mechanics.kinematics import unit_normal
from avneo_fem.mechanics.loads import pressure_force_density
from avneo_fem.mechanics.materials import NeoHookean
from avneo_fem.mechanics.membrane import membrane_energy_density
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.scene import Template
from solving import Problem, start

__all__ = ["FULL", "Figure", "Level", "disagreement", "expected", "measure", "report"]

Floats = NDArray[np.float64]

Task = Callable[[], Any] | tuple[Callable[[], Any], Callable[[], Any]]

VARIANTS: dict[str, Callable[[CuspMesh, ShellParameters], ShellModel]] = {
    "automatic": automatic_shell,
    "by hand": shell_model,
}
STOCK = {1: "P1 membrane", 2: "P2 C0-IP"}
SAME = 1e-10
#: E, H with D = 1 and a membrane of no stiffness, so that a difference in bending is seen
BENDING_ALONE = {"young_modulus": 12e-12, "thickness": 1e4, "pressure": 0.0}
ASSEMBLY = ("energy", "residual", "tangent")
STARTS = ("cold, wall clock", "cold, CPU", "warm, wall clock", "warm, CPU")
FACTORS = ("L D L^T, first", "L D L^T, again", "L U, first", "L U, again")


@dataclass(frozen=True)
class Figure:
    """One measured number: ``group`` is its table, ``case`` and ``variant`` its line there."""

    group: str
    case: str
    variant: str
    quantity: str
    value: float


@dataclass(frozen=True)
class Level:
    """What to measure; sizes in mm, ``flags`` and ``starts`` compile from scratch."""

    sizes: tuple[float, ...] = (1.4, 0.7)
    degrees: tuple[int, ...] = (1, 2)
    stock_degrees: tuple[int, ...] = (1, 2)
    pressures: tuple[float, ...] = (0.0001, 0.001, 0.01, 1.0)
    flags: tuple[str, ...] = ("-O0 -g0", "-O1 -g0", "-O2 -g0", "-O2", "-O3 -march=native -g0")
    starts: bool = True
    repeats: int = 12
    start_repeats: int = 2


FULL = Level()


def template_mesh(size: float) -> CuspMesh:
    """Triangles with edges of ``size`` [mm] on the template of Experiment 1."""
    return triangulate_template(CuspTemplate(Template()), size)


def bent_states(model: ShellModel) -> tuple[Floats, Floats]:
    """Two close states, bent, with directors that lean; cached results do not carry over."""
    random = np.random.default_rng(1)
    x, y = model.node_points.T
    state = np.zeros(model.size)
    height = 0.02 * (x**2 - x * y) + 0.5 * np.sin(x / 4)
    state[model.position_dofs] = np.c_[x, y, height]
    state = start_directors(model, state)
    model.set_directors(model.directors + 0.1 * random.uniform(-1, 1, model.directors.shape))
    state[model.angle_dofs] = 0.1 * random.uniform(-1, 1, model.angle_dofs.shape)
    return state, state + 1e-3 * random.uniform(-1, 1, model.size)


def cpu_times(tasks: list[Task], repeats: int) -> list[float]:
    """Least CPU time of every task [s], after one round that is not counted.

    The tasks take turns: what else the machine does slows all of them alike, so ratios hold. A
    pair of tasks is a preparation, which is not timed, and the task.
    """
    times = np.empty((repeats + 1, len(tasks)))
    for row in times:
        for column, task in enumerate(tasks):
            prepare, run = task if isinstance(task, tuple) else (None, task)
            if prepare is not None:
                prepare()
            clock = time.process_time()
            run()
            row[column] = time.process_time() - clock
    return [float(least) for least in times[1:].min(axis=0)]


def _alternating(function: Callable[[Floats], Any], states: tuple[Floats, Floats]) -> Task:
    """A task that never asks twice for the same state in succession."""
    turns = cycle(states)
    return lambda: function(next(turns))


def difference(first: Any, second: Any) -> float:
    """Largest difference of two vectors or sparse matrices over the largest entry."""
    return float(abs(first - second).max() / abs(first).max())


def disagreement(mesh: CuspMesh, degree: int, first: str, second: str) -> float:
    """Largest relative difference of residual and tangent of two variants, bending alone."""
    results = []
    for name in (first, second):
        model = VARIANTS[name](mesh, ShellParameters(degree=degree, **BENDING_ALONE))
        state, _ = bent_states(model)
        results.append((model.residual(state), model.tangent(state)))
    return max(difference(a, b) for a, b in zip(*results, strict=True))


def _check(value: float, what: str) -> None:
    if not value <= SAME:
        raise RuntimeError(f"{what}: variants differ by {value:.1e}")


# -- assembly and factorisation ----------------------------------------------------------------
def assembly(mesh: CuspMesh, case: str, degree: int, repeats: int) -> Iterator[Figure]:
    """ms per thousand unknowns of energy, residual and tangent."""
    _check(disagreement(mesh, degree, *VARIANTS), case)
    models = [make(mesh, ShellParameters(degree=degree)) for make in VARIANTS.values()]
    states = [bent_states(model) for model in models]
    for variant, model in zip(VARIANTS, models, strict=True):
        yield Figure("assembly", case, variant, "unknowns", model.size)
    for name in ASSEMBLY:
        pairs = zip(models, states, strict=True)
        tasks = [_alternating(getattr(model, name), both) for model, both in pairs]
        for variant, seconds in zip(VARIANTS, cpu_times(tasks, repeats), strict=True):
            yield Figure("assembly", case, variant, name, 1e6 * seconds / models[0].size)


def membrane_quadrature(mesh: CuspMesh, case: str, degree: int, repeats: int) -> Iterator[Figure]:
    """ms of a tangent for several quadrature degrees of the membrane, and how far the residual
    is from that of the highest."""
    rules, tasks, residuals = (1, 2) if degree == 1 else (2, 4, 6), [], []
    for quadrature in rules:
        chosen = ShellParameters(degree=degree, membrane_quadrature=quadrature)
        model = shell_model(mesh, chosen)
        states = bent_states(model)
        residuals.append(model.residual(states[0]))
        tasks.append(_alternating(model.tangent, states))
    if degree == 1:
        _check(difference(*residuals), "quadrature of constants")
    results = zip(rules, cpu_times(tasks, repeats), residuals, strict=True)
    for quadrature, seconds, residual in results:
        variant, error = f"quadrature degree {quadrature}", difference(residuals[-1], residual)
        yield Figure("quadrature", case, variant, "tangent", 1e3 * seconds)
        yield Figure("quadrature", case, variant, "residual differs by", error)


def edge_terms(mesh: CuspMesh, repeats: int) -> Iterator[Figure]:
    """ms of the tangent of the edges' work, degree 2, as facet and as cell integrals."""
    model = shell_model(mesh, ShellParameters(degree=2))
    assert isinstance(model, HighOrderShell)
    moment = compat.scalar_element(model.domain, "DG", 1)
    elements = [
        compat.vector_element(model.domain, "Lagrange", 3, 2),
        compat.edge_trace_element(model.domain, 1),
    ]
    space = compat.mixed_space(model.domain, elements + [moment] * 3)
    state, director = fem.Function(space), model._director
    random = np.random.default_rng(2)
    x = ufl.SpatialCoordinate(model.domain)
    state.x.array[:] = random.uniform(-1, 1, len(state.x.array))
    position, _, *components = ufl.split(state)
    flat = ufl.as_vector([10 * x[0], 10 * x[1], 0 * x[0]])
    virtual, moments = ufl.split(ufl.TestFunction(space))[:2], ufl.as_vector(components)

    def force(side: Callable[[Any], Any], normal: Any) -> Any:
        place = side(position) + side(flat)
        parts = (side(virtual[0]), side(virtual[1]))
        return moment_force_on_edges(place, parts, side(director), side(moments), normal)

    measures = [
        ufl.Measure(k, model.domain, metadata={"quadrature_degree": 3}) for k in ("dS", "ds")
    ]
    nu = ufl.FacetNormal(model.domain)
    sides = [lambda f: f("+"), lambda f: f("-")]
    facets = sum(force(side, side(nu)) for side in sides) * measures[0]
    facets += force(lambda f: f, nu) * measures[1]
    cells = model._around_cells(lambda normal: force(lambda f: f, normal))
    forms = [
        compat.compile_form(ufl.derivative(residual, state, ufl.TrialFunction(space)))
        for residual in (facets, cells)
    ]
    matrices = [fem_petsc.create_matrix(form) for form in forms]
    tasks: list[Task] = [partial(_assembled, *pair) for pair in zip(forms, matrices, strict=True)]
    times, results = cpu_times(tasks, repeats), [_csr(matrix) for matrix in matrices]
    names = ("facet integrals", "cell integrals")
    for variant, seconds, matrix in zip(names, times, results, strict=True):
        yield Figure("edges", "degree 2", variant, "tangent", 1e3 * seconds)
        yield Figure("edges", "degree 2", variant, "entries", matrix.nnz / 1e6)
    _check(difference(*results), "edge terms")


def _assembled(form: Any, matrix: Any, bcs: Any = ()) -> Any:
    matrix.zeroEntries()
    fem_petsc.assemble_matrix(matrix, form, list(bcs))
    matrix.assemble()
    return matrix


def _csr(matrix: Any) -> sp.csr_matrix:
    rows, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, rows), shape=matrix.size)


def factorisation(mesh: CuspMesh, case: str, degree: int, repeats: int) -> Iterator[Figure]:
    """ms of a factorisation with and without analysis of the pattern, suture held."""
    problem = plate(mesh, degree, 0.01)
    tangent = problem.model.tangent(bent_states(problem.model)[0])
    free = problem.system.free
    matrix = tangent[free][:, free].tocsr()
    tasks: list[Task] = [lambda: tangent[free][:, free].tocsr()]
    for symmetric in (True, False):
        tasks.append(lambda s=symmetric: Factorization(s).factorize(matrix))
        tasks.append(partial(Factorization(symmetric).factorize, matrix))
    names = ("taking out held rows", *FACTORS)
    for name, seconds in zip(names, cpu_times(tasks, repeats), strict=True):
        yield Figure("factorisation", case, "ours", name, 1e3 * seconds)


# -- baselines ---------------------------------------------------------------------------------
class StockShell:
    """P1 membrane (degree 1) or P2 shell with interior penalty (degree 2), energy by UFL."""

    def __init__(self, mesh: CuspMesh, degree: int, pressure: float) -> None:
        p, self.mesh = ShellParameters(), mesh
        domain = self.domain = compat.create_mesh(mesh.points, mesh.triangles)
        element = compat.vector_element(domain, "Lagrange", 3, degree)
        self.space = compat.function_space(domain, element)
        self.position = fem.Function(self.space)
        self.position.interpolate(lambda x: np.vstack([x[0], x[1], 0 * x[0]]))
        self.constants = fem.Constant(domain, np.array([p.young_modulus, p.thickness, pressure]))
        young, thickness, load = (self.constants[k] for k in range(3))
        gradient = ufl.grad(self.position)
        membrane = membrane_energy_density(gradient, NeoHookean(young), thickness)
        energy = membrane * self._measure("dx", max(2 * degree - 2, 1))
        if degree == 2:
            energy += self._interior_penalty(young * thickness**3 / 12)
        test, trial = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        force = ufl.dot(pressure_force_density(gradient, load), test)
        self.residual = ufl.derivative(energy, self.position, test)
        self.residual -= force * self._measure("dx", 3 * degree - 2)
        self.tangent = ufl.derivative(self.residual, self.position, trial)
        ends = mesh.points[mesh.suture_line]
        edges = np.sort(compat.match_edges(domain, (ends[1:] + ends[:-1]) / 2)).astype(np.int32)
        held = fem.locate_dofs_topological(self.space, 1, edges)
        start_place = fem.Function(self.space)
        start_place.x.array[:] = self.position.x.array
        self.bcs = [fem.dirichletbc(start_place, held)]

    def _measure(self, kind: str, degree: int) -> Any:
        return ufl.Measure(kind, domain=self.domain, metadata={"quadrature_degree": degree})

    def _interior_penalty(self, rigidity: Any) -> Any:
        """C0 interior penalty energy of design.md section 3, penalty 5, edges free to turn."""
        gradient, second = ufl.grad(self.position), ufl.grad(ufl.grad(self.position))
        normal, nu = unit_normal(gradient), ufl.FacetNormal(self.domain)
        i, j, k = ufl.indices(3)
        curvature = ufl.as_matrix(second[k, i, j] * normal[k], (i, j))
        across = [ufl.dot(nu(s), curvature(s) * nu(s)) for s in "+-"]
        along = gradient("+") * ufl.as_vector([-nu("+")[1], nu("+")[0]])
        along /= ufl.sqrt(ufl.dot(along, along))
        sine = ufl.dot(along, ufl.cross(normal("+"), normal("-")))
        angle = 2 * ufl.atan(sine / (1 + ufl.dot(normal("+"), normal("-"))))
        height = ufl.avg(ufl.CellVolume(self.domain)) / ufl.FacetArea(self.domain)("+")
        edge = -(across[0] + across[1]) / 2 * angle + 5 / (2 * height) * angle**2
        cell = ufl.inner(curvature, curvature) / 2 * self._measure("dx", 2)
        return rigidity * (cell + edge * self._measure("dS", 2))

    def solve(self, tolerance: float) -> tuple[bool, int, float]:
        """Stock Newton from flat: (converged, iterations, CPU seconds)."""
        from dolfinx import log
        from dolfinx.nls.petsc import NewtonSolver as StockNewton

        log.set_log_level(log.LogLevel.ERROR)  # that it fails is in the table

        with compat._compiling() as options:
            problem = fem_petsc.NonlinearProblem(
                self.residual, self.position, self.bcs, J=self.tangent, **options
            )
        solver = StockNewton(self.domain.comm, problem)
        solver.convergence_criterion = "residual"
        solver.atol, solver.rtol, solver.max_it = tolerance, 1e-14, 50
        solver.error_on_nonconvergence = False
        _use_mumps(solver.krylov_solver)
        clock = time.process_time()
        try:
            iterations, converged = solver.solve(self.position)
        except (RuntimeError, PETSc.Error):  # DOLFINx 0.5.2 raises when the matrix is singular
            iterations, converged = 1, False
        finite = bool(np.isfinite(self.position.x.array).all())
        return converged and finite, iterations, time.process_time() - clock

    def deflection(self) -> float:
        """Largest displacement out of the plane [mm]."""
        return float(abs(self.position.x.array.reshape(-1, 3)[:, 2]).max())


def _use_mumps(solver: Any) -> None:
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")


def plate(mesh: CuspMesh, degree: int, pressure: float, **more: bool) -> Problem:
    """The flat template in our model, held along the suture line."""
    scale = 8.0 * mesh.area
    options = {"material": "neo_hookean", "pressure": pressure}
    problem = start(mesh, degree, force_scale=scale, **options, **more)
    line = problem.nodes(lambda x: _on_line(x, mesh.points[mesh.suture_line]))
    problem.system.fix(problem.model.position_dofs[line])
    return problem


def _on_line(points: Floats, line: Floats) -> NDArray[np.bool_]:
    """Which points (n, 2) are ends or midpoints of the pieces of ``line`` (k, 2)."""
    places = np.vstack([line, (line[1:] + line[:-1]) / 2])
    return np.linalg.norm(points[:, None] - places, axis=2).min(axis=1) < 1e-9


def _ours(level: Level) -> dict[str, tuple[int, dict[str, bool]]]:
    """Our elements that solve the plate: degree and options by name."""
    names: dict[str, tuple[int, dict[str, bool]]] = {
        f"ours, degree {k}": (k, {}) for k in level.degrees
    }
    if 2 in level.degrees:
        names["ours, degree 2, strain not projected"] = 2, {"membrane_projection": False}
    return names


def solving(mesh: CuspMesh, case: str, level: Level) -> Iterator[Figure]:
    """Newton iterations, CPU ms per iteration and deflection: stock and ours."""
    for pressure in level.pressures:
        tolerance = 1e-9 * 8.0 * mesh.area
        for variant, (degree, options) in _ours(level).items():
            problem = plate(mesh, degree, pressure, **options)
            settings = NewtonSettings(largest_move=1e30, first_shift=1e-6)
            newton = NewtonSolver(problem.system, settings)
            clock = time.process_time()
            state, verdict = newton.solve(problem.state, 1e-9, maximum_iterations=100)
            seconds = time.process_time() - clock
            height = float(abs(state[problem.model.position_dofs][:, 2]).max())
            result = (verdict.converged, verdict.iterations, seconds, height)
            yield from _solved(f"{case}, {pressure:g} kPa", variant, *result)
        for degree in level.stock_degrees:
            stock = StockShell(mesh, degree, pressure)
            outcome = (*stock.solve(tolerance), stock.deflection())
            name = f"stock, {STOCK[degree]}"
            yield from _solved(f"{case}, {pressure:g} kPa", name, *outcome)


def _solved(
    case: str, variant: str, converged: bool, iterations: int, seconds: float, height: float
) -> Iterator[Figure]:
    yield Figure("Newton", case, variant, "converged", float(converged))
    yield Figure("Newton", case, variant, "iterations", iterations)
    yield Figure(
        "Newton",
        case,
        variant,
        "ms per iteration",
        1e3 * seconds / iterations if iterations else np.nan,
    )
    yield Figure("Newton", case, variant, "deflection", height if converged else np.nan)


def bare_loop(mesh: CuspMesh, case: str, level: Level) -> Iterator[Figure]:
    """ms of assembling a tangent and of factorising it: DOLFINx and PETSc alone, and ours."""
    model = shell_model(mesh, ShellParameters())
    model._put(model._state, bent_states(model)[0])
    held = np.sort(model.position_dofs[mesh.suture_line].ravel()).astype(np.int32)
    bcs = [fem.dirichletbc(fem.Function(model.space), held)]
    tasks = dict(_bare("bare loop, our degree 1", model._tangent_form, bcs))
    for degree in level.stock_degrees:
        stock = StockShell(mesh, degree, 0.01)
        random = np.random.default_rng(3)
        heights = stock.position.x.array.reshape(-1, 3)
        heights[:, 2] = 0.1 * random.uniform(-1, 1, len(heights))
        form = compat.compile_form(stock.tangent)
        tasks |= dict(_bare(f"bare loop, {STOCK[degree]}", form, stock.bcs))
    for degree in level.degrees:
        problem = plate(mesh, degree, 0.01)
        states, free = bent_states(problem.model), problem.system.free

        def reduced(state: Floats, p: Problem = problem, f: Any = free) -> Any:
            return p.system.tangent(state)[f][:, f].tocsr()

        factorise = partial(Factorization(symmetric=True).factorize, reduced(states[0]))
        tasks[f"ours, degree {degree}", "assemble"] = _alternating(reduced, states)
        tasks[f"ours, degree {degree}", "factorise"] = factorise
    times = cpu_times(list(tasks.values()), level.repeats)
    for (variant, quantity), seconds in zip(tasks, times, strict=True):
        yield Figure("bare", case, variant, quantity, 1e3 * seconds)


def _bare(variant: str, form: Any, bcs: Any) -> Iterator[tuple[tuple[str, str], Task]]:
    matrix = fem_petsc.create_matrix(form)
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    _use_mumps(solver)

    def renew() -> None:
        _assembled(form, matrix, bcs)  # so that PETSc sees new values
        solver.setOperators(matrix)

    yield (variant, "assemble"), lambda: _assembled(form, matrix, bcs)
    yield (variant, "factorise"), (renew, solver.setUp)


# -- compilation -------------------------------------------------------------------------------
@contextmanager
def empty_cache() -> Iterator[Path]:
    """A kernel cache of its own, for compilations from scratch."""
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.dict(os.environ, XDG_CACHE_HOME=folder),
    ):
        yield Path(folder)


def compiler_flags(mesh: CuspMesh, level: Level) -> Iterator[Figure]:
    """Seconds (CPU, the compiler's included) to make the kernels, and ms of residual, tangent."""
    for degree in level.degrees if level.flags else ():
        models, seconds, case = [], [], f"degree {degree}, by hand"
        for flags in level.flags:
            chosen = {"cffi_extra_compile_args": flags.split()}
            with empty_cache(), mock.patch.dict(compat._JIT, chosen):
                clock = _cpu_of_all()
                models.append(shell_model(mesh, ShellParameters(degree=degree)))
                seconds.append(_cpu_of_all() - clock)
        states = [bent_states(model) for model in models]
        for model, flags in zip(models, level.flags, strict=True):
            for name in ("residual", "tangent"):
                results = [getattr(m, name)(states[0][0]) for m in (models[0], model)]
                _check(difference(*results), flags)
        for flags, taken in zip(level.flags, seconds, strict=True):
            yield Figure("flags", case, flags, "compile", taken)
        for name in ("residual", "tangent"):
            pairs = zip(models, states, strict=True)
            tasks = [_alternating(getattr(model, name), both) for model, both in pairs]
            for flags, taken in zip(level.flags, cpu_times(tasks, level.repeats), strict=True):
                yield Figure("flags", case, flags, name, 1e3 * taken)


def _cpu_of_all() -> float:
    """CPU time of this process and its finished children [s]."""
    return sum(os.times()[:4])


_CHILD = """
import json, sys
from kernel_speed import VARIANTS, ShellParameters, bent_states, template_mesh
size, degree, variant = json.loads(sys.argv[1])
model = VARIANTS[variant](template_mesh(size), ShellParameters(degree=degree))
model.tangent(bent_states(model)[0])
"""


def starts(mesh: CuspMesh, level: Level) -> Iterator[Figure]:
    """Wall-clock and CPU seconds from the start of Python to the first tangent, cold and warm;
    the least of ``level.start_repeats`` rounds in which the variants take turns."""
    names = [(k, variant) for k in level.degrees for variant in VARIANTS]
    times = np.empty((level.start_repeats, len(names), 4))
    for round_ in times:
        for row, (degree, variant) in zip(round_, names, strict=True):
            with empty_cache():
                for place in (0, 2):  # cold, then warm
                    row[place : place + 2] = _start(level.sizes[-1], degree, variant)
    for (degree, variant), row in zip(names, times.min(axis=0), strict=True):
        for quantity, taken in zip(STARTS, row, strict=True):
            yield Figure("starts", f"degree {degree}", variant, quantity, float(taken))
    for degree in level.stock_degrees:
        with empty_cache():
            wall, clock = time.perf_counter(), _cpu_of_all()
            stock = StockShell(mesh, degree, 0.01)
            compat.compile_form(stock.residual)
            compat.compile_form(stock.tangent)
            both = time.perf_counter() - wall, _cpu_of_all() - clock
        case, variant = f"degree {degree}", f"stock, {STOCK[degree]}: compilation alone"
        for quantity, taken in zip(STARTS[:2], both, strict=True):
            yield Figure("starts", case, variant, quantity, taken)


def _start(size: float, degree: int, variant: str) -> tuple[float, float]:
    """Wall-clock and CPU seconds of a process that assembles one tangent."""
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    command = [sys.executable, "-c", _CHILD, json.dumps([size, degree, variant])]
    wall, clock = time.perf_counter(), _cpu_of_all()
    environment = os.environ | {"PYTHONPATH": path}
    subprocess.run(command, check=True, env=environment, capture_output=True)
    return time.perf_counter() - wall, _cpu_of_all() - clock


# -- all of it ---------------------------------------------------------------------------------
def _case(size: float, degree: int) -> str:
    return f"h = {size:g} mm, degree {degree}"


def measure(level: Level, tell: Callable[[str], None] = lambda _text: None) -> list[Figure]:
    """All figures of a level.

    Raises
    ------
    RuntimeError
        When two variants of the same element differ by more than 1e-10.
    """
    figures: list[Figure] = []

    def add(what: str, some: Iterator[Figure]) -> None:
        clock = time.perf_counter()
        figures.extend(some)
        tell(f"{what}: {time.perf_counter() - clock:.0f} s")

    meshes = {size: template_mesh(size) for size in level.sizes}
    for size, mesh in meshes.items():
        for degree in level.degrees:
            case = _case(size, degree)
            add(f"assembly, {case}", assembly(mesh, case, degree, level.repeats))
            add(f"factorisation, {case}", factorisation(mesh, case, degree, level.repeats))
        add(f"bare loop, h = {size:g} mm", bare_loop(mesh, f"h = {size:g} mm", level))
    finest, coarsest = meshes[level.sizes[-1]], meshes[level.sizes[0]]
    for degree in level.degrees:
        case = _case(level.sizes[-1], degree)
        add(f"quadrature, {case}", membrane_quadrature(finest, case, degree, level.repeats))
    if 2 in level.degrees:
        add("edge terms", edge_terms(finest, level.repeats))
    add("Newton", solving(coarsest, f"h = {level.sizes[0]:g} mm", level))
    add("compiler flags", compiler_flags(finest, level))
    if level.starts:
        add("starts", starts(coarsest, level))
    return figures


def expected(level: Level) -> set[tuple[str, str, str]]:
    """(group, case, variant) of every line the report of this level must have."""
    ours = [f"ours, degree {k}" for k in level.degrees]
    stock = [STOCK[k] for k in level.stock_degrees]
    lines = set()
    for size in level.sizes:
        at = f"h = {size:g} mm"
        for degree in level.degrees:
            lines |= {("assembly", _case(size, degree), name) for name in VARIANTS}
            lines.add(("factorisation", _case(size, degree), "ours"))
        names = [*ours, "bare loop, our degree 1", *(f"bare loop, {name}" for name in stock)]
        lines |= {("bare", at, name) for name in names}
    for pressure in level.pressures:
        at = f"h = {level.sizes[0]:g} mm, {pressure:g} kPa"
        lines |= {("Newton", at, name) for name in [*_ours(level), *(f"stock, {n}" for n in stock)]}
    for degree in level.degrees:
        case, rules = _case(level.sizes[-1], degree), (1, 2) if degree == 1 else (2, 4, 6)
        lines |= {("quadrature", case, f"quadrature degree {rule}") for rule in rules}
        lines |= {("flags", f"degree {degree}, by hand", flags) for flags in level.flags}
        if level.starts:
            lines |= {("starts", f"degree {degree}", name) for name in VARIANTS}
    if level.starts:
        for degree in level.stock_degrees:
            name = f"stock, {STOCK[degree]}: compilation alone"
            lines.add(("starts", f"degree {degree}", name))
    if 2 in level.degrees:
        names = ("facet integrals", "cell integrals")
        lines |= {("edges", "degree 2", name) for name in names}
    return lines


def _ratio(figures: list[Figure], group: str, quantity: str, slow: str, fast: str, at: str) -> str:
    """How many times ``slow`` is ``fast``, mean over the cases that contain ``at``; a name is a
    variant, or a variant and its quantity with a bar between."""

    def values(name: str) -> dict[str, float]:
        variant, _, other = name.partition("|")
        wanted = (group, variant, other or quantity)
        return {
            f.case: f.value
            for f in figures
            if (f.group, f.variant, f.quantity) == wanted and at in f.case
        }

    over, under = values(slow), values(fast)
    ratios = [over[case] / under[case] for case in over if case in under]
    return f"{np.exp(np.mean(np.log(ratios))):.2g}" if ratios else "–"


#: group: title, lesson with places for ratios, and what to put there (``_ratio``)
_LESSONS: dict[str, tuple[str, str, list[tuple[str, ...]]]] = {
    "assembly": (
        "Assembly, ms per thousand unknowns",
        "UFL differentiates an angle into long code. With its first variation derived by hand, and "
        "only the second left to UFL, the tangent comes out {} times faster at degree 1 and {} "
        "times at degree 2, the residual {} and {} times, the same to 1e-10.",
        [
            ("tangent", "automatic", "by hand", "degree 1"),
            ("tangent", "automatic", "by hand", "degree 2"),
            ("residual", "automatic", "by hand", "degree 1"),
            ("residual", "automatic", "by hand", "degree 2"),
        ],
    ),
    "edges": (
        "Edge terms, tangent in ms and millions of stored entries",
        "An edge's director meets one triangle at a time. A facet integral nevertheless fills a "
        "matrix of all unknowns of both; the same integral as points on the edges of a cell takes "
        "{} times less time and stores {} times less. One quadrature rule holds the points of all "
        "three edges; three rules of one point each gave a wrong energy with FFCx 0.5.2.",
        [
            ("tangent", "facet integrals", "cell integrals", ""),
            ("entries", "facet integrals", "cell integrals", ""),
        ],
    ),
    "factorisation": (
        "Factorisation by MUMPS, ms",
        "Keeping the pattern saves its analysis: a second L D L^T takes {} times less than the "
        "first at degree 1 and {} at degree 2. L U of the same matrix takes {} and {} times as "
        "long as L D L^T, which also counts the negative eigenvalues the Newton solver goes by.",
        [
            ("", "ours|L D L^T, first", "ours|L D L^T, again", "degree 1"),
            ("", "ours|L D L^T, first", "ours|L D L^T, again", "degree 2"),
            ("", "ours|L U, again", "ours|L D L^T, again", "degree 1"),
            ("", "ours|L U, again", "ours|L D L^T, again", "degree 2"),
        ],
    ),
    "bare": (
        "Against a bare loop, ms",
        "Ours here means the tangent as the Newton solver gets it: constraint terms, moments "
        "eliminated, held rows taken out, then L D L^T. At degree 1 that takes {} times the bare "
        "assembly and {} times the bare factorisation of the same form. Interior penalty couples "
        "neighbouring triangles: its bare assembly takes {} times ours of degree 2, its "
        "factorisation {} times.",
        [
            ("assemble", "ours, degree 1", "bare loop, our degree 1", ""),
            ("factorise", "ours, degree 1", "bare loop, our degree 1", ""),
            ("assemble", "bare loop, P2 C0-IP", "ours, degree 2", ""),
            ("factorise", "bare loop, P2 C0-IP", "ours, degree 2", ""),
        ],
    ),
    "Newton": (
        "A held plate under pressure, one step from flat",
        "The stock linear membrane has no stiffness out of its plane: a singular first matrix. "
        "The stock shell takes {} times the CPU time of our degree 2 per iteration and "
        "diverges where the deflection passes a few thicknesses (0.5 mm); its solver takes full "
        "steps, ours searches along them. The first full step at 1 kPa is 1.7 m long: there the "
        "energy of the projected strain (degree 2) is not a number, and the search gives up.",
        [("ms per iteration", "stock, P2 C0-IP", "ours, degree 2", "0.0001")],
    ),
    "quadrature": (
        "Quadrature of the membrane, tangent in ms",
        "More points than the default (1 at degree 1, 3 at degree 2) buy nothing at degree 1, "
        "where the gradient is constant, and take {} (degree 4) and {} (degree 6) times the time "
        "of a whole tangent at degree 2.",
        [
            ("tangent", "quadrature degree 4", "quadrature degree 2", "degree 2"),
            ("tangent", "quadrature degree 6", "quadrature degree 2", "degree 2"),
        ],
    ),
    "flags": (
        "Compiler flags, compilation in CPU seconds (UFL and FFCx included), assembly in ms",
        "At degree 2, against -O2 -g0: -O0 runs a tangent {} times as long; -O1 compiles in {} of "
        "the time and runs {} times as long; -O3 -march=native compiles {} times as long and "
        "runs {} times as long. The project keeps -O2 -g0.",
        [
            ("tangent", "-O0 -g0", "-O2 -g0", "degree 2"),
            ("compile", "-O1 -g0", "-O2 -g0", "degree 2"),
            ("tangent", "-O1 -g0", "-O2 -g0", "degree 2"),
            ("compile", "-O3 -march=native -g0", "-O2 -g0", "degree 2"),
            ("tangent", "-O3 -march=native -g0", "-O2 -g0", "degree 2"),
        ],
    ),
    "starts": (
        "From the start of Python to the first tangent, s",
        "All kernels of Experiment 1 are those of degree 1; the targets are 40 s cold and 3 s "
        "warm by the wall clock. Derived by hand the cold start takes {} times less CPU time at "
        "degree 1 and {} at degree 2; the stock shell compiles {} times as long as that.",
        [
            ("cold, CPU", "automatic", "by hand", "degree 1"),
            ("cold, CPU", "automatic", "by hand", "degree 2"),
            ("cold, CPU", "stock, P2 C0-IP: compilation alone", "by hand", "degree 2"),
        ],
    ),
}


def report(figures: list[Figure]) -> str:
    """The tables and what they teach, as Markdown."""
    place = f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    versions = ", ".join(f"{name} {text}" for name, text in compat.versions().items())
    parts = [
        "# Speed of the kernels",
        "<!-- Written by `python demos/verification/kernel_speed.py --write "
        "docs/kernel_speed.md`. Do not edit. -->",
        f"Measured in one run on {place}; {versions}. Other work ran on the machine: times are "
        "the least CPU time of several repeats in which the variants take turns; only starts are "
        "wall clock too, and a Newton solve is timed once. Trust ratios.",
    ]
    for group, (title, lesson, wanted) in _LESSONS.items():
        some = [figure for figure in figures if figure.group == group]
        if some:
            ratios = [_ratio(figures, group, *where) for where in wanted]
            parts += [f"## {title}", lesson.format(*ratios), _table(some)]
    return "\n\n".join(parts) + "\n"


def _table(figures: list[Figure]) -> str:
    """One line per case and variant, one column per quantity."""
    quantities = list(dict.fromkeys(figure.quantity for figure in figures))
    lines = {(f.case, f.variant): dict[str, float]() for f in figures}
    for figure in figures:
        lines[figure.case, figure.variant][figure.quantity] = figure.value
    rows = [["case", "variant", *quantities], ["---"] * (2 + len(quantities))]
    for key, values in lines.items():
        rows.append([*key, *(_text(name, values.get(name, np.nan)) for name in quantities)])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def _text(quantity: str, value: float) -> str:
    if np.isnan(value):
        return "–"
    if quantity == "converged":
        return "yes" if value else "no"
    if quantity in ("unknowns", "iterations"):
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _processor() -> str:
    """Model of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main() -> None:
    """Measure and print the report, or write it to a file."""
    parser = argparse.ArgumentParser(description="Speed of the kernels")
    parser.add_argument("--write", type=Path, help="Markdown file to write")
    chosen = parser.parse_args()
    text = report(measure(FULL, lambda line: print(line, file=sys.stderr, flush=True)))
    if chosen.write is None:
        print(text)
    else:
        chosen.write.write_text(text)


if __name__ == "__main__":
    main()
