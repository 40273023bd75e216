"""A whole study: run every setting, measure it against the reference, write table and picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from avneo_fem.errors import SceneError
from avneo_fem.scene import Scene, load_scene
from avneo_fem.tradeoff.advice import advice, dominated_settings
from avneo_fem.tradeoff.measured import CuspMeasures, Errors, compare_cusps, measure_run, worst
from avneo_fem.tradeoff.plot import draw_tradeoff
from avneo_fem.tradeoff.rows import Row, row_of, write_csv
from avneo_fem.tradeoff.runs import Run, Study, kept_run, run_setting
from avneo_fem.tradeoff.settings import (
    REFERENCE,
    SECOND_PATH,
    Setting,
    chosen_settings,
    default_settings,
    second_path,
)

__all__ = ["Outcome", "evaluate", "plan", "run_study", "write_study"]


@dataclass(frozen=True)
class Outcome:
    """Rows of a study, the scatter (None when it is not known), who is dominated, and advice."""

    rows: tuple[Row, ...]
    scatter: Errors | None
    dominated: dict[str, str]
    advice: str


def plan(study: Study, texts: Sequence[str] = ()) -> list[Setting]:
    """The settings of a study: those that were asked for, or the default ones, and the
    reference's second path.

    Raises
    ------
    SceneError
        When the scene or a setting is bad input.
    """

    def scene_of(setting: Setting) -> Scene:
        return load_scene(study.scene, overrides=study.overrides_of(setting))

    defaults = default_settings(scene_of(Setting("standard", ("fidelity=standard",))))
    settings = chosen_settings(texts, defaults) if texts else defaults
    for setting in settings:
        scene_of(setting)  # an entry that does not exist is told before anything runs
    reference = next(setting for setting in settings if setting.name == REFERENCE)
    settings = [*settings, second_path(reference, scene_of(reference))]
    return settings


def run_study(
    study: Study,
    settings: Sequence[Setting],
    repeats: int,
    resume: bool,
    tell: Callable[[str], None] = lambda _text: None,
) -> dict[Setting, list[Run]]:
    """Run every setting ``repeats`` times, all of them once before any a second time.

    What failed or was stopped is not run again, and the reference's second path, which is there
    for its surface, is run once.

    Parameters
    ----------
    study, settings
        What to run.
    repeats : int
        At least 1.
    resume : bool
        Take the runs that are kept from before.
    tell : callable
        Told of every run.

    Raises
    ------
    SceneError
        When the folder cannot be written to.
    """
    if not resume:
        study.clear(settings)
    runs: dict[Setting, list[Run]] = {setting: [] for setting in settings}
    jobs = [(setting, k) for k in range(repeats) for setting in settings]
    jobs = [job for job in jobs if job[0].name != SECOND_PATH or job[1] == 0]
    for number, (setting, repeat) in enumerate(jobs, 1):
        start = f"[{number}/{len(jobs)}] {setting.name}, run {repeat + 1}"
        if any(run.status != 0 for run in runs[setting]):
            tell(f"{start}: not repeated")
            continue
        run = kept_run(study, setting, repeat) if resume else None
        kept = " (kept)" if run else ""
        if run is None:
            tell(f"{start} ...")
            run = run_setting(study, setting, repeat)
        runs[setting].append(run)
        tell(f"{start}: {run.message}, {run.cpu_seconds:.0f} s of processor time{kept}")
    return runs


def evaluate(runs: dict[Setting, list[Run]], target: float | None = None) -> Outcome:
    """Measure what the runs left against the reference."""
    measured: dict[str, dict[int, CuspMeasures]] = {}
    for setting, found in runs.items():
        report = found[0].report
        if report is not None:
            measured[setting.name] = measure_run(report, found[0].folder)
    reference = measured.get(REFERENCE)
    trusted = _is_verified(runs, REFERENCE)
    rows = []
    for setting, found in runs.items():
        own = measured.get(setting.name)
        errors = None
        if trusted and reference and own and own.keys() == reference.keys():
            errors = worst([compare_cusps(own[i], reference[i]) for i in reference])
        rows.append(row_of(setting, found, errors))
    second = next((row for row in rows if row.name == SECOND_PATH), None)
    scatter = second.errors if second is not None and second.verified else None
    dominated = dominated_settings(rows, scatter)
    return Outcome(tuple(rows), scatter, dominated, advice(rows, scatter, target))


def _is_verified(runs: dict[Setting, list[Run]], name: str) -> bool:
    reports = [found[0].report for setting, found in runs.items() if setting.name == name]
    return bool(reports) and reports[0] is not None and bool(reports[0]["verified"])


def write_study(folder: Path, outcome: Outcome, title: str) -> None:
    """Write ``tradeoff.csv`` and ``tradeoff.png``, each whole or not at all.

    Raises
    ------
    SceneError
        When the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_csv(folder / "tradeoff.csv", outcome.rows, outcome.dominated)
        draw_tradeoff(folder / "tradeoff.png", outcome.rows, outcome.scatter, title)
    except OSError as error:
        reason = f"cannot be used ({error.strerror})"
        raise SceneError("output folder", str(folder), reason) from None
