"""All stages of one cusp, from the flat template to its place in the root.

Order and reasons (design.md §3): bending is on from the first step and the state never crosses
itself. On a coarse mesh, ``boundary`` moves the sutured edge to its line in damped steps,
``hinged_edge`` takes the damping out, with the wall present (paper §3.2 step 3), ``clamped_edge``
turns the edge into its tangent half-plane (step 4), and ``contact_wedge`` closes the wedge,
lambda = 0 ... 1 (§3.4 step 2). Each ``refinement`` splits the triangles into four and goes on from
the same surface, which is free of crossings, too. ``first_row`` lays down what has no room in its
half-plane (``stages.blocked_edge``), ``root_wall`` raises the penalties of wall, wedge and clamp
until each holds (step 3) and has the
layers keep their clearance, and ``equilibrium`` converges the result.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.clamp_penalty import ClampPenalty
from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.equilibrium.directors import clamp_rotation, renew_directors, start_directors
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.harmonic import harmonic_extension
from avneo_fem.meshing.refine import prolong
from avneo_fem.stages.checkpoint import Checkpoint, CheckpointStore
from avneo_fem.stages.continuation import Attempt, StageFailed, march
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.levels import Level, levels_of
from avneo_fem.stages.record import CuspResult, Snapshot, StageRecord

__all__ = ["CuspSuturing"]

Floats = NDArray[np.float64]
Outcome = tuple[Floats | None, str]

_Penalty = SignedDistancePenalty | ClampPenalty | LayerClearance

#: share of the pressure that acts while the edge leaves the template
_FIRST_PRESSURE = 0.05
#: first dampings, in units of E H / R^2
_BOUNDARY_DAMPING, _SETTLE_DAMPING = 1.5, 0.6
_BOUNDARY_ITERATIONS = 6
#: a row that layers keep from the last of its way lies well enough; the judge looks at it, too
_ROW_FAR_ENOUGH = 0.95

#: what may help when a stage cannot be completed
_ADVICE = {
    "boundary": "raise solver.boundary_steps, or refine mesh.size",
    "hinged_edge": "raise solver.maximum_iterations, or refine mesh.size",
    "clamped_edge": "raise solver.clamp_steps, or refine mesh.size",
    "contact_wedge": "raise contact.steps, or refine mesh.size",
    "refinement": "choose other mesh.refinements (0 splits nothing), or another mesh.size",
    "first_row": "refine mesh.size, or raise solver.inside_tolerance",
}


class CuspSuturing:
    """Runs the stages of one cusp.

    Parameters
    ----------
    setup : CuspSetup
        Model, constraints and solver.
    observer : callable
        Told the cusp's index and every completed level.
    store : CheckpointStore or None
        Where progress is kept.
    finer : sequence of CuspMesh
        Refinements of the set-up's mesh, to go on with one after the other.
    index : int or None
        What the cusp is called towards observer and store; None: as in the set-up.
    """

    def __init__(
        self,
        setup: CuspSetup,
        observer: Callable[[int, StageRecord], None],
        store: CheckpointStore | None = None,
        finer: Sequence[CuspMesh] = (),
        index: int | None = None,
    ) -> None:
        self.setup, self.observer, self.store, self.finer = setup, observer, store, finer
        self.index = setup.index if index is None else index
        lambdas = setup.wedges.levels(setup.scene.contact.steps)
        self.levels = levels_of(setup.scene, setup.placement_k, lambdas, finer)
        self.options = setup.scene.solver
        self.records: list[StageRecord] = []
        self.snapshots: list[Snapshot] = []
        self._said = ""
        self._prepare(setup)

    def _prepare(self, setup: CuspSetup) -> None:
        """What a quality changes in a fresh set-up."""

    def run(self, resume: bool = False) -> CuspResult:
        """Run all stages; a failure is part of the result, with the last good state."""
        clock = time.perf_counter()
        state, done = self._begin(), 0
        checkpoint = self.store.load(self.index) if resume and self.store else None
        if checkpoint is not None:
            state, done = self._go_on_from(checkpoint), checkpoint.levels_done
        if checkpoint is not None and checkpoint.finished:
            failure, residual = checkpoint.failure, checkpoint.residual
        else:
            state, failure = self._run_from(state, done)
            residual = self.setup.system.relative_residual(state)
            done = len(self.levels) if failure is None else self._reached
            self._save(state, done, True, residual, failure)
        setup, seconds = self.setup, time.perf_counter() - clock
        shares = dict(setup.system.stopwatch.seconds)
        shares["python"] = seconds - sum(shares.values())
        return CuspResult(
            index=self.index,
            mesh=setup.mesh,
            points=setup.system.positions(state),
            records=self.records,
            snapshots=self.snapshots,
            residual=residual,
            dofs=setup.model.size,
            failure=failure,
            compile_seconds=setup.compile_seconds,
            seconds=seconds,
            shares=shares,
            energy=setup.system.energy(state),
        )

    def _run_from(self, state: Floats, done: int) -> tuple[Floats, str | None]:
        """All levels after the first ``done``; last good state, and what failed if anything did."""
        self._reached = done
        try:
            for number, level in enumerate(self.levels):
                if number < done:
                    self._activate(level, level.stop)
                    continue
                if level.name == "refinement":
                    state = self._enter_mesh(level, state)
                self._activate(level, level.start)
                self._reached = number
                state = self._level(state, level, number + 1)
            return self._raise_until_inside(state), None
        except StageFailed as error:
            return error.state, str(error)

    def _begin(self) -> Floats:
        """First state: the nodes at their start."""
        setup, model = self.setup, self.setup.model
        line = setup.mesh.suture_line
        away = setup.target - setup.start[line]
        self._way = harmonic_extension(setup.mesh, line, away)
        state = np.zeros(model.size)
        state[model.position_dofs] = setup.start
        return start_directors(model, state)

    def _enter_mesh(self, level: Level, state: Floats) -> Floats:
        """Go over to the next finer mesh: the same surface, all terms as they are."""
        coarse = self.setup
        points = prolong(coarse.mesh, coarse.system.positions(state))
        self.setup = coarse.on_mesh(self.finer[level.mesh - 1], points)
        self._prepare(self.setup)
        self.snapshots = [
            Snapshot(
                shot.name,
                shot.parameter,
                prolong(coarse.mesh, shot.points),
                {name: prolong(coarse.mesh, field) for name, field in shot.fields.items()},
            )
            for shot in self.snapshots
        ]
        for earlier in self.levels[: self.levels.index(level)]:
            self._activate(earlier, earlier.stop)
        return self._begin()

    def _go_on_from(self, checkpoint: Checkpoint) -> Floats:
        """Take over what a checkpoint holds; its state."""
        behind = self.levels[: checkpoint.levels_done + checkpoint.finished]
        mesh = max((level.mesh for level in behind), default=0)
        if mesh:
            self.setup = self.setup.on_mesh(self.finer[mesh - 1], checkpoint.snapshots[-1].points)
            self._prepare(self.setup)
        setup = self.setup
        self.records, self.snapshots = checkpoint.records, checkpoint.snapshots
        stiffness = checkpoint.penalty_stiffness
        for term, value in zip(self._penalties(), stiffness, strict=True):
            term.stiffness = value
        setup.clamp.reference = checkpoint.clamp_reference
        self._set_directors(checkpoint.directors)
        return checkpoint.state

    def _penalties(self) -> tuple[_Penalty, ...]:
        setup = self.setup
        return setup.wall, setup.wedge, setup.clamp, setup.layers

    def _directors(self) -> Floats:
        model = self.setup.model
        return model.directors if model.parameters.bending else np.empty((0, 3))

    def _set_directors(self, directors: Floats) -> None:
        if self.setup.model.parameters.bending:
            self.setup.model.set_directors(directors)

    def _save(
        self,
        state: Floats,
        done: int,
        finished: bool = False,
        residual: float = float("nan"),
        failure: str | None = None,
    ) -> None:
        if self.store is None:
            return
        setup = self.setup
        wall, wedge, clamp, layers = (term.stiffness for term in self._penalties())
        kept = Checkpoint(
            state=state,
            directors=self._directors(),
            levels_done=done,
            penalty_stiffness=(wall, wedge, clamp, layers),
            clamp_reference=setup.clamp.reference,
            records=self.records,
            snapshots=self.snapshots,
            finished=finished,
            residual=residual,
            failure=failure,
        )
        self.store.save(self.index, kept)

    # -- levels ----------------------------------------------------------------------------
    def _activate(self, level: Level, parameter: float) -> None:
        """Terms and held unknowns that come with a level; they stay for all later ones.

        ``parameter`` is where the level starts, or its end when it is behind the state.
        """
        setup, name = self.setup, level.name
        if name == "hinged_edge":
            # from here on the cusp must not slip behind its own sutured edge
            setup.system.terms = [setup.wall]
        elif name == "clamped_edge":
            setup.system.fix(setup.model.angle_dofs[self._suture_edges(~setup.row.is_blocked)])
            setup.system.terms = [setup.wall, setup.clamp]
        elif name == "contact_wedge":
            clamp = [setup.clamp] if setup.scene.material.bending else []
            setup.system.terms = [setup.wall, *clamp, setup.wedge]
            setup.wedge.field = setup.wedges.wedge(setup.index, max(parameter, 0.0))
        elif name == "first_row":
            setup.system.fix(setup.model.angle_dofs[setup.mesh.suture_edges])
            setup.system.fix(setup.model.position_dofs[setup.row.nodes])
            setup.clamp.active[:] = True
        if name not in ("placement", "boundary"):
            setup.model.pressure = setup.scene.diastolic_pressure

    def _suture_edges(self, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
        return self.setup.mesh.suture_edges[chosen]

    def _mesh_size(self, level: Level) -> float:
        return float(self.setup.scene.mesh_size * 2.0 ** (len(self.finer) - level.mesh))

    def _level(self, state: Floats, level: Level, done: int) -> Floats:
        """Run one level and keep its verdict, also when it fails."""
        name, before, after = level.name, level.start, level.stop
        attempt, step, reason = {
            "placement": (None, 1.0, "placed clear of the suture line"),
            "boundary": (
                self._move_boundary,
                1.0 / self.options.boundary_steps,
                "damped steps accepted, free of crossings",
            ),
            "hinged_edge": (self._settle_hinged, 1.0, ""),
            "clamped_edge": (self._turn_edge, after - before, ""),
            "contact_wedge": (self._close_wedge, after - before, ""),
            "refinement": (self._follow_mesh, 1.0, ""),
            "first_row": (self._lay_row, after - before, ""),
        }[name]
        clock, used = time.perf_counter(), self.setup.newton.iterations
        self.setup.newton.forget()
        failure, steps = None, 1
        if attempt is not None:
            smallest = self.options.smallest_step * step
            try:
                safe = self._undoing(attempt)
                state, steps = march(state, before, after, safe, step, smallest, name)
                reason = reason or self._said.split(", residual")[0]
            except StageFailed as error:
                state, after, steps = error.state, error.parameter, error.steps
                reason = f"{error}; {_ADVICE[name]}"
                if name != "first_row" or after < _ROW_FAR_ENOUGH:
                    failure = StageFailed(reason, state, after, steps)
        # a failed level is no place to go on from: it would be run again from its middle
        kept = done if failure is None else None
        parameter = self._mesh_size(level) if name == "refinement" else after
        self._keep(state, name, parameter, used, reason, clock, steps, kept)
        if failure is not None:
            raise failure
        return state

    def _keep(
        self,
        state: Floats,
        name: str,
        parameter: float,
        used: int,
        reason: str,
        clock: float,
        steps: int,
        done: int | None,
    ) -> None:
        """Record and snapshot of a level, and a checkpoint with ``done`` levels behind it."""
        setup = self.setup
        residual = setup.system.relative_residual(state)
        spent = setup.newton.iterations - used
        seconds = time.perf_counter() - clock
        record = StageRecord(name, parameter, spent, reason, residual, seconds, steps)
        points = setup.system.positions(state)
        self.records.append(record)
        self.snapshots.append(Snapshot(name, parameter, points, self._fields(points)))
        if done is not None:
            self._save(state, done)
        self.observer(self.index, record)

    def _fields(self, points: Floats) -> dict[str, Floats]:
        """Distances and penalty pressure at the nodes, for ParaView."""
        setup = self.setup
        pressure = np.zeros(len(points))
        for term in setup.system.terms:
            if isinstance(term, SignedDistancePenalty):
                pressure += term.stiffness * term.ramp(points)
        return {
            "wall_distance": setup.geometry.root.signed_distance(points),
            "wedge_distance": setup.wedge.field.evaluate(points)[0],
            "penalty_pressure": pressure,
        }

    # -- attempts of one step --------------------------------------------------------------
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
        settled, verdict = self.setup.relaxation.settle(state, tolerance, _SETTLE_DAMPING, budget)
        return (settled if verdict.converged else None), (
            f"{verdict.reason}, residual {verdict.residual:.1e}"
        )

    def _move_boundary(self, state: Floats, start: float, stop: float) -> Outcome:
        """Move the sutured edge on its straight way; the inside follows harmonically."""
        model = self.setup.model
        model.pressure = self.setup.scene.diastolic_pressure * max(_FIRST_PRESSURE, stop)
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

    def _follow_mesh(self, state: Floats, start: float, stop: float) -> Outcome:
        """Move the new sutured nodes to their line; once there, clamp them and settle."""
        moved, reason = self._move(state, start, stop)
        if moved is None or stop < 1.0:
            return moved, reason
        # ``_move`` has left no crossing behind
        return self._settle(moved, self._turned(moved, ~self.setup.row.is_blocked, 1.0))

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

    def _damped(self, before: Floats, trial: Floats) -> Outcome:
        relaxation = self.setup.relaxation
        state, verdict = relaxation.damped(trial, _BOUNDARY_DAMPING, _BOUNDARY_ITERATIONS)
        return (state if np.isfinite(verdict.residual) else None), verdict.reason

    def _settle_hinged(self, state: Floats, _start: float, _stop: float) -> Outcome:
        return self._settle(state, state)

    def _turn_edge(self, state: Floats, start: float, stop: float) -> Outcome:
        """Turn the suture edges by their share of what is missing to the tangent half-plane.

        The penalty that takes the triangles along grows with it, by a factor of 4 a level.
        """
        setup, free = self.setup, ~self.setup.row.is_blocked
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

    def _close_wedge(self, state: Floats, _start: float, stop: float) -> Outcome:
        self.setup.wedge.field = self.setup.wedges.wedge(self.setup.index, max(stop, 0.0))
        return self._settle(state, state)

    # -- last stages -----------------------------------------------------------------------
    def outside(self, points: Floats) -> tuple[float, float]:
        """Largest depth of a node outside the root and outside the contact wedge [mm]."""
        wall, wedge = self.setup.wall.evaluate(points)[0], self.setup.wedge.evaluate(points)[0]
        return float((-wall).max(initial=0.0)), float((-wedge).max(initial=0.0))

    def shortfalls(self, points: Floats) -> tuple[float, float, float, float]:
        """How far wall, wedge, clamp and layers are from what they must hold.

        Returns
        -------
        (wall, wedge, clamp, layers)
            Largest miss of the clearances [mm], sutured nodes apart; within the taper the node
            need only be inside the root. Clamp: rms angle to the half-plane [degrees].
        """
        setup = self.setup
        free = np.ones(len(points), dtype=bool)
        free[setup.mesh.suture_line] = False
        free[setup.row.nodes] = False
        distance = setup.wall.evaluate(points)[0]
        tapered = setup.wall.clearance < setup.wall.clearance.max()
        wall = np.where(tapered, -distance, setup.wall.clearance - distance)
        wedge = setup.wedge.shortfall(points)
        clamp = setup.clamp.rms_angle(points) if setup.scene.material.bending else 0.0
        return (
            float(wall[free].max(initial=0.0)),
            float(wedge[free].max(initial=0.0)),
            float(np.degrees(clamp)),
            setup.layers.shortfall(points),
        )

    def _raise_until_inside(self, state: Floats) -> Floats:
        """Raise the penalties until clearances and clamp hold, then converge (§3.4 step 3)."""
        setup, scene = self.setup, self.setup.scene
        if setup.layers.clearance > 0:
            # not before: coarse folds are sharper than the clearance
            setup.system.terms = [*setup.system.terms, setup.layers]
        # less than what is judged: the judge also looks between the nodes
        inside = 0.5 * scene.inside_tolerance(setup.cusp.thickness)
        allowed = (inside, inside, scene.clamp.tolerance_degrees, inside)
        limits = (
            scene.wall.maximum_stiffness,
            scene.contact.maximum_stiffness,
            scene.clamp.maximum_stiffness,
            scene.layers.maximum_stiffness,
        )
        while True:
            misses = self.shortfalls(setup.system.positions(state))
            late = [miss > most for miss, most in zip(misses, allowed, strict=True)]
            if not any(late):
                state = self._converge(state, "equilibrium", self.options.tolerance)
                misses = self.shortfalls(setup.system.positions(state))
                if all(miss <= most for miss, most in zip(misses, allowed, strict=True)):
                    return state
                continue
            raised = False
            for term, limit, miss, most in zip(
                self._penalties(), limits, misses, allowed, strict=True
            ):
                if miss > most and term.stiffness < limit:
                    # no more than is missing: stiff penalties cost digits
                    factor = min(scene.wall.growth, 1.3 * miss / most)
                    term.stiffness = min(limit, factor * term.stiffness)
                    raised = True
            if not raised:
                state = self._converge(state, "equilibrium", self.options.tolerance)
                raise StageFailed(self._what_is_missing(state), state, setup.wall.stiffness, 0)
            state = self._converge(state, "root_wall", self.options.path_tolerance)

    def _what_is_missing(self, state: Floats) -> str:
        setup = self.setup
        wall, wedge, clamp, layers = self.shortfalls(setup.system.positions(state))
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
        state, verdict = relaxation.settle(state, tolerance, _SETTLE_DAMPING, budget)
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
