"""The command line: bad input in one line, what goes to which stream, and what is imported."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.report import geometry_report, to_json
from avneo_fem.results.surfaces import read_stl, write_stl
from avneo_fem.scene import load_scene
from run_cases import SMALL, Run, avneo, avneo_inside, environment, written
from valve_cases import DEMOS

#: Scenes no one can build: TOML text, then what the message must say of key = value, and of what
#: would be valid.
BAD: dict[str, tuple[str, str, str]] = {
    "unknown key": (
        "[template]\nthicknes = 0.5",
        "template.thicknes = 0.5",
        "did you mean 'thickness'",
    ),
    "unknown table": ("[stich]\nx = 1", "stich = {'x': 1}", "did you mean 'stitching'"),
    "negative thickness": ("[template]\nthickness = -0.5", "template.thickness = -0.5", "> 0"),
    "suction": ("diastolic_pressure = -1.0", "diastolic_pressure = -1.0", ">= 0"),
    "radius of the paper": (
        "[template]\nbelly_radius = 33.0",
        "template.belly_radius = 33.0",
        "R_s < sqrt(H_i^2 + L_f^2/4) = 22.6",
    ),
    "of one cusp": (
        "[[cusp]]\n[[cusp]]\ntemplate.belly_radius = 33.0\n[[cusp]]",
        "cusp.1.template.belly_radius = 33.0",
        "R_s < ",
    ),
    "text": ("[mesh]\nsize = 'fine'", "mesh.size = 'fine'", "a finite number > 0"),
    "truth value": ("[mesh]\nsize = true", "mesh.size = True", "a finite number > 0"),
    "nan": ("[root]\nradius = nan", "root.radius = nan", "a finite number > 0"),
    "infinite": ("[root]\nradius = inf", "root.radius = inf", "a finite number > 0"),
    "whole number": ("[contact]\nsteps = 2.5", "contact.steps = 2.5", "an integer >= 1"),
    "material": ("[material]\nmodel = 'rubber'", "material.model = 'rubber'", '"neo_hookean"'),
    "fidelity": ("fidelity = 'best'", "fidelity = 'best'", '"draft" or "standard"'),
    "no triangle": (
        "[commissures]\nchord_ratio = [1.0, 1.0, 3.0]",
        "commissures.chord_ratio = (1.0, 1.0, 3.0)",
        "must form a triangle: a_2 = 3 must lie between 0 and a_0 + a_1 = 2",
    ),
    "two chords": (
        "[commissures]\nchord_ratio = [1.0, 1.0]",
        "commissures.chord_ratio = [1.0, 1.0]",
        "an array of 3",
    ),
    "two cusps": ("[[cusp]]\n[[cusp]]", "cusp = ", "three [[cusp]] tables"),
    "gap": ("[commissures]\ngap = 26.0", "commissures.gap = 26.0", "below its arc of 25.1327"),
    "too long a cusp": (
        "[template]\nfree_edge_length = 130.0",
        "template.free_edge_length = 130.0",
        "would do",
    ),
    "too little gather": (
        "[stitching]\ngather_ratio = 1.5",
        "template.free_edge_length = 39.0",
        "would do",
    ),
    "method": ("[contact]\nmethod = 'planes'", "contact.method = 'planes'", '"virtual_planes"'),
    "no symmetry": (
        (DEMOS / "experiment_2.toml").read_text() + "[contact]\nmethod = 'symmetry_planes'\n",
        "contact.method = 'symmetry_planes'",
        "not symmetric: its chords (20.9068, ",
    ),
    "not TOML": ("[template\nthickness = 0.5", "scene file = ", "is not valid TOML"),
    "policy": (
        (DEMOS / "experiment_2.toml").read_text() + '\n[competence]\npolicy = "error"\n',
        "competence.policy = 'error'",
        '"warn" would go on',
    ),
}


def one_line(process: subprocess.CompletedProcess[str], key: str, valid: str) -> None:
    """Exit status 2, nothing on stdout, and one line on stderr that says what and what instead."""
    assert process.returncode == 2
    assert process.stdout == ""
    lines = process.stderr.splitlines()
    assert len(lines) == 1, process.stderr
    assert lines[0].startswith("avneo: ")
    assert key in lines[0]
    assert valid in lines[0]
    assert len(lines[0]) < 600


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes(tmp_path: Path, case: str) -> None:
    """Truth: design.md §2: exit status 2 for bad input, one line with key, value and what would be
    valid; nothing is left behind."""
    text, key, valid = BAD[case]
    scene = written(text, tmp_path)
    for arguments in (("check", scene), ("suture", scene, "-o", tmp_path / "out")):
        one_line(avneo_inside(*arguments), key, valid)
    assert [path.name for path in tmp_path.iterdir()] == [scene.name]


def test_bad_file(tmp_path: Path) -> None:
    """Truth: a scene file that is missing, a folder, or not text is bad input, and says so."""
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00name")
    for path, why in (
        (tmp_path / "missing.toml", "cannot be read (No such file or directory)"),
        (tmp_path, "cannot be read (Is a directory)"),
        (binary, "is not valid TOML"),
    ):
        for command in ("check", "suture"):
            one_line(avneo_inside(command, path), f"scene file = '{path}'", why)


def test_bad_option(tmp_path: Path) -> None:
    """Truth: a fidelity that does not exist is bad input like that of the scene; so are options and
    commands that do not exist and a cusp beyond 2, by their own messages."""
    scene = written(SMALL, tmp_path)
    process = avneo_inside("check", scene, "--fidelity", "best")
    one_line(process, "fidelity = 'best'", '"draft" or "standard" or "fine" or "reference"')
    for arguments in (
        ("suture", scene, "--cusp", "3"),
        ("suture", scene, "--nonsense"),
        ("suture",),
        ("sew", scene),
    ):
        process = avneo_inside(*arguments)
        assert process.returncode == 2
        assert process.stdout == ""
        assert "Usage: " in process.stderr
        assert "Traceback" not in process.stderr


COARSE = SMALL.replace("size = 3.0", "size = 30.0")


@pytest.mark.parametrize("case", ["mesh", "placement"])
def test_bad_scenes_found_by_suture_only(
    tmp_path: Path, case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Truth: what takes a mesh, or the set-up of a cusp, to find out is bad input as well, and
    leaves no folder behind; an existing one it keeps."""
    key, valid = "mesh.size = 30.0", "too large"
    if case == "placement":
        key, valid = "placement.c1 = 1e-09", "must be larger"

        def impossible(*_arguments: Any) -> None:
            raise SceneError("placement.c1", 1e-9, "must be larger")

        monkeypatch.setattr("avneo_fem.valve.suture_valve.CuspSetup", impossible)
    scene = written(COARSE if case == "mesh" else SMALL, tmp_path)
    out = tmp_path / "out"
    one_line(avneo_inside("suture", scene, "-o", out), key, valid)
    assert not out.exists()
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    one_line(avneo_inside("suture", scene, "-o", out), key, valid)
    assert [path.name for path in out.iterdir()] == ["notes.txt"]


def test_no_gap_leaves_no_valve(tmp_path: Path) -> None:
    """Truth: neighbours on one line touch, so a valve without a gap is refused by ``suture``; its
    geometry can be looked at."""
    scene, out = written(f"{SMALL}\n[commissures]\ngap = 0.0\n", tmp_path), tmp_path / "out"
    one_line(avneo_inside("suture", scene, "-o", out), "commissures.gap = 0.0", "must be above 0")
    assert not out.exists()
    assert avneo_inside("check", scene).returncode == 0


def test_a_mesh_too_coarse_keeps_old_results(tmp_path: Path) -> None:
    """Truth: bad input is found before the report of an older run is removed."""
    scene, out = written(COARSE, tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "report.json").write_text("{}")
    one_line(avneo_inside("suture", scene, "-o", out), "mesh.size", "too large")
    assert (out / "report.json").read_text() == "{}"


@pytest.mark.parametrize("kind", ["a file", "below a file", "takes no files"])
def test_bad_folder(tmp_path: Path, kind: str) -> None:
    """Truth: results that cannot be written are found before anything is solved."""
    (tmp_path / "file").write_text("mine")
    out = {
        "a file": tmp_path / "file",
        "below a file": tmp_path / "file" / "out",
        "takes no files": Path("/proc/self"),
    }[kind]
    process = avneo_inside("suture", written(SMALL, tmp_path), "-o", out)
    one_line(process, f"output folder = '{out}'", "cannot be used (")
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("case", ["negative thickness", "not TOML"])
def test_bad_scenes_in_a_process(tmp_path: Path, case: str) -> None:
    """Truth: the same of a process of its own, from the shell's point of view."""
    text, key, valid = BAD[case]
    scene, out = written(text, tmp_path), tmp_path / "out"
    one_line(avneo("suture", scene, "-o", out), key, valid)
    assert not out.exists()


@pytest.mark.parametrize("number", [1, 2, 3])
def test_check(number: int) -> None:
    """Truth: status 0 also for Experiment 2, which is not competent but may go on; people read the
    table with the check values of design.md §1 on stderr; stdout has the geometry as JSON with
    ``--json`` and is empty without."""
    scene = DEMOS / f"experiment_{number}.toml"
    process = avneo_inside("check", scene, "--json")
    given = ValveInput.from_scene(load_scene(scene))
    expected = geometry_report(given.geometry, given.wedges)
    assert process.returncode == 0
    assert process.stdout == to_json(expected)
    assert json.loads(process.stdout)["nu_star"] == pytest.approx(
        {1: 0.6153, 2: 0.6031, 3: 0.9859}[number], abs=0.6e-4
    )
    ratios = {1: "0.5315", 2: "0.3963", 3: "0.8062"}
    for text in (ratios[number], expected["competence_reason"], "stitching ratio J_sl", "a_i [mm]"):
        assert text in process.stderr
    assert ("not competent: " in process.stderr) == (number == 2)
    assert avneo_inside("check", scene).stdout == ""
    assert avneo_inside("check", scene).stderr == process.stderr


def test_check_of_contact_planes(tmp_path: Path) -> None:
    """Truth: planes have no sigma*: null in the report, no row in the table."""
    scene = written("[contact]\nmethod = 'virtual_planes'", tmp_path)
    process = avneo_inside("check", scene, "--json")
    assert process.returncode == 0
    assert json.loads(process.stdout)["sigma"] is None
    assert "sigma" not in process.stderr
    assert "stitching ratio J_sl" in process.stderr


@pytest.mark.parametrize("number", [1, 2, 3])
def test_check_explains(number: int) -> None:
    """Truth: people read which lengths would do, those of the report; a valve in case 1 has none in
    proportion."""
    process = avneo_inside("check", DEMOS / f"experiment_{number}.toml", "--json")
    advice = json.loads(process.stdout)["free_edge_advice"]
    assert ("all L_f times nu*" in process.stderr) == (number != 2)
    assert "closing L_f, alone [mm]" in process.stderr
    if number == 2:
        assert advice["for_unit_nu"] is None
        assert advice["alone"][1] is None
        assert "31.51-40.49" in process.stderr
        assert "none" in process.stderr
    else:
        assert f"{advice['for_unit_nu'][1]:.3f}" in process.stderr


@pytest.mark.parametrize("number", [1, 2, 3])
def test_size(number: int) -> None:
    """Truth: status 0, L_f = 2 a / sqrt(3) and nu* of the rebuilt valve for people and as JSON."""
    scene = DEMOS / f"experiment_{number}.toml"
    process = avneo_inside("size", scene, "--json")
    assert process.returncode == 0, process.stderr
    report = json.loads(process.stdout)
    wanted = report["quasi_optimal"]
    expected = np.array(report["chord_lengths"]) * 2 / np.sqrt(3)
    np.testing.assert_allclose(wanted["free_edge_length"], expected)
    present = {1: [39.0] * 3, 2: [58.5, 39.0, 48.75], 3: [27.48948749, 18.32632499, 22.90790624]}
    np.testing.assert_allclose(report["present"]["free_edge_length"], present[number])
    np.testing.assert_allclose(wanted["change"], expected - present[number], atol=1e-7)
    assert report["verified"] is True
    assert f"nu* = {wanted['nu_star']:.4f}" in process.stderr
    assert "verified: " in process.stderr
    for length in wanted["free_edge_length"]:
        assert f"{length:.3f}" in process.stderr
    assert avneo_inside("size", scene).stdout == ""


def test_size_that_is_not_competent(tmp_path: Path) -> None:
    """Truth: status 1 when the limits of the scene leave no room for Proposition 3.2."""
    text = "[commissures]\nchord_ratio = [6.0, 4.0, 5.0]\n[competence]\nminimum_nu = 0.99"
    process = avneo_inside("size", written(text, tmp_path), "--json")
    assert process.returncode == 1
    assert json.loads(process.stdout)["verified"] is False
    assert "not verified: nu* = 0.9859 < 0.99" in process.stderr


def test_size_of_impossible_cusps(tmp_path: Path) -> None:
    """Truth: inconsistent present lengths are told, not fatal; status 2 in one line where the
    quasi-optimal cusp would not fit its suture line, or for a bad scene."""
    text = "[[cusp]]\ntemplate.free_edge_length = 90.0\n[[cusp]]\n[[cusp]]"
    process = avneo_inside("size", written(text, tmp_path))
    assert process.returncode == 0
    assert "now: no valve, cusp.0.template.free_edge_length = 90.0" in process.stderr
    scene = written("[template]\ncorner_height = 2.0", tmp_path)
    one_line(avneo_inside("size", scene), "free_edge_length = 23.9", "change corner_height")
    one_line(avneo_inside("size", written("[rot]", tmp_path)), "rot = {}", "'root'")


def test_check_takes_the_fidelity(tmp_path: Path) -> None:
    """Truth: ``--fidelity`` is accepted by every scene; it does not change the geometry."""
    scene = written(SMALL, tmp_path)
    plain = avneo_inside("check", scene, "--json")
    fine = avneo_inside("check", scene, "--json", "--fidelity", "fine")
    assert plain.stdout == fine.stdout


def test_check_needs_no_solver() -> None:
    """Truth: none of the heavy packages is imported for ``check``, ``--help`` or a bad scene: they
    take seconds, MPI starts with them, and a plain workstation may not have them."""
    script = (
        "import sys\n"
        "from avneo_fem.cli import main\n"
        "status = 0\n"
        "try:\n    main()\nexcept SystemExit as end:\n    status = end.code\n"
        "heavy = ('dolfinx', 'petsc4py', 'mpi4py', 'gmsh', 'ipctk', 'pyvista', 'vtkmodules',\n"
        "         'igl', 'h5py', 'matplotlib', 'ufl')\n"
        "print(status, sorted(set(heavy) & set(sys.modules)))\n"
    )
    for arguments, status in (
        (["check", str(DEMOS / "experiment_1.toml")], 0),
        (["size", str(DEMOS / "experiment_1.toml")], 0),
        (["suture", "missing.toml"], 2),
        (["tradeoff", "missing.toml"], 2),
    ):
        process = subprocess.run(
            [sys.executable, "-c", script, *arguments],
            env=environment(),
            capture_output=True,
            text=True,
            check=True,
        )
        assert process.stdout == f"{status} []\n"


def test_entry_points() -> None:
    """Truth: ``avneo`` and ``python -m avneo_fem`` are the same command, which explains itself."""
    (entry,) = entry_points(group="console_scripts", name="avneo")
    assert entry.value == "avneo_fem.__main__:main"
    assert entry.load().__module__ == "avneo_fem.cli"
    text = avneo("--help")
    assert text.returncode == 0
    for command in ("check", "size", "suture", "plot", "tradeoff"):
        assert f" {command} " in text.stdout
    for option in ("--output", "--fidelity", "--set", "--cusp", "--resume", "--json"):
        assert option in avneo_inside("suture", "--help").stdout


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (None, "holds no readable report.json"),
        ("{", "holds no readable report.json"),
        ("{}", "its report.json is not that of a run"),
        ("[1, 2]", "its report.json is not that of a run"),
        ('{"scene": {}, "cusps": [{"index": "first"}]}', "its report.json is not that of a run"),
    ],
)
def test_plot_of_no_results(tmp_path: Path, content: str | None, why: str) -> None:
    """Truth: a folder that holds no results is bad input."""
    if content is not None:
        (tmp_path / "report.json").write_text(content)
    one_line(avneo_inside("plot", tmp_path), f"DIR = '{tmp_path}'", why)


def test_plot_without_surfaces(tmp_path: Path, failing_run: Run) -> None:
    """Truth: a missing or broken surface file is named."""
    report = (failing_run.folder / "report.json").read_text()
    (tmp_path / "report.json").write_text(report)
    path = tmp_path / "cusp_0.stl"
    one_line(avneo_inside("plot", tmp_path), f"surface file = '{path}'", "cannot be read")
    path.write_bytes((failing_run.folder / "cusp_0.stl").read_bytes()[:-7])
    one_line(avneo_inside("plot", tmp_path), f"surface file = '{path}'", "cannot be read")
    assert not (tmp_path / "valve.png").exists()


def test_read_stl_returns_what_was_written(tmp_path: Path) -> None:
    """Truth: the same triangles in the same order, in single precision; corners at one place are
    one point, so that neighbours are neighbours again."""
    random = np.random.default_rng(1)
    points = random.normal(size=(30, 3))
    triangles = np.array([random.choice(30, 3, replace=False) for _ in range(50)])
    write_stl(tmp_path / "s.stl", points, triangles, "name")
    found, corners = read_stl(tmp_path / "s.stl")
    np.testing.assert_array_equal(found[corners], points.astype(np.float32)[triangles])
    assert len(found) == len(np.unique(triangles))
    for one, two in ((0, 1), (3, 40)):
        shared = np.intersect1d(triangles[one], triangles[two])
        assert len(np.intersect1d(corners[one], corners[two])) == len(shared)


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data[:50],
        lambda data: data[:-1],
        lambda data: data + b"\0" * 50,
        lambda _data: b"solid ascii\nendsolid",
        lambda _data: b"",
    ],
)
def test_read_stl_refuses(tmp_path: Path, change: Any) -> None:
    """Truth: a file whose length does not fit its number of triangles is no result of ours."""
    path = tmp_path / "s.stl"
    write_stl(path, np.eye(3), [[0, 1, 2]])
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(SceneError, match=r"surface file = .* cannot be read"):
        read_stl(path)
