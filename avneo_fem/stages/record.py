"""What a run keeps of its stages."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["CuspResult", "Snapshot", "StageRecord"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StageRecord:
    """Verdict of one level of a stage.

    ``parameter`` is the boundary fraction, clamp fraction, lambda or eta_1 [kPa]; ``residual``
    the undamped one over the pressure load, ``substeps`` the number of steps the level took.
    """

    name: str
    parameter: float
    iterations: int
    reason: str
    residual: float
    seconds: float
    substeps: int = 1


@dataclass(frozen=True)
class Snapshot:
    """State of a cusp at the end of a level: positions (n, 3) and nodal fields for ParaView."""

    name: str
    parameter: float
    points: Floats
    fields: dict[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class CuspResult:
    """One cusp at the end of its stages.

    ``residual`` is that of the final undamped equilibrium over the pressure load; ``failure``
    says which stage failed and why, None when all ran. ``copied_from`` is the index of the
    congruent cusp this one was rotated from, ``shares`` the seconds spent in assembly,
    factorization, collision, penalties and all the rest ("python"), compilation apart,
    ``energy`` the final one, penalties included and the pressure's work apart [mN mm], and
    ``condition`` the condition number of the tangent there.
    """

    index: int
    mesh: CuspMesh
    points: Floats
    records: list[StageRecord]
    snapshots: list[Snapshot]
    residual: float
    dofs: int
    failure: str | None
    compile_seconds: float
    seconds: float
    copied_from: int | None = None
    shares: dict[str, float] = field(default_factory=dict)
    energy: float = float("nan")
    condition: float = float("nan")
