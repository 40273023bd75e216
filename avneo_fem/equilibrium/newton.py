"""PETSc SNES line-search Newton that never leaves the intersection-free set.

SNES does the Newton work: its line search (``bt``) backtracks on the merit of ``CuspSystem``. The
linear solver handed to SNES returns the Newton direction already (a) shifted by mu S_n until it
descends, and (b) shortened to the largest step that moves no node too far and meets no
collision, so that every trial state of the line search is free of crossings too.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.compat import PETSc
from avneo_fem.constraints.term import Foreseen, Term
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.factorization import Factorization, FactorizationError

__all__ = ["NewtonSettings", "NewtonSolver", "Verdict"]

Floats = NDArray[np.float64]

#: times at most that a direction is corrected for penalties it switches on or off
_FORESIGHT = 2
#: a step is short below this share of what was asked; bt often takes exactly 1/2 or 1/4, which
#: rounding must not decide on
_SHORT = 0.4

_REASONS = {
    2: "converged: residual below tolerance",
    -5: "iteration limit reached",
    -6: "line search found no decrease",
    -3: "linear solver failed",
    -4: "residual is not a number",
}


@dataclass(frozen=True)
class Verdict:
    """How a solve ended.

    ``residual`` is the norm of the residual of the problem that was solved (its damping
    included) over the pressure load.
    """

    converged: bool
    reason: str
    iterations: int
    residual: float
    seconds: float


@dataclass(frozen=True)
class NewtonSettings:
    """Limits of the Newton iteration.

    ``largest_move`` [mm] bounds the displacement of a node in one iteration, ``safety`` the
    share of the way to the first collision that is taken.
    """

    maximum_iterations: int = 60
    largest_move: float = 1.0
    safety: float = 0.9
    first_shift: float = 0.1
    largest_shift: float = 1e8
    exact_below: float = 1e-3


class NewtonSolver:
    """Solves ``CuspSystem`` for its free unknowns."""

    def __init__(self, system: CuspSystem, settings: NewtonSettings) -> None:
        self.system, self.settings = system, settings
        self.symmetric = Factorization(symmetric=True)
        self.general = Factorization(symmetric=False)
        # of its own, as its patterns differ: that of the tangent need not be analysed again
        self.ahead = Factorization(symmetric=True)
        self.iterations, self.hindered = 0, 0
        self.forget()
        self._base: Floats = np.empty(0)
        self._asked = self._share = 0.0

    def forget(self) -> None:
        """Begin the next solve without the shift that the last ones needed."""
        self._shift, self._hold, self._convex = 0.0, 0, False

    # -- pieces SNES calls ---------------------------------------------------------------------
    def _full(self, reduced: Any) -> Floats:
        state = self._start.copy()
        state[self._free] = reduced.array_r
        return state

    def _residual(self, _snes: Any, x: Any, f: Any) -> None:
        f.array[:] = self.system.residual(self._full(x), self._extra)[self._free]

    def _objective(self, _snes: Any, x: Any) -> float:
        state = self._full(x)
        with np.errstate(all="ignore"):
            change = self.system.merit_change(state, self._base, self._base_energy, self._extra)
        if not np.isfinite(change):
            return 1e300
        way = state - self._base
        if abs(change) < 1e-10 * self._energy_scale:
            # lost in the rounding of large energies: the work of the residual is not
            force = self.system.residual(state, self._extra) + self._base_residual
            return float(0.5 * np.dot(force[self._free], way[self._free]))
        return change

    def _jacobian(self, _snes: Any, x: Any, _a: Any, _p: Any) -> None:
        self._note_step(x.array_r - self._base[self._free])
        self._base = self._full(x)
        self._base_energy = self.system.energy(self._base, self._extra)
        self._energy_scale = max(abs(self._base_energy), self.system.energy_scale())
        self._base_residual = self.system.residual(self._base, self._extra)
        tangent = self.system.tangent(self._base, self._extra)
        self._tangent = tangent[self._free][:, self._free].tocsr()

    def _converged(self, snes: Any, iteration: int, norms: tuple[float, float, float]) -> int:
        if not np.isfinite(norms[2]):
            return -4
        # PETSc's norm adds forces to moments
        force = self.system.magnitude(snes.getFunction()[0].array_r, self._free)
        return 2 if force <= self._target else 0

    # -- Newton direction --------------------------------------------------------------------
    def apply(self, _pc: Any, right: Any, left: Any) -> None:
        """PETSc's preconditioner: the shifted, shortened Newton direction."""
        force = right.array_r
        direction = self._descent(force)
        left.array[:] = direction * self._length(direction)

    def _descent(self, force: Floats) -> Floats:
        """Newton direction of a model made convex by the smallest shift of a geometric series."""
        settings = self.settings
        close = self.system.magnitude(force, self._free) < settings.exact_below * self._scale
        shift = 0.0 if close and not self._hold else self._shift
        if close and self._convex:
            # the iteration before was convex, and steps are small now: its inertia will do
            with suppress(FactorizationError):
                direction = self._unsymmetric(force)
                if np.isfinite(direction).all() and direction @ force > 0:
                    return direction
        self._convex = False
        while True:
            matrix = self._tangent if shift == 0.0 else self._tangent + sp.diags(shift * self._mass)
            try:
                with self._factorizing():
                    negative = self.symmetric.factorize(matrix)
                if negative == 0:
                    self._shift = shift
                    with self._factorizing():
                        direction = self.symmetric.solve(force)
                    # follower pressure at the free edge is not symmetric: near the end that counts
                    if shift == 0.0 and close:
                        direction = self._unsymmetric(force)
                        self._convex = True
                    if np.isfinite(direction).all() and direction @ force > 0:
                        return self._with_foresight(direction, force, matrix)
            except FactorizationError:
                pass
            self._hold = 2
            shift = max(4.0 * shift, settings.first_shift)
            if shift > settings.largest_shift:
                raise FactorizationError("no descent direction up to the largest shift")

    def _with_foresight(self, direction: Floats, force: Floats, matrix: Any) -> Floats:
        """Direction that takes into account which penalties begin or cease to act on its way."""
        known: Any = 0
        for _ in range(_FORESIGHT):
            step = np.zeros(self.system.model.size)
            step[self._free] = -direction
            found = self.system.foreseen(self._base, step)
            if found is None or (found.switched == known).all():
                break
            known = found.switched
            better = self._ahead(force, matrix, found)
            if better is None:
                break
            direction = better
        return direction

    def _ahead(self, force: Floats, matrix: Any, found: Foreseen) -> Floats | None:
        """Newton direction with what is foreseen, None when that model is not convex."""
        with suppress(FactorizationError), self._factorizing():
            if self.ahead.factorize(matrix + found.hessian[self._free][:, self._free]) == 0:
                direction = self.ahead.solve(force + found.gradient[self._free])
                if np.isfinite(direction).all() and direction @ force > 0:
                    return direction
        return None

    def _factorizing(self) -> AbstractContextManager[None]:
        return self.system.stopwatch.part("factorization")

    def _unsymmetric(self, force: Floats) -> Floats:
        with self._factorizing():
            self.general.factorize(self._tangent)
            return self.general.solve(force)

    def _length(self, direction: Floats) -> float:
        step = np.zeros(self.system.model.size)
        step[self._free] = -direction
        moves = self.system.positions(step)
        longest = float(np.linalg.norm(moves, axis=1).max())
        share = min(1.0, self.settings.largest_move / max(longest, 1e-300))
        share *= self.system.largest_share(self._base, share * moves)
        self._convex = self._convex and share == 1.0
        contact = self.system.contact
        if contact is not None:
            with self.system.stopwatch.part("collision"):
                clear = contact.step_fraction(self.system.positions(self._base), share * moves)
            if clear < 1.0:
                share *= self.settings.safety * clear
        self._asked, self._share = share * float(np.linalg.norm(direction)), share
        return share

    def _note_step(self, taken: Floats) -> None:
        """Choose the next shift: more after a step that was cut short, less after a full one."""
        if self._asked == 0.0:
            return
        share = self._share * float(np.linalg.norm(taken)) / self._asked
        self.hindered += self._shift > 0.0 or share < _SHORT
        first = self.settings.first_shift
        if share < _SHORT:
            self._shift = max(2 * self._shift, 0.5 * first)
        elif self._hold > 0:
            self._hold -= 1  # a smaller one was refused not long ago
        else:
            self._shift /= 4
        if self._shift < 0.01 * first:
            self._shift = 0.0

    # -- solve ---------------------------------------------------------------------------------
    def solve(
        self,
        state: Floats,
        tolerance: float,
        extra: Sequence[Term] = (),
        maximum_iterations: int | None = None,
    ) -> tuple[Floats, Verdict]:
        """Newton iteration from ``state`` until the residual is below ``tolerance`` x load.

        Returns
        -------
        (state, Verdict)
            The last iterate, converged or not; it is free of crossings if ``state`` is.
        """
        clock = time.perf_counter()
        system = self.system
        self._start, self._extra, self._free = state.copy(), extra, system.free
        self._scale = system.load_scale()
        self._target = tolerance * self._scale
        mass = np.zeros(system.model.size)
        mass[system.model.position_dofs] = system.model.node_areas[:, None]
        self._mass = mass[self._free]
        self._convex, self.hindered, self._asked, self._base = False, 0, 0.0, self._start
        size = len(self._free)
        x = PETSc.Vec().createSeq(size)
        x.array[:] = state[self._free]
        snes = self._make_snes(size, maximum_iterations or self.settings.maximum_iterations)
        try:
            try:
                snes.solve(None, x)
                reason = snes.getConvergedReason()
            except (PETSc.Error, FactorizationError):
                reason = -3
            except BaseException as error:
                # frames of the callbacks hold PETSc objects, which crash when they outlive PETSc
                error.add_note(traceback.format_exc())
                raise error.with_traceback(None) from None
            iterations = snes.getIterationNumber()
            result = self._full(x)
        finally:
            # left to PETSc's own clean-up at exit, a SNES with Python parts takes it down
            snes.destroy()
            for held in (*self._work, x):
                held.destroy()
        self.iterations += iterations
        out_of_balance = system.residual(result, extra)[self._free]
        residual = system.magnitude(out_of_balance, self._free) / self._scale
        text = _REASONS.get(reason, f"SNES reason {reason}")
        seconds = time.perf_counter() - clock
        return result, Verdict(residual <= tolerance, text, iterations, residual, seconds)

    def _make_snes(self, size: int, maximum_iterations: int) -> Any:
        snes = PETSc.SNES().create(PETSc.COMM_SELF)
        snes.setOptionsPrefix("avneo_")
        options = PETSc.Options("avneo_")
        options["snes_type"] = "newtonls"
        options["snes_linesearch_type"] = "bt"
        options["snes_linesearch_max_it"] = 12
        options["snes_linesearch_maxstep"] = 1e30
        vector = PETSc.Vec().createSeq(size)
        snes.setFunction(self._residual, vector)
        matrix = PETSc.Mat().createPython((size, size), self, comm=PETSc.COMM_SELF)
        matrix.setUp()
        snes.setJacobian(self._jacobian, matrix, matrix)
        self._work = (vector, matrix)
        snes.setObjective(self._objective)
        snes.setConvergenceTest(self._converged)
        solver = snes.getKSP()
        solver.setType("preonly")
        preconditioner = solver.getPC()
        preconditioner.setType("python")
        preconditioner.setPythonContext(self)
        snes.setFromOptions()
        snes.setTolerances(max_it=maximum_iterations)
        return snes

    def mult(self, _matrix: Any, x: Any, y: Any) -> None:
        """Product with the tangent, for PETSc."""
        y.array[:] = self._tangent @ x.array_r
