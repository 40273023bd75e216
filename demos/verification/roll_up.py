"""Cantilever strip rolled up by an end moment (Sze, Liu & Lo 2004, problem 3.2).

A flat strip, L = 12 mm long, b = 1 mm wide, H = 0.1 mm thick, E = 1.2e6 kPa, nu = 0, is clamped
at x = 0 and bent by a moment at x = L that turns with that edge. Pure bending: the strip becomes
an arc of radius R = EI/M, its tip comes back by U = L - R sin(L/R) and rises by
W = R (1 - cos(L/R)). M_max = 50 pi/3 mN mm = 2 pi EI/L closes the circle: U = 12, W = 0.

The figures to reach: 0.1 % of L (0.012 mm) at each of the 20 published loads, for structured and
unstructured meshes, and a tip no farther than 0.1 % of L from the clamped edge at the end.

Two things to know. (1) R = EI/M is exact for an inextensible strip, and for shells of degree 1.
From degree 2 on the curvature phi''.n is l t' (l the stretch, t the slope); a moment then
shortens the strip by 1 - l = (H/R)^2/12, 0.02 % here, and the circle stays open by 0.0055 mm or
0.046 % of L (:func:`cantilever.stretchable_tip`). (2) The moment is the load conjugate to the
edge's angle, and under it the plane arc is no longer a minimum of the total potential above some
0.95 M_max: the strip would rather leave sideways, and a solver that seeks minima goes with it. So
one long edge is held in its plane y = 0, as by a mirror, which changes nothing in the solution.

Load steps (:func:`steps_needed`): plain Newton, full steps and nothing else, takes up to 0.2-0.3
of the load at once from the flat strip, and the whole circle in four or five equal steps of some
20 iterations. The line search on the energy gets as far in as many steps, but with four to six
times the iterations: whatever stretches the strip on the way costs energy, so it shortens steps
that plain Newton takes and repairs in the next.

Source of the table: https://doi.org/10.1016/j.finel.2003.11.001, see ``sze_tables.json``.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import MatrixRankWarning, spsolve

from avneo_fem.equilibrium.directors import renew_directors
from cantilever import stretchable_tip, sze_table, tip
from meshes import strip
from record import Row
from solving import Problem, start

__all__ = ["draw", "exact_tip", "plain_newton", "rolled", "rows", "solve", "steps_needed"]

Floats = NDArray[np.float64]
Mesh = tuple[int, int, bool]  # columns, rows, structured
Solver = Callable[[Problem], int]

LENGTH, WIDTH, THICKNESS, YOUNG = 12.0, 1.0, 0.1, 1.2e6  # mm, mm, mm, kPa
RIGIDITY = YOUNG * THICKNESS**3 / 12 * WIDTH  # mN mm^2
FULL_MOMENT = 50 * np.pi / 3  # mN mm
ALLOWED = 1e-3 * LENGTH  # mm
EXACT, OWN = "R = EI/M", "stretchable line"

QUICK: tuple[tuple[int, Mesh], ...] = ((1, (64, 4, False)), (2, (32, 2, False)))
FULL: tuple[tuple[int, Mesh], ...] = (
    (1, (64, 1, True)),
    (1, (64, 4, False)),
    (2, (32, 2, True)),
    (2, (32, 2, False)),
    (3, (16, 2, True)),
    (3, (16, 2, False)),
)


def exact_tip(share: float) -> tuple[float, float]:
    """(-U, W) [mm] at M = ``share`` M_max."""
    radius = RIGIDITY / (share * FULL_MOMENT)
    angle = LENGTH / radius
    return LENGTH - radius * float(np.sin(angle)), radius * (1 - float(np.cos(angle)))


def plain_newton(problem: Problem, tolerance: float = 1e-8, largest: int = 50) -> int:
    """Full Newton steps and nothing else; their number. Raises RuntimeError when it fails."""
    system, free = problem.system, problem.system.free
    directors = problem.model.directors.copy()
    state = renew_directors(problem.model, problem.state)
    for iteration in range(largest + 1):
        force = system.residual(state)[free]
        size = np.linalg.norm(force) / system.load_scale()
        if size <= tolerance:
            problem.state = state
            return iteration
        if not size < 1e12:
            break
        with warnings.catch_warnings():
            # a singular tangent gives steps that are no numbers: a failure like others
            warnings.simplefilter("ignore", MatrixRankWarning)
            state[free] -= spsolve(system.tangent(state)[free][:, free].tocsc(), force)
    problem.model.set_directors(directors)  # those that problem.state is measured from
    raise RuntimeError(f"plain Newton did not converge: residual {size:.1e}")


def line_search(problem: Problem) -> int:
    """The shell's own solver, which minimises; its number of iterations."""
    return problem.solve(maximum_iterations=200).iterations


def rolled(degree: int, mesh: Mesh) -> tuple[Problem, Floats, Floats]:
    """The flat strip, held; the load of the moment M_max; the mean over the end, cf. ``tip``."""
    columns, across, structured = mesh
    flat = strip(columns, across, LENGTH, WIDTH, structured)
    problem = start(flat, degree, force_scale=FULL_MOMENT, young_modulus=YOUNG, thickness=THICKNESS)
    problem.hold(lambda x: x[:, 0] < 1e-9)
    problem.clamp(lambda x: x[:, 0] < 1e-9)
    problem.hold(lambda x: x[:, 1] < 1e-9, (1,))
    # the end runs along +y, and the strip is to rise: a negative turn about it
    moment = -problem.edge_moment(lambda x: x[:, 0] > LENGTH - 1e-9, 1.0) * FULL_MOMENT / WIDTH
    unit = problem.edge_load(lambda x: x[:, 0] > LENGTH - 1e-9, np.array([0.0, 0.0, 1 / WIDTH]))
    return problem, moment, unit


@cache
def solve(
    degree: int, mesh: Mesh, steps: int = 20, solver: Solver = plain_newton
) -> tuple[tuple[tuple[float, float], ...], int]:
    """(-U, W) of the tip [mm] at ``steps`` equal steps of the moment, and all iterations."""
    problem, moment, unit = rolled(degree, mesh)
    curve, iterations = [], 0
    for step in range(1, steps + 1):
        problem.system.dead_load = moment * step / steps
        iterations += solver(problem)
        move = tip(problem, unit)
        curve.append((-float(move[0]), float(move[2])))
    return tuple(curve), iterations


def steps_needed(degree: int, mesh: Mesh, solver: Solver = plain_newton) -> tuple[int, int]:
    """Fewest equal load steps, and their iterations, with which ``solver`` closes the circle."""
    for steps in (1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 40):
        try:
            return steps, solve(degree, mesh, steps, solver)[1]
        except RuntimeError:
            continue
    raise RuntimeError("not in 40 steps")


def rows(full: bool) -> list[Row]:
    """Tip against R = EI/M at the published loads, and the closed circle.

    ``full``: all 20 loads, structured and unstructured, degrees 1 to 3; else five loads.
    """
    steps = len(sze_table("sze_3_2_cantilever_end_moment")) if full else 5
    answer = []
    for degree, mesh in FULL if full else QUICK:
        kind = "structured" if mesh[2] else "unstructured"
        case = f"degree {degree}, {2 * mesh[0] * mesh[1]} triangles, {kind}"
        curve, _ = solve(degree, mesh, 20 if full or degree > 1 else 5)
        for step in range(1, steps + 1):
            share, found = step / steps, curve[step * len(curve) // steps - 1]
            for name, value, at in zip(("-U", "W"), found, exact_tip(share), strict=True):
                what = f"{name} [mm] at M/M_max = {share:g}"
                answer.append(Row("roll_up", case, what, value, at, ALLOWED, EXACT, absolute=True))
        gap = float(np.hypot(curve[-1][0] - LENGTH, curve[-1][1])) / LENGTH
        answer.append(
            Row("roll_up", case, "open gap of the circle / L", gap, 0.0, 1e-3, EXACT, absolute=True)
        )
        if degree > 1:
            x, z = stretchable_tip(0.0, FULL_MOMENT, YOUNG * THICKNESS * WIDTH, LENGTH, RIGIDITY)
            for name, value, at in zip(("x", "z"), curve[-1], (LENGTH - x, z), strict=True):
                what = f"{name} of the tip [mm] at M_max, stretch included"
                answer.append(
                    Row("roll_up", case, what, value, at, ALLOWED / 10, OWN, absolute=True)
                )
    return answer


def draw(axes: Any) -> None:
    """Tip of a degree-1 shell over the exact curves, moment against displacement."""
    shares = np.linspace(1e-3, 1, 200)
    lines = np.array([exact_tip(s) for s in shares])
    found = np.array(solve(1, (64, 4, False))[0])
    loads = np.arange(1, len(found) + 1) / len(found)
    for column, name in enumerate(("-U", "W")):
        (line,) = axes.plot(lines[:, column], FULL_MOMENT * shares, label=f"{name}, R = EI/M")
        label = f"{name}, degree 1, 512 triangles"
        axes.plot(found[:, column], FULL_MOMENT * loads, "o", color=line.get_color(), label=label)
    axes.set(xlabel="tip displacement [mm]", ylabel="end moment [mN mm]", title="Roll-up (Sze 3.2)")
    axes.legend()
