"""Membrane energy: in-plane deformation of the cusp."""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.mechanics.kinematics import area_vector, right_cauchy_green
from avneo_fem.mechanics.materials import Material

__all__ = ["membrane_energy_density"]


def membrane_energy_density(
    gradient: Any, material: Material, thickness: Any, projected: Any = None
) -> Any:
    """H psi(C) [mN/mm]: energy per reference area whose variation is delta U_m of (1.2).

    ``projected`` is what to take for C instead of F^T F (``mechanics.projected_strain``).
    """
    if projected is not None:
        return thickness * material.strain_energy(projected)
    vector = area_vector(gradient)
    square = ufl.dot(vector, vector)
    return thickness * material.strain_energy(right_cauchy_green(gradient), square)
