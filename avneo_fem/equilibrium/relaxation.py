"""Pseudo-transient continuation: damped Newton solves whose damping dies out.

From far away an undamped Newton iteration jumps between folds. Here every outer step minimises
the energy plus mu/2 sum S_n |x - x_prev|^2 roughly, in a few iterations, and lowers mu when that
went well. Close to the equilibrium mu is dropped and Newton converges on its own.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.proximal import ProximalTerm
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.directors import renew_directors
from avneo_fem.equilibrium.newton import NewtonSolver, Verdict

__all__ = ["Relaxation", "RelaxationSettings"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RelaxationSettings:
    """How fast the damping dies out.

    ``damping_unit`` [kPa/mm] makes the dampings below relative: a membrane's stiffness E H / R^2.
    """

    damping_unit: float
    inner_iterations: int = 6
    inner_reduction: float = 0.1
    decrease: float = 5.0
    increase: float = 2.0
    smallest: float = 3e-3
    largest: float = 15.0
    undamped_below: float = 1e-4
    largest_stalls: int = 12


class Relaxation:
    """Brings a cusp to undamped equilibrium without leaving the intersection-free set."""

    def __init__(
        self, system: CuspSystem, newton: NewtonSolver, settings: RelaxationSettings
    ) -> None:
        self.system, self.newton, self.settings = system, newton, settings

    def damped(
        self, state: Floats, damping: float, iterations: int, tolerance: float | None = None
    ) -> tuple[Floats, Verdict]:
        """One outer step: at most ``iterations`` Newton iterations, damped towards ``state``.

        They end at a residual, damping included, of ``tolerance``; None: a tenth of the present.
        """
        system, settings = self.system, self.settings
        state = renew_directors(system.model, state)
        extra = self._damping(state, damping)
        force = system.relative_residual(state)
        target = settings.inner_reduction * force if tolerance is None else tolerance
        return self.newton.solve(state, target, extra, iterations)

    def _damping(self, state: Floats, damping: float) -> list[ProximalTerm]:
        system = self.system
        strength = damping * self.settings.damping_unit
        return [ProximalTerm(system.positions(state), system.model.node_areas, strength)]

    def settle(
        self, state: Floats, tolerance: float, damping: float, budget: int
    ) -> tuple[Floats, Verdict]:
        """Undamped equilibrium from ``state``.

        Parameters
        ----------
        state : (size,) array
            Start, free of crossings.
        tolerance : float
            Undamped residual over the pressure load to reach.
        damping : float
            First mu in units of E H / R^2.
        budget : int
            Newton iterations to spend at most.

        Returns
        -------
        (state, Verdict)
            The last state and how it ended; ``residual`` is the undamped one.
        """
        clock, settings = time.perf_counter(), self.settings
        system, used, stalls = self.system, 0, 0
        reason = "converged: residual below tolerance"
        while True:
            state = renew_directors(system.model, state)
            residual = system.relative_residual(state)
            if residual <= tolerance:
                break
            if not np.isfinite(residual):
                reason = "residual is not a number"
                break
            if stalls > settings.largest_stalls:
                reason = "no step decreases the energy, whatever the damping"
                break
            if used >= budget:
                reason = f"iteration limit of {budget} reached"
                break
            if residual < settings.undamped_below:
                damping = 0.0
            if system.contact is not None:
                system.contact.project = damping > 0.0
            if damping > 0.0:
                target = max(settings.inner_reduction * residual, 0.5 * tolerance)
                extra, limit = self._damping(state, damping), settings.inner_iterations
            else:
                target, extra, limit = tolerance, [], 2 * settings.inner_iterations
            state, verdict = self.newton.solve(state, target, extra, min(limit, budget - used))
            used += max(verdict.iterations, 1)
            stalls = 0 if verdict.iterations or verdict.converged else stalls + 1
            if verdict.converged:
                damping /= settings.decrease
            elif verdict.iterations and 3 * self.newton.hindered < verdict.iterations:
                damping /= settings.increase
            else:
                damping = max(settings.increase * damping, 10 * settings.smallest)
            damping = min(damping, settings.largest)
            if damping < settings.smallest:
                damping = 0.0
        if system.contact is not None:
            system.contact.project = True
        seconds = time.perf_counter() - clock
        return state, Verdict(residual <= tolerance, reason, used, residual, seconds)
