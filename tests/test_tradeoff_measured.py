"""What is measured on a cusp, on moved, bent and stretched templates, and on a real run."""

from __future__ import annotations

import math
import shutil
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.results.cusp_curves import length
from avneo_fem.scene import Scene
from avneo_fem.tradeoff.measured import (
    CuspMeasures,
    compare_cusps,
    measure_cusp,
    measure_run,
    worst,
)
from run_cases import Run
from tradeoff_cases import errors

GIVEN = ValveInput.from_scene(Scene())
TEMPLATE = GIVEN.geometry.cusps[0].template
MESH = triangulate_template(TEMPLATE, 1.5)


def upright(stretch: float = 1.0, shift: Any = (0.0, 0.0, 0.0)) -> CuspMeasures:
    """The flat template standing upright, x to y and y to z, stretched along the first."""
    x, y = MESH.points.T
    points = np.column_stack([0.0 * x, stretch * x, y]) + np.asarray(shift)
    return measure_cusp(GIVEN, 0, MESH, points)


def test_flat_cusp() -> None:
    """Truth: depth, edge and stretch of the template itself; M is the plane z = 0."""
    found = upright(1.25)
    y = MESH.points[:, 1]
    assert found.belly_depth == pytest.approx(16.5)
    edge = MESH.points[MESH.free_edge] * [1.25, 1.0]
    assert found.free_edge_length == pytest.approx(length(edge), rel=1e-6)
    assert found.free_edge_height == pytest.approx((y[MESH.free_edge].max() + 11.5) / 2, abs=1e-3)
    assert found.stretch == pytest.approx(1.25)
    assert found.free_edge.shape == (2001, 3)


def test_shifted_cusp() -> None:
    """Truth: raised by 0.3 mm, heights differ by that, lengths and stretch do not; surfaces and
    edges in one plane only where they stick out, across it everywhere."""
    found = compare_cusps(upright(shift=(0.0, 0.0, 0.3)), upright())
    assert found.belly_depth_mm == pytest.approx(0.3)
    assert found.free_edge_height_mm == pytest.approx(0.3)
    assert found.free_edge_length_mm == pytest.approx(0.0, abs=1e-9)
    assert found.stretch == pytest.approx(0.0, abs=1e-9)
    assert found.surface_mean_mm < 0.1
    assert found.surface_largest_mm == pytest.approx(0.3, abs=0.1)
    found = compare_cusps(upright(shift=(0.3, 0.0, 0.0)), upright())
    assert (found.surface_mean_mm, found.surface_95_mm) == pytest.approx((0.3, 0.3))
    assert found.free_edge_mm == pytest.approx(0.3)
    assert found.belly_depth_mm == pytest.approx(0.0, abs=1e-9)


def test_stretched_edge() -> None:
    """Truth: an edge of two straight halves with slope 2.5 / 19.5, stretched by 1.1 across."""
    found = compare_cusps(upright(1.1), upright())
    halves = [2.0 * math.hypot(s * 19.5, 2.5) for s in (1.1, 1.0)]
    assert found.free_edge_length_mm == pytest.approx(halves[0] - halves[1], rel=1e-3)
    assert found.stretch == pytest.approx(0.1)


def test_contact_curve() -> None:
    """Truth: what lies on the wedge from 5 mm under M upwards touches from there; lowered by
    1.5 mm it touches 1.5 mm lower. What is nowhere near has no contact curve."""
    wedge = GIVEN.wedges.wedge(0, 1.0).polyline3(200, 0.0)
    line = np.column_stack([wedge[:, :2], np.zeros(len(wedge))])
    share = (MESH.points[:, 0] - MESH.points[:, 0].min()) / np.ptp(MESH.points[:, 0])
    at = np.interp(share, np.linspace(0.0, 1.0, len(line)), np.arange(len(line)))
    height = np.ptp(MESH.points[:, 1])
    points = line[np.round(at).astype(int)]
    points[:, 2] = 5.0 * (MESH.points[:, 1] - MESH.points[:, 1].max()) / height

    def measured(depth: float) -> CuspMeasures:
        return measure_cusp(GIVEN, 0, MESH, points - [0.0, 0.0, depth])

    found = compare_cusps(measured(1.5), measured(0.0))
    assert found.contact_curve_mm == pytest.approx(1.5, abs=1e-6)
    assert -5.1 < np.nanmin(measured(0.0).contact) < -4.5
    far = measure_cusp(GIVEN, 0, MESH, points + np.array([9.0, 0.0, 0.0]))
    assert np.isnan(far.contact).all() == np.isnan(compare_cusps(far, far).contact_curve_mm)


def test_worst() -> None:
    """Truth: figure by figure; nan only where none has a number."""
    nan = float("nan")
    first = errors(0.2, belly_depth_mm=0.1, contact_curve_mm=nan, stretch=nan)
    found = worst([first, errors(0.1, belly_depth_mm=0.3, contact_curve_mm=0.4, stretch=nan)])
    assert (found.surface_mean_mm, found.belly_depth_mm, found.contact_curve_mm) == (0.2, 0.3, 0.4)
    assert math.isnan(found.stretch)


def test_a_run(small_run: Run, tmp_path: Path) -> None:
    """Truth: the mesh made again is that of the run: nodes as in valve.h5 to STL's single
    precision; only cusps that were solved; a surface of another run is refused."""
    found = measure_run(small_run.report, small_run.folder)
    assert list(found) == [0]
    points = small_run.points()[: len(found[0].points)]
    np.testing.assert_allclose(found[0].points, points, atol=2e-6)
    assert max(astuple(compare_cusps(found[0], found[0]))) == pytest.approx(0.0, abs=1e-6)
    report = small_run.report
    report["scene"]["mesh"]["size"] = 2.5
    with pytest.raises(SceneError, match="not of the mesh"):
        measure_run(report, small_run.folder)
    with pytest.raises(SceneError, match="cannot be read"):
        measure_run(small_run.report, tmp_path)
    shutil.copy(small_run.folder / "cusp_1.stl", tmp_path / "cusp_0.stl")
    turned = measure_run(small_run.report, tmp_path)[0]
    assert turned.belly_depth == pytest.approx(found[0].belly_depth, abs=1e-5)
    assert turned.free_edge_length == pytest.approx(found[0].free_edge_length, abs=1e-4)
