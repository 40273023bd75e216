"""The levels of one cusp that are known beforehand, in their order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.scene import Scene

__all__ = ["Level", "levels_of"]

_BOUNDARY_LEVELS = 10
_ROW_LEVELS = 2
_UNLOADING_LEVELS = 2


@dataclass(frozen=True)
class Level:
    """One level of a stage.

    Attributes
    ----------
    name : str
        The stage.
    start, stop : float
        Its parameter before and after: boundary or clamp fraction, lambda.
    mesh : int
        0 on the first mesh, one more with every refinement.
    """

    name: str
    start: float
    stop: float
    mesh: int = 0


def _steps(name: str, count: int, mesh: int = 0) -> list[Level]:
    return [Level(name, k / count, (k + 1) / count, mesh) for k in range(count)]


def levels_of(
    scene: Scene,
    placement: int,
    lambdas: Sequence[float],
    finer: Sequence[CuspMesh] = (),
    unloads: bool = False,
) -> list[Level]:
    """All levels up to the last mesh; the raising of penalties afterwards has as many as it needs.

    Parameters
    ----------
    scene : Scene
    placement : int
        k of the paper's search for the first position.
    lambdas : sequence of float
        How the contact wedge closes, from the level at which it appears (0) to 1.
    finer : sequence of CuspMesh
        Refinements of the first mesh.
    unloads : bool
        Whether the pressure on the way is more than P.
    """
    levels = [Level("placement", 0.0, float(placement))]
    levels += _steps("boundary", _BOUNDARY_LEVELS)
    levels += [Level("hinged_edge", 0.0, 1.0)]
    if scene.material.bending:
        levels += _steps("clamped_edge", scene.solver.clamp_steps)
    # lambda = 0 is a level of its own: there the wedge appears
    step = 1.0 / max(len(lambdas) - 1, 1)
    levels += [Level("contact_wedge", stop - step, stop) for stop in lambdas]
    levels += [Level("refinement", 0.0, 1.0, number + 1) for number in range(len(finer))]
    if scene.material.bending:
        levels += _steps("first_row", _ROW_LEVELS, len(finer))
    if unloads:
        levels += _steps("unloading", _UNLOADING_LEVELS, len(finer))
    return levels
