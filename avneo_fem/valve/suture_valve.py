"""Suture all cusps of a scene, shared out over the MPI ranks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from avneo_fem.compat import MPI, clear_stale_kernels
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.refine import nested_meshes
from avneo_fem.stages.approximate import ApproximateSuturing
from avneo_fem.stages.checkpoint import CheckpointStore
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.record import CuspResult, StageRecord
from avneo_fem.stages.suturing import CuspSuturing
from avneo_fem.valve.congruence import representatives, rotate_result, to_its_place

__all__ = ["mesh_templates", "suture_valve"]


def mesh_templates(given: ValveInput) -> list[list[CuspMesh]]:
    """Nested meshes of every cusp, from coarse to fine; the same on all ranks.

    Cusps of equal templates, suture lines and stitching share theirs.

    Raises
    ------
    SceneError
        When ``mesh.size`` is too large for one of them.
    """
    scene, meshes = given.scene, []
    known: list[tuple[Any, Any, list[CuspMesh]]] = []
    for table, cusp in zip(scene.cusp, given.geometry.cusps, strict=True):
        joints = cusp.suture_joints()
        # to rounding: congruent suture lines are not computed at the same place
        same = [
            mesh
            for template, of_them, mesh in known
            if template == table.template and np.allclose(of_them, joints, rtol=1e-9, atol=0.0)
        ]
        meshes.append(
            same[0]
            if same
            else nested_meshes(
                cusp.template,
                scene.mesh_size,
                scene.refinements,
                scene.mesh.refinements is None,
                joints,
            )
        )
        known.append((table.template, joints, meshes[-1]))
    return meshes


def suture_valve(
    given: ValveInput,
    observer: Callable[[int, StageRecord], None] = lambda _index, _record: None,
    store: CheckpointStore | None = None,
    resume: bool = False,
    only: int | None = None,
    comm: Any = MPI.COMM_WORLD,
    meshes: list[list[CuspMesh]] | None = None,
) -> list[CuspResult]:
    """Run the stages of every cusp.

    Congruent cusps are solved once and turned (``scene.reuse_congruent``), unless there are as
    many ranks as cusps: then nothing is saved by it and every rank takes one.

    Parameters
    ----------
    given : ValveInput
        Scene and geometry, the same on all ranks.
    observer : callable
        Told the cusp's index and every completed level, on the rank that solves it.
    store, resume
        Where progress is kept, and whether to go on from there.
    only : int or None
        Just this cusp.
    comm : MPI communicator
        Cusps are dealt out to its ranks.
    meshes : list or None
        What :func:`mesh_templates` gives, if at hand.

    Returns
    -------
    list of CuspResult
        In the order of the cusps; empty on all ranks but the first.
    """
    scene = given.scene
    if comm.rank == 0:
        clear_stale_kernels()
    comm.Barrier()
    wanted = [0, 1, 2] if only is None else [only]
    same = tuple(wanted)
    if only is None and scene.reuse_congruent and comm.size < len(wanted):
        same = representatives(scene, given.geometry, given.wedges)
    to_solve = sorted(set(same))
    meshes = mesh_templates(given) if meshes is None else meshes
    mine = []
    for number, index in enumerate(to_solve):
        if number % comm.size != comm.rank:
            continue
        first, *finer = meshes[index]
        own = given.seen_from(index)
        setup = CuspSetup(own.scene, own.geometry, own.wedges, 0, first)
        stages = CuspSuturing if scene.solver.quality == "equilibrium" else ApproximateSuturing
        result = stages(setup, observer, store, finer, index).run(resume)
        mine.append(to_its_place(own.geometry, given.geometry, result) if index else result)
    gathered = comm.gather(mine, root=0)
    if comm.rank != 0:
        return []
    solved = {result.index: result for part in gathered for result in part}
    return [
        solved[source] if source == index else rotate_result(given.geometry, solved[source], index)
        for index, source in zip(wanted, same, strict=True)
    ]
