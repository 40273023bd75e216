"""Angles of the commissures and contact lengths against geometry (paper sections 3.1 and 3.3)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import (
    angles_of_sides,
    commissure_angles,
    commissure_directions,
    contact_lengths,
)
from avneo_fem.geometry.commissure_plane import CommissurePlane


@settings(deadline=None)
@given(st.floats(1.0, 10.0), st.floats(1.0, 10.0), st.floats(0.01, 0.99))
def test_angles_follow_the_law_of_cosines(a: float, b: float, share: float) -> None:
    """Truth: c^2 = a^2 + b^2 - 2 a b cos(gamma) for each angle; the angles add up to pi."""
    ratio = np.array([a, b, abs(a - b) + share * (a + b - abs(a - b))])
    alpha = commissure_angles(ratio)
    assert alpha.sum() == pytest.approx(np.pi, rel=1e-14)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        square = ratio[j] ** 2 + ratio[k] ** 2 - 2.0 * ratio[j] * ratio[k] * np.cos(alpha[i])
        assert square == pytest.approx(ratio[i] ** 2, abs=1e-11 * ratio.max() ** 2)


def test_angles_of_thin_and_open_triangles() -> None:
    """Truth: small-angle expansion for sides 1, 1, 1e-7; pi, 0, 0 where the sides do not close."""
    thin, flat, broken = angles_of_sides(
        np.array([[1.0, 1.0, 1e-7], [2.0, 1.0, 1.0], [3.0, 1.0, 1.0]])
    )
    assert thin[2] == pytest.approx(1e-7, rel=1e-7)
    assert thin[:2] == pytest.approx([np.pi / 2 - 0.5e-7] * 2, rel=1e-13)
    assert flat == pytest.approx([np.pi, 0.0, 0.0], abs=1e-15)
    assert broken == pytest.approx([np.pi, 0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("ratio", [(1.0, 1.0, 1.0), (8.0, 9.0, 6.0), (6.0, 4.0, 5.0), (2, 2, 3.9)])
def test_directions_give_the_chords(ratio: tuple[float, float, float]) -> None:
    """Truth: points on the circle at these angles have chords in the ratio, counter-clockwise."""
    alpha = commissure_angles(ratio)
    angle = commissure_directions(alpha)
    points = 12.0 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(3)])
    plane = CommissurePlane(points)
    assert plane.chord_lengths / plane.chord_lengths[0] == pytest.approx(
        np.array(ratio) / ratio[0], rel=1e-13
    )
    assert points[0].tolist() == [12.0, 0.0, 0.0]
    assert plane.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    arcs = np.mod(np.roll(angle, -2) - np.roll(angle, -1), 2.0 * np.pi)
    assert arcs == pytest.approx(2.0 * alpha, rel=1e-13)


@pytest.mark.parametrize("ratio", [(1.0, 2.0, 3.0), (5.0, 1.0, 1.0), (1.0, 0.0, 1.0)])
def test_chords_that_form_no_triangle(ratio: tuple[float, float, float]) -> None:
    """Truth: the triangle inequality, strictly."""
    with pytest.raises(SceneError, match="form a triangle") as caught:
        commissure_angles(ratio)
    assert caught.value.key == "commissures.chord_ratio"


@settings(deadline=None)
@given(*[st.floats(0.1, 50.0)] * 3)
def test_contact_lengths_solve_their_system(c_0: float, c_1: float, c_2: float) -> None:
    """Truth: l_0 = c_1 + c_2, l_1 = c_2 + c_0, l_2 = c_0 + c_1 (paper section 3.3)."""
    found = contact_lengths([c_1 + c_2, c_2 + c_0, c_0 + c_1])
    assert found == pytest.approx([c_0, c_1, c_2], abs=1e-13 * (c_0 + c_1 + c_2))


@pytest.mark.parametrize(("cusp", "length"), [(0, 50.0), (1, 60.0), (2, 50.0)])
def test_inconsistent_lengths(cusp: int, length: float) -> None:
    """Truth: l_k >= l_i + l_j leaves no c_k; the error names the cusp and the open interval."""
    lengths = [20.0, 20.0, 20.0]
    lengths[(cusp + 1) % 3] = 30.0
    lengths[cusp] = length
    with pytest.raises(SceneError, match="between 10 and 50 mm") as caught:
        contact_lengths(lengths)
    assert caught.value.key == f"cusp.{cusp}.template.free_edge_length"
    assert caught.value.value == length
    for valid in (10.001, 49.999):
        lengths[cusp] = valid
        assert contact_lengths(lengths).min() > 0.0
