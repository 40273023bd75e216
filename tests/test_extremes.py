"""The map of extremes: its cases, how outcomes are judged, and a few real ends."""

from __future__ import annotations

import csv
import io
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from avneo_fem.errors import SceneError
from avneo_fem.extremes.campaign import run_map
from avneo_fem.extremes.case import ExtremeCase, flat, scene_text
from avneo_fem.extremes.cases import all_cases, selected
from avneo_fem.extremes.drawing import draw_map
from avneo_fem.extremes.outcome import Judgement, Kind, Outcome, classify, judged
from avneo_fem.extremes.running import deviation, kept_outcome, run_case
from avneo_fem.extremes.shaping import (
    BASE,
    chords_by_angles,
    in_other_units,
    of_thickness,
    proportioned,
    root_of,
    scene_of_entries,
    suture_line_lengths,
)
from avneo_fem.extremes.table import bugs, summary, write_table
from avneo_fem.geometry.commissure import commissure_angles
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import Scene, parse_scene
from run_cases import SMALL, avneo, avneo_inside

CASES = all_cases()
FEASIBLE = ExtremeCase("good", "axis", "good", "a case that can be had")
HOPELESS = replace(FEASIBLE, name="hopeless", infeasible="cannot be", diagnosis="too large")


def quiet() -> Console:
    """A console that nobody reads."""
    return Console(file=io.StringIO(), width=200)


def report(**changes: Any) -> dict[str, Any]:
    """As much of report.json as is looked at."""
    cusp = {
        "index": 0,
        "copied_from": None,
        "failure": None,
        "residual": 1e-12,
        "condition": 3e5,
        "clamp_error_deg": {"rms": 2.0},
        "stages": [{"name": "boundary", "iterations": 3}, {"name": "equilibrium", "iterations": 4}],
    }
    copied = {**cusp, "index": 1, "copied_from": 0, "residual": 2e-12}
    return {"verified": True, "failures": [], "cusps": [cusp, copied], **changes}


# -- cases ---------------------------------------------------------------------------------------
def test_cases_are_distinct() -> None:
    """Truth: names are unique, and so are the scenes but for their names."""
    assert len({case.name for case in CASES}) == len(CASES) >= 60
    scenes = {scene_text(replace(case, name="x", about="")) for case in CASES}
    assert len(scenes) == len(CASES)


def test_cases_say_what_they_are() -> None:
    """Truth: every infeasible case says why and what must be said, every other neither."""
    for case in CASES:
        assert case.about, case.name
        assert case.label, case.name
        assert bool(case.infeasible) == bool(case.diagnosis), case.name
    names = [case.name for case in CASES]
    for case in CASES:
        assert not case.same_as or names.index(case.same_as) < names.index(case.name)


@pytest.mark.parametrize("case", [case for case in CASES if case.feasible], ids=lambda c: c.name)
def test_feasible_cases_have_a_geometry(case: ExtremeCase) -> None:
    """Truth: no feasible case is refused for its schema or geometry."""
    scene = parse_scene(tomllib.loads(scene_text(case)))
    ValveGeometry.from_scene(scene)
    assert scene.name == case.name


def test_axes_reach_their_ends() -> None:
    """Truth: the ends of the axes that issue 6 names, read from the parsed scenes."""
    scenes = {
        case.name: parse_scene(tomllib.loads(scene_text(case))) for case in CASES if case.feasible
    }
    for values, low, high in (
        ([s.cusp[0].template.thickness for n, s in scenes.items() if n[:2] == "h-"], 0.05, 2.0),
        ([s.material.young_modulus for s in scenes.values()], 10.0, 1e5),
        ([s.diastolic_pressure for n, s in scenes.items() if "pascals" not in n], 0.0, 40.0),
        ([s.mesh.size for n, s in scenes.items() if n.startswith("mesh")], 0.25, 3.0),
        ([s.root.radius for n, s in scenes.items() if n[:2] == "r-"], 2.0, 40.0),
        ([s.stitching.gather_ratio for s in scenes.values()], 1.01, 10.0),
        ([s.contact.steps for s in scenes.values()], 1, 100),
    ):
        assert min(values) == pytest.approx(low)
        assert max(values) >= high
    ratios = [
        ValveGeometry.from_scene(s).cusps[0].stitching.stitching_ratio
        for n, s in scenes.items()
        if n.startswith("j-")
    ]
    assert (min(ratios), max(ratios)) == pytest.approx((0.335, 0.995))
    angles = np.degrees([commissure_angles(s.commissures.chord_ratio) for s in scenes.values()])
    assert (angles.min(), angles.max()) == pytest.approx((15.0, 150.0))


def test_scene_text_is_toml() -> None:
    """Truth: what is written is what tomllib reads, arrays of tables included."""
    entries = {
        "mesh.size": 1.5,
        "material.bending": False,
        "cusp": [{"template.thickness": 1e-7}] * 3,
    }
    data = tomllib.loads(scene_text(ExtremeCase("a-1", "g", "l", "about # this", entries)))
    assert data == {
        "name": "a-1",
        "mesh": {"size": 1.5},
        "material": {"bending": False},
        "cusp": [{"template": {"thickness": 1e-7}}] * 3,
    }
    assert flat(data) == {**entries, "name": "a-1"}


def test_selected() -> None:
    """Truth: a group or name selects, long cases on demand; what is compared with comes along."""
    assert {case.group for case in selected(CASES, "^gap$")} == {"gap"}
    assert [case.name for case in selected(CASES, "units-metres$")] == ["base", "units-metres"]
    assert "mesh-0.25" not in [case.name for case in selected(CASES)]
    assert selected(CASES, with_long=True) == CASES
    with pytest.raises(SceneError, match=r"--only = 'nothing': matches no case; groups: base, "):
        selected(CASES, "nothing")
    with pytest.raises(SceneError, match="must be a regular expression"):
        selected(CASES, "(")


# -- shapes --------------------------------------------------------------------------------------
def test_proportioned() -> None:
    """Truth: L_f over the chord and J_sl of the built geometry are what was asked for."""
    entries = {**BASE, "commissures.chord_ratio": chords_by_angles(80.0, 60.0, 40.0)}
    geometry = ValveGeometry.from_scene(scene_of_entries(proportioned(entries, 1.4, 0.62)))
    assert geometry.commissure_lengths == pytest.approx(1.4 * geometry.commissures.chord_lengths)
    assert [cusp.stitching.stitching_ratio for cusp in geometry.cusps] == pytest.approx([0.62] * 3)
    # 2 R_s cannot be spanned by so short a suture line
    with pytest.raises(ValueError, match="no corner height gives"):
        proportioned(dict(BASE), 2.8, 0.9)


def test_shapes() -> None:
    """Truth: sides of a 30-60-90 triangle; suture lines of the geometry; lengths times R/12."""
    assert chords_by_angles(30.0, 60.0, 90.0) == pytest.approx([0.5, 3**0.5 / 2, 1.0])
    scene = scene_of_entries(proportioned(dict(BASE), 1.5, 0.6))
    built = [cusp.suture_line.length for cusp in ValveGeometry.from_scene(scene).cusps]
    assert suture_line_lengths(scene) == pytest.approx(built)
    large, small = (ValveGeometry.from_scene(scene_of_entries(root_of(r))) for r in (24.0, 12.0))
    assert large.commissures.points == pytest.approx(2.0 * small.commissures.points)
    assert large.cusps[0].template.area == pytest.approx(4.0 * small.cusps[0].template.area)
    assert scene_of_entries(of_thickness(0.3)).inside_tolerance(0.3) == pytest.approx(0.06)


def test_other_units_do_not_change_the_geometry() -> None:
    """Truth: all positions times the unit, to the last bit for a power of two."""
    one = ValveGeometry.from_scene(scene_of_entries(dict(BASE)))
    other = ValveGeometry.from_scene(scene_of_entries(in_other_units(dict(BASE), 2.0**-10)))
    assert (other.commissures.points * 2.0**10 == one.commissures.points).all()
    assert (other.triple_contact.point * 2.0**10 == one.triple_contact.point).all()
    scene = Scene()
    entries = in_other_units({}, 1e-3, 1e3)
    assert entries["diastolic_pressure"] == pytest.approx(8e3)
    assert entries["clamp.stiffness"] == pytest.approx(1e3 * 1e-6 * scene.clamp.stiffness)
    assert entries["clamp.tolerance_degrees"] == scene.clamp.tolerance_degrees


# -- outcomes ------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("status", "errors", "found", "off", "kind", "message"),
    [
        (0, "", report(), None, Kind.VERIFIED, ""),
        (0, "", report(), 1e-9, Kind.VERIFIED, ""),
        (0, "", report(), 2e-8, Kind.DIFFERS, "off by 2.0e-08"),
        (0, "", report(), float("nan"), Kind.DIFFERS, "off by nan"),
        (0, "", None, None, Kind.UNVERIFIED, "no report"),
        (0, "", report(verified=False), None, Kind.UNVERIFIED, "no report"),
        (0, "", report(failures=["sags"]), None, Kind.UNVERIFIED, "sags"),
        (1, "", report(failures=["sags", "cusp 1: as cusp 0"]), None, Kind.FAILED, "sags"),
        (1, "avneo: solver gave up\n", None, None, Kind.FAILED, "solver gave up"),
        (1, "Killed\n", None, None, Kind.CRASH, "exit status 1; its last words: Killed"),
        (
            1,
            "Traceback (most recent call last):\n  x\nKeyError: 'a'",
            None,
            None,
            Kind.CRASH,
            "KeyE",
        ),
        (2, "not competent: x\navneo: a.b = 1: bad\n", None, None, Kind.REFUSED, "a.b = 1: bad"),
        (2, "Usage: avneo\nNo such option\n", None, None, Kind.CRASH, "exit status 2"),
        (-11, "cusp 0 boundary\n", None, None, Kind.CRASH, "signal 11; its last words: cusp 0 b"),
        (None, "cusp 0 boundary\n\n", None, None, Kind.TIMEOUT, "killed; its last words: cusp 0"),
        (3, "", None, None, Kind.CRASH, "exit status 3; its last words: said nothing"),
    ],
)
def test_classify(
    status: int | None, errors: str, found: Any, off: float | None, kind: Kind, message: str
) -> None:
    """Truth: the exit statuses as the README has them; all else is a crash."""
    outcome = classify("good", status, errors, found, 1.5, off)
    assert (outcome.name, outcome.kind, outcome.seconds) == ("good", kind, 1.5)
    assert outcome.message.startswith(message)
    if found is not None:
        # copied cusps cost no iterations
        assert (outcome.iterations, outcome.residual, outcome.clamp_degrees) == (7, 2e-12, 2.0)
        assert outcome.condition == 3e5
        assert outcome.stage == "equilibrium"


@pytest.mark.parametrize(
    ("case", "kind", "message", "expected"),
    [
        (FEASIBLE, Kind.VERIFIED, "", Judgement.VERIFIED),
        (FEASIBLE, Kind.FAILED, "sags", Judgement.MISSED),
        (FEASIBLE, Kind.REFUSED, "bad", Judgement.BUG),
        (FEASIBLE, Kind.TIMEOUT, "", Judgement.BUG),
        (FEASIBLE, Kind.CRASH, "", Judgement.BUG),
        (FEASIBLE, Kind.DIFFERS, "", Judgement.BUG),
        (FEASIBLE, Kind.UNVERIFIED, "", Judgement.BUG),
        (HOPELESS, Kind.REFUSED, "mesh is too large", Judgement.RIGHT),
        (HOPELESS, Kind.FAILED, "mesh is too large", Judgement.RIGHT),
        (HOPELESS, Kind.REFUSED, "something else", Judgement.BUG),
        (HOPELESS, Kind.TIMEOUT, "too large", Judgement.BUG),
        (HOPELESS, Kind.VERIFIED, "", Judgement.BUG),
    ],
)
def test_judged(case: ExtremeCase, kind: Kind, message: str, expected: Judgement) -> None:
    """Truth: only what was stated beforehand, told in the right words, is no bug."""
    assert judged(case, Outcome(case.name, kind, message)) == expected


ENDED = [
    (FEASIBLE, Outcome("good", Kind.VERIFIED, "", 2.0, 40, 1e-12, 1.0, "end", 1e-10, 2e7)),
    (replace(FEASIBLE, name="late"), Outcome("late", Kind.FAILED, "sags", 2.0, 40, 1.0, 1.0, "b")),
    (replace(FEASIBLE, name="slow"), Outcome("slow", Kind.TIMEOUT, "killed")),
    (HOPELESS, Outcome("hopeless", Kind.REFUSED, "too large")),
]


def test_table(tmp_path: Path) -> None:
    """Truth: counts of the four judgements by hand; the CSV reads back."""
    assert summary(ENDED) == (
        "1 of 3 feasible verified (33 %), 1 of 1 infeasible rightly diagnosed, 1 bugs"
    )
    assert bugs(ENDED) == ["slow: timeout: killed"]
    write_table(tmp_path / "x.csv", ENDED)
    with (tmp_path / "x.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["judgement"] for row in rows] == [judged(*pair).value for pair in ENDED]
    assert rows[0]["residual"] == "1.0e-12"
    assert rows[2]["residual"] == ""
    assert [row["condition"] for row in rows] == ["2.0e+07", "", "", ""]


def test_map_is_drawn(tmp_path: Path) -> None:
    """Truth: a cell has the colour of its judgement, in the rows of its groups."""
    image = pytest.importorskip("matplotlib.image")
    path = tmp_path / "map.png"
    many = [(replace(case, group=f"g{k}"), outcome) for k in range(3) for case, outcome in ENDED]
    draw_map(path, many)
    pixels = (255 * image.imread(path)[..., :3]).round().astype(int).reshape(-1, 3)
    for colour in ("a6d8a8", "b8cbe4", "f6c77e", "ee8a80"):
        rgb = [int(colour[k : k + 2], 16) for k in (0, 2, 4)]
        assert (pixels == rgb).all(axis=1).sum() > 3000
    assert [item.name for item in tmp_path.iterdir()] == ["map.png"]


# -- runs ----------------------------------------------------------------------------------------
def test_map_resumes(tmp_path: Path) -> None:
    """Truth: with resume a case that ended is not run again, unless its scene has changed."""
    ran = []

    def run(case: ExtremeCase, folder: Path, reference: Path | None, limit: float) -> Outcome:
        ran.append((case.name, None if reference is None else reference.name, limit))
        if len(ran) == 2:
            raise KeyboardInterrupt
        return run_case(case, folder, reference, limit)

    refused = ExtremeCase("a", "g", "a", "suction", {"diastolic_pressure": -1.0}, "no", ">= 0")
    other = replace(refused, name="b", same_as="a")
    with pytest.raises(KeyboardInterrupt):
        run_map([refused, other], tmp_path, quiet(), run=run)
    ended = run_map([refused, other], tmp_path, quiet(), resume=True, run=run)
    assert [name for name, *_ in ran] == ["a", "b", "b"]
    assert ran[-1] == ("b", "a", 300.0)
    assert [judged(*pair) for pair in ended] == [Judgement.RIGHT] * 2
    changed = replace(refused, entries={"diastolic_pressure": -2.0})
    assert kept_outcome(refused, tmp_path / "a") == ended[0][1]
    assert kept_outcome(changed, tmp_path / "a") is None
    assert {"extremes.csv", "extremes.png"} <= {item.name for item in tmp_path.iterdir()}


def test_time_limit(tmp_path: Path) -> None:
    """Truth: a case that takes seconds of processor time, given one, is killed and called so."""
    case = ExtremeCase("slow", "g", "s", "small cusps", flat(tomllib.loads(SMALL)))
    outcome = run_case(case, tmp_path / "slow", None, 1.0)
    assert outcome.kind == Kind.TIMEOUT
    assert judged(case, outcome) == Judgement.BUG


def test_command(tmp_path: Path) -> None:
    """Truth: refusals end as stated, status 0; a pattern without a case is an error."""
    run = avneo_inside(
        "extremes", "-o", tmp_path, "--only", "gap-26|template-inside|template-collapsed"
    )
    assert run.returncode == 0
    assert "0 of 0 feasible verified, 3 of 3 infeasible rightly diagnosed, 0 bugs" in run.stderr
    assert len((tmp_path / "extremes.csv").read_text().splitlines()) == 4
    wrong = avneo("extremes", "-o", tmp_path, "--only", "nothing")
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr


def test_command_tells_bugs(tmp_path: Path) -> None:
    """Truth: status 1 when a case is killed."""
    run = avneo_inside("extremes", "-o", tmp_path, "--only", "^base$", "--time-limit", "1")
    assert run.returncode == 1
    assert "bug: base: timeout: killed" in run.stderr


@pytest.mark.slow
def test_some_real_cases(tmp_path: Path) -> None:
    """Truth: the base and far ends of five axes are verified, and the base in other units is it."""
    pattern = "^(base|p-40|h-2|r-2|bending-off|gather-1.01|units-(1024|metres))$"
    run = avneo("extremes", "-o", tmp_path, "--only", pattern)
    assert run.returncode == 0, run.stderr
    assert "8 of 8 feasible verified (100 %)" in run.stderr
    off = deviation(tmp_path / "units-1024", tmp_path / "base", 1024.0)
    assert off is not None
    assert off <= 1e-12
