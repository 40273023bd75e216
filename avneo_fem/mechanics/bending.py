r"""Kirchhoff-Love bending of a faceted surface with one rotation angle per edge.

The surface is piecewise linear, so its curvature sits in the edges. Each edge e carries a
director: a given vector p_e, seen across the edge and turned about it by the unknown angle
alpha_e. Against a triangle T with normal n and outward conormal mu = t x n it stands at

    theta_e^T = s_e^T alpha_e + atan2(p_e . mu, p_e . n),      s_e^T = +-1 (direction of the edge),

and the curvature of T is the tensor whose normal moments do the same work as those rotations,

    kappa_T = 1/|T| sum_e l_e theta_e^T nu_e (x) nu_e,
    W_T = D/2 |T| kappa_T : kappa_T,   D = E H^3/12.

This is the lowest-order Hellan-Herrmann-Johnson shell with the moments eliminated and the edge
rotation kept (cf. Neunteufel & Schoeberl, Comput. Struct. 225 (2019) 106109; Grinspun et al.,
Comput. Graph. Forum 25 (2006) 547): a minimisation, integrals over cells only, and quadratic
with a positive definite form in the angles. A hinged or free edge leaves alpha_e free; a clamped
one prescribes it.
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.mechanics.edge_turn import turn_variation
from avneo_fem.mechanics.kinematics import unit_normal

__all__ = ["bending_energy_density", "bending_force_density", "edge_rotations"]


def _barycentric_gradients(domain: Any) -> list[Any]:
    """Gradients of the three barycentric coordinates, vertex order of the reference triangle."""
    inverse = ufl.JacobianInverse(domain)
    first = ufl.as_vector([inverse[0, 0], inverse[0, 1]])
    second = ufl.as_vector([inverse[1, 0], inverse[1, 1]])
    return [-(first + second), first, second]


def _to_edge_midpoints(domain: Any) -> list[Any]:
    """Vectors from the cell's centroid to the midpoints of the edges opposite vertex 0, 1, 2."""
    jacobian = ufl.Jacobian(domain)
    first = ufl.as_vector([jacobian[0, 0], jacobian[1, 0]])
    second = ufl.as_vector([jacobian[0, 1], jacobian[1, 1]])
    third = (first + second) / 3
    return [third / 2, -(first - third) / 2, -(second - third) / 2]


def edge_rotations(
    domain: Any, position: Any, angle: Any, director: Any, direction: Any
) -> list[tuple[Any, Any, Any]]:
    """(theta_e, l_e, nu_e) for the three edges of a cell.

    Valid at the centroid of the cell only (one-point quadrature). ``position`` is linear;
    ``angle`` alpha_e, ``director`` p_e (3) and ``direction`` (2, the unit tangent in the template
    that tells which way alpha_e turns) are Crouzeix-Raviart functions, whose value at an edge's
    midpoint is rebuilt from centroid value and gradient.
    """
    gradient = ufl.grad(position)
    normal = unit_normal(gradient)
    area = ufl.CellVolume(domain)
    rotations = []
    barycentric = _barycentric_gradients(domain)
    for weight, arm in zip(barycentric, _to_edge_midpoints(domain), strict=True):
        steepness = ufl.sqrt(ufl.dot(weight, weight))
        outward = -weight / steepness
        tangent = ufl.as_vector([-outward[1], outward[0]])
        along = gradient * tangent
        conormal = ufl.cross(along / ufl.sqrt(ufl.dot(along, along)), normal)
        alpha = angle + ufl.dot(ufl.grad(angle), arm)
        vector = director + ufl.grad(director) * arm
        sign = ufl.dot(tangent, direction + ufl.grad(direction) * arm)
        sine, cosine = ufl.dot(vector, conormal), ufl.dot(vector, normal)
        # half-angle form: singular only where the director is opposite to the normal
        turn = 2 * ufl.atan(sine / (cosine + ufl.sqrt(sine**2 + cosine**2)))
        rotations.append((sign * alpha + turn, 2 * area * steepness, outward))
    return rotations


def bending_energy_density(
    domain: Any, position: Any, angle: Any, director: Any, direction: Any, rigidity: Any
) -> Any:
    """D/2 kappa : kappa [mN/mm] per reference area (delta U_b of (1.2)); one-point quadrature."""
    area = ufl.CellVolume(domain)
    curvature = ufl.zero(2, 2)
    for theta, length, outward in edge_rotations(domain, position, angle, director, direction):
        curvature = curvature + length * theta / area * ufl.outer(outward, outward)
    return rigidity / 2 * ufl.inner(curvature, curvature)


def bending_force_density(
    domain: Any,
    state: tuple[Any, Any],
    virtual: tuple[Any, Any],
    director: Any,
    direction: Any,
    rigidity: Any,
) -> Any:
    """D kappa : delta kappa [mN/mm], variation of :func:`bending_energy_density`.

    ``state`` and ``virtual`` are (position, angle) and their variations; one-point quadrature.
    """
    position, angle = state
    area = ufl.CellVolume(domain)
    gradient, change = ufl.grad(position), ufl.grad(virtual[0])
    curvature, variation = ufl.zero(2, 2), ufl.zero(2, 2)
    rotations = edge_rotations(domain, position, angle, director, direction)
    sides = zip(_to_edge_midpoints(domain), rotations, strict=True)
    for arm, (theta, length, outward) in sides:
        tangent = ufl.as_vector([-outward[1], outward[0]])
        sign = ufl.dot(tangent, direction + ufl.grad(direction) * arm)
        turn = turn_variation(gradient, change, director + ufl.grad(director) * arm, outward)
        turn += sign * (virtual[1] + ufl.dot(ufl.grad(virtual[1]), arm))
        both = ufl.outer(outward, outward)
        curvature = curvature + length * theta / area * both
        variation = variation + length * turn / area * both
    return rigidity * ufl.inner(curvature, variation)
