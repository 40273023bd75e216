"""The quick way: what collides on a move is taken apart, and a few damped iterations are enough.

The paper's Algorithm 1.1 (SolveQSEProb) stops after a few iterations and repairs what crosses as
Bridson et al. do. Levels, constraints and record are those of ``stages.suturing``, and on the
first, coarsest mesh, where that is quick, so are the solves: the cusp leaves it inside and free of
crossings. On the finer meshes a move that collides is not halved but resolved
(``constraints.collision_response``), and no level converges: a few damped iterations, none of
which crosses, and an end when the mid-surface is inside.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.collision_response import CrossingsRemain, resolve
from avneo_fem.stages.continuation import StageFailed
from avneo_fem.stages.levels import Level
from avneo_fem.stages.moves import Outcome
from avneo_fem.stages.shortfall import outside
from avneo_fem.stages.suturing import CuspSuturing

__all__ = ["ApproximateSuturing"]

Floats = NDArray[np.float64]

#: dampings, in units of E H / R^2
_BOUNDARY_DAMPING, _DAMPING = 1.5, 0.3
#: rounds of raising penalties, at most
_ROUNDS = 12
#: the resolver keeps this share of the distance at which the barrier acts
_RESOLVED = 0.1


class ApproximateSuturing(CuspSuturing):
    """Stages of one cusp in ``solver.quality = "approximate"``."""

    # what has no room in its half-plane is left as it lies
    _left_out = ("first_row",)

    def _is_quick(self) -> bool:
        return any(self.setup.mesh is mesh for mesh in self.finer)

    def _enter_mesh(self, level: Level, state: Floats) -> Floats:
        if level.mesh == 1:
            state = self._raise_until_inside(state)
        return super()._enter_mesh(level, state)

    def _blocked(self, state: Floats, move: Floats) -> str | None:
        # on finer meshes collisions of the move are resolved
        return None if self._is_quick() else super()._blocked(state, move)

    def _damped(self, before: Floats, trial: Floats) -> Outcome:
        if not self._is_quick():
            return super()._damped(before, trial)
        return self._few_iterations(before, trial, _BOUNDARY_DAMPING)

    def _settle(self, before: Floats, state: Floats) -> Outcome:
        if not self._is_quick():
            return super()._settle(before, state)
        self.setup.clamp.renew(self.setup.system.positions(state))
        return self._few_iterations(before, state, _DAMPING)

    def _few_iterations(self, before: Floats, trial: Floats, damping: float) -> Outcome:
        """The move from ``before`` to ``trial`` freed of collisions, and iterations from there."""
        setup = self.setup
        held = setup.system.fixed[setup.model.position_dofs].any(axis=1)
        try:
            found = resolve(
                setup.mesh.triangles,
                setup.system.positions(before),
                setup.system.positions(trial),
                setup.mesh.node_areas,
                held,
                _RESOLVED * setup.contact.distance,
                rest=np.c_[setup.mesh.points, np.zeros(len(setup.mesh.points))],
            )
        except CrossingsRemain as error:
            return None, str(error)
        state = trial.copy()
        state[setup.model.position_dofs] = found.points
        count, tolerance = self.options.approximate_iterations, self.options.path_tolerance
        state, verdict = setup.relaxation.damped(state, damping, count, tolerance)
        if not np.isfinite(verdict.residual):
            return None, verdict.reason
        return state, (
            f"{found.impulses} impulses, {found.zones} impact zones, "
            f"{verdict.iterations} damped iterations"
        )

    def _raise_until_inside(self, state: Floats) -> Floats:
        """Raise the penalties until the cusp is inside wall and wedge (§3.4 step 3)."""
        setup, scene = self.setup, self.setup.scene
        allowed = scene.inside_tolerance(setup.cusp.thickness)
        limits = scene.wall.maximum_stiffness, scene.contact.maximum_stiffness
        for _ in range(_ROUNDS):
            misses = outside(setup, setup.system.positions(state))
            if max(misses) <= allowed:
                return state
            for term, miss, limit in zip((setup.wall, setup.wedge), misses, limits, strict=True):
                if miss > allowed:
                    factor = min(scene.wall.growth, 1.3 * miss / allowed)
                    term.stiffness = min(limit, factor * term.stiffness)
            clock, used = time.perf_counter(), setup.newton.iterations
            found, reason = self._settle(state, state)
            if found is None:
                raise StageFailed(f"root_wall: {reason}", state, setup.wall.stiffness, 0)
            state = found
            self._keep(state, "root_wall", setup.wall.stiffness, used, reason, clock, 1, None)
        wall, wedge = outside(setup, setup.system.positions(state))
        message = (
            f"root_wall: outside the root by {wall:.3f} mm and the contact wedge by {wedge:.3f} mm"
            f" after {_ROUNDS} rounds; raise solver.approximate_iterations or take"
            ' solver.quality = "equilibrium"'
        )
        raise StageFailed(message, state, setup.wall.stiffness, 0)
