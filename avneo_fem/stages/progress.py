"""What a cusp's stages leave behind: records, snapshots for ParaView, checkpoints."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.stages.checkpoint import Checkpoint, CheckpointStore
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.levels import Level
from avneo_fem.stages.moves import CuspMoves
from avneo_fem.stages.record import Snapshot, StageRecord

__all__ = ["CuspProgress"]

Floats = NDArray[np.float64]


class CuspProgress(CuspMoves):
    """Keeps what was reached.

    Parameters
    ----------
    setup : CuspSetup
        Model, constraints and solver of the present mesh.
    levels : list of Level
        All that are known beforehand.
    observer : callable
        Told the cusp's index and every completed level.
    store : CheckpointStore or None
        Where progress is kept.
    index : int
        What the cusp is called towards observer and store.
    """

    def __init__(
        self,
        setup: CuspSetup,
        levels: list[Level],
        observer: Callable[[int, StageRecord], None],
        store: CheckpointStore | None,
        index: int,
    ) -> None:
        super().__init__(setup)
        self.levels, self.observer, self.store, self.index = levels, observer, store, index
        self.records: list[StageRecord] = []
        self.snapshots: list[Snapshot] = []

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
            wedge_clearance=setup.wedge.clearance,
            records=self.records,
            snapshots=self.snapshots,
            finished=finished,
            residual=residual,
            failure=failure,
        )
        self.store.save(self.index, kept)

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
