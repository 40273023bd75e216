"""Signed distance of the cylinder against brute force and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.root import CylinderRoot

ROOT = CylinderRoot(12.0)


def cloud(count: int = 200) -> np.ndarray:
    """Random points inside and outside, at least 0.5 mm from the axis."""
    rng = np.random.default_rng(1)
    radius, angle = rng.uniform(0.5, 20.0, count), rng.uniform(-np.pi, np.pi, count)
    z = rng.uniform(-20.0, 20.0, count)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def test_distance_by_brute_force() -> None:
    """Truth: the nearest of many points on the wall; the sign from x^2 + y^2 < R^2."""
    points = cloud()
    angle = np.linspace(-np.pi, np.pi, 20001)
    wall = 12.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    nearest = np.array([np.linalg.norm(wall - p[:2], axis=1).min() for p in points])
    sign = np.where((points[:, :2] ** 2).sum(axis=1) < 144.0, 1.0, -1.0)
    assert np.abs(ROOT.signed_distance(points) - sign * nearest).max() < 1e-5


def test_derivatives_by_differences() -> None:
    """Truth: central differences of the value give the gradient, of the gradient the Hessian."""
    points, h = cloud(), 1e-5
    distance, gradient, hessian = ROOT.evaluate(points)
    assert np.array_equal(distance, ROOT.signed_distance(points))
    assert np.array_equal(ROOT.inward_normal(points), gradient)
    for axis, step in enumerate(h * np.eye(3)):
        plus, minus = ROOT.evaluate(points + step), ROOT.evaluate(points - step)
        assert np.abs((plus[0] - minus[0]) / (2.0 * h) - gradient[:, axis]).max() < 1e-8
        assert np.abs((plus[1] - minus[1]) / (2.0 * h) - hessian[:, :, axis]).max() < 1e-8


def test_eikonal_and_symmetry() -> None:
    """Truth: |grad d| = 1, the Hessian is symmetric and kills the gradient, n points inwards."""
    points = cloud()
    distance, gradient, hessian = ROOT.evaluate(points)
    assert np.abs(np.linalg.norm(gradient, axis=1) - 1.0).max() < 1e-14
    assert np.abs(hessian - hessian.transpose(0, 2, 1)).max() == 0.0
    assert np.abs(np.einsum("nij,nj->ni", hessian, gradient)).max() < 1e-14
    assert np.abs(ROOT.signed_distance(points + 0.1 * gradient) - distance - 0.1).max() < 1e-13


def test_rotation_and_shift_along_axis() -> None:
    """Truth: the cylinder maps to itself under rotation about and shift along z."""
    points = cloud()
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    d, g, hessian = ROOT.evaluate(points)
    moved_d, moved_g, moved_h = ROOT.evaluate(points @ turn.T + [0.0, 0.0, 5.0])
    assert np.abs(moved_d - d).max() < 1e-13
    assert np.abs(moved_g - g @ turn.T).max() < 1e-13
    assert np.abs(moved_h - turn @ hessian @ turn.T).max() < 1e-12


def test_axis_is_finite() -> None:
    """Truth: on the axis d = R, and the documented finite choice without a warning."""
    distance, gradient, hessian = ROOT.evaluate(np.array([[0.0, 0.0, 3.0], [1e-20, 0.0, 0.0]]))
    assert distance.tolist() == [12.0, 12.0]
    assert gradient.tolist() == [[-1.0, 0.0, 0.0]] * 2
    assert not hessian.any()


@pytest.mark.parametrize("radius", [0.0, -1.0, np.inf, np.nan])
def test_bad_radius(radius: float) -> None:
    """Truth: only a positive finite radius makes a cylinder."""
    with pytest.raises(SceneError, match=r"root\.radius"):
        CylinderRoot(radius)
