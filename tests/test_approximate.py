"""Quality approximate: the same stages, another end."""

from __future__ import annotations

from pathlib import Path

import pytest

from avneo_fem.constraints.collision_response import CrossingsRemain
from avneo_fem.stages import approximate
from run_cases import SMALL, Run, suture_inside

DEMOS = Path(__file__).parent.parent / "demos"
#: One refinement, so that there is a finest mesh to be quick on.
QUICK = SMALL.replace(
    "inside_tolerance = 0.3", 'inside_tolerance = 0.05\nquality = "approximate"'
).replace("size = 3.0", "size = 1.5")


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The small scene, approximately."""
    return suture_inside(QUICK, tmp_path_factory.mktemp("quick"))


def test_verified_for_what_it_claims(quick: Run) -> None:
    """Truth: exit status 0 without equilibrium: no crossing, mid-surfaces inside wedge and root to
    the tolerance, sutured edges in place, no sag; the residual is told and is none of one."""
    report = quick.report
    assert (quick.process.returncode, report["verified"]) == (0, True)
    assert report["valve"]["cusp_intersections"] == 0
    for cusp in report["cusps"]:
        assert cusp["self_intersections"] == 0
        assert cusp["outside_root_mm"] <= 0.05
        assert cusp["outside_wedge_mm"] <= 0.05
        assert cusp["free_edge_sag_mm"] <= 0.1
        assert cusp["suture_error_mm"] <= 1e-6
        assert cusp["residual"] > 1e-8


def test_no_level_converges_on_the_finest_mesh(quick: Run) -> None:
    """Truth: on the finest mesh no level takes more than its few iterations and says what the
    resolver did; nothing is laid down; there is no stage called equilibrium."""
    stages = quick.report["cusps"][0]["stages"]
    names = [stage["name"] for stage in stages]
    assert "first_row" not in names
    assert "equilibrium" not in names
    last = names.index("refinement")
    for stage in stages[last:]:
        assert stage["iterations"] <= 3 * stage["substeps"] + 3
        assert stage["reason"].endswith("damped iterations")
        assert "impulses" in stage["reason"]


def test_crossings_that_remain_are_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Truth: a resolver that cannot clear a move is a named failure of its stage, exit status 1;
    the state that is left has no crossing."""

    def never(*_args: object, **_options: object) -> None:
        raise CrossingsRemain(3)

    monkeypatch.setattr(approximate, "resolve", never)
    run = suture_inside(QUICK, tmp_path)
    assert (run.process.returncode, run.report["verified"]) == (1, False)
    failure = run.report["cusps"][0]["failure"]
    assert failure.startswith("refinement: stopped at 0 of 1")
    assert str(CrossingsRemain(3)) in failure
    assert run.report["cusps"][0]["self_intersections"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 3])
def test_experiments(number: int, tmp_path: Path) -> None:
    """Truth: the paper's experiments come out inside and free of crossings at the paper's mesh."""
    text = (DEMOS / f"experiment_{number}.toml").read_text()
    run = suture_inside(text + '\n[solver]\nquality = "approximate"\n', tmp_path)
    assert run.report["failures"] == []
    assert (run.process.returncode, run.report["verified"]) == (0, True)
