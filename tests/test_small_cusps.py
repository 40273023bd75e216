"""The scenes of demos/small_cusps, and scenes beyond both ends of what can be stitched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem.scene import load_scene
from run_cases import avneo_inside, written
from valve_cases import DEMOS

FOLDER = DEMOS / "small_cusps"
#: alpha -> J_sl, to two digits
RATIOS = {"1.00": 0.99, "1.16": 0.73, "1.90": 0.34}
CHORD = 24.0 * np.cos(0.5 / 24.0) * np.sin(np.pi / 3)


@pytest.mark.parametrize("alpha", RATIOS)
def test_check(alpha: str) -> None:
    """Truth: equal chords a = 2 R cos(gap/2R) sin 60: L_f = alpha a, nu* = 2/(sqrt(3) alpha)
    (Proposition 3.2), and C is the centre; alpha = 1 is not competent, which is said with the
    length that would do, 2 a / sqrt(3) = 23.99 mm."""
    process = avneo_inside("check", FOLDER / f"alpha_{alpha}.toml", "--json")
    assert process.returncode == 0
    found: dict[str, Any] = json.loads(process.stdout)
    np.testing.assert_allclose(found["chord_lengths"], CHORD, rtol=1e-12)
    np.testing.assert_allclose(found["commissure_lengths"], float(alpha) * CHORD, rtol=1e-7)
    assert found["nu_star"] == pytest.approx(2.0 / np.sqrt(3.0) / float(alpha), rel=1e-7)
    np.testing.assert_allclose(found["triple_contact_point"], 0.0, atol=1e-9)
    np.testing.assert_allclose(found["stitching_ratio"], RATIOS[alpha], atol=0.005)
    assert found["competent"] is (alpha != "1.00")
    if alpha == "1.00":
        assert "too small to close; all free_edge_length times 1.155 give" in process.stderr
        assert "(23.99, 23.99, 23.99 mm)" in process.stderr


def beyond(alpha: str, corner_height: float) -> str:
    """The scene with another corner height, as TOML text."""
    text = (FOLDER / f"alpha_{alpha}.toml").read_text(encoding="utf-8")
    old = load_scene(FOLDER / f"alpha_{alpha}.toml").cusp[0].template.corner_height
    assert f"corner_height = {old:g} " in text
    return text.replace(f"corner_height = {old:g} ", f"corner_height = {corner_height} ")


@pytest.mark.parametrize(
    ("alpha", "height", "ratio", "advice"),
    [("1.00", 5.5, "1.029", "longer by more than 1.125"), ("1.90", 34.0, "0.3325", "shorter by")],
)
def test_beyond_both_ends(
    tmp_path: Path, alpha: str, height: float, ratio: str, advice: str
) -> None:
    """Truth: a cusp suture line shorter than the aortic one, J_sl > 1, or more than alpha_sl = 3
    times as long, J_sl < 1/3, cannot be stitched (paper §3.2): `check` and `suture` refuse it in
    one line with the lengths that would do, and leave nothing behind."""
    scene = written(beyond(alpha, height), tmp_path)
    for arguments in (("check", scene), ("suture", scene, "-o", tmp_path / "out")):
        process = avneo_inside(*arguments)
        assert process.returncode == 2
        assert process.stdout == ""
        (line,) = process.stderr.splitlines()
        assert line.startswith("avneo: template.free_edge_length = ")
        for words in (f"= {ratio} must lie between", advice, "or corner_height"):
            assert words in line
    assert [path.name for path in tmp_path.iterdir()] == [scene.name]


@pytest.mark.parametrize(("alpha", "low", "high"), [("1.00", 6.07, 6.09), ("1.90", 33.8, 33.9)])
def test_the_ends(tmp_path: Path, alpha: str, low: float, high: float) -> None:
    """Truth: the corner heights that the messages name, 6.078 and 33.851 mm, separate what can be
    stitched from what cannot."""
    status = [
        avneo_inside("check", written(beyond(alpha, height), tmp_path)).returncode
        for height in (low, high)
    ]
    assert status == ([2, 0] if alpha == "1.00" else [0, 2])
