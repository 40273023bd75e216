"""Kinematics against NumPy's own linear algebra and the invariances of a surface."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.compat import ufl
from avneo_fem.mechanics.kinematics import (
    area_vector,
    right_cauchy_green,
    surface_stretch,
    unit_normal,
)
from shell_cases import evaluated, rotation


def gradient(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(3, 2))


@pytest.mark.parametrize("seed", range(4))
def test_against_numpy(seed: int) -> None:
    """Truth: C = F^T F, area vector = F e1 x F e2, J = its length, n = its direction."""
    f = gradient(seed)
    cross = np.cross(f[:, 0], f[:, 1])
    symbol = ufl.as_matrix(f.tolist())
    np.testing.assert_allclose(evaluated(right_cauchy_green(symbol)), f.T @ f, rtol=1e-13)
    np.testing.assert_allclose(evaluated(area_vector(symbol)), cross, rtol=1e-13)
    length = np.linalg.norm(cross)
    np.testing.assert_allclose(evaluated(surface_stretch(symbol)), length, rtol=1e-13)
    np.testing.assert_allclose(evaluated(unit_normal(symbol)), cross / length, rtol=1e-13)


@pytest.mark.parametrize("seed", range(4))
def test_stretch_is_root_of_determinant(seed: int) -> None:
    """Truth: J^2 = det C, the identity behind the J of (1.3)."""
    symbol = ufl.as_matrix(gradient(seed).tolist())
    determinant = np.linalg.det(evaluated(right_cauchy_green(symbol)))
    assert evaluated(surface_stretch(symbol)) ** 2 == pytest.approx(determinant, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_rotation_invariance(seed: int) -> None:
    """Truth: under F -> Q F the tensor C stays and the normal turns with Q."""
    f, q = gradient(seed), rotation(seed)
    before, after = ufl.as_matrix(f.tolist()), ufl.as_matrix((q @ f).tolist())
    strains = evaluated(right_cauchy_green(before)), evaluated(right_cauchy_green(after))
    np.testing.assert_allclose(strains[1], strains[0], atol=1e-13)
    normals = evaluated(unit_normal(before)), evaluated(unit_normal(after))
    np.testing.assert_allclose(normals[1], q @ normals[0], atol=1e-13)


def test_template_looks_up() -> None:
    """Truth: the flat template's normal is e1 x e2 = e3."""
    flat = ufl.as_matrix([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(evaluated(unit_normal(flat)), [0.0, 0.0, 1.0])
