"""Kinematics of a surface given by its current position phi over a flat template."""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl

__all__ = ["area_vector", "right_cauchy_green", "surface_stretch", "unit_normal"]


def right_cauchy_green(gradient: Any) -> Any:
    """C = F^T F (2x2) of the deformation gradient F (3x2); C_S of the paper's (1.1)."""
    return gradient.T * gradient


def area_vector(gradient: Any) -> Any:
    """F e1 x F e2: current normal times area stretch J."""
    return ufl.cross(gradient[:, 0], gradient[:, 1])


def surface_stretch(gradient: Any) -> Any:
    """J = |F e1 x F e2|, current over reference area."""
    vector = area_vector(gradient)
    return ufl.sqrt(ufl.dot(vector, vector))


def unit_normal(gradient: Any) -> Any:
    """Current unit normal n."""
    return area_vector(gradient) / surface_stretch(gradient)
