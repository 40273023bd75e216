"""Progress of one cusp on disk, so that a killed run loses only its current level."""

from __future__ import annotations

import hashlib
import json
import pickle
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from avneo_fem.results.writing import written_whole
from avneo_fem.scene import Scene
from avneo_fem.stages.record import Snapshot, StageRecord

__all__ = ["Checkpoint", "CheckpointStore"]

Floats = NDArray[np.float64]


@dataclass
class Checkpoint:
    """Where a cusp stands: the state, what it took, and how many levels are complete.

    ``penalty_stiffness`` is that of wall, wedge, clamp and layers, ``clamp_reference`` the
    clamp's, ``wedge_clearance`` that of the nodes from the wedge.
    ``finished`` says that nothing is left to do; then ``residual`` and ``failure`` are those of
    the result.
    """

    state: Floats
    directors: Floats
    levels_done: int
    penalty_stiffness: tuple[float, float, float, float]
    clamp_reference: Floats
    wedge_clearance: Floats
    records: list[StageRecord]
    snapshots: list[Snapshot]
    finished: bool = False
    residual: float = float("nan")
    failure: str | None = None


class CheckpointStore:
    """Checkpoints of one run in ``folder``, valid for exactly one resolved scene.

    A file that is unreadable or belongs to another scene counts as absent.
    """

    def __init__(self, folder: Path, scene: Scene, version: str) -> None:
        self.folder = folder
        text = json.dumps([scene.model_dump(mode="json"), version], sort_keys=True)
        self.key = hashlib.sha256(text.encode()).hexdigest()

    def path(self, index: int) -> Path:
        """File of cusp ``index``."""
        return self.folder / f"cusp_{index}.checkpoint"

    def save(self, index: int, checkpoint: Checkpoint) -> None:
        """Write a checkpoint, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with written_whole(self.path(index)) as temporary:
            temporary.write_bytes(pickle.dumps((self.key, checkpoint)))

    def load(self, index: int) -> Checkpoint | None:
        """The checkpoint of a cusp, None when there is none for this scene."""
        try:
            key, checkpoint = pickle.loads(self.path(index).read_bytes())
        except Exception:  # bytes that are no pickle can raise anything
            return None
        fits = key == self.key and isinstance(checkpoint, Checkpoint)
        return checkpoint if fits else None

    def clear(self) -> None:
        """Remove all checkpoints of the run, and what a kill while writing one left."""
        for pattern in ("cusp_*.checkpoint", ".cusp_*.checkpoint"):
            for path in self.folder.glob(pattern):
                path.unlink(missing_ok=True)
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()
