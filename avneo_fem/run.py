"""A whole run: suture, verify, write the results."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from avneo_fem import __version__
from avneo_fem.compat import MPI, versions
from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.drawing import drawing_of
from avneo_fem.results.fields import principal_stresses, principal_stretches
from avneo_fem.results.forewarnings import forewarnings
from avneo_fem.results.history import HistoryStep, write_history
from avneo_fem.results.pictures import PictureError, draw_valve
from avneo_fem.results.report import build_report, geometry_report, write_report
from avneo_fem.results.surfaces import write_stl
from avneo_fem.results.verdict import judge
from avneo_fem.results.verification_input import constraints_of, surface_of, tolerances_of
from avneo_fem.results.verify import verify_valve
from avneo_fem.stages.checkpoint import CheckpointStore
from avneo_fem.stages.record import CuspResult, StageRecord
from avneo_fem.valve.suture_valve import mesh_templates, suture_valve

__all__ = ["draw_results", "run_scene"]


def run_scene(
    given: ValveInput,
    folder: Path,
    *,
    resume: bool = False,
    only: int | None = None,
    picture: bool = True,
    observer: Callable[[int, StageRecord], None] = lambda _index, _record: None,
    warn: Callable[[str], None] = lambda _text: None,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """Suture a valve and leave report, surfaces, history and picture in ``folder``.

    Parameters
    ----------
    given : ValveInput
        Scene and geometry.
    folder : Path
        Made if missing. ``report.json`` is written last.
    resume : bool
        Go on from the checkpoints of a killed run of the same scene.
    only : int or None
        Just this cusp.
    picture : bool
        Draw ``valve.png``, which takes seconds of a draft.
    observer, warn : callables
        Told of completed levels, and of things that did not work but do not stop the run.

    Returns
    -------
    dict
        The report (on every rank).

    Raises
    ------
    SceneError
        When neighbours share a suture line, a template cannot be meshed or placed as asked, or
        ``folder`` cannot be written to; a folder that was made for the run is then removed.
    """
    clock = time.perf_counter()
    if only is None and given.scene.commissures.gap == 0.0:
        raise SceneError(
            "commissures.gap",
            0.0,
            "must be above 0 for a valve: neighbouring cusps would be sewn to the same line, and"
            " cannot keep apart; a single cusp can be sutured (--cusp)",
        )
    meshes = mesh_templates(given)
    is_new = not folder.exists()
    comm.Barrier()
    _open_folder(folder)
    store = CheckpointStore(folder / "checkpoints", given.scene, __version__)
    if not resume and comm.rank == 0:
        store.clear()
    comm.Barrier()
    try:
        results = suture_valve(given, observer, store, resume, only, comm, meshes)
    except SceneError:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise
    report = None
    if comm.rank == 0:
        report = _finish(given, folder, results, clock, comm.size, picture, warn)
        store.clear()
    return comm.bcast(report, root=0)


def _open_folder(folder: Path) -> None:
    """Make the folder, see that it takes files, and remove report and picture of an older run."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        for name in ("report.json", "valve.png"):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        reason = f"cannot be used ({error.strerror})"
        raise SceneError("output folder", str(folder), reason) from None


def _finish(
    given: ValveInput,
    folder: Path,
    results: list[CuspResult],
    clock: float,
    ranks: int,
    picture: bool,
    warn: Callable[[str], None],
) -> dict[str, Any]:
    scene, geometry, wedges = given.scene, given.geometry, given.wedges
    verification = verify_valve(
        [surface_of(geometry, result) for result in results],
        [constraints_of(scene, geometry, wedges, result.index) for result in results],
        [result.residual for result in results],
    )
    failures = [
        f"cusp {result.index}: {result.failure}" for result in results if result.failure is not None
    ]
    failures += judge(verification, tolerances_of(given))
    if failures:
        failures += forewarnings(given)
    for result in results:
        write_stl(
            folder / f"cusp_{result.index}.stl",
            result.points,
            result.mesh.triangles,
            f"{scene.name} cusp {result.index}",
        )
    triangles, steps = _history(given, results)
    write_history(folder / "valve.xdmf", triangles, steps)
    try:
        if picture:
            surfaces = [(result.points, result.mesh.triangles) for result in results]
            draw_results(given, folder / "valve.png", surfaces)
    except PictureError as error:
        warn(str(error))
    report = build_report(
        scene,
        geometry_report(geometry, wedges),
        results,
        verification,
        failures,
        time.perf_counter() - clock,
        ranks,
        versions(),
    )
    write_report(folder / "report.json", report)
    return report


def draw_results(given: ValveInput, path: Path, surfaces: list[tuple[Any, Any]]) -> None:
    """Draw cusps, suture lines, commissures and contact curves to a PNG file."""
    drawing = drawing_of(given.geometry, surfaces)
    draw_valve(
        path,
        surfaces,
        drawing.radius,
        drawing.suture_lines,
        drawing.commissures,
        triple_contact_point=drawing.triple_contact_point,
        title=given.scene.name,
    )


def _history(given: ValveInput, results: list[CuspResult]) -> tuple[Any, list[HistoryStep]]:
    """All cusps as one mesh, one step per level; a cusp that is done early waits."""
    offsets = np.cumsum([0, *(len(result.points) for result in results)])
    triangles = np.vstack(
        [result.mesh.triangles + start for result, start in zip(results, offsets, strict=False)]
    )
    longest = max(results, key=lambda result: len(result.snapshots)).snapshots
    material = given.scene.material
    steps = []
    for number, leading in enumerate(longest):
        shots = [r.snapshots[min(number, len(r.snapshots) - 1)] for r in results]
        stretches = np.vstack(
            [
                principal_stretches(result.mesh.points, result.mesh.triangles, shot.points)
                for result, shot in zip(results, shots, strict=True)
            ]
        )
        stresses = principal_stresses(stretches, material.model, material.young_modulus)
        fields = {
            name: np.concatenate([shot.fields[name] for shot in shots]) for name in leading.fields
        }
        first = [result.snapshots[0].points for result in results]
        points = np.vstack([shot.points for shot in shots])
        fields["displacement"] = points - np.vstack(first)
        fields["cusp"] = np.repeat(
            [result.index for result in results], [len(shot.points) for shot in shots]
        )
        steps.append(
            HistoryStep(
                time=float(number),
                name=leading.name,
                parameter=leading.parameter,
                points=points,
                point_fields=fields,
                cell_fields={
                    "thickness_stretch": 1.0 / stretches.prod(axis=1),
                    "principal_stretch_1": stretches[:, 0],
                    "principal_stretch_2": stretches[:, 1],
                    "principal_stress_1": stresses[:, 0],
                    "principal_stress_2": stresses[:, 1],
                },
            )
        )
    return triangles, steps
