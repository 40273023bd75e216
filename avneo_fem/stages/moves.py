"""The moves of a cusp: one attempt of one step of each stage (see ``stages.suturing``).

An attempt takes a state from one value of its stage's parameter to the next and returns the new
state, or None and why it failed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.clamp_penalty import ClampPenalty
from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.equilibrium.directors import clamp_rotation, renew_directors
from avneo_fem.meshing.harmonic import harmonic_extension
from avneo_fem.stages.continuation import Attempt
from avneo_fem.stages.cusp_setup import CuspSetup

__all__ = ["SETTLE_DAMPING", "CuspMoves", "Outcome"]

Floats = NDArray[np.float64]
Outcome = tuple[Floats | None, str]

_Penalty = SignedDistancePenalty | ClampPenalty | LayerClearance

#: share of the pressure that acts while the edge leaves the template
_FIRST_PRESSURE = 0.05
#: first dampings, in units of E H / R^2
_BOUNDARY_DAMPING, SETTLE_DAMPING = 1.5, 0.6
_BOUNDARY_ITERATIONS = 6
#: iterations after a part of the way to the line of a finer mesh
_REST_ITERATIONS = 100
#: a triangle that is turned by more has turned over [rad]
_OVER = np.radians(90.0)
#: angle from which on an edge is turned gently [rad]
_FAR = np.radians(60.0)


class CuspMoves:
    """Attempts of one step.

    Parameters
    ----------
    setup : CuspSetup
        Model, constraints and solver of the present mesh.
    """

    def __init__(self, setup: CuspSetup) -> None:
        self.setup, self.options = setup, setup.scene.solver
        self._way: Floats = np.zeros((0, 3))
        self._said = ""
        self._clamp_rounds = 0

    def _penalties(self) -> tuple[_Penalty, ...]:
        setup = self.setup
        return setup.wall, setup.wedge, setup.clamp, setup.layers

    def _directors(self) -> Floats:
        model = self.setup.model
        return model.directors if model.parameters.bending else np.empty((0, 3))

    def _set_directors(self, directors: Floats) -> None:
        if self.setup.model.parameters.bending:
            self.setup.model.set_directors(directors)

    def _suture_edges(self, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
        return self.setup.mesh.suture_edges[chosen]

    def _undoing(self, attempt: Attempt) -> Attempt:
        """The attempt, which takes back what it set in the model when it fails.

        The angles of the state it started from are measured from the directors of then.
        """
        setup, model = self.setup, self.setup.model

        def safe(state: Floats, start: float, stop: float) -> Outcome:
            pressure, field = model.pressure, setup.wedge.field
            clamp, reference = setup.clamp.stiffness, setup.clamp.reference
            directors = self._directors()
            result, reason = attempt(state, start, stop)
            self._said = reason
            if result is None:
                model.pressure, setup.wedge.field = pressure, field
                setup.clamp.stiffness, setup.clamp.reference = clamp, reference
                self._set_directors(directors)
            return result, reason

        return safe

    def _blocked(self, state: Floats, move: Floats) -> str | None:
        """Why a move (n, 3) of the nodes cannot be made, None when it can."""
        setup = self.setup
        clear = setup.contact.step_fraction(setup.system.positions(state), move)
        return None if clear == 1.0 else f"layers would collide after {clear:.2f} of the step"

    def _settle(self, before: Floats, state: Floats) -> Outcome:
        """Equilibrium from ``state``, which was reached from ``before`` without a collision."""
        tolerance, budget = self.options.path_tolerance, self.options.maximum_iterations
        self.setup.clamp.renew(self.setup.system.positions(state))
        settled, verdict = self.setup.relaxation.settle(state, tolerance, SETTLE_DAMPING, budget)
        return (settled if verdict.converged else None), (
            f"{verdict.reason}, residual {verdict.residual:.1e}"
        )

    def _settle_hinged(self, state: Floats, _start: float, _stop: float) -> Outcome:
        return self._settle(state, state)

    def _move_boundary(self, state: Floats, start: float, stop: float) -> Outcome:
        """Move the sutured edge on its straight way; the inside follows harmonically."""
        model = self.setup.model
        model.pressure = self.setup.path_pressure * max(_FIRST_PRESSURE, stop)
        return self._move(state, start, stop)

    def _move(self, state: Floats, start: float, stop: float) -> Outcome:
        setup, model = self.setup, self.setup.model
        move = (stop - start) * self._way
        blocked = self._blocked(state, move)
        if blocked:
            return None, blocked
        trial = state.copy()
        trial[model.position_dofs] += move
        line = setup.mesh.suture_line
        trial[model.position_dofs[line]] = setup.start[line] + stop * (
            setup.target - setup.start[line]
        )
        return self._damped(state, trial)

    def _damped(self, before: Floats, trial: Floats) -> Outcome:
        relaxation = self.setup.relaxation
        state, verdict = relaxation.damped(trial, _BOUNDARY_DAMPING, _BOUNDARY_ITERATIONS)
        return (state if np.isfinite(verdict.residual) else None), verdict.reason

    def _follow_mesh(self, state: Floats, start: float, stop: float) -> Outcome:
        """Move the new sutured nodes to their line; once there, clamp them and settle."""
        moved, reason = self._move(state, start, stop)
        if moved is None:
            return None, reason
        if stop < 1.0:
            # a layer is in the way: it must get out of it before the next step
            relaxation, tolerance = self.setup.relaxation, self.options.path_tolerance
            moved, _ = relaxation.settle(moved, tolerance, SETTLE_DAMPING, _REST_ITERATIONS)
            return moved, reason
        # ``_move`` has left no crossing behind
        return self._clamp_again(moved)

    def _ease_clamp(self, points: Floats) -> None:
        """Soften the clamp where a finer mesh finds room that the coarse one did not see.

        An edge that was left to turn may then be far from its half-plane: at once, the clamp would
        tear its triangle round through whatever lies in between.
        """
        clamp = self.setup.clamp
        angles = np.abs(clamp.angles(points)[clamp.active])
        self._clamp_rounds = self.options.clamp_steps if angles.max(initial=0.0) > _FAR else 0
        clamp.stiffness /= 4.0**self._clamp_rounds

    def _clamp_again(self, state: Floats) -> Outcome:
        """Turn the edges into their half-planes on a finer mesh, as gently as it needs."""
        rounds, room = self._clamp_rounds, self.setup.row.has_room
        if not rounds:
            return self._settle(state, self._turned(state, room, 1.0))
        for number in range(rounds):
            self.setup.clamp.stiffness *= 4.0
            turned = self._turned(state, room, 1.0 / (rounds - number))
            settled, reason = self._settle(state, turned)
            if settled is None:
                return None, reason
            state = settled
        return state, reason

    def _turned(self, state: Floats, chosen: NDArray[np.bool_], share: float) -> Floats:
        """State with chosen suture edges (k-1,) turned by a share of what is missing to the
        tangent half-plane."""
        setup, model = self.setup, self.setup.model
        if not model.parameters.bending:
            return state
        state = renew_directors(model, state)
        rest = clamp_rotation(model, state, setup.conormal)
        state[model.angle_dofs[self._suture_edges(chosen)]] += share * rest[chosen]
        return state

    def _turn_edge(self, state: Floats, start: float, stop: float) -> Outcome:
        """Turn the suture edges by their share of what is missing to the tangent half-plane.

        The penalty that takes the triangles along grows with it, by a factor of 4 a level.
        """
        setup, free = self.setup, self.setup.row.has_room
        # as long as no wedge is in the way, there is room for all: what has turned over on its way
        # to the stitch is turned back
        over = np.abs(setup.clamp.angles(setup.system.positions(state))) > _OVER
        setup.clamp.active = free | over
        trial = self._turned(state, free, (stop - start) / (1.0 - start))
        full, count = setup.scene.clamp.stiffness, self.options.clamp_steps
        setup.clamp.stiffness = full * 4.0 ** (count * (stop - 1.0))
        return self._settle(state, trial)

    def _lay_row(self, state: Floats, start: float, stop: float) -> Outcome:
        """Lay down the nodes that have no room in their half-plane, and clamp their edges."""
        setup, row = self.setup, self.setup.row
        if not len(row.nodes):
            return state, "converged: every node has room in its half-plane"
        share = (stop - start) / (1.0 - start)
        points, line = setup.system.positions(state), setup.mesh.suture_line
        away = row.on_the_way(points[row.nodes], share) - points[row.nodes]
        held = np.r_[line, row.nodes]
        move = harmonic_extension(setup.mesh, held, np.vstack([np.zeros((len(line), 3)), away]))
        blocked = self._blocked(state, move)
        if blocked:
            return None, blocked
        trial = state.copy()
        trial[setup.model.position_dofs] += move
        return self._settle(state, self._turned(trial, row.is_blocked, share))

    def _unload(self, state: Floats, _start: float, stop: float) -> Outcome:
        """Let the pressure down from that of the way to P."""
        self.setup.model.pressure = self._pressure(stop)
        return self._settle(state, state)

    def _pressure(self, share: float) -> float:
        """Pressure when that of the way is let down by a share of what it is above P [kPa]."""
        above = self.setup.path_pressure - self.setup.scene.diastolic_pressure
        return self.setup.path_pressure - share * above

    def _close_wedge(self, state: Floats, _start: float, stop: float) -> Outcome:
        self.setup.wedge.field = self.setup.wedge_field(max(stop, 0.0))
        return self._settle(state, state)
