"""The clamped tangent half-plane of the sutured edge (paper section 3.1, (3.1)).

A cusp leaves its suture line in a prescribed half-plane: the director of the sutured edge is held.
Here the suture line is straight, one short edge of a strip (length 8 mm, H = 0.05 mm, E = 1 MPa,
nu = 0, D = E H^3/12 per width), and the half-plane is turned step by step from the plane of the
strip by theta_0 = 10 ... 170 degrees, almost folded onto itself. Problems with an independent
answer:

``free``     nothing else acts: the strip turns as a rigid body, all of it at theta_0.
``tension``  a dead traction T = D/l^2, l = 1 mm, pulls the far edge along the flat strip, which
             leaves at theta_0 and turns into the direction of T within the boundary layer l:
             tan(theta/4) = tan(theta_0/4) exp(-s/l), clamp moment 2 sqrt(D T) sin(theta_0/2).
``loop``     the far edge is hinged and held half a length away from the suture: an elastica,
             solved as a two-point boundary value problem (SciPy).
``inflated`` the same, blown up by the pressure p = -D/mm^3, whose tension |p| x radius makes a
             boundary layer again.

Compared are the angle of the surface itself at the sutured edge (to 0.1 degree), the clamp moment
(the reaction to the held directors, to 1 per mille) and the place of every node (to 5e-4 of the
length). The side of the fold is kept: the strip stays above the plane at every angle, returns to
the same state after a random displacement of a per cent of its length, and the mirrored problem
gives the mirror image. Last, on triangles twice as large as the layer the director alone says
little about them; ``ClampPenalty`` of stiffness k leaves them an angle that falls like 1/k.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from avneo_fem.constraints.clamp_penalty import ClampPenalty
from avneo_fem.equilibrium.directors import turn_directors
from half_plane_reference import arc, elasticas, separatrix
from meshes import strip
from record import Row
from solving import Problem, start

__all__ = ["Fold", "draw", "errors", "penalty_angles", "rows"]

Floats = NDArray[np.float64]

YOUNG, THICKNESS, LENGTH, LAYER = 1000.0, 0.05, 8.0, 1.0
RIGIDITY = YOUNG * THICKNESS**3 / 12
TENSION = RIGIDITY / LAYER**2
INFLATION = -RIGIDITY
#: half the opening of the arc of the strip's length whose chord is half of it
OPENING = float(brentq(lambda b: np.sin(b) / b - 0.5, 1.0, 3.0))
SOURCE = {
    "free": "rigid rotation",
    "tension": "pendulum separatrix",
    "loop": "elastica, solve_bvp",
    "inflated": "elastica under pressure, solve_bvp",
}


def _sutured(points: Floats) -> NDArray[np.bool_]:
    return points[:, 0] < 1e-9


def _far(points: Floats) -> NDArray[np.bool_]:
    return points[:, 0] > LENGTH - 1e-9


@dataclass
class Fold:
    """A strip of square cells, sutured at x = 0; ``side`` is -1 for the mirrored problem.

    ``angle`` [rad] is that of the prescribed half-plane from the flat strip, counted upwards.
    """

    case: str
    problem: Problem
    angle: float = 0.0
    side: float = 1.0

    @classmethod
    def of(cls, case: str, degree: int, columns: int, side: float = 1.0) -> Fold:
        """The strip of one of the module's problems, ready to be turned."""
        width = LENGTH / columns
        mesh, scale = strip(columns, 1, LENGTH, width), TENSION * width
        problem = start(mesh, degree, scale, young_modulus=YOUNG, thickness=THICKNESS)
        problem.hold(_sutured)
        problem.clamp(_sutured)
        fold = cls(case, problem, side=side)
        if case == "tension":
            problem.system.dead_load = problem.edge_load(_far, np.array([TENSION, 0.0, 0.0]))
        elif case != "free":
            problem.hold(_far, (0, 2))
            # a ribbon as narrow as this could twist
            problem.hold(lambda points: np.full(len(points), True), (1,))
            fold._buckle()
        if case == "inflated":
            problem.system.force_scale = abs(INFLATION) * LENGTH * width
            for share in (0.05, 0.2, 0.5, 1.0):
                problem.model.pressure = side * share * INFLATION
                problem.solve()
        return fold

    def turn_to(self, angle: float) -> None:
        """Turn the half-plane to ``angle`` [rad] and solve."""
        problem, mesh = self.problem, self.problem.model.mesh
        edges = problem.edges(_sutured)
        # turning about +y brings the strip down; edges are stored from smaller to larger node
        sense = np.sign(np.diff(mesh.points[mesh.edges[edges]], axis=1)[:, 0, 1])
        turn = -self.side * (angle - self.angle) * sense
        problem.state = turn_directors(problem.model, problem.state, edges, turn)
        self.angle = angle
        problem.solve()

    def _buckle(self, steps: int = 8) -> None:
        """Bring the ends together; the change from arc to arc is the guess of every step."""
        dofs, before = self.problem.model.position_dofs, np.c_[self.s, 0 * self.s]
        for half in OPENING * np.arange(1, steps + 1) / steps:
            after = arc(self.s, LENGTH, half)
            self.problem.state[dofs[:, [0, 2]]] += (after - before) * [1.0, self.side]
            before = after
            self.turn_to(float(half))

    @property
    def s(self) -> Floats:
        """(n,) arc lengths of the nodes in the flat strip [mm]."""
        return self.problem.model.node_points[:, 0]

    @property
    def shape(self) -> Floats:
        """(n, 2) x and height of the nodes on the fold's side [mm]."""
        return self.problem.positions[:, [0, 2]] * [1.0, self.side]

    @property
    def surface_angle(self) -> float:
        """Angle of the surface at the sutured edge [rad]: of its tangent there, for degree 1
        that of the first three rows of triangles extrapolated quadratically."""
        degree, s = self.problem.model.parameters.degree, np.round(self.s, 9)
        lines = np.unique(s)[: max(degree, 3) + 1]
        mean = np.array([self.shape[s == line].mean(axis=0) for line in lines])
        if degree == 1:
            x, z = np.diff(mean, axis=0).T
            return float(np.unwrap(np.arctan2(z, x)) @ [15, -10, 3] / 8)
        lines, mean = lines[: degree + 1], mean[: degree + 1]
        tangent = np.linalg.solve(np.vander(lines, increasing=True), mean)[1]
        return float(np.arctan2(tangent[1], tangent[0]))

    @property
    def moment(self) -> float:
        """Reaction to the held directors per width of the suture [mN], positive against theta."""
        problem, mesh = self.problem, self.problem.model.mesh
        edges = problem.edges(_sutured)
        width = np.diff(mesh.points[mesh.edges[edges]], axis=1)[:, 0, 1]
        unit = turn_directors(
            problem.model, np.zeros(problem.model.size), edges, -self.side * np.sign(width)
        )
        return float(problem.system.residual(problem.state) @ unit / np.abs(width).sum())

    def shaken(self, seed: int = 0) -> float:
        """Largest change [mm] after a random displacement of all free nodes by up to a per cent
        of the length (five waves along the strip) and a new solve."""
        problem, dofs = self.problem, self.problem.model.position_dofs
        before = problem.positions.copy()
        waves = np.sin(np.pi * np.outer(self.s / LENGTH, np.arange(0.5, 5.5)))
        random = waves @ np.random.default_rng(seed).uniform(-1, 1, (waves.shape[1], 3))
        random *= 0.01 * LENGTH / np.abs(random).max()
        problem.state[dofs] += np.where(problem.system.fixed[dofs], 0.0, random)
        problem.solve()
        return float(np.abs(problem.positions - before).max())


def _references(case: str, angles: Floats, degree: int) -> list[tuple[Callable[..., Any], float]]:
    """Shape as a function of s, and clamp moment, for each angle."""
    if case == "free":
        return [(lambda s, t=t: np.outer(s, [np.cos(t), np.sin(t)]), 0.0) for t in angles]
    if case == "tension":
        moment = 2 * RIGIDITY / LAYER * np.sin(angles / 2)
        return [
            (lambda s, t=t: separatrix(s, t, LAYER), m) for t, m in zip(angles, moment, strict=True)
        ]
    pressure = INFLATION if case == "inflated" else 0.0
    loops = elasticas(
        angles, OPENING, LENGTH, YOUNG * THICKNESS, RIGIDITY, pressure, second_form=degree > 1
    )
    return [(loop.shape, loop.moment) for loop in loops]


def errors(fold: Fold, angles: Floats) -> Floats:
    """(len(angles), 4) for each prescribed angle [rad] in turn: error of the surface's angle
    [degrees], of the clamp moment relative to the largest, of the nodes over the length, and the
    lowest height of the nodes between the ends over the length."""
    degree = fold.problem.model.parameters.degree
    references = _references(fold.case, angles, degree)
    largest = max(abs(moment) for _, moment in references) or RIGIDITY / LENGTH
    result = []
    for angle, (shape, moment) in zip(angles, references, strict=True):
        fold.turn_to(float(angle))
        place = np.abs(fold.shape - shape(fold.s)).max() / LENGTH
        off = np.degrees(abs(fold.surface_angle - angle))
        inside = ~(_sutured(fold.problem.model.node_points) | _far(fold.problem.model.node_points))
        lowest = fold.shape[inside, 1].min() / LENGTH
        result.append([off, abs(fold.moment - moment) / largest, place, lowest])
    return np.array(result)


def penalty_angles(stiffness: Floats) -> Floats:
    """Angle [rad] that ``ClampPenalty`` of each stiffness k [mN] leaves the first triangles of a
    coarse strip (h = 2 l, degree 1) under tension, clamped at 90 degrees."""
    fold = Fold.of("tension", 1, 4)
    problem, mesh = fold.problem, fold.problem.model.mesh
    edge = problem.edges(_sutured)
    ends, triangle = np.sort(mesh.edges[edge][0])[::-1], mesh.triangles[mesh.edge_cells[edge, 0][0]]
    apex = triangle[~np.isin(triangle, ends)]
    conormal = np.array([[0.0, 0.0, -1.0]])  # the strip leaves along -b, upwards
    width = np.array([LENGTH / 4])
    clamp = ClampPenalty(
        len(mesh.points), apex, problem.positions[ends][None], conormal, width, 0.0
    )
    problem.system.terms.append(clamp)
    fold.turn_to(np.pi / 2)
    result = []
    for clamp.stiffness in stiffness:
        clamp.renew(problem.positions)
        problem.solve()
        result.append(abs(clamp.angles(problem.positions)[0]))
    return np.array(result)


def _row(case: str, quantity: str, value: float, tolerance: float, source: str) -> Row:
    return Row("half-plane", case, quantity, float(value), 0.0, tolerance, source, absolute=True)


def _case_rows(case: str, degree: int, columns: int, angles: Floats) -> list[Row]:
    """Errors of one problem on one mesh, largest over all angles."""
    fold, name = Fold.of(case, degree, columns), f"{case}, degree {degree}, {2 * columns} triangles"
    most = np.abs(found := errors(fold, np.radians(angles)))[:, :3].max(axis=0)
    rigid, upto = case == "free", f"theta_0 <= {max(angles):.0f} deg"
    limits = (1e-6, 1e-8, 1e-8) if rigid else (0.1, 1e-3, 5e-4)
    names = ("surface angle at the suture [deg]", "clamp moment / largest", "nodes / length")
    rows = [
        _row(name, f"{quantity}, {upto}", value, limit, SOURCE[case])
        for quantity, value, limit in zip(names, most, limits, strict=True)
    ]
    below = (found[:, 3] <= 0).sum()
    rows.append(_row(name, "angles at which it left its side", below, 0.0, "no snap-through"))
    rows.append(_row(name, "change after 1 % noise [mm]", fold.shaken(), 1e-6, "no snap-through"))
    mirror = Fold.of(case, degree, columns, side=-1.0)
    for angle in np.radians(angles):
        mirror.turn_to(float(angle))
    off = np.abs(mirror.shape - fold.shape).max()
    rows.append(_row(name, "mirror image at -theta_0 [mm]", off, 1e-6, "symmetry"))
    return rows


def rows(full: bool) -> list[Row]:
    """Rows of the verification table; ``full``: every 10 degrees, pressure, degree 3."""
    if full:
        angles = np.arange(10.0, 171.0, 10.0)
        there_and_back = np.r_[angles[angles > 100], angles[-2::-1]]
        cases = [("free", k, n, angles) for k, n in ((1, 8), (2, 4), (3, 2))]
        cases += [("tension", k, n, angles) for k, n in ((1, 128), (2, 64), (3, 32))]
        cases += [("loop", k, n, there_and_back) for k, n in ((1, 96), (2, 48), (3, 24))]
        cases += [("inflated", k, n, there_and_back) for k, n in ((1, 192), (2, 96), (3, 32))]
    else:
        angles = np.array([50.0, 90.0, 130.0, 170.0])
        cases = [("free", 1, 4, angles), ("tension", 1, 128, angles), ("tension", 2, 64, angles)]
        cases += [("loop", 1, 80, np.array([130.0, 170.0, 110.0, 60.0]))]
    result = [row for case in cases for row in _case_rows(*case)]
    stiffness = RIGIDITY / LAYER * np.array([1e3, 1e4])
    order = np.diff(np.log(penalty_angles(stiffness)))[0] / np.log(10.0)
    name, source = "coarse (h = 2 l), degree 1, ClampPenalty", "penalty method"
    return [
        *result,
        Row("half-plane", name, "order in k of the angle left", order, -1, 0.01, source),
    ]


def draw(axes: Any) -> None:
    """Strip under tension, clamped at 30, 90 and 170 degrees: nodes over the closed form."""
    fold, s = Fold.of("tension", 1, 64), np.linspace(0.0, LENGTH, 400)
    for degrees in (30.0, 60.0, 90.0, 130.0, 170.0):
        fold.turn_to(np.radians(degrees))
        (line,) = axes.plot(*separatrix(s, fold.angle, LAYER).T, lw=1)
        marks = np.argsort(fold.s)[::4]
        axes.plot(*fold.shape[marks].T, "o", ms=3, color=line.get_color(), label=f"{degrees:.0f}°")
    axes.set(xlabel="x [mm]", ylabel="height [mm]", aspect="equal")
    axes.set_title("Clamped at an angle, pulled to the right")
    axes.legend(fontsize="small", ncols=5, loc="upper center", bbox_to_anchor=(0.5, -0.35))
