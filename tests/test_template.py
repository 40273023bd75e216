"""Cusp templates against design.md section 1, polygons and brute force."""

from __future__ import annotations

import re
from itertools import pairwise
from math import acos, atan, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avneo_fem.errors import SceneError
from avneo_fem.geometry.template import (
    CuspTemplate,
    corner_height_for,
    free_edge_length_for,
    suture_length,
)
from avneo_fem.scene import Template


@st.composite
def templates(draw: st.DrawFn) -> Template:
    """Templates that exist, from flat to deep, with corners inside and outside the belly."""
    length, height = draw(st.floats(1.0, 80.0)), draw(st.floats(0.1, 40.0))
    radius = draw(st.floats(0.02, 0.999)) * hypot(height, length / 2.0)
    apex = draw(st.floats(-0.98, 2.0)) * height
    return Template(
        free_edge_length=length, free_edge_height=apex, corner_height=height, belly_radius=radius
    )


def boundary(template: CuspTemplate, count: int) -> np.ndarray:
    """Closed polygon (n, 2), counter-clockwise: CSL from N_0 to N_1, then the free edge back."""
    parts = [
        np.concatenate([np.linspace(a, b, count, endpoint=False) for a, b in pairwise(s)])
        for s in (template.suture_line.breaks, template.free_edge.breaks)
    ]
    edge = template.free_edge.point(template.free_edge.length - parts[1])
    return np.concatenate([template.suture_line.point(parts[0]), edge])


def crossings(polygon: np.ndarray) -> int:
    """Properly crossing pairs of sides, by orientation of all pairs."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    rounding = 1e-13 * np.ptp(polygon, axis=0).max() ** 2

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        u, v = q - p, r - p
        doubled_area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
        # sides of one straight part are in line up to rounding; that is no crossing
        return np.where(np.abs(doubled_area) < rounding, 0.0, doubled_area)

    one = side(a[:, None], b[:, None], a) * side(a[:, None], b[:, None], b)
    return int(np.count_nonzero((one < 0.0) & (one.T < 0.0)))


@settings(deadline=None)
@given(templates())
def test_suture_length_closed_form(parameters: Template) -> None:
    """Truth: l_c = 2 R_s phi + 2 sqrt(q^2 - R_s^2), written out from design.md section 1."""
    p = parameters
    q2 = p.corner_height**2 + p.free_edge_length**2 / 4.0
    radius = p.belly_radius
    phi = pi - (atan(p.free_edge_length / (2.0 * p.corner_height)) + acos(radius / sqrt(q2)))
    exact = 2.0 * radius * phi + 2.0 * sqrt(q2 - radius**2)
    template = CuspTemplate(p)
    assert template.suture_length == pytest.approx(exact, rel=1e-12)
    assert suture_length(p) == pytest.approx(exact, rel=1e-12)


@settings(deadline=None)
@given(templates())
def test_free_edge_and_corners(parameters: Template) -> None:
    """Truth: the free edge is twice the hypotenuse of L_f/2 and H_f, from corner to corner."""
    template = CuspTemplate(parameters)
    half, height = parameters.free_edge_length / 2.0, parameters.corner_height
    corners = [[-half, height], [half, height]]
    assert template.corners.tolist() == corners
    for path in (template.suture_line, template.free_edge):
        assert np.allclose(path.point([0.0, path.length]), corners, rtol=0.0, atol=1e-12)
    exact = 2.0 * hypot(half, parameters.free_edge_height)
    assert template.free_edge_length == pytest.approx(exact, rel=1e-14)
    apex = template.free_edge.point([exact / 2.0])[0]
    assert apex == pytest.approx([0.0, height + parameters.free_edge_height], abs=1e-10)
    assert template.intercommissural_length == parameters.free_edge_length


@settings(deadline=None)
@given(templates())
def test_suture_line_is_smooth_and_wraps_the_arc(parameters: Template) -> None:
    """Truth: no kink at the tangent points; never inside the belly circle; on it at the bottom."""
    template = CuspTemplate(parameters)
    line, radius = template.suture_line, parameters.belly_radius
    for s in line.breaks[1:-1]:
        before, after = line.tangent([s * (1.0 - 1e-12), s])
        assert np.linalg.norm(after - before) < 1e-6
    distance = np.linalg.norm(line.point(np.linspace(0.0, line.length, 201)), axis=1)
    assert distance.min() > radius * (1.0 - 1e-12)
    bottom = line.point([line.length / 2.0])[0]
    assert bottom == pytest.approx([0.0, -radius], abs=1e-9 * line.length)
    assert line.tangent([line.length / 2.0])[0] == pytest.approx([1.0, 0.0], abs=1e-7)


@settings(deadline=None)
@given(templates())
def test_area_against_polygon(parameters: Template) -> None:
    """Truth: shoelace area of an inscribed polygon plus its exact circular segments."""
    template = CuspTemplate(parameters)
    count = 64
    polygon = boundary(template, count)
    x, y = polygon.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    radius = parameters.belly_radius
    step = (template.suture_line.breaks[2] - template.suture_line.breaks[1]) / radius / count
    segments = count * 0.5 * radius**2 * (step - np.sin(step))
    assert template.area == pytest.approx(shoelace + segments, rel=1e-9)


@settings(deadline=None)
@given(templates())
def test_boundary_is_simple(parameters: Template) -> None:
    """Truth: no two sides of the boundary polygon cross, all pairs tested; star-shaped."""
    polygon = boundary(CuspTemplate(parameters), 16)
    assert crossings(polygon) == 0
    angles = np.unwrap(np.arctan2(polygon[:, 1], polygon[:, 0]))
    assert np.all(np.diff(angles) > -1e-9)


def test_crossing_count_sees_a_crossing() -> None:
    """Truth: a bow tie has one crossing pair (counted twice): the brute force above can fail."""
    assert crossings(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])) == 2


@pytest.mark.parametrize("change", [0.0, 0.3, 20.0])
def test_belly_too_large(change: float) -> None:
    """Truth: R_s >= q is refused; each of the three values the error offers would do."""
    limit = hypot(11.5, 19.5)
    radius = limit + change
    with pytest.raises(SceneError) as caught:
        CuspTemplate(Template(belly_radius=radius), "cusp.1.template")
    assert caught.value.key == "cusp.1.template.belly_radius"
    assert caught.value.value == radius
    numbers = [float(found) for found in re.findall(r"([\d.]+) mm", caught.value.valid)]
    assert numbers[0] == pytest.approx(limit, rel=1e-5)
    good = 1.0001
    CuspTemplate(Template(belly_radius=numbers[0] / good))
    CuspTemplate(Template(belly_radius=radius, corner_height=numbers[1] * good))
    CuspTemplate(Template(belly_radius=radius, free_edge_length=numbers[2] * good))


@pytest.mark.parametrize("height", [-11.5, -30.0])
def test_free_edge_too_deep(height: float) -> None:
    """Truth: H_f <= -H_i is refused by name; just above it the template exists."""
    with pytest.raises(SceneError, match=r"-11\.5 mm") as caught:
        CuspTemplate(Template(free_edge_height=height))
    assert caught.value.key == "template.free_edge_height"
    CuspTemplate(Template(free_edge_height=-11.499))


def test_paper_radius_does_not_exist() -> None:
    """Truth: r_s = 33 mm of paper §4.3 read as a radius has no template (design.md section 1)."""
    with pytest.raises(SceneError, match="belly_radius"):
        CuspTemplate(Template(free_edge_length=39.0, belly_radius=33.0))


@settings(deadline=None)
@given(templates(), st.floats(1.001, 5.0))
def test_free_edge_length_for(parameters: Template, factor: float) -> None:
    """Truth: the offered L_f gives the wanted CSL length; below pi R_s + 2 H_i there is none."""
    shortest = pi * parameters.belly_radius + 2.0 * parameters.corner_height
    found = free_edge_length_for(factor * shortest, parameters)
    assert found is not None
    assert found >= 2.0 * parameters.belly_radius
    changed = parameters.model_copy(update={"free_edge_length": found})
    assert CuspTemplate(changed).suture_length == pytest.approx(factor * shortest, rel=1e-10)
    assert free_edge_length_for(shortest / factor, parameters) is None


@settings(deadline=None)
@given(templates(), st.floats(0.05, 3.0))
def test_corner_height_for(parameters: Template, factor: float) -> None:
    """Truth: l_c grows with H_i, so the H_i that gives the CSL of another one is that other one; a
    shorter CSL than that of the lowest corners there is none."""
    half, radius = parameters.free_edge_length / 2.0, parameters.belly_radius
    lowest = sqrt(max(radius**2 - half**2, 0.0))
    height = lowest + factor * (half + radius)
    other = parameters.model_copy(update={"corner_height": height})
    found = corner_height_for(suture_length(other), parameters)
    assert found == pytest.approx(height, rel=1e-9)
    taller = other.model_copy(update={"corner_height": 1.01 * height})
    assert suture_length(taller) > suture_length(other)
    assert corner_height_for(0.99 * parameters.free_edge_length, parameters) is None
