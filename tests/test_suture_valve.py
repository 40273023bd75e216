"""Cusps on ranks: who solves which, the same result everywhere, and one error ends all."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.scene import parse_scene
from avneo_fem.stages.record import CuspResult
from avneo_fem.valve import suture_valve as module
from avneo_fem.valve.suture_valve import mesh_templates, suture_valve
from run_cases import SMALL, SMALL_ALL, Run, command, environment, suture_inside, written

UNEQUAL = {"cusp": [{"template": {"thickness": 0.4}}, {}, {}]}


class Rank:
    """One of several ranks, run one after the other, the first last."""

    def __init__(self, rank: int, size: int, parts: dict[int, Any]) -> None:
        self.rank, self.size, self.parts = rank, size, parts

    def Barrier(self) -> None:
        """All are in one process."""

    def gather(self, part: Any, root: int) -> list[Any] | None:
        assert root == 0
        self.parts[self.rank] = part
        return [self.parts[rank] for rank in range(self.size)] if self.rank == 0 else None


class FakeSuturing:
    """Solves nothing; the result says which cusp and mesh it was asked for."""

    def __init__(
        self, setup: tuple[int, Any], _observer: Any, _store: Any, _finer: Any, index: int
    ) -> None:
        self.index, self.mesh = index, setup[1]

    def run(self, resume: bool) -> CuspResult:
        points = np.zeros((2, 3))
        reason = f"solved {self.index}, resume {resume}"
        return CuspResult(self.index, self.mesh, points, [], [], 0.0, 0, reason, 1.0, 1.0)


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Deal out cusps over ranks without solving; (results of rank 0, indices solved per rank)."""
    monkeypatch.setattr(module, "CuspSetup", lambda _s, _g, _w, index, mesh: (index, mesh))
    monkeypatch.setattr(module, "CuspSuturing", FakeSuturing)
    monkeypatch.setattr(module, "clear_stale_kernels", lambda: 0)

    def run(
        scene: dict[str, Any], size: int, only: int | None = None
    ) -> tuple[list[CuspResult], list[list[int]]]:
        given = ValveInput.from_scene(parse_scene({"mesh": {"size": 4.0}} | scene))
        parts: dict[int, Any] = {}
        for rank in reversed(range(size)):
            comm = Rank(rank, size, parts)
            results = suture_valve(given, resume=True, only=only, comm=comm)
            assert rank == 0 or results == []
        return results, [[part.index for part in parts[rank]] for rank in range(size)]

    return run


@pytest.mark.parametrize(
    ("scene", "size", "solved", "copied"),
    [
        ({}, 1, [[0]], [None, 0, 0]),
        ({}, 2, [[0], []], [None, 0, 0]),
        ({}, 3, [[0], [1], [2]], [None, None, None]),
        ({}, 5, [[0], [1], [2], [], []], [None, None, None]),
        ({"reuse_congruent": False}, 1, [[0, 1, 2]], [None, None, None]),
        ({"reuse_congruent": False}, 2, [[0, 2], [1]], [None, None, None]),
        (UNEQUAL, 1, [[0, 1]], [None, None, 1]),
        (UNEQUAL, 2, [[0], [1]], [None, None, 1]),
    ],
)
def test_dealing_out(pretend: Any, scene: dict, size: int, solved: list, copied: list) -> None:
    """Truth: by hand: each cusp to solve goes to one rank in turn; congruent ones are copied unless
    there are as many ranks as cusps; rank 0 has all three in order."""
    results, of_ranks = pretend(scene, size)
    assert of_ranks == solved
    assert [result.index for result in results] == [0, 1, 2]
    assert [result.copied_from for result in results] == copied
    for result in results:
        source = result.index if result.copied_from is None else result.copied_from
        assert result.failure == f"solved {source}, resume True"


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("only", [0, 1, 2])
def test_one_cusp_only(pretend: Any, size: int, only: int) -> None:
    """Truth: just that cusp, solved and not copied, by the first rank."""
    results, of_ranks = pretend({}, size, only)
    assert of_ranks == [[only]] + [[]] * (size - 1)
    assert [(result.index, result.copied_from) for result in results] == [(only, None)]


def test_meshes() -> None:
    """Truth: cusps that are stitched alike share a mesh, others have their own; a size too large
    for one of them is an error of the scene."""
    given = ValveInput.from_scene(parse_scene({"mesh": {"size": 3.0}} | UNEQUAL))
    meshes = mesh_templates(given)
    assert [meshes[index] is meshes[0] for index in range(3)] == [
        cusp.template == given.scene.cusp[0].template for cusp in given.scene.cusp
    ]
    assert len({id(of_cusp) for of_cusp in meshes}) == 2
    given = ValveInput.from_scene(parse_scene({"mesh": {"size": 30.0}}))
    with pytest.raises(SceneError, match=r"mesh\.size = 30\.0: too large"):
        mesh_templates(given)


def test_three_ranks(small_run_of_ranks: Run, small_run: Run, small_run_of_all: Run) -> None:
    """Truth: the runs in one process, with and without reuse of congruent cusps: all nodes of every
    level looked at within 1e-6 mm, same verdict and status; each rank told of its own cusp."""
    run, report = small_run_of_ranks, small_run_of_ranks.report
    assert (run.process.returncode, report["verified"]) == (0, True)
    assert small_run.process.returncode == 0
    assert report["timing"]["ranks"] == 3
    assert small_run.report["timing"]["ranks"] == 1
    assert [cusp["copied_from"] for cusp in report["cusps"]] == [None, None, None]
    for other in (small_run, small_run_of_all):
        for step in (0, 5, 11, 15, -1):
            assert np.abs(run.points(step) - other.points(step)).max() < 1e-6
    for index in (1, 2):
        told = [line for line in run.process.stderr.splitlines() if f"cusp {index} " in line]
        assert len(told) == len(report["cusps"][index]["stages"])
        assert all(line.endswith(f"(rank {index})") for line in told)
    assert sorted(path.name for path in run.folder.iterdir()) == sorted(
        path.name for path in small_run.folder.iterdir()
    )


def test_json_once_from_three_ranks(small_run_of_ranks: Run) -> None:
    """Truth: stdout is one report, that of the file, however many ranks there are."""
    text = (small_run_of_ranks.folder / "report.json").read_text()
    assert small_run_of_ranks.process.stdout == text


def test_one_cusp_is_that_of_the_whole_valve(small_run: Run, tmp_path: Path) -> None:
    """Truth: ``--cusp 1`` gives cusp 1 of the whole run, to 1e-6 mm, and nothing of the others."""
    run = suture_inside(SMALL, tmp_path, "--cusp", "1")
    assert run.process.returncode == 0
    report = run.report
    assert [cusp["index"] for cusp in report["cusps"]] == [1]
    assert report["valve"]["min_distance_mm"] is None
    assert sorted(path.name for path in run.folder.glob("*.stl")) == ["cusp_1.stl"]
    whole = small_run.points()
    count = len(whole) // 3
    assert np.abs(run.points() - whole[count : 2 * count]).max() < 1e-6


BROKEN_RANK = """
import sys
from avneo_fem.compat import MPI
from avneo_fem.errors import SceneError
from avneo_fem.valve import suture_valve

class Setup:
    def __init__(self, *rest):
        if MPI.COMM_WORLD.rank == 1:
            raise {error}
        MPI.COMM_WORLD.recv(source=1)  # never sent: waits for ever

suture_valve.CuspSetup = Setup
sys.argv[0] = "avneo"
from avneo_fem.cli import main
main()
"""


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        ("SceneError('mesh.size', 9.0, 'too large')", 2, "avneo: mesh.size = 9.0: too large"),
        ("RuntimeError('unforeseen')", 1, "RuntimeError: unforeseen"),
    ],
)
def test_an_error_on_one_rank_ends_all(tmp_path: Path, error: str, status: int, text: str) -> None:
    """Truth: the others, which wait for that rank, are ended too; its message is seen, its exit
    status is that of the run, and there is no report."""
    scene, script = written(SMALL_ALL, tmp_path), tmp_path / "broken.py"
    script.write_text(BROKEN_RANK.format(error=error))
    process = subprocess.run(
        command(script, "suture", scene, "-o", tmp_path / "out", ranks=2),
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert process.returncode == status
    assert process.stderr.count(text) == 1
    assert not (tmp_path / "out" / "report.json").exists()
