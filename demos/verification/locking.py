"""Thin shells must not lock: the same answer for every thickness.

Bending a thin sheet without stretching it is cheap, stretching it is dear. An element that cannot
bend without stretching becomes far too stiff as the thickness H goes to 0: it locks. Here strips
of length L = 1 mm, rigidity EI = 1 per width (E = 12/H^3 kPa, so EA/EI = 12/H^2), nu = 0, clamped
at x = 0, are made ten and a hundred times thinner, L/H = 20, 200, 2000; loads are relative to
EI, so in the limit the answer does not depend on H.

- *linear*: a small dead end force P L^2/EI = 0.01, deflection PL^3/3EI;
- *large*: the force P L^2/EI = 4 of the cantilever of problem 3.1;
- *curved*: the strip is first rolled to half a circle by an end moment, then a radial force
  P L^2/EI = 1 at its tip opens it. The test proper: a curved sheet under bending.

Value: deflection of the loaded end along the force over the exact one, 1 when nothing locks;
exact is the stretchable line (``cantilever.stretchable_tip``). Meshes are structured, or
unstructured with four rows (at random, so no row of edges lies along the axis of bending), or
stretched 20:1 either way. The figure to reach: 1 % for each thickness.

What is found. Degree 1 (one membrane strain a triangle) and degree 3 (full quadrature, 4) hold it
on ordinary meshes. **Degree 2 locks**, most where the sheet is curved, with its three-point
quadrature (2) as with the full one (4): on 128 triangles the large deflection comes to 0.98 of
the exact one with three points, and 0.95 with full quadrature, at L/H = 2000, and the curved strip
does not even keep its half circle. Three points defer the locking, they do not cure it. So the
rows are those of degrees 1 and 3; ``rows(full, degrees=(2,))`` gives those of degree 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from cantilever import stretchable_tip, tip
from meshes import strip
from numpy.typing import NDArray
from record import Row
from roll_up import plain_newton
from solving import Problem, start

__all__ = ["CASES", "MESHES", "Case", "deflection_ratio", "draw", "rows"]

Floats = NDArray[np.float64]

SLENDER = (20, 200, 2000)  # L/H
ALLOWED = 1e-2


@dataclass(frozen=True)
class Case:
    """Dead end force along z, and end moment put on before it, for L = EI = 1."""

    name: str
    force: float
    moment: float = 0.0
    steps: int = 4


@dataclass(frozen=True)
class Grid:
    """Mesh of a strip of length 1: columns, rows, width, structured or not."""

    columns: int
    rows: int
    width: float
    structured: bool = False

    def __str__(self) -> str:
        kind = "structured" if self.structured else "unstructured"
        long, high = 1 / self.columns, self.width / self.rows
        ratio = max(long / high, high / long)
        shape = f", stretched {ratio:.0f}:1" if ratio > 10 else ""
        return f"{2 * self.columns * self.rows} triangles, {kind}{shape}"


CASES = (
    Case("linear", 0.01, steps=1),
    Case("large", 4.0),
    Case("curved", -1.0, moment=np.pi, steps=5),
)
#: per degree: structured, unstructured, stretched across the strip, stretched along it
MESHES: dict[int, tuple[Grid, ...]] = {
    1: (Grid(64, 4, 0.1, True), Grid(64, 4, 0.1), Grid(64, 4, 1.25, True), Grid(16, 4, 0.0125)),
    2: (Grid(32, 2, 0.1, True), Grid(32, 4, 0.1), Grid(32, 2, 1.25, True), Grid(16, 4, 0.0125)),
    3: (Grid(16, 2, 0.1, True), Grid(16, 4, 0.1), Grid(16, 2, 2.5, True), Grid(16, 4, 0.0125)),
}


def _settle(problem: Problem) -> None:
    """Plain Newton; where it fails, the line search from the same state."""
    state, directors = problem.state.copy(), problem.model.directors.copy()
    try:
        # below 1e-5 of the load E A drowns it in rounding at L/H = 2000
        plain_newton(problem, 1e-5, 30)
    except RuntimeError:
        problem.state = state
        problem.model.set_directors(directors)
        problem.solve(1e-5, maximum_iterations=500)


def exact_deflection(case: Case, slender: float, faceted: bool) -> float:
    """Move of the tip along z by the force, of the stretchable line."""
    stretching = 12.0 * slender**2
    after = stretchable_tip(case.force, case.moment, stretching, faceted=faceted)[1]
    if not case.moment:
        return after
    return after - stretchable_tip(0.0, case.moment, stretching, faceted=faceted)[1]


@cache
def deflection_ratio(
    degree: int, grid: Grid, case: Case, slender: float, quadrature: int | None = None
) -> float:
    """Deflection by the end force over the exact one; ``quadrature`` as ``membrane_quadrature``.

    Raises RuntimeError where no equilibrium is found.
    """
    thickness = 1 / slender
    problem = start(
        strip(grid.columns, grid.rows, 1.0, grid.width, grid.structured),
        degree,
        force_scale=abs(case.force) * grid.width,
        young_modulus=12 / thickness**3,
        thickness=thickness,
        membrane_quadrature=quadrature,
    )
    problem.hold(lambda x: x[:, 0] < 1e-9)
    problem.clamp(lambda x: x[:, 0] < 1e-9)
    problem.hold(lambda x: x[:, 1] < 1e-9, (1,))  # as in roll_up
    unit = problem.edge_load(lambda x: x[:, 0] > 1 - 1e-9, np.array([0.0, 0.0, 1.0]))
    bent = np.zeros_like(unit)
    if case.moment:
        bent = -problem.edge_moment(lambda x: x[:, 0] > 1 - 1e-9, 1.0) * case.moment
        for step in range(1, case.steps + 1):
            problem.system.dead_load = bent * step / case.steps
            _settle(problem)
    before = tip(problem, unit)[2]
    for step in range(1, case.steps + 1):
        problem.system.dead_load = bent + unit * case.force * step / case.steps
        _settle(problem)
    move = float(tip(problem, unit)[2] - before)
    return move / exact_deflection(case, slender, degree == 1)


def rows(full: bool, degrees: tuple[int, ...] = (1, 3)) -> list[Row]:
    """Deflection ratios; quick: the large and curved strip, unstructured, at L/H = 2000."""
    answer = []
    for degree in degrees:
        for grid in MESHES[degree] if full else MESHES[degree][1:2]:
            for case in CASES if full else CASES[1:]:
                for slender in SLENDER if full else SLENDER[-1:]:
                    try:
                        ratio = deflection_ratio(degree, grid, case, slender)
                    except RuntimeError:
                        ratio = float("nan")
                    name = f"{case.name}, degree {degree}, {grid}"
                    what = f"deflection / exact at L/H = {slender}"
                    answer.append(Row("locking", name, what, ratio, 1.0, ALLOWED, "elastica"))
    return answer


def draw(axes: Any) -> None:
    """Large deflection over thickness, unstructured: degrees 1 to 3, and 2 fully integrated."""
    axes.axhline(1.0, color="k", linewidth=0.8, label="exact")
    for degree, quadrature, mark in ((1, None, "o"), (2, None, "s"), (2, 4, "v"), (3, None, "^")):
        grid = MESHES[degree][1]
        found = [deflection_ratio(degree, grid, CASES[1], s, quadrature) for s in SLENDER]
        kind = "" if quadrature is None else ", full quadrature"
        label = f"degree {degree}{kind}, {2 * grid.columns * grid.rows} triangles"
        axes.semilogx(SLENDER, found, mark + "-", label=label)
    axes.set(xlabel="L/H [-]", ylabel="deflection / exact [-]", title="Membrane locking")
    axes.legend()
