"""Stretches and stresses of the pictures against closed forms and the solver's materials."""

from __future__ import annotations

import numpy as np
import pytest
import ufl

from avneo_fem.errors import SceneError
from avneo_fem.mechanics.materials import material_named
from avneo_fem.results.fields import principal_stresses, principal_stretches
from shell_cases import disc, evaluated, rotation

MODELS = ["neo_hookean", "st_venant_kirchhoff"]


@pytest.mark.parametrize(("along", "across"), [(1.0, 1.0), (1.4, 0.8), (0.3, 2.0)])
def test_stretches_of_a_homogeneous_deformation(along: float, across: float) -> None:
    """Truth: x -> R diag(along, across) Q x with random rotations has these stretches everywhere,
    the larger first, whatever the triangle."""
    mesh = disc(4)
    for seed in range(5):
        angle = float(seed)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        flat = mesh.points @ turn.T * [along, across]
        points = np.c_[flat, np.zeros(len(flat))] @ rotation(seed).T + [3.0, -1.0, 5.0]
        found = principal_stretches(mesh.points, mesh.triangles, points)
        larger, smaller = max(along, across), min(along, across)
        np.testing.assert_allclose(found, np.tile([larger, smaller], (len(found), 1)), rtol=1e-12)


def test_simple_shear() -> None:
    """Truth: shear by k has stretches sqrt(1 + k^2/4) +- k/2 and keeps areas."""
    mesh, k = disc(3), 0.9
    x, y = mesh.points.T
    found = principal_stretches(mesh.points, mesh.triangles, np.c_[x + k * y, y, 0 * x])
    expected = np.sqrt(1 + k**2 / 4) + np.array([k, -k]) / 2
    np.testing.assert_allclose(found, np.tile(expected, (len(found), 1)), rtol=1e-12)


def test_rolling_up_does_not_stretch() -> None:
    """Truth: triangles of a strip laid on a cylinder of radius r are chords: between
    sin(h/2r)/(h/2r) and 1 of their length, 1 along the axis."""
    x, y = (k.ravel() for k in np.meshgrid(np.linspace(0, 2, 21), [0.0, 1.0]))
    low = np.arange(20)
    triangles = np.vstack([np.c_[low, low + 1, low + 21], np.c_[low + 1, low + 22, low + 21]])
    rolled = np.c_[np.sin(x), y, np.cos(x)]
    found = principal_stretches(np.c_[x, y], triangles, rolled)
    np.testing.assert_allclose(found[:, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], np.sin(0.05) / 0.05, rtol=1e-12)


def test_invariance_of_random_states() -> None:
    """Truth: rigid motion of either configuration changes no stretch; the product is the ratio of
    the areas; the larger comes first."""
    mesh = disc(4)
    random = np.random.default_rng(5)
    points = np.c_[mesh.points, np.zeros(len(mesh.points))]
    points += random.uniform(-0.1, 0.1, points.shape)
    found = principal_stretches(mesh.points, mesh.triangles, points)
    moved = principal_stretches(mesh.points, mesh.triangles, points @ rotation(1).T + 7.0)
    np.testing.assert_allclose(moved, found, rtol=1e-10)
    turned = mesh.points @ np.array([[0.6, 0.8], [-0.8, 0.6]]) - 2.0
    np.testing.assert_allclose(
        principal_stretches(turned, mesh.triangles, points), found, rtol=1e-10
    )
    a, b, c = (points[mesh.triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    np.testing.assert_allclose(found.prod(axis=1), area / mesh.cell_areas, rtol=1e-10)
    assert (found[:, 0] >= found[:, 1]).all()


def energy(model: str, stretches: np.ndarray) -> float:
    """psi [kPa] of the solver's own material at C = diag(l1^2, l2^2)."""
    c = ufl.as_matrix([[stretches[0] ** 2, 0.0], [0.0, stretches[1] ** 2]])
    return float(evaluated(ufl.as_ufl(material_named(model, 800.0).strain_energy(c))))


@pytest.mark.parametrize("model", MODELS)
def test_stresses_are_those_of_the_solver(model: str) -> None:
    """Truth: l_i dpsi/dl_i by central differences (fourth order) of the UFL strain energy."""
    random = np.random.default_rng(6)
    stretches = random.uniform(0.4, 2.0, (12, 2))
    found = principal_stresses(stretches, model, 800.0)
    step = 1e-3
    for pair, stress in zip(stretches, found, strict=True):
        for i in range(2):
            way = step * np.eye(2)[i]
            near = energy(model, pair + way) - energy(model, pair - way)
            far = energy(model, pair + 2 * way) - energy(model, pair - 2 * way)
            assert stress[i] == pytest.approx(
                pair[i] * (8 * near - far) / (12 * step), rel=1e-6, abs=1e-5
            )


@pytest.mark.parametrize("model", MODELS)
def test_small_strain(model: str) -> None:
    """Truth: nothing at rest, and E times the strain close to it, with Poisson ratio 0."""
    assert (principal_stresses(np.ones((1, 2)), model, 1000.0) == 0).all()
    found = principal_stresses(np.array([[1 + 1e-7, 1 - 2e-7]]), model, 1000.0)
    np.testing.assert_allclose(found, [[1e-4, -2e-4]], rtol=1e-5)


def test_unknown_material() -> None:
    """Truth: no stress is made up for a material that does not exist."""
    with pytest.raises(SceneError, match=r"material\.model = 'rubber': must be 'neo_hookean' or"):
        principal_stresses(np.ones((1, 2)), "rubber", 1.0)
