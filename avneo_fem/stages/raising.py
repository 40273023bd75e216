"""The last stages of a cusp: penalties are raised until each holds, and all converges."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from avneo_fem.stages.continuation import StageFailed
from avneo_fem.stages.moves import SETTLE_DAMPING
from avneo_fem.stages.progress import CuspProgress
from avneo_fem.stages.shortfall import bulging, may_be_missed_by_nodes, shortfalls

__all__ = ["PenaltyRaising", "raising_factor"]

Floats = NDArray[np.float64]


#: times at most that nodes are moved off because of what lies between them
_ROUNDS = 8


def raising_factor(
    now: tuple[float, float], most: float, before: tuple[float, float] | None, largest: float
) -> float:
    """By how much to raise a penalty; no more than is missing, as stiff penalties cost digits.

    Parameters
    ----------
    now, before : (float, float)
        Stiffness and what is missed with it, now and when it was raised last.
    most : float
        What may be missed.
    largest : float
        Largest factor.

    Returns
    -------
    float
        Miss / allowed where a miss goes with 1/stiffness, as that of a single node does; where
        the last raise helped less, as a clamp's that whole folds pull at, more. 30 % on top.
    """
    power = 1.0
    if before is not None:
        gained = np.log(before[1] / now[1]) / np.log(now[0] / before[0])
        power = float(np.clip(gained, 0.1, 1.0))
    wanted = np.log(1.3) + np.log(now[1] / most) / power
    return largest if wanted >= np.log(largest) else float(np.exp(wanted))


class PenaltyRaising(CuspProgress):
    """The end of the stages (paper §3.4 step 3)."""

    _kept_off = 0

    def _keep_off(self, points: Floats) -> bool:
        """Ask more clearance of nodes between which the surface is short of it.

        Whether there were any. No node is moved off by more than half of a usual edge, however
        long its own are: across a sharp bend, where there is no room to move off to, nodes slide
        away on both sides, the edge between them grows, and would ask for ever more.
        """
        setup, edges = self.setup, self.setup.mesh.edges
        if self._kept_off == _ROUNDS:
            return False  # whether what is left matters, the verification says
        before = setup.wedge.clearance
        lengths = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
        most = setup.wedge_clearance + float(np.median(lengths)) / 2
        after = np.minimum(before + bulging(setup, points), most)
        if np.array_equal(before, after):
            return False
        self._kept_off += 1
        setup.wedge.clearance = after
        setup.wedge.field = setup.wedge_field(1.0)
        return True

    def _raise_until_inside(self, state: Floats) -> Floats:
        """Raise the penalties until clearances and clamp hold, then converge (§3.4 step 3)."""
        setup, scene = self.setup, self.setup.scene
        if setup.layers.clearance > 0:
            # not before: coarse folds are sharper than the clearance
            setup.system.terms = [*setup.system.terms, setup.layers]
        inside = may_be_missed_by_nodes(setup)
        allowed = (inside, inside, scene.clamp.tolerance_degrees, inside)
        limits = (
            scene.wall.maximum_stiffness,
            scene.contact.maximum_stiffness,
            scene.clamp.maximum_stiffness,
            scene.layers.maximum_stiffness,
        )
        tried: dict[int, tuple[float, float]] = {}
        while True:
            misses = shortfalls(setup, setup.system.positions(state))
            late = [miss > most for miss, most in zip(misses, allowed, strict=True)]
            if not any(late) and self._keep_off(setup.system.positions(state)):
                state = self._converge(state, "root_wall", self.options.path_tolerance)
                continue
            if not any(late):
                state = self._converge(state, "equilibrium", self.options.tolerance)
                points = setup.system.positions(state)
                misses = shortfalls(setup, points)
                kept = all(miss <= most for miss, most in zip(misses, allowed, strict=True))
                if kept and not self._keep_off(points):
                    return state
                continue
            raised = False
            for number, (term, limit, miss, most) in enumerate(
                zip(self._penalties(), limits, misses, allowed, strict=True)
            ):
                if miss > most and term.stiffness < limit:
                    now = (term.stiffness, miss)
                    factor = raising_factor(now, most, tried.get(number), scene.wall.growth)
                    term.stiffness = min(limit, factor * term.stiffness)
                    tried[number] = now
                    raised = True
            if not raised:
                state = self._converge(state, "equilibrium", self.options.tolerance)
                raise StageFailed(self._what_is_missing(state), state, setup.wall.stiffness, 0)
            state = self._converge(state, "root_wall", self.options.path_tolerance)

    def _what_is_missing(self, state: Floats) -> str:
        setup = self.setup
        wall, wedge, clamp, layers = shortfalls(setup, setup.system.positions(state))
        return (
            f"root_wall: short of the clearance by {wall:.3f} mm from the wall and {wedge:.3f} mm"
            f" from the contact wedge, layers by {layers:.3f} mm, clamp off by {clamp:.1f} degrees"
            f" rms, at penalties of {setup.wall.stiffness:g} kPa, {setup.wedge.stiffness:g} kPa,"
            f" {setup.layers.stiffness:g} kPa and {setup.clamp.stiffness:g} mN; refine mesh.size,"
            " or raise maximum_stiffness of wall, contact, layers or clamp, or the tolerance"
        )

    def _converge(self, state: Floats, name: str, tolerance: float) -> Floats:
        clock, used = time.perf_counter(), self.setup.newton.iterations
        self.setup.newton.forget()
        budget = 10 * self.options.maximum_iterations
        relaxation = self.setup.relaxation
        self.setup.clamp.renew(self.setup.system.positions(state))
        state, verdict = relaxation.settle(state, tolerance, SETTLE_DAMPING, budget)
        stiffness = self.setup.wall.stiffness
        # after the last equilibrium comes the checkpoint of the finished cusp
        done = None if name == "equilibrium" else len(self.levels)
        self._keep(state, name, stiffness, used, verdict.reason, clock, 1, done)
        if not verdict.converged:
            message = (
                f"{name}: residual {verdict.residual:.1e} of the pressure load, wanted"
                f" {tolerance:.1e} ({verdict.reason}); raise solver.maximum_iterations"
            )
            raise StageFailed(message, state, stiffness, 0)
        return state
