"""The plane of the commissures against geometry (paper sections 3.1 and 3.3)."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import commissure_angles
from avneo_fem.geometry.commissure_plane import CommissurePlane
from commissure_cases import random_triangles


def test_plane_coordinates() -> None:
    """Truth: equidistant centre, orthonormal right-handed basis, round trip, extended sine rule;
    A_0 on the first axis and A_0 A_1 A_2 counter-clockwise."""
    for points in random_triangles(50, 3):
        plane = CommissurePlane(points)
        to_centre = np.linalg.norm(points - plane.origin, axis=1)
        assert to_centre == pytest.approx([plane.circumradius] * 3, rel=1e-9)
        frame = np.column_stack([plane.basis, plane.normal])
        assert np.abs(frame.T @ frame - np.eye(3)).max() < 1e-13
        assert np.linalg.det(frame) == pytest.approx(1.0, rel=1e-13)
        flat = plane.project(points)
        assert flat[0] == pytest.approx([plane.circumradius, 0.0], abs=1e-12)
        assert np.linalg.det(flat[1:] - flat[0]) > 0.0
        assert np.abs(plane.embed(flat) - points).max() < 1e-12
        lifted = plane.project(points + 3.0 * plane.normal)
        assert np.abs(lifted - flat).max() < 1e-12
        ratio = plane.chord_lengths / np.sin(commissure_angles(plane.chord_lengths))
        assert ratio == pytest.approx([2.0 * plane.circumradius] * 3, rel=1e-9)


def test_normal_follows_the_order() -> None:
    """Truth: a cyclic order keeps n and the circle; exchanging two points turns n round."""
    for points in random_triangles(20, 5):
        plane = CommissurePlane(points)
        for order, sign in (([1, 2, 0], 1.0), ([0, 2, 1], -1.0)):
            other = CommissurePlane(points[order])
            assert other.normal == pytest.approx(sign * plane.normal, abs=1e-12)
            assert other.origin == pytest.approx(plane.origin, abs=1e-9)
            assert other.chord_lengths == pytest.approx(plane.chord_lengths[order], rel=1e-14)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [3.0, 3.0, 0.0]]), "not on a line"),
        (np.outer([0, 1, 2], [1.0, 2, 3]), "not on a line"),
        (np.zeros((3, 3)), "not on a line"),
        (np.zeros((3, 2)), "of shape"),
        (np.diag([1.0, np.nan, 1.0]), "finite"),
    ],
)
def test_plane_needs_a_triangle(points: np.ndarray, words: str) -> None:
    """Truth: three points on a line span no plane; nor do points that are not three in space."""
    with pytest.raises(SceneError, match=words) as caught:
        CommissurePlane(points)
    assert caught.value.key == "commissures"


def test_frozen() -> None:
    """Truth: no array of the plane can be changed, and the caller's points stay his own."""
    points = np.eye(3)
    plane = CommissurePlane(points)
    points[0] = 7.0
    assert plane.points.tolist() == np.eye(3).tolist()
    for array in (plane.points, plane.normal, plane.origin, plane.basis, plane.chord_lengths):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
