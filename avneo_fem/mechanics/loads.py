"""Follower pressure and the force that holds the free edge up."""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.mechanics.kinematics import area_vector

__all__ = ["free_edge_energy_density", "pressure_force_density", "pressure_work_density"]


def pressure_force_density(gradient: Any, pressure: Any) -> Any:
    """Follower pressure per reference area, -P J n [kPa]; the continuum form of (1.4).

    The template's normal e1 x e2 points to the wall when the cusp is in place, the aortic
    pressure acts against it.
    """
    return -pressure * area_vector(gradient)


def pressure_work_density(position: Any, start: Any, pressure: Any) -> Any:
    """Work of the pressure on the straight way from ``start`` to ``position`` (P x swept volume).

    The force is quadratic along a straight way, so Simpson's rule is exact.
    """
    way = position - start
    middle = (position + start) / 2
    force = sum(
        weight * pressure_force_density(ufl.grad(place), pressure)
        for weight, place in ((1.0, start), (4.0, middle), (1.0, position))
    )
    return ufl.dot(force, way) / 6


def free_edge_energy_density(height: Any, stiffness: Any, width: Any, clearance: Any) -> Any:
    """Energy per reference length of the free edge, whose force is (1.6) [mN].

    ``height`` is the argument d of f: (Q - A_0).n - (P - N_0).e2. ``stiffness`` is eta_1 S^0 /
    L_free [mN/mm]; f = max(1 - 2 (d - d_0)/eta_2, 0) = -d/dd of the energy.
    """
    return stiffness * width / 4 * ufl.max_value(1 - 2 * (height - clearance) / width, 0.0) ** 2
