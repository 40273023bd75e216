r"""Kirchhoff-Love bending of any degree: moments in the cells, rotation angles on the edges.

The surface is a Lagrange function of degree k. Its curvature has a smooth part in the cells and
a part concentrated in the edges, where neighbouring triangles meet at an angle. As in
``mechanics.bending`` an edge carries a director p, seen across the edge and turned about it by
the unknown angle A.t; against the normal n of one triangle, with conormal mu = t x n, it stands at

    theta = A.t + atan2(p.mu, p.n).

Moments m (symmetric, discontinuous, degree k-1) do on the whole curvature the work

    W(m) = sum_T int_T -m : (grad grad phi . n) + int_dT m_nunu theta - int_T m : m/(2 D),

and the bending energy is its maximum over m, found cell by cell. This is the Hellan-Herrmann-
Johnson shell (Neunteufel & Schoeberl, Comput. Struct. 225 (2019) 106109) with a Lagrange
multiplier A on the edges and the moments eliminated: a minimisation without penalty parameter,
of order k in the moments. A is the tangential trace of a Nedelec field, whose sign follows the
edge's direction by itself. Degree 1 is the element of ``mechanics.bending``.
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.mechanics.edge_turn import turn_variation
from avneo_fem.mechanics.kinematics import area_vector, right_cauchy_green, unit_normal

__all__ = [
    "angle_between",
    "director_angle",
    "moment_force_in_cells",
    "moment_force_on_edges",
    "moment_on_cells",
    "moment_on_edges",
    "symmetric",
]


def symmetric(components: Any) -> Any:
    """Symmetric 2x2 tensor of its components 11, 22, 12."""
    return ufl.as_matrix([[components[0], components[2]], [components[2], components[1]]])


def _edge_tangent(facet_normal: Any) -> Any:
    """Unit tangent of the boundary of a cell in the template, counter-clockwise."""
    return ufl.as_vector([-facet_normal[1], facet_normal[0]])


def _frame(gradient: Any, facet_normal: Any) -> tuple[Any, Any]:
    """Current unit normal and outward conormal mu of a triangle at its edge."""
    normal = unit_normal(gradient)
    along = gradient * _edge_tangent(facet_normal)
    return normal, ufl.cross(along / ufl.sqrt(ufl.dot(along, along)), normal)


def _angle(sine: Any, cosine: Any) -> Any:
    """atan2 in its half-angle form: singular at 180 degrees only."""
    return 2 * ufl.atan(sine / (cosine + ufl.sqrt(sine**2 + cosine**2)))


def director_angle(gradient: Any, rotation: Any, director: Any, facet_normal: Any) -> Any:
    """theta: angle from the normal of a triangle to the turned director, positive outwards."""
    normal, conormal = _frame(gradient, facet_normal)
    turn = _angle(ufl.dot(director, conormal), ufl.dot(director, normal))
    return ufl.dot(rotation, _edge_tangent(facet_normal)) + turn


def angle_between(gradient: Any, first: Any, second: Any, facet_normal: Any) -> Any:
    """Angle from the director ``first`` to ``second``, both seen across the edge."""
    normal, conormal = _frame(gradient, facet_normal)
    up, out = ufl.dot(first, normal), ufl.dot(first, conormal)
    second_up, second_out = ufl.dot(second, normal), ufl.dot(second, conormal)
    return _angle(up * second_out - out * second_up, up * second_up + out * second_out)


def moment_on_cells(position: Any, moment: Any) -> Any:
    """-m : (grad grad phi . n), work of the moments on the smooth part of the curvature."""
    normal = unit_normal(ufl.grad(position))
    second = ufl.grad(ufl.grad(position))
    tensor = symmetric(moment)
    return -sum(
        tensor[i, j] * ufl.dot(normal, ufl.as_vector([second[k, i, j] for k in range(3)]))
        for i in range(2)
        for j in range(2)
    )


def moment_on_edges(position: Any, rotation: Any, director: Any, moment: Any, normal: Any) -> Any:
    """m_nunu theta of one triangle at its edge; ``normal`` is nu, all arguments on one side."""
    angle = director_angle(ufl.grad(position), rotation, director, normal)
    return ufl.dot(normal, symmetric(moment) * normal) * angle


def moment_force_on_edges(
    position: Any, virtual: tuple[Any, Any], director: Any, moment: Any, normal: Any
) -> Any:
    """m_nunu delta theta, variation of :func:`moment_on_edges`.

    ``virtual`` holds the variations of position and rotation.
    """
    tangent = ufl.as_vector([-normal[1], normal[0]])
    turn = turn_variation(ufl.grad(position), ufl.grad(virtual[0]), director, normal)
    return ufl.dot(normal, symmetric(moment) * normal) * (ufl.dot(virtual[1], tangent) + turn)


def moment_force_in_cells(position: Any, virtual: Any, moment: Any) -> Any:
    """Variation of :func:`moment_on_cells`, with delta n = -F C^-1 G^T n:

    -m : (grad grad delta phi . n + grad grad phi . delta n).
    """
    gradient, change = ufl.grad(position), ufl.grad(virtual)
    square, area = right_cauchy_green(gradient), area_vector(gradient)
    normal = area / ufl.sqrt(ufl.dot(area, area))
    adjugate = ufl.as_matrix([[square[1, 1], -square[0, 1]], [-square[1, 0], square[0, 0]]])
    steepness = adjugate * (gradient.T * _contracted(moment, position)) / ufl.dot(area, area)
    return ufl.dot(normal, change * steepness) - ufl.dot(normal, _contracted(moment, virtual))


def _contracted(moment: Any, field: Any) -> Any:
    """m : grad grad of a vector field, (3,)."""
    tensor, second = symmetric(moment), ufl.grad(ufl.grad(field))
    places = [(i, j) for i in range(2) for j in range(2)]
    return ufl.as_vector([sum(tensor[i, j] * second[k, i, j] for i, j in places) for k in range(3)])
