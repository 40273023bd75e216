"""Membrane energy: density, Taylor tests, homogeneous deformations, invariances."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.compat import ufl
from avneo_fem.mechanics.materials import NeoHookean, StVenantKirchhoff
from avneo_fem.mechanics.membrane import membrane_energy_density
from shell_cases import (
    MEMBRANE_ALONE,
    disc,
    evaluated,
    flat,
    rotation,
    rough,
    shell,
    state_at,
    strip,
    taylor_orders,
    unit_direction,
)

VARIANTS = [
    {"bending": False, "material": "neo_hookean"},
    {"bending": True, "material": "neo_hookean"},
    {"bending": True, "material": "st_venant_kirchhoff"},
]


def test_density_is_thickness_times_strain_energy() -> None:
    """Truth: H psi(F^T F) with psi in closed form for stretches 1.2 and 0.8 along the axes."""
    f = ufl.as_matrix([[0.0, 0.8], [1.2, 0.0], [0.0, 0.0]])
    expected = 0.5 * 1000 / 8 * ((1.44 - 1) ** 2 + (0.64 - 1) ** 2)
    value = evaluated(membrane_energy_density(f, StVenantKirchhoff(1000.0), 0.5))
    assert value == pytest.approx(expected)
    expected = 0.5 * 1000 / 4 * (1.44 + 0.64 - 2 - 2 * np.log(0.96))
    assert evaluated(membrane_energy_density(f, NeoHookean(1000.0), 0.5)) == pytest.approx(expected)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("seed", [1, 2])
def test_taylor(variant: dict, seed: int) -> None:
    """Truth: residual and tangent are first and second derivative of the membrane energy."""
    model = shell(disc(2), **variant, **MEMBRANE_ALONE)
    state, way = rough(model, seed), unit_direction(model, seed)
    assert taylor_orders(model.energy, model.residual(state) @ way, state, way) == pytest.approx(
        2, abs=0.05
    )
    assert taylor_orders(model.residual, model.tangent(state) @ way, state, way) == pytest.approx(
        2, abs=0.05
    )


@pytest.mark.parametrize("variant", VARIANTS)
def test_homogeneous_stretch(variant: dict) -> None:
    """Truth: an affine map has the energy area * H psi, and no force on any inner node."""
    mesh = strip(5, 4, 2.0, 1.0)
    model = shell(mesh, **variant, **MEMBRANE_ALONE)
    f = rotation(3) @ np.array([[1.2, 0.1], [0.0, 0.8], [0.0, 0.0]])
    state = state_at(model, mesh.points @ f.T)
    c = f.T @ f
    if variant["material"] == "neo_hookean":
        density = (np.trace(c) - 2 - np.log(np.linalg.det(c))) / 4
    else:
        density = np.sum((c - np.eye(2)) ** 2) / 8
    assert model.energy(state) == pytest.approx(mesh.area * density, rel=1e-10)
    forces = model.residual(state)[model.position_dofs]
    inside = np.setdiff1d(np.arange(len(mesh.points)), np.r_[mesh.suture_line, mesh.free_edge])
    assert len(inside) == 12
    assert np.abs(forces[inside]).max() < 1e-9 * np.abs(forces).max()


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_energy_in_rigid_motion(variant: dict) -> None:
    """Truth: the template moved rigidly is free of stress; folding it in halves costs nothing."""
    mesh = strip(4, 4, 2.0, 1.0, jitter=0.0)
    model = shell(mesh, **variant, **MEMBRANE_ALONE)
    moved = flat(mesh) @ rotation(5).T + [3.0, -4.0, 5.0]
    assert abs(model.energy(state_at(model, moved))) < 1e-10
    assert np.abs(model.residual(state_at(model, moved))).max() < 1e-8
    x, y = mesh.points.T
    angle = 2.0  # of the right half about the line x = 1
    beyond = np.maximum(x - 1, 0)
    bent = np.c_[np.minimum(x, 1) + beyond * np.cos(angle), y, beyond * np.sin(angle)]
    assert abs(model.energy(state_at(model, bent))) < 1e-10


@pytest.mark.parametrize("variant", VARIANTS)
def test_frame_indifference(variant: dict) -> None:
    """Truth: a rigid motion of a deformed state leaves the energy and turns the forces."""
    model = shell(disc(2), **variant, **MEMBRANE_ALONE)
    state = rough(model, 7)
    q, places = rotation(8), model.position_dofs
    moved = state_at(model, state[places] @ q.T + 1.0)
    moved[model.angle_dofs] = state[model.angle_dofs]
    assert model.energy(moved) == pytest.approx(model.energy(state), rel=1e-10)
    forces = model.residual(state)[places]
    np.testing.assert_allclose(
        model.residual(moved)[places], forces @ q.T, atol=1e-10 * np.abs(forces).max()
    )
