"""Strain energies against closed forms of homogeneous deformations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avneo_fem.compat import ufl
from avneo_fem.errors import SceneError
from avneo_fem.mechanics.materials import NeoHookean, StVenantKirchhoff, material_named
from shell_cases import evaluated

E = 1000.0
STRETCHES = np.array([0.3, 0.577, 0.9, 1.0, 1.2, 2.0])
MODELS = [StVenantKirchhoff(E), NeoHookean(E)]


def energy(material: object, c: np.ndarray) -> float:
    return float(evaluated(material.strain_energy(ufl.as_matrix(c.tolist()))))


def nominal_stress(material: object, stretch: float) -> float:
    """d psi / d lambda under uniaxial stretch, differentiated by UFL."""
    variable = ufl.variable(ufl.as_ufl(stretch))
    c = ufl.as_matrix([[variable**2, 0.0], [0.0, 1.0]])
    return float(evaluated(ufl.diff(material.strain_energy(c), variable)))


@pytest.mark.parametrize("stretch", STRETCHES)
def test_uniaxial(stretch: float) -> None:
    """Truth: E/8 (l^2 - 1)^2 and E/4 (l^2 - 1 - 2 ln l); nu = 0 leaves the width at 1."""
    c = np.diag([stretch**2, 1.0])
    assert energy(MODELS[0], c) == pytest.approx(E / 8 * (stretch**2 - 1) ** 2, abs=1e-10)
    closed = E / 4 * (stretch**2 - 1 - 2 * np.log(stretch))
    assert energy(MODELS[1], c) == pytest.approx(closed, abs=1e-10)


@pytest.mark.parametrize("stretch", STRETCHES)
def test_equibiaxial(stretch: float) -> None:
    """Truth: for nu = 0 the two directions do not interact, so twice the uniaxial energy."""
    for material in MODELS:
        both = energy(material, np.diag([stretch**2, stretch**2]))
        assert both == pytest.approx(2 * energy(material, np.diag([stretch**2, 1.0])), abs=1e-9)


@pytest.mark.parametrize("stretch", STRETCHES)
def test_pure_shear(stretch: float) -> None:
    """Truth: stretches l and 1/l: E/8 sum (l_i^2 - 1)^2 and, as J = 1, E/4 (l^2 + l^-2 - 2)."""
    c = np.diag([stretch**2, stretch**-2])
    first = E / 8 * ((stretch**2 - 1) ** 2 + (stretch**-2 - 1) ** 2)
    assert energy(MODELS[0], c) == pytest.approx(first, rel=1e-12, abs=1e-10)
    second = E / 4 * (stretch**2 + stretch**-2 - 2)
    assert energy(MODELS[1], c) == pytest.approx(second, rel=1e-12, abs=1e-10)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6))
def test_st_venant_kirchhoff_is_quadratic_in_green_strain(entries: list[float]) -> None:
    """Truth: (1.3) equals E/2 tr(E_GL^2) with E_GL = (C - 1)/2, for any C = F^T F."""
    f = np.reshape(entries, (3, 2))
    strain = (f.T @ f - np.eye(2)) / 2
    expected = E / 2 * np.trace(strain @ strain)
    assert energy(MODELS[0], f.T @ f) == pytest.approx(expected, rel=1e-9, abs=1e-8)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 2 * np.pi), st.floats(0.4, 2.0), st.floats(0.4, 2.0))
def test_isotropy(angle: float, first: float, second: float) -> None:
    """Truth: turning the material directions leaves the energy unchanged."""
    q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    c = np.diag([first, second])
    for material in MODELS:
        assert energy(material, q @ c @ q.T) == pytest.approx(
            energy(material, c), rel=1e-9, abs=1e-9
        )


def test_st_venant_kirchhoff_stress_peaks_at_one_over_root_three() -> None:
    """Truth: the compressive nominal stress E/2 l (l^2 - 1) is largest at l = 1/sqrt(3)."""
    peak = 1 / np.sqrt(3)
    assert nominal_stress(MODELS[0], peak) == pytest.approx(E / 2 * peak * (peak**2 - 1))
    beside = [nominal_stress(MODELS[0], peak + shift) for shift in (-0.01, 0.01)]
    assert nominal_stress(MODELS[0], peak) < min(beside)


def test_neo_hookean_stiffens_in_compression() -> None:
    """Truth: its nominal stress E/2 (l - 1/l) falls monotonically to minus infinity as l -> 0."""
    values = [nominal_stress(MODELS[1], stretch) for stretch in STRETCHES]
    np.testing.assert_allclose(values, E / 2 * (STRETCHES - 1 / STRETCHES), atol=1e-9)
    assert nominal_stress(MODELS[1], 1e-6) < -1e8


@pytest.mark.parametrize("seed", range(4))
def test_same_small_strain_response(seed: int) -> None:
    """Truth: both are E/2 tr(e^2) to second order in a small strain e (nu = 0)."""
    e = np.random.default_rng(seed).normal(size=(2, 2))
    e = 1e-4 * (e + e.T)
    expected = E / 2 * np.trace(e @ e)
    for material in MODELS:
        assert energy(material, np.eye(2) + 2 * e) == pytest.approx(expected, rel=5e-3)


def test_named() -> None:
    """Truth: the scene's two names give the two models; any other is a SceneError that says so."""
    assert material_named("st_venant_kirchhoff", E) == StVenantKirchhoff(E)
    assert material_named("neo_hookean", E) == NeoHookean(E)
    with pytest.raises(SceneError, match="neo_hookean") as caught:
        material_named("fung", E)
    assert (caught.value.key, caught.value.value) == ("material.model", "fung")
