"""Elastic model plus constraint terms, reduced to the unknowns that are free."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.constraints.term import Foreseeing, Foreseen, Limiting, Term
from avneo_fem.equilibrium.shell_model import ShellModel
from avneo_fem.equilibrium.stopwatch import Stopwatch

__all__ = ["CuspSystem"]

Floats = NDArray[np.float64]

#: arm at which moments on director angles count as forces, in units of the template's size
MOMENT_ARM = 0.1


class CuspSystem:
    """Residual, tangent and merit of one cusp.

    Parameters
    ----------
    model : ShellModel
        Elastic energy, pressure and free-edge force.
    contact : SelfContact or None
        Barrier and step filter; None lets layers cross.

    Attributes
    ----------
    dead_load : (size,) array or None
        Generalised forces that do not follow the motion, conjugate to the entries of the state:
        forces on positions [mN], moments on angles [mN mm].
    force_scale : float or None
        What residuals are given relative to [mN]; None: the pressure load P x area.
    """

    def __init__(self, model: ShellModel, contact: SelfContact | None) -> None:
        self.model, self.contact = model, contact
        self.stopwatch = Stopwatch()
        self.terms: list[Term] = []
        self.dead_load: Floats | None = None
        self.force_scale: float | None = None
        self.fixed = np.zeros(model.size, dtype=bool)
        self._arms = np.ones(model.size)
        self._arms[model.angle_dofs.ravel()] = MOMENT_ARM * np.sqrt(model.mesh.area)
        self._expand = self._expansion()

    def _expansion(self) -> sp.csr_matrix:
        """(size, 3n) matrix that puts nodal vectors at their place in the state."""
        rows = self.model.position_dofs.ravel()
        ones = np.ones(len(rows))
        shape = (self.model.size, len(rows))
        return sp.csr_matrix((ones, (rows, np.arange(len(rows)))), shape=shape)

    def positions(self, state: Floats) -> Floats:
        """(n, 3) node positions of a state."""
        return state[self.model.position_dofs]

    def fix(self, dofs: NDArray[np.int64]) -> None:
        """Hold these entries of the state at their present values."""
        self.fixed[dofs.ravel()] = True

    @property
    def free(self) -> NDArray[np.int64]:
        """Indices of the free unknowns."""
        return np.flatnonzero(~self.fixed)

    def load_scale(self) -> float:
        """Force that residuals are given relative to [mN]."""
        return self.model.load_scale() if self.force_scale is None else self.force_scale

    def magnitude(self, forces: Floats, dofs: NDArray[np.int64]) -> float:
        """Norm of generalised forces on ``dofs`` [mN]: a moment counts as a force at an
        arm of a tenth of sqrt(area).

        Forces and moments have no common unit: without an arm a convergence test would depend on
        the unit of length.
        """
        return float(np.linalg.norm(forces / self._arms[dofs]))

    def energy_scale(self) -> float:
        """Energy whose rounding counts at least [mN mm]: the membrane's is a difference of terms of
        the size of E H x area."""
        given = self.model.parameters
        return float(1e-3 * given.young_modulus * given.thickness * self.model.mesh.area)

    def largest_share(self, state: Floats, moves: Floats) -> float:
        """Share of ``moves`` (n, 3) that no term finds too far, 0..1."""
        points = self.positions(state)
        limits = [t.largest_share(points, moves) for t in self.terms if isinstance(t, Limiting)]
        return min(limits, default=1.0)

    def _active(self, extra: Sequence[Term]) -> list[Term]:
        contact = [] if self.contact is None else [self.contact]
        return [*contact, *self.terms, *extra]

    def _counted(self, term: Term) -> AbstractContextManager[None]:
        return self.stopwatch.part("collision" if term is self.contact else "penalties")

    def residual(self, state: Floats, extra: Sequence[Term] = ()) -> Floats:
        """Out-of-balance force of every unknown, (size,); held ones carry their reaction."""
        with self.stopwatch.part("assembly"):
            result = self.model.residual(state)
        if self.dead_load is not None:
            result -= self.dead_load
        points = self.positions(state)
        for term in self._active(extra):
            with self._counted(term):
                result[self.model.position_dofs] += term.gradient(points)
        return result

    def relative_residual(self, state: Floats) -> float:
        """Norm of the undamped residual over the load scale."""
        free = self.free
        return self.magnitude(self.residual(state)[free], free) / self.load_scale()

    def tangent(self, state: Floats, extra: Sequence[Term] = ()) -> sp.csr_matrix:
        """Derivative of :meth:`residual`, (size, size)."""
        points = self.positions(state)
        total: sp.spmatrix | None = None
        for term in self._active(extra):
            with self._counted(term):
                hessian = term.hessian(points)
            total = hessian if total is None else total + hessian
        with self.stopwatch.part("assembly"):
            stiffness = self.model.tangent(state)
        if total is None:
            return stiffness
        return (stiffness + self._expand @ total.tocsr() @ self._expand.T).tocsr()

    def merit_change(
        self,
        state: Floats,
        base: Floats,
        base_energy: float,
        extra: Sequence[Term] = (),
    ) -> float:
        """Energy of ``state`` minus that of ``base`` minus the work of the pressure between them.

        Along a straight step this is a true potential of the residual, follower pressure
        included, so a line search on it is sound.
        """
        return self.energy(state, extra) - base_energy - self.model.pressure_work(state, base)

    def energy(self, state: Floats, extra: Sequence[Term] = ()) -> float:
        """Energy of all conservative parts [mN mm]."""
        points = self.positions(state)
        dead = 0.0 if self.dead_load is None else float(self.dead_load @ state)
        with self.stopwatch.part("assembly"):
            total = self.model.energy(state) - dead
        for term in self._active(extra):
            with self._counted(term):
                total += term.energy(points)
        return total

    def foreseen(self, state: Floats, step: Floats) -> Foreseen | None:
        """Change of residual and tangent when ``step`` (size,) is taken, as far as terms foresee
        it; arrays are (size,) and (size, size). None without such terms."""
        points, moves = self.positions(state), self.positions(step)
        with self.stopwatch.part("penalties"):
            found = [t.foreseen(points, moves) for t in self.terms if isinstance(t, Foreseeing)]
        if not found:
            return None
        residual = np.zeros(self.model.size)
        residual[self.model.position_dofs] = sum(part.gradient for part in found)
        total = sum((part.hessian.tocsr() for part in found[1:]), found[0].hessian.tocsr())
        tangent = (self._expand @ total @ self._expand.T).tocsr()
        return Foreseen(np.concatenate([part.switched for part in found]), residual, tangent)
