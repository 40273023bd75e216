"""Hyperelastic membranes with Poisson ratio 0: a material is one method, its strain energy.

Further models (a Fung-type pericardium, say) are one dataclass more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from avneo_fem.compat import ufl
from avneo_fem.errors import SceneError

__all__ = ["Material", "NeoHookean", "StVenantKirchhoff", "material_named"]


class Material(Protocol):
    """What the membrane energy asks of a material."""

    def strain_energy(self, right_cauchy_green: Any, square: Any = None) -> Any:
        """Strain energy per reference volume [kPa] of the in-plane C (2x2).

        ``square`` is J^2 where it is known better than as det C, whose digits cancel in a
        squeezed triangle.
        """


@dataclass(frozen=True)
class StVenantKirchhoff:
    """psi = E/8 ((I1 - 1)^2 - 2 J^2 + 1), the paper's (1.3); equals E/2 tr(E^2) for nu = 0.

    Not convex in compression: the nominal stress peaks at a stretch of 1/sqrt(3).
    """

    young_modulus: Any

    def strain_energy(self, right_cauchy_green: Any, square: Any = None) -> Any:
        """psi(C) [kPa]."""
        first = ufl.tr(right_cauchy_green)
        square = ufl.det(right_cauchy_green) if square is None else square
        return self.young_modulus / 8 * ((first - 1) ** 2 - 2 * square + 1)


@dataclass(frozen=True)
class NeoHookean:
    """psi = E/4 (I1 - 2 - 2 ln J): same small-strain response (nu = 0), stiffens in compression.

    The energy grows without bound as J -> 0, so a triangle cannot collapse.
    """

    young_modulus: Any

    def strain_energy(self, right_cauchy_green: Any, square: Any = None) -> Any:
        """psi(C) [kPa]."""
        first = ufl.tr(right_cauchy_green)
        square = ufl.det(right_cauchy_green) if square is None else square
        return self.young_modulus / 4 * (first - 2 - ufl.ln(square))


def material_named(model: str, young_modulus: Any) -> Material:
    """Material for the scene entry ``material.model``; E [kPa] may be a number or a UFL constant.

    Raises
    ------
    SceneError
        When there is no material of that name.
    """
    if model == "neo_hookean":
        return NeoHookean(young_modulus)
    if model == "st_venant_kirchhoff":
        return StVenantKirchhoff(young_modulus)
    valid = "must be 'neo_hookean' or 'st_venant_kirchhoff'"
    raise SceneError("material.model", model, valid)
