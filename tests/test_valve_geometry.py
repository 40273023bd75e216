"""The whole geometry against the check values of design.md section 1, and its errors."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.scene import load_scene
from valve_cases import DEMOS, build, experiment

TABLE: dict[int, tuple[list[float], list[float], float]] = {
    1: ([0.5315] * 3, [19.5] * 3, 0.6153),
    2: ([0.3963, 0.6203, 0.3824], [14.625, 34.125, 24.375], 0.6031),
    3: ([0.8062, 0.7152, 0.7206], [6.872, 16.036, 11.454], 0.9859),
}


@pytest.mark.parametrize("source", ["code", "demo"])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_check_values(number: int, source: str) -> None:
    """Truth: the independently computed table of design.md section 1, to all its digits."""
    valve = experiment(number, source)
    ratios, contact, nu = TABLE[number]
    found = [cusp.stitching.stitching_ratio for cusp in valve.cusps]
    assert found == pytest.approx(ratios, abs=0.5e-4)
    assert valve.contact_lengths == pytest.approx(contact, abs=0.5e-3)
    assert valve.triple_contact.nu_star == pytest.approx(nu, abs=0.5e-4)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_demo_equals_code(number: int) -> None:
    """Truth: the demo files describe the scenes that design.md section 1 derives."""
    demo, code = experiment(number, "demo"), experiment(number, "code")
    assert demo.commissures.points == pytest.approx(code.commissures.points, abs=1e-12)
    assert demo.commissure_lengths == pytest.approx(code.commissure_lengths, abs=1e-8)
    for one, two in zip(demo.cusps, code.cusps, strict=True):
        assert one.template.suture_length == pytest.approx(two.template.suture_length, abs=1e-7)
        assert one.suture_line.length == pytest.approx(two.suture_line.length, abs=1e-12)
    assert load_scene(DEMOS / f"experiment_{number}.toml").name == f"experiment-{number}"


@pytest.mark.parametrize("number", [1, 2, 3])
def test_commissures_lie_between_the_ends(number: int) -> None:
    """Truth: A_i is half way from P_1 of cusp i+1 to P_0 of cusp i+2, at R cos(gap/2R), z = 0.

    The ends are 0.5 mm apart along the wall, A_0 lies on +x, and the chords keep their ratio.
    """
    valve = experiment(number, "code")
    ends = [cusp.suture_line.ends for cusp in valve.cusps]
    points = valve.commissures.points
    for i in range(3):
        before, after = ends[(i + 1) % 3][1], ends[(i + 2) % 3][0]
        assert points[i] == pytest.approx((before + after) / 2.0, abs=1e-13)
        assert np.linalg.norm(after - before) == pytest.approx(24.0 * np.sin(0.25 / 12.0))
    assert np.linalg.norm(points, axis=1) == pytest.approx([12.0 * np.cos(0.25 / 12.0)] * 3)
    assert points[0, 0] > 0.0
    assert np.abs(points[:, 2]).max() < 1e-12
    assert abs(points[0, 1]) < 1e-12
    ratio = np.array({1: [1.0, 1, 1], 2: [8.0, 9, 6], 3: [6.0, 4, 5]}[number])
    assert valve.commissures.chord_lengths / ratio == pytest.approx(
        [valve.commissures.chord_lengths[0] / ratio[0]] * 3, rel=1e-12
    )
    assert valve.commissures.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_sutured_edge() -> None:
    """Truth: corner to P_0, corner to P_1, middle to the bottom, b = +z there, on the wall."""
    valve = experiment(1, "code")
    for cusp in valve.cusps:
        s = np.array([0.0, 0.5, 1.0]) * cusp.template.suture_length
        position = cusp.sutured_position(s)
        assert position[[0, 2]] == pytest.approx(cusp.suture_line.ends, abs=1e-12)
        assert position[1, 2] == pytest.approx(-12.5, abs=1e-9)
        assert cusp.sutured_conormal(s)[1] == pytest.approx([0.0, 0.0, 1.0], abs=1e-7)
        fine = np.linspace(0.0, cusp.template.suture_length, 101)
        assert np.abs(valve.root.signed_distance(cusp.sutured_position(fine))).max() < 1e-12
        h = 1e-6
        slope = (cusp.sutured_position(fine[1:-1] + h) - cusp.sutured_position(fine[1:-1] - h)) / h
        slope /= np.linalg.norm(slope, axis=1, keepdims=True)
        assert np.abs(slope - cusp.sutured_tangent(fine[1:-1])).max() < 1e-4
        assert cusp.thickness == 0.5


def test_equal_cusps_are_rotations() -> None:
    """Truth: in Experiment 1 cusp i is cusp 0 turned by i thirds about z, and C is the axis."""
    valve = experiment(1, "code")
    s = np.linspace(0.0, valve.cusps[0].template.suture_length, 50)
    for cusp in valve.cusps:
        angle = 2.0 * np.pi * cusp.index / 3.0
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        expected = valve.cusps[0].sutured_position(s)
        expected[:, :2] = expected[:, :2] @ turn.T
        assert np.abs(cusp.sutured_position(s) - expected).max() < 1e-12
    assert np.abs(valve.triple_contact.point).max() < 1e-12


@pytest.mark.parametrize(
    ("data", "key"),
    [
        ({"template": {"belly_radius": 33.0}}, "template.belly_radius"),
        ({"cusp": [{}, {"template": {"belly_radius": 33.0}}, {}]}, "cusp.1.template.belly_radius"),
        (
            {"cusp": [{}, {}, {"template": {"free_edge_height": -12.0}}]},
            "cusp.2.template.free_edge_height",
        ),
        ({"commissures": {"chord_ratio": [1.0, 2.0, 3.5]}}, "commissures.chord_ratio"),
        ({"commissures": {"gap": 26.0}}, "commissures.gap"),
        ({"template": {"free_edge_length": 120.0}}, "template.free_edge_length"),
        ({"root": {"radius": 40.0}}, "template.free_edge_length"),
        (
            {
                "cusp": [{"template": {"free_edge_length": 120.0}}, {}, {}],
                "stitching": {"gather_ratio": 9.0},
            },
            "cusp.0.template.free_edge_length",
        ),
        # the order of the checks: template before chords before gap before stitching
        (
            {"template": {"belly_radius": 33.0}, "commissures": {"chord_ratio": [1.0, 1.0, 3.0]}},
            "template.belly_radius",
        ),
        ({"commissures": {"chord_ratio": [1.0, 1.0, 3.0], "gap": 99.0}}, "commissures.chord_ratio"),
        (
            {"commissures": {"gap": 99.0}, "template": {"free_edge_length": 120.0}},
            "commissures.gap",
        ),
    ],
)
def test_errors_name_their_entry(data: dict[str, Any], key: str) -> None:
    """Truth: the first violated condition, in the documented order, as the scene names it."""
    with pytest.raises(SceneError) as caught:
        build(data)
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("data", "low_is_sharp"),
    # in the first the CSL at L_f = 2 R_s, where the branch ends, is longer than the ASL already
    [({"template": {"free_edge_length": 120.0}}, False), ({"root": {"radius": 32.0}}, True)],
)
def test_stitching_advice_works(data: dict[str, Any], low_is_sharp: bool) -> None:
    """Truth: free edge lengths just inside the offered interval can be stitched, outside not."""
    with pytest.raises(SceneError) as caught:
        build(data)
    words = caught.value.valid.rsplit("; between ", 1)[1].split()
    low, high = float(words[0]), float(words[2])
    for length in (low * 1.001, high * 0.999):
        build({**data, "template": {"free_edge_length": length}})
    for length in [high * 1.001, low * 0.999][: 1 + low_is_sharp]:
        with pytest.raises(SceneError, match="J_sl"):
            build({**data, "template": {"free_edge_length": length}})


def test_stitching_without_a_free_edge_that_would_do() -> None:
    """Truth: when pi R_s + 2 H_i alone is too long, the error blames those and not L_f."""
    with pytest.raises(SceneError, match="no free_edge_length would do") as caught:
        build({"root": {"radius": 4.0}, "stitching": {"gather_ratio": 2.0}})
    limit = float(caught.value.valid.rsplit("below ", 1)[1].split()[0])
    assert np.pi * 16.5 + 23.0 > limit


@pytest.mark.parametrize(
    ("tables", "low_is_sharp"),
    [
        ({"template": {"free_edge_length": 20.78, "belly_radius": 8.79, "corner_height": 5}}, True),
        (
            {"template": {"free_edge_length": 39.5, "belly_radius": 16.7, "corner_height": 40}},
            False,
        ),
    ],
)
def test_corner_height_advice_works(tables: dict[str, Any], low_is_sharp: bool) -> None:
    """Truth: corner heights just inside the offered range can be stitched, outside not."""
    with pytest.raises(SceneError) as caught:
        build(tables)
    words = caught.value.valid.rsplit("; or corner_height ", 1)[1].split()
    high = float(words[-2])
    good, bad = [high * 0.999], [high * 1.001]
    if low_is_sharp:
        assert words[0] == "between"
        good.append(float(words[1]) * 1.001)
        bad.append(float(words[1]) * 0.999)
    else:
        assert words[0] == "below"
    for height in good:
        build({"template": {**tables["template"], "corner_height": height}})
    for height in bad:
        with pytest.raises(SceneError, match="J_sl"):
            build({"template": {**tables["template"], "corner_height": height}})


def test_gap_limit_is_sharp() -> None:
    """Truth: the gap may take up all but the whole arc of the smallest cusp, 2 R alpha_min."""
    with pytest.raises(SceneError, match="cusp 1") as caught:
        build({"commissures": {"chord_ratio": [6.0, 4.0, 5.0], "gap": 24.0}})
    alpha = np.arccos((36.0 + 25.0 - 16.0) / 60.0)
    assert f"{24.0 * alpha:.6g} mm" in caught.value.valid


def test_import_is_light() -> None:
    """Truth: geometry needs neither the finite-element stack nor the mesher."""
    code = (
        "import sys, avneo_fem.geometry.valve_geometry;"
        "print(sorted({'dolfinx', 'gmsh', 'petsc4py', 'mpi4py', 'pyvista'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "[]"
