"""Penalty contact (paper (1.5)): a sheet pressed into the wall of a cylinder.

A flat sheet 46.5 mm long (E = 1 GPa, H = 0.1 mm, nu = 0), wider than the cylinder of radius
R = 12 mm it is put into, is bent upwards; its two ends are hinged on rollers that run along the
lines x = -4 and 4 mm, and the pressure P = 8 kPa inside presses it against the wall (one half is
computed). Wall and sheet meet below; above, the sheet leaves the wall, rounds a free arc and comes
back to the rollers. ``SignedDistancePenalty`` with eta_1 = 64 kPa, eta_2 = 0.5 mm and
d_0 = -eta_2/2 acts from the wall on, so a contact pressure p_c sinks in by (eta_2/2) p_c/eta_1.

References:

- balance of forces: rollers hold nothing upwards, so the penalty forces add up to P x distance of
  the rollers x width, to rounding;
- thin membrane: the free arc has a radius of 6 mm (chosen: it fixes the length), the tension is
  T = P 6 mm, the contact pressure P - T/R = 4 kPa; bending takes 1 % off it;
- the sheet with its bending stiffness: extensible rod under pressure and penalty, a two-point
  boundary value problem (SciPy): place of every node, contact pressure;
- the penetration away from the ends of contact falls like 1/eta_1;
- Newton's residuals near the solution fall quadratically: the penalty's tangent is consistent;
- a *sampled* distance (cubic B-splines through a grid's nodes) gives the place that the analytic
  one gives, with order 4 in the grid's step; when the samples are libigl's distances to a
  triangulated cylinder, with order 2 in the length of its facets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp
from scipy.sparse.linalg import spsolve

from avneo_fem.constraints.signed_distance_penalty import SignedDistance, SignedDistancePenalty
from avneo_fem.equilibrium.directors import start_directors
from avneo_fem.geometry.root import CylinderRoot
from meshes import strip
from record import Row
from sampled_distance import Distance, Lying, SampledDistance, distance_to_facets
from solving import Problem, start

__all__ = ["Sheet", "draw", "membrane", "rod", "rows", "sampled_shifts", "shape_error"]

Floats = NDArray[np.float64]

YOUNG, THICKNESS, PRESSURE = 1e6, 0.1, 8.0
#: E [kPa] and H [mm] of the softer sheet that shows the order of Newton's iteration
SOFT = (1e4, 0.5)
RADIUS, ROLLER, FREE_RADIUS, WIDTH = 12.0, 4.0, 6.0, 0.5
#: angle at which the membrane leaves the wall, and half the sheet's length
LEAVING = float(np.arcsin(ROLLER / (RADIUS - FREE_RADIUS)))
HALF = RADIUS * LEAVING + FREE_RADIUS * (np.pi - LEAVING)
AXIAL, RIGIDITY = YOUNG * THICKNESS, YOUNG * THICKNESS**3 / 12
STIFFNESS, MIDDLE = 64.0, 3.0
TITLE, BALANCE = "pressed sheet", "balance of forces"
CYLINDER = Lying(CylinderRoot(RADIUS))


def membrane(s: Floats) -> tuple[Floats, Floats]:
    """Places (n, 2) [mm] and tangent angles (n,) [rad] of the inextensible membrane at arc
    lengths ``s`` from the bottom [mm]."""
    on_wall = s < RADIUS * LEAVING
    angle = np.where(on_wall, s / RADIUS, LEAVING + (s - RADIUS * LEAVING) / FREE_RADIUS)
    radius = np.where(on_wall, RADIUS, FREE_RADIUS)
    centre = (RADIUS - radius)[:, None] * [np.sin(LEAVING), -np.cos(LEAVING)]
    place = centre + radius[:, None] * np.c_[np.sin(angle), -np.cos(angle)]
    return place, angle


def rod(stiffness: float, second_form: bool) -> Any:
    """Sheet in the penalised cylinder as an extensible rod on 0 <= s <= HALF, symmetric at 0.

    ``stiffness`` is eta_1 [kPa], ``second_form`` as in ``half_plane_reference.elasticas``.
    Returns SciPy's solution; ``sol(s)`` holds x, z, theta, moment and the two forces per width.

    Raises
    ------
    RuntimeError
        When ``solve_bvp`` does not converge.
    """
    s = np.linspace(0.0, HALF, 400)
    place, theta = membrane(s)
    tension = PRESSURE * FREE_RADIUS
    start_force = tension * np.vstack([np.cos(theta), np.sin(theta)])
    # in touch with the wall from the start: else nothing holds the rod's height
    place[:, 1] -= WIDTH / 2 * PRESSURE / stiffness
    y = np.vstack([place.T, theta, 0 * s, start_force])

    def slope(_s: Floats, y: Floats) -> Floats:
        x, z, theta, moment, along, up = y
        cosine, sine = np.cos(theta), np.sin(theta)
        share = moment**2 / RIGIDITY if second_form else 0.0
        # as in half_plane_reference.elasticas
        stretch = 1 + (along * cosine + up * sine - share) / (AXIAL - 3 * share)
        bend = moment / RIGIDITY / (stretch**2 if second_form else 1.0)
        r = np.hypot(x, z)
        push = stiffness * np.maximum(2 * (r - RADIUS) / WIDTH, 0.0) / r
        outward = PRESSURE * stretch
        return np.vstack(
            [
                stretch * cosine,
                stretch * sine,
                bend,
                stretch * (along * sine - up * cosine),
                push * x - outward * sine,
                push * z + outward * cosine,
            ]
        )

    def ends(a: Floats, b: Floats) -> Floats:
        return np.r_[a[0], a[2], a[5], b[0] - ROLLER, b[3], b[5]]

    answer = solve_bvp(slope, ends, s, y, tol=1e-6, max_nodes=50000)
    if not answer.success:
        raise RuntimeError(f"rod at eta_1 = {stiffness:g} kPa: {answer.message}")
    return answer


def _bottom(points: Floats) -> NDArray[np.bool_]:
    return points[:, 0] < 1e-9


@dataclass(frozen=True)
class Sheet:
    """Half of the sheet in its wall; ``s`` (n,) are the nodes' arc lengths from the middle [mm]."""

    problem: Problem
    wall: SignedDistancePenalty
    s: Floats

    @classmethod
    def of(
        cls,
        degree: int,
        columns: int,
        stiffness: float = STIFFNESS,
        field: SignedDistance = CYLINDER,
        material: tuple[float, float] = (YOUNG, THICKNESS),
    ) -> Sheet:
        """Start from the membrane's shape and solve; ``columns`` square cells."""
        width = HALF / columns
        scale = PRESSURE * ROLLER * width
        mesh = strip(columns, 1, HALF, width)
        young, thickness = material
        problem = start(mesh, degree, scale, young_modulus=young, thickness=thickness)
        problem.model.pressure = PRESSURE
        nodes = problem.model.node_points
        s = nodes[:, 0]
        problem.state[problem.model.position_dofs[:, [0, 2]]] = membrane(s)[0]
        problem.state = start_directors(problem.model, problem.state)
        directors = problem.model.directors
        bottom = problem.edges(_bottom) if degree == 1 else problem.nodes(_bottom)
        directors[bottom] = [0.0, 0.0, 1.0]  # symmetry
        problem.model.set_directors(directors)
        problem.clamp(_bottom)
        problem.hold(lambda points: np.full(len(points), True), (1,))
        problem.hold(lambda points: _bottom(points) | (points[:, 0] > HALF - 1e-9), (0,))
        clearance = np.full(len(nodes), -WIDTH / 2)
        wall = SignedDistancePenalty(field, problem.model.node_areas, stiffness, WIDTH, clearance)
        problem.system.terms.append(wall)
        sheet = cls(problem, wall, s)
        problem.solve(1e-9)
        return sheet

    @property
    def shape(self) -> Floats:
        """(n, 2) x and height [mm]."""
        return self.problem.positions[:, [0, 2]]

    @property
    def penetration(self) -> Floats:
        """(n,) depth behind the wall [mm], negative in front of it."""
        return -self.wall.evaluate(self.problem.positions)[0]

    @property
    def lift(self) -> float:
        """Sum of the vertical penalty forces over P x distance of roller and middle x width."""
        force = -self.wall.gradient(self.problem.positions)[:, 2].sum()
        return float(force / self.problem.system.load_scale())

    @property
    def mean_pressure(self) -> float:
        """Contact pressure per reference area, mean over s < ``MIDDLE`` [kPa]."""
        near = self.s < MIDDLE
        pressure = self.wall.stiffness * self.wall.ramp(self.problem.positions)
        return float(np.average(pressure[near], weights=self.wall.node_areas[near]))

    def newton_order(self) -> float:
        """Order log(r_3/r_2) / log(r_2/r_1) of the last three residuals of a plain Newton
        iteration, which starts from the equilibrium under 8/9 of the pressure."""
        model, system = self.problem.model, self.problem.system
        state, free, norms = self.problem.state.copy(), system.free, [np.inf]
        model.pressure = 9 / 8 * PRESSURE
        while norms[-1] > 1e-8 and len(norms) < 12:
            residual = system.residual(state)[free]
            norms.append(float(np.linalg.norm(residual) / system.load_scale()))
            state[free] -= spsolve(system.tangent(state)[free][:, free].tocsc(), residual)
        model.pressure = PRESSURE
        last, previous = np.diff(np.log(norms[-3:]))[::-1]
        return float(last / previous)


def _mean_pressure_of_rod(answer: Any, stiffness: float) -> float:
    s = np.linspace(0.0, MIDDLE, 2001)
    depth = np.hypot(*answer.sol(s)[:2]) - RADIUS
    return float(np.mean(stiffness * np.maximum(2 * depth / WIDTH, 0.0)))


def shape_error(sheet: Sheet, answer: Any) -> float:
    """Largest distance of a node from the rod, over R."""
    return float(np.abs(sheet.shape - answer.sol(sheet.s)[:2].T).max() / RADIUS)


def sampled_shifts(degree: int, columns: int, fields: Sequence[SignedDistance]) -> Floats:
    """Largest difference of the nodes [mm] between the analytic cylinder and each sampled one."""
    place = Sheet.of(degree, columns).shape
    return np.array(
        [np.abs(Sheet.of(degree, columns, field=f).shape - place).max() for f in fields]
    )


def _sampled(distance: Distance, width: float, step: float) -> SampledDistance:
    return SampledDistance.through(distance, RADIUS + 1, width, step)


def _exact(points: Floats) -> Floats:
    return CYLINDER.evaluate(points)[0]


def _mesh_rows(degree: int, columns: int) -> list[Row]:
    """Place, balance, pressure and Newton's order on one mesh."""
    name = f"eta_1 = {STIFFNESS:g} kPa, degree {degree}, {2 * columns} triangles"
    sheet, answer = Sheet.of(degree, columns), rod(STIFFNESS, degree > 1)
    pressure, source = _mean_pressure_of_rod(answer, STIFFNESS), "rod, solve_bvp"
    mean = sheet.mean_pressure
    label = f"mean contact pressure, s < {MIDDLE:g} mm [kPa]"
    limit = PRESSURE * (1 - FREE_RADIUS / RADIUS)
    return [
        Row(TITLE, name, "nodes / R", shape_error(sheet, answer), 0.0, 2e-4, source, True),
        Row(TITLE, name, "penalty forces / (P x roller distance)", sheet.lift, 1.0, 1e-8, BALANCE),
        Row(TITLE, name, label, mean, pressure, 1e-3, source),
        Row(TITLE, name, label, mean, limit, 0.015, "thin membrane, P - T/R"),
    ]


def _stiffness_rows(degree: int, columns: int) -> list[Row]:
    """Penetration falls like 1/eta_1."""
    name = f"degree {degree}, {2 * columns} triangles, eta_1 = 256 and 4096 kPa"
    sheets = [Sheet.of(degree, columns, stiffness) for stiffness in (256.0, 4096.0)]
    depth = [sheet.mean_pressure / sheet.wall.stiffness for sheet in sheets]
    order = np.log(depth[1] / depth[0]) / np.log(16.0)
    return [Row(TITLE, name, "order of penetration in eta_1", order, -1, 0.005, "penalty method")]


def _newton_rows(name: str, degree: int, columns: int, field: SignedDistance) -> list[Row]:
    """Newton's order with a ten times softer sheet, whose residuals have more digits."""
    order = Sheet.of(degree, columns, field=field, material=SOFT).newton_order()
    name = f"{name}, {2 * columns} triangles, E = 10 MPa, H = 0.5 mm"
    label = "Newton's order, at most 2 counted"
    return [Row(TITLE, name, label, min(order, 2.0), 2.0, 0.2, "Newton", True)]


def _sampled_rows(degree: int, columns: int) -> list[Row]:
    """The sampled distance against the analytic one."""
    name, width = f"sampled, degree {degree}, {2 * columns} triangles", HALF / columns
    steps = [_sampled(_exact, width, step) for step in (2.0, 1.0)]
    facets = [
        _sampled(lambda points, n=n: distance_to_facets(RADIUS, n, points), width, 1.0)
        for n in (60, 240)
    ]
    shifts = sampled_shifts(degree, columns, [*steps, *facets])
    order = np.log2(shifts[0] / shifts[1])
    facet_order = np.log(shifts[2] / shifts[3]) / np.log(4.0)
    spline, flat = "cubic splines", "chords of a circle"
    result = [
        Row(TITLE, name, "order in the grid's step", order, 4.0, 0.5, spline, True),
        Row(TITLE, name, "shift of the nodes, step 1 mm [mm]", shifts[1], 0.0, 1e-5, spline, True),
        Row(TITLE, name, "order in the facets' length", facet_order, 2.0, 0.2, flat, True),
    ]
    return result + _newton_rows(f"sampled, degree {degree}", degree, columns, steps[1])


def rows(full: bool) -> list[Row]:
    """Rows of the verification table; ``full``: finer meshes and degree 3."""
    meshes = [(1, 128), (2, 64), (3, 32)] if full else [(1, 64), (2, 32)]
    result = [row for mesh in meshes for row in _mesh_rows(*mesh)]
    for degree, columns in [(1, 64), (2, 32)] if full else [(1, 64)]:
        result += _newton_rows(f"degree {degree}", degree, columns, CYLINDER)
        result += _stiffness_rows(degree, columns) + _sampled_rows(degree, columns)
    return result


def draw(axes: Any) -> None:
    """Sheet in the cylinder: nodes over the rod of the reference, both halves."""
    sheet, s = Sheet.of(1, 64), np.linspace(0.0, HALF, 400)
    angle = np.linspace(0.0, 2 * np.pi, 200)
    wall = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
    axes.plot(*wall, color="0.7", lw=3, label="wall")
    x, z = rod(STIFFNESS, False).sol(s)[:2]
    nodes = sheet.shape[np.argsort(sheet.s)[::4]].T
    for side in (-1, 1):
        axes.plot(side * x, z, color="C0", lw=1, label="rod" if side > 0 else None)
        axes.plot(
            side * nodes[0], nodes[1], "o", color="C1", ms=3, label="nodes" if side > 0 else None
        )
    axes.plot([-ROLLER, ROLLER], [z[-1]] * 2, "k^", ms=6, label="rollers")
    axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal")
    axes.set_title("A sheet pressed into a cylinder")
    axes.legend(fontsize="small", loc="upper center")
