"""Manufactured solution of plate bending: a clamped square whose deflection is a polynomial.

w = g(x) g(y) (1 + y/2) with g = t^2 (1 - t)^2 and its load D (w,xxxx + 2 w,xxyy + w,yyyy), small
enough that the shell answers linearly. Bending moments are compared with m = -D grad grad w.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from avneo_fem.compat import ufl
from avneo_fem.equilibrium.high_order_shell import HighOrderShell
from cell_fields import Samples, boundary, sampled, sampled_on_cells
from linear_response import respond
from meshes import strip
from solving import Problem, start

__all__ = ["plate_errors"]

Floats = NDArray[np.float64]

_YOUNG, _THICKNESS = 1200.0, 0.1
_RIGIDITY = _YOUNG * _THICKNESS**3 / 12
_SIZE = 1e-6  # of the deflection: the exact shell differs from its linear part by the square

_t = Polynomial([0.0, 1.0])
_ALONG_X = _SIZE * _t**2 * (1 - _t) ** 2
_ALONG_Y = _t**2 * (1 - _t) ** 2 * (1 + _t / 2)


def _exact(x: Floats, y: Floats, i: int, j: int) -> Floats:
    """Derivative of the deflection, i times in x and j times in y."""
    return np.asarray(_ALONG_X.deriv(i)(x) * _ALONG_Y.deriv(j)(y))


def _load(domain: Any) -> Any:
    """D times the biharmonic of the deflection as a UFL vector [kPa]."""
    x, y = ufl.SpatialCoordinate(domain)

    def part(i: int, j: int) -> Any:
        return _horner(_ALONG_X.deriv(i), x) * _horner(_ALONG_Y.deriv(j), y)

    biharmonic = part(4, 0) + 2 * part(2, 2) + part(0, 4)
    return ufl.as_vector([0.0 * x, 0.0 * x, _RIGIDITY * biharmonic])


def _horner(polynomial: Polynomial, t: Any) -> Any:
    value: Any = float(polynomial.coef[-1])
    for coefficient in polynomial.coef[-2::-1]:
        value = value * t + float(coefficient)
    return value


def _linear_moments(problem: Problem, response: Floats) -> Floats:
    """(m, 1, 3) moments 11, 22, 12 of the degree-1 shell, from the definition of its bending.

    D/|T| times the sum over edges of l theta nu (x) nu with the rotation theta = s alpha + dw/dnu
    of the director against the triangle, s the edge's direction (``mechanics.bending``).
    """
    model, mesh = problem.model, problem.model.mesh
    slope = sampled(model, response[model.position_dofs][:, 2:], 1).gradients[:, 0, 0]
    angle = response[model.angle_dofs]
    total = np.zeros((len(mesh.triangles), 3))
    for corner in range(3):
        start_, stop = (mesh.triangles[:, (corner + k) % 3] for k in (1, 2))
        side = mesh.points[stop] - mesh.points[start_]
        length = np.linalg.norm(side, axis=1)
        outward = np.c_[side[:, 1], -side[:, 0]] / length[:, None]
        sense = np.where(start_ < stop, 1.0, -1.0)
        theta = sense * angle[mesh.cell_edges[:, corner]] + (slope * outward).sum(axis=1)
        products = np.c_[outward**2, outward[:, 0] * outward[:, 1]]
        total += (length * theta)[:, None] * products
    return (_RIGIDITY * total / mesh.cell_areas[:, None])[:, None]


def _moments(problem: Problem, response: Floats, count: int) -> Samples:
    """Moments 11, 22, 12 [mN] that the shell itself works with, at quadrature points."""
    model = problem.model
    if not isinstance(model, HighOrderShell):
        return sampled_on_cells(model, _linear_moments(problem, response), 0, count)
    model._update_moments(problem.state + response)
    values = model._moment.x.array[model._moments].reshape(len(model.cell_nodes), 3, -1)
    return sampled_on_cells(model, values.transpose(0, 2, 1), model.parameters.degree - 1, count)


def plate_errors(degree: int, columns: int, structured: bool) -> tuple[float, float]:
    """Errors of a clamped plate on a mesh of 2 columns^2 triangles, relative to the solution's.

    Returns
    -------
    (float, float)
        Of the deflection in L2 and of the moments in the energy norm, (int |m|^2/D)^(1/2).
    """
    problem = start(
        strip(columns, columns, 1.0, 1.0, structured),
        degree,
        force_scale=1.0,
        young_modulus=_YOUNG,
        thickness=_THICKNESS,
    )
    model = problem.model
    problem.hold(boundary)
    problem.clamp(boundary)
    response = respond(problem, problem.surface_load(_load(model.domain)))
    found = sampled(model, response[model.position_dofs][:, 2:])
    deflection = _exact(found.points[..., 0], found.points[..., 1], 0, 0)[..., None]
    moments = _moments(problem, response, 6)
    x, y = moments.points[..., 0], moments.points[..., 1]
    curvature = [_exact(x, y, *order) for order in ((2, 0), (0, 2), (1, 1))]
    weight = np.sqrt([1.0, 1.0, 2.0])  # the component 12 counts twice
    target = -_RIGIDITY * np.stack(curvature, axis=-1) * weight
    return (
        found.norm(found.values - deflection) / found.norm(deflection),
        moments.norm(moments.values * weight - target) / moments.norm(target),
    )
