"""All stages of one cusp, from the flat template to its place in the root.

Order and reasons (design.md §3): bending is on from the first step and the state never crosses
itself. On a coarse mesh, ``boundary`` moves the sutured edge to its line in damped steps,
``hinged_edge`` takes the damping out, with the wall present (paper §3.2 step 3), ``clamped_edge``
turns the edge into its tangent half-plane (step 4), and ``contact_wedge`` closes the wedge,
lambda = 0 ... 1 (§3.4 step 2). Each ``refinement`` splits the triangles into four and goes on from
the same surface, which is free of crossings, too. ``first_row`` lays down what has no room in its
half-plane (``stages.blocked_edge``). Where P is too little to unfold a cusp on its way, more acts
so far, and ``unloading`` lets it down. ``root_wall`` raises the penalties of wall, wedge and clamp
until each holds (step 3) and layers keep their clearance, and ``equilibrium`` converges the
result. One step of each is in ``stages.moves``, the end in ``stages.raising``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from avneo_fem.equilibrium.condition import condition_number
from avneo_fem.equilibrium.directors import start_directors
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.harmonic import harmonic_extension
from avneo_fem.meshing.refine import prolong
from avneo_fem.stages.checkpoint import Checkpoint, CheckpointStore
from avneo_fem.stages.continuation import StageFailed, march
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.levels import Level, levels_of
from avneo_fem.stages.raising import PenaltyRaising
from avneo_fem.stages.record import CuspResult, Snapshot, StageRecord

__all__ = ["CuspSuturing"]

Floats = NDArray[np.float64]

#: a row that layers keep from the last of its way lies well enough; the judge looks at it, too
_ROW_FAR_ENOUGH = 0.95

#: what may help when a stage cannot be completed
_ADVICE = {
    "boundary": "raise solver.boundary_steps, or refine mesh.size",
    "hinged_edge": "raise solver.maximum_iterations, or refine mesh.size",
    "clamped_edge": "raise solver.clamp_steps, or refine mesh.size",
    "contact_wedge": "raise contact.steps, or refine mesh.size",
    "unloading": "raise solver.maximum_iterations, or diastolic_pressure",
    "refinement": "choose other mesh.refinements (0 splits nothing), or another mesh.size",
    "first_row": "refine mesh.size, or raise solver.inside_tolerance",
}


class CuspSuturing(PenaltyRaising):
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

    #: stages that a quality does without
    _left_out: tuple[str, ...] = ()

    def __init__(
        self,
        setup: CuspSetup,
        observer: Callable[[int, StageRecord], None],
        store: CheckpointStore | None = None,
        finer: Sequence[CuspMesh] = (),
        index: int | None = None,
    ) -> None:
        lambdas = setup.wedges.levels(setup.scene.contact.steps)
        unloads = setup.path_pressure > setup.scene.diastolic_pressure
        planned = levels_of(setup.scene, setup.placement_k, lambdas, finer, unloads)
        levels = [level for level in planned if level.name not in self._left_out]
        name = setup.index if index is None else index
        super().__init__(setup, levels, observer, store, name)
        self.finer = finer

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
            condition=condition_number(setup.system, state),
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
        self._ease_clamp(points)
        return self._begin()

    def _go_on_from(self, checkpoint: Checkpoint) -> Floats:
        """Take over what a checkpoint holds; its state."""
        behind = self.levels[: checkpoint.levels_done + checkpoint.finished]
        mesh = max((level.mesh for level in behind), default=0)
        if mesh:
            self.setup = self.setup.on_mesh(self.finer[mesh - 1], checkpoint.snapshots[-1].points)
        self.records, self.snapshots = checkpoint.records, checkpoint.snapshots
        stiffness = checkpoint.penalty_stiffness
        for term, value in zip(self._penalties(), stiffness, strict=True):
            term.stiffness = value
        self.setup.clamp.reference = checkpoint.clamp_reference
        self.setup.wedge.clearance = checkpoint.wedge_clearance
        self._set_directors(checkpoint.directors)
        return checkpoint.state

    def _activate(self, level: Level, parameter: float) -> None:
        """Terms and held unknowns that come with a level; they stay for all later ones.

        ``parameter`` is where the level starts, or its end when it is behind the state.
        """
        setup, name = self.setup, level.name
        if name == "hinged_edge":
            # from here on the cusp must not slip behind its own sutured edge
            setup.system.terms = [setup.wall]
        elif name == "clamped_edge":
            setup.system.fix(setup.model.angle_dofs[self._suture_edges(setup.row.has_room)])
            setup.system.terms = [setup.wall, setup.clamp]
        elif name == "contact_wedge":
            clamp = [setup.clamp] if setup.scene.material.bending else []
            setup.system.terms = [setup.wall, *clamp, setup.wedge]
            setup.clamp.active = setup.row.has_room
            setup.wedge.field = setup.wedge_field(max(parameter, 0.0))
        elif name == "first_row":
            held = ~setup.row.is_left
            setup.system.fix(setup.model.angle_dofs[self._suture_edges(held)])
            setup.system.fix(setup.model.position_dofs[setup.row.nodes])
            setup.clamp.active = held
        if name == "unloading":
            setup.model.pressure = self._pressure(parameter)
        elif name not in ("placement", "boundary"):
            setup.model.pressure = setup.path_pressure

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
            "unloading": (self._unload, after - before, ""),
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
