"""Manufactured solution of the membrane: a stretched, bulged square under a made-to-fit load.

A smooth large deformation phi of the unit square is chosen. Its first Piola-Kirchhoff stress P
(written out here by hand, not taken from the solver's automatic derivatives) gives the load per
reference area f = -Div P that holds it in equilibrium. With the boundary held where phi puts it
the finite-element membrane must find phi again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.compat import ufl
from cell_fields import boundary, sampled
from meshes import strip
from solving import start

__all__ = ["membrane_errors"]

Floats = NDArray[np.float64]

_YOUNG, _THICKNESS = 1000.0, 0.1


def _deformation(x: Any, y: Any, sine: Any, cosine: Any) -> list[Any]:
    """phi(x, y) [mm]; stretched everywhere, so that the membrane is stable."""
    return [
        1.25 * x + 0.05 * sine(2 * x + y),
        1.3 * y + 0.04 * cosine(x - 2 * y),
        0.2 * sine(2.5 * x + 0.3) * sine(2 * y + 0.4),
    ]


def _gradient(x: Floats, y: Floats) -> Floats:
    """(..., 3, 2) of :func:`_deformation`, by hand."""
    first = 0.05 * np.cos(2 * x + y)
    second = 0.04 * np.sin(x - 2 * y)
    bulge, fall = 2.5 * x + 0.3, 2 * y + 0.4
    rows = [
        [1.25 + 2 * first, first],
        [-second, 1.3 + 2 * second],
        [0.5 * np.cos(bulge) * np.sin(fall), 0.4 * np.sin(bulge) * np.cos(fall)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _load(domain: Any, material: str) -> Any:
    """f = -Div P of the exact solution as a UFL vector [kPa]."""
    x, y = ufl.SpatialCoordinate(domain)
    gradient = ufl.grad(ufl.as_vector(_deformation(x, y, ufl.sin, ufl.cos)))
    right = gradient.T * gradient
    half = _THICKNESS * _YOUNG / 2
    if material == "st_venant_kirchhoff":
        stress = half * gradient * (right - ufl.Identity(2))  # H F S, S = E (C - 1)/2
    else:
        stress = half * (
            gradient - gradient * ufl.inv(right)
        )  # H dpsi/dF, psi = E/4 (I1 - ln det C)
    return -ufl.div(stress)


def membrane_errors(
    degree: int, columns: int, structured: bool, material: str = "st_venant_kirchhoff"
) -> tuple[float, float]:
    """Errors of the positions on a mesh of 2 columns^2 triangles.

    Returns
    -------
    (float, float)
        L2 norm of the error [mm^2] and of the error of its gradient [mm].
    """
    problem = start(
        strip(columns, columns, 1.0, 1.0, structured),
        degree,
        force_scale=_YOUNG * _THICKNESS,
        young_modulus=_YOUNG,
        thickness=_THICKNESS,
        bending=False,
        material=material,
    )
    model = problem.model
    places = model.node_points
    exact = np.stack(_deformation(*places.T, np.sin, np.cos), axis=-1)
    problem.state[model.position_dofs] = exact  # on the boundary for good, inside a first guess
    problem.hold(boundary)
    load = _load(model.domain, material)  # smooth: UFL would take degree 92 for the inverse in it
    problem.system.dead_load = problem.surface_load(load, 12)
    problem.solve(1e-11)
    found = sampled(model, problem.positions)
    x, y = found.points[..., 0], found.points[..., 1]
    target = np.stack(_deformation(x, y, np.sin, np.cos), axis=-1)
    return found.norm(found.values - target), found.norm(found.gradients - _gradient(x, y))
