"""Cantilever strip under an end shear force (Sze, Liu & Lo 2004, problem 3.1).

A flat strip, L = 10 mm long, b = 1 mm wide, H = 0.1 mm thick, E = 1.2e6 kPa, nu = 0, is clamped
at x = 0 and pulled out of its plane at x = L by a dead force, in all P_max = 4 mN = 4 EI/L^2. Its
tip rises by W and comes back by U: at full load U = 3.2894 mm, W = 6.6996 mm.

Two references, independent of finite elements. The *elastica*, an inextensible line that resists
bending alone, in closed form with elliptic integrals (:func:`elastica_tip`). And the same line
with the strip's own membrane stiffness E H b (:func:`stretchable_tip`, an ordinary differential
equation by shooting): U = 3.28954, W = 6.69989, what the shell converges to. The published table
was computed with 16 x 1 Abaqus S4R elements and lies up to 0.0035 mm below the elastica; its
figures are compared with that known error allowed for.

The figures to reach: 0.1 % of the elastica with at most 400 triangles for every degree; and the
error falls with the mesh size h like h^2k, k the degree, as for the energy of smooth solutions.

Source of the table: K. Y. Sze, X. H. Liu, S. H. Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569,
https://doi.org/10.1016/j.finel.2003.11.001; see ``sze_tables.json``.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipkinc

from meshes import strip
from record import Row
from solving import Problem, start

__all__ = [
    "draw",
    "elastica_tip",
    "observed_order",
    "rows",
    "solve",
    "stretchable_tip",
    "sze_table",
    "tip",
]

Floats = NDArray[np.float64]
Mesh = tuple[int, int, bool]  # columns, rows, structured

LENGTH, WIDTH, THICKNESS, YOUNG = 10.0, 1.0, 0.1, 1.2e6  # mm, mm, mm, kPa
FULL_LOAD = 4.0  # mN
EXACT, PUBLISHED = "elastica, elliptic integrals", "Sze et al. 2004, table 3.1 (16 x 1 S4R)"
#: allowed error relative to the elastica
ALLOWED = 1e-3

QUICK: tuple[tuple[int, Mesh], ...] = ((1, (48, 4, False)), (2, (32, 2, False)), (3, (8, 1, True)))
FULL: tuple[tuple[int, Mesh], ...] = (
    (1, (48, 4, True)),
    (1, (48, 4, False)),
    (2, (32, 2, True)),
    (2, (32, 2, False)),
    (3, (16, 2, True)),
    (3, (16, 2, False)),
)
#: pairs of meshes, the second twice as fine, for the order of convergence
REFINED: dict[int, tuple[Mesh, Mesh]] = {
    1: ((24, 2, True), (48, 4, True)),
    2: ((16, 1, True), (32, 1, True)),
    3: ((4, 1, True), (8, 1, True)),
}


def sze_table(name: str) -> Floats:
    """(loads, columns) figures of one table of ``sze_tables.json``, without its zero load."""
    path = Path(__file__).with_name("sze_tables.json")
    table = np.array(json.loads(path.read_text(encoding="utf-8"))[name]["rows"])
    return table[table[:, 0] > 0]


def elastica_tip(load: float) -> tuple[float, float]:
    """(U, W)/L of an inextensible cantilever under a dead end force, ``load`` = P L^2/EI > 0.

    With the tip's slope theta, k^2 = (1 + sin theta)/2 and sin p = 1/(k sqrt 2):
    sqrt(load) = K(k) - F(p, k), W/L = 1 - 2 (E(k) - E(p, k))/sqrt(load) and
    1 - U/L = sqrt(2 sin theta/load) (Bisshopp & Drucker, Q. Appl. Math. 3 (1945) 272).
    """

    def between(integral: Any, slope: float) -> float:
        m = (1 + np.sin(slope)) / 2
        return float(integral(np.pi / 2, m) - integral(np.arcsin(np.sqrt(0.5 / m)), m))

    root = np.sqrt(load)
    slope = brentq(lambda s: between(ellipkinc, s) - root, 1e-12, np.pi / 2 - 1e-12, xtol=1e-15)
    rise = 1 - 2 * between(ellipeinc, slope) / root
    return 1 - float(np.sqrt(2 * np.sin(slope) / load)), rise


def stretchable_tip(
    force: float,
    moment: float,
    stretching: float,
    length: float = 1.0,
    bending: float = 1.0,
    faceted: bool = False,
) -> tuple[float, float]:
    """(x, z) of the tip of a line clamped along x at 0, as thin shells of nu = 0 deform it.

    Energy per length: ``stretching`` (l^2 - 1)^2/8 + ``bending`` k^2/2 with stretch l, slope t
    and curvature k = phi''.n = l t'; ``faceted``: k = t', the curvature of shells of degree 1,
    which sits in their edges. Loads: dead end ``force`` along z, end ``moment`` conjugate to t(L).
    Solved back from the tip, DOP853 at 1e-12, whose slope is that which is 0 at the clamp.
    """

    def stretch(m: float, sine: float) -> float:
        value = 1.0
        curved = 0.0 if faceted else m * m / bending
        for _ in range(50):
            rest = stretching / 2 * (value**3 - value) + curved / value**3 - force * sine
            step = rest / (stretching / 2 * (3 * value**2 - 1) - 3 * curved / value**4)
            value -= step
            if abs(step) < 1e-15:
                break
        return value

    def along(_: float, y: Floats) -> list[float]:
        sine, cosine = np.sin(y[0]), np.cos(y[0])
        here = stretch(y[1], sine)
        turn = y[1] / (bending if faceted else bending * here**2)
        return [turn, -force * here * cosine, here * cosine, here * sine]

    def back(slope: float) -> Floats:
        start_values = [slope, moment, 0.0, 0.0]
        way = solve_ivp(along, (length, 0), start_values, "DOP853", rtol=1e-12, atol=1e-13)
        return np.asarray(way.y[:, -1])

    guess = moment * length / bending
    reach = (guess - 1, guess + 1) if moment else (0.0, np.pi / 2)
    clamped = back(brentq(lambda s: back(s)[0], *reach, xtol=1e-14))
    return -float(clamped[2]), -float(clamped[3])


def tip(problem: Problem, unit_load: Floats) -> Floats:
    """(3,) mean displacement of the loaded end, weighted as ``unit_load`` along z is [mm]."""
    weights = unit_load[problem.model.position_dofs[:, 2]]
    return np.asarray(weights @ problem.displacements / weights.sum())


@cache
def solve(degree: int, mesh: Mesh, steps: int = 4) -> tuple[tuple[float, float], ...]:
    """(-U, W) of the tip [mm] at the loads P_max/steps, 2 P_max/steps, ..., P_max."""
    columns, across, structured = mesh
    flat = strip(columns, across, LENGTH, WIDTH, structured)
    problem = start(flat, degree, force_scale=FULL_LOAD, young_modulus=YOUNG, thickness=THICKNESS)
    problem.hold(lambda x: x[:, 0] < 1e-9)
    problem.clamp(lambda x: x[:, 0] < 1e-9)
    unit = problem.edge_load(lambda x: x[:, 0] > LENGTH - 1e-9, np.array([0.0, 0.0, 1 / WIDTH]))
    curve = []
    for step in range(1, steps + 1):
        problem.system.dead_load = unit * FULL_LOAD * step / steps
        problem.solve()
        move = tip(problem, unit)
        curve.append((-float(move[0]), float(move[2])))
    return tuple(curve)


def observed_order(degree: int) -> float:
    """Order of convergence of the tip's place to that of the stretchable line."""
    rigidity = YOUNG * THICKNESS**3 / 12 * WIDTH
    stiffness = YOUNG * THICKNESS * WIDTH
    x, z = stretchable_tip(FULL_LOAD, 0.0, stiffness, LENGTH, rigidity, degree == 1)
    errors = [
        np.hypot(*np.subtract(solve(degree, m)[-1], (LENGTH - x, z))) for m in REFINED[degree]
    ]
    return float(np.log2(errors[0] / errors[1]))


def rows(full: bool) -> list[Row]:
    """Tip against the elastica at four loads and against the table, and orders of convergence.

    ``full``: all 20 published loads, structured and unstructured meshes, degrees 1 to 3.
    """
    table = sze_table("sze_3_1_cantilever_end_shear")
    answer = []
    for degree, mesh in FULL if full else QUICK:
        kind = "structured" if mesh[2] else "unstructured"
        case = f"degree {degree}, {2 * mesh[0] * mesh[1]} triangles, {kind}"
        steps = len(table) if full else 4
        for step, found in enumerate(solve(degree, mesh, steps), start=1):
            share = step / steps
            exact = LENGTH * np.array(elastica_tip(FULL_LOAD * share))
            published = table[np.argmin(abs(table[:, 0] - share)), 1:]
            for name, value, at, printed in zip(("-U", "W"), found, exact, published, strict=True):
                what = f"{name} [mm] at P/P_max = {share:g}"
                if 4 * share == round(4 * share):
                    answer.append(Row("cantilever", case, what, value, at, ALLOWED, EXACT))
                # the source's own error is known, rounding included; ours may add to it
                limit = abs(printed - at) + ALLOWED * at
                answer.append(
                    Row("cantilever", case, what, value, printed, limit, PUBLISHED, absolute=True)
                )
    for degree in REFINED:
        name = f"degree {degree}, twice as fine"
        order, due = observed_order(degree), 2 * degree
        answer.append(
            Row("cantilever", name, "order", order, due, 0.5, "2k, theory", absolute=True)
        )
    return answer


def draw(axes: Any) -> None:
    """Tip displacements of a degree-2 shell over the elastica, load against displacement."""
    shares = np.linspace(1e-3, 1, 100)
    lines = LENGTH * np.array([elastica_tip(FULL_LOAD * s) for s in shares])
    found = np.array(solve(2, (32, 2, False)))
    loads = np.arange(1, len(found) + 1) / len(found)
    for column, name in enumerate(("-U", "W")):
        (line,) = axes.plot(lines[:, column], FULL_LOAD * shares, label=f"{name}, elastica")
        label = f"{name}, degree 2, 128 triangles"
        axes.plot(found[:, column], FULL_LOAD * loads, "o", color=line.get_color(), label=label)
    axes.set(xlabel="tip displacement [mm]", ylabel="end force [mN]", title="Cantilever (Sze 3.1)")
    axes.legend()
