"""One cusp by the stages of the literature, with nothing that guards the Newton iteration.

Full steps but for a cap of R/10 on every node (and of one radian on the angle of an edge); no line
search, no convexity shift, no barrier, no collision filter, no coarser mesh. What steadies it is
what the paper's authors' public program has: every level is solved three times with a viscous force
towards the state before, strong, then 1e-2, then 1e-4 of it, and contact is brought in by 14 levels
of its penalty. What a level leaves is taken, converged or not. Energies and penalties are those of
``CuspSetup``, so the same as our solver's. Lengths mm, stresses kPa, forces mN.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from dataclasses import field as dataclass_field

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.proximal import ProximalTerm
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.directors import clamp_rotation, renew_directors, start_directors
from avneo_fem.equilibrium.factorization import Factorization, FactorizationError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.results.crossings import self_intersections
from avneo_fem.scene import parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup

__all__ = ["PlainCusp", "PlainLevel", "suture_plainly"]

Floats = NDArray[np.float64]

#: of the viscous force: in units of E H / R^2, and what follows as shares of it. With less,
#: the jump of the edge to its line is not survived; the last is what our solver begins with
_STRONG, _SHARES = 1.5e4, (1.0, 1e-2, 1e-4)
_CONTACT_LEVELS = 14  # each twice the one before
_CLAMP_LEVELS, _CLAMP_GROWTH = 5, 4.0
_WALL_LEVELS, _WALL_GROWTH = 4, 4.0
_ITERATIONS = 50  # of one solve, Table 1
_TOLERANCE = 1e-5  # of one solve, residual over the pressure load
#: as in the last level of our solver: an equilibrium
_EQUILIBRIUM = 1e-8


@dataclass(frozen=True)
class PlainLevel:
    """How a level ended: its iterations, the undamped residual over the pressure load, and the
    pairs of triangles that meet."""

    name: str
    parameter: float
    iterations: int
    residual: float
    crossings: int


@dataclass
class PlainCusp:
    """Where the cusp came to.

    ``converged`` is that of a last solve without damping; ``failure`` says where the iteration
    broke down (numbers that are none), None when it went through all levels.
    """

    mesh: CuspMesh
    points: Floats
    levels: list[PlainLevel] = dataclass_field(default_factory=list)
    converged: bool = False
    failure: str | None = None
    seconds: float = 0.0

    @property
    def iterations(self) -> int:
        """Newton iterations of all levels."""
        return sum(level.iterations for level in self.levels)

    @property
    def residual(self) -> float:
        """Residual of the last level, nan before the first."""
        return self.levels[-1].residual if self.levels else float("nan")


class _BrokenDown(ArithmeticError):
    """The iteration met a singular matrix or numbers that are none."""


class _PlainSolver:
    """Newton's method on one system."""

    def __init__(self, setup: CuspSetup, damped: bool) -> None:
        self.setup, self.model, self.shares = setup, setup.model, _SHARES if damped else (0.0,)
        self.system = CuspSystem(setup.model, None)
        self.system.fix(setup.model.position_dofs[setup.mesh.suture_line])
        self.factorization = Factorization(symmetric=False)
        radius = setup.geometry.commissures.circumradius
        self.largest_move = radius / 10
        self.unit = setup.scene.material.young_modulus * setup.cusp.thickness / radius**2

    def _capped(self, step: Floats) -> Floats:
        """The step, every node's move cut to R/10 and every angle's to 1."""
        step[self.model.angle_dofs] = np.clip(step[self.model.angle_dofs], -1.0, 1.0)
        moves = step[self.model.position_dofs]
        length = np.linalg.norm(moves, axis=1, keepdims=True)
        share = np.minimum(1.0, self.largest_move / np.maximum(length, 1e-300))
        step[self.model.position_dofs] = share * moves
        return step

    def _solve(self, state: Floats, damping: float, tolerance: float) -> tuple[Floats, int]:
        """At most 50 iterations with a viscous force towards ``state``."""
        system, free = self.system, self.system.free
        extra = [ProximalTerm(system.positions(state), self.model.node_areas, damping * self.unit)]
        for iteration in range(_ITERATIONS):
            state = renew_directors(self.model, state)
            force = system.residual(state, extra)[free]
            if not np.isfinite(force).all():
                raise _BrokenDown("the residual is not a number")
            if np.linalg.norm(force) <= tolerance * system.load_scale():
                return state, iteration
            tangent = system.tangent(state, extra)[free][:, free].tocsr()
            if not np.isfinite(tangent.data).all():
                raise _BrokenDown("the tangent is not a number")
            step = np.zeros(self.model.size)
            try:
                self.factorization.factorize(tangent)
                step[free] = -self.factorization.solve(force)
            except FactorizationError as error:
                raise _BrokenDown(str(error)) from None
            if not np.isfinite(step).all():
                raise _BrokenDown("the tangent is singular")
            state = state + self._capped(step)
        return state, _ITERATIONS

    def level(self, cusp: PlainCusp, state: Floats, name: str, parameter: float) -> Floats:
        """One level: damped ever less, or not at all; the last level is never damped."""
        used, last = 0, name == "equilibrium"
        self.setup.clamp.renew(self.system.positions(state))
        for share in (0.0,) if last else self.shares:
            tolerance = _EQUILIBRIUM if last else _TOLERANCE
            state, iterations = self._solve(state, _STRONG * share, tolerance)
            used += iterations
        residual = self.system.relative_residual(renew_directors(self.model, state))
        cusp.points = self.system.positions(state)
        crossings = self_intersections(cusp.points, cusp.mesh.triangles)
        cusp.levels.append(PlainLevel(name, parameter, used, residual, crossings))
        return state


def _membrane(given: ValveInput, index: int, mesh: CuspMesh) -> CuspSetup:
    """The cusp without bending, its template placed as in section 3.2, step 1."""
    data = given.scene.model_dump(mode="json", exclude_none=True)
    data["material"]["bending"] = False
    return CuspSetup(parse_scene(data), given.geometry, given.wedges, index, mesh)


def _clamped(setup: CuspSetup, solver: _PlainSolver, points: Floats) -> Floats:
    """State with the directors of the sutured edge in their half-plane, and held there."""
    model = setup.model
    state = np.zeros(model.size)
    state[model.position_dofs] = points
    state = start_directors(model, state)
    edges = model.angle_dofs[setup.mesh.suture_edges]
    state[edges] += clamp_rotation(model, state, setup.conormal)
    solver.system.fix(edges)
    setup.clamp.active[:] = True
    return state


def _stages(cusp: PlainCusp, given: ValveInput, index: int, damped: bool) -> None:
    """Sections 3.2 and 3.4 of the paper, one level after the other."""
    first = _membrane(given, index, cusp.mesh)
    solver = _PlainSolver(first, damped)
    state = np.zeros(first.model.size)
    state[first.model.position_dofs] = first.start
    state[first.model.position_dofs[cusp.mesh.suture_line]] = first.target
    solver.level(cusp, state, "membrane", 1.0)

    setup = CuspSetup(given.scene, given.geometry, given.wedges, index, cusp.mesh, cusp.points)
    solver = _PlainSolver(setup, damped)
    state = _clamped(setup, solver, cusp.points)
    terms = solver.system.terms
    terms.append(setup.clamp)
    for number in reversed(range(_CLAMP_LEVELS if damped else 1)):
        setup.clamp.stiffness = given.scene.clamp.stiffness / _CLAMP_GROWTH**number
        state = solver.level(cusp, state, "shell", setup.clamp.stiffness)

    contact, lambdas = setup.wedge.stiffness, given.wedges.levels(given.scene.contact.steps)
    terms.append(setup.wedge)
    setup.wedge.field = given.wedges.wedge(index, lambdas[0])
    for number in reversed(range(_CONTACT_LEVELS if damped else 1)):
        setup.wedge.stiffness = contact / 2.0**number
        state = solver.level(cusp, state, "contact penalty", setup.wedge.stiffness)
    for lam in lambdas[1:]:
        setup.wedge.field = given.wedges.wedge(index, lam)
        state = solver.level(cusp, state, "contact wedge", lam)

    terms.append(setup.wall)
    for number in range(_WALL_LEVELS):
        setup.wall.stiffness = given.scene.wall.stiffness * _WALL_GROWTH**number
        state = solver.level(cusp, state, "wall", setup.wall.stiffness)
        if not setup.wall.shortfall(cusp.points).any():
            break
    solver.level(cusp, state, "equilibrium", setup.wall.stiffness)
    cusp.converged = cusp.residual <= _EQUILIBRIUM


def suture_plainly(given: ValveInput, index: int, mesh: CuspMesh, damped: bool = True) -> PlainCusp:
    """Take one cusp through all levels, or as far as they go.

    Parameters
    ----------
    given : ValveInput
    index : int
        Which cusp.
    mesh : CuspMesh
        Its triangulated template; there is no coarser one.
    damped : bool
        Without, there is neither viscous force nor a ramp of the penalties of contact and clamp.
    """
    clock = time.perf_counter()
    cusp = PlainCusp(mesh, np.c_[mesh.points, np.zeros(len(mesh.points))])
    with np.errstate(all="ignore"):  # numbers that are none are looked for, and told
        try:
            _stages(cusp, given, index, damped)
        except _BrokenDown as error:
            last = cusp.levels[-1].name if cusp.levels else "placement"
            cusp.failure = f"broke down after the level {last!r}: {error}"
    cusp.seconds = time.perf_counter() - clock
    return cusp
