r"""Membrane strain of a quadratic shell, projected so that thin curved shells do not lock.

A quadratic surface cannot bend without some membrane strain: C = F^T F is quadratic in a triangle
while a rigidly bent sheet needs C = I. The cure of Neunteufel & Schoeberl (Comput. Mech. 69
(2022) 1169, Regge interpolation) replaces C by the linear tensor C_R whose tangential component
on every edge is the L2 projection of that of C, and whose mean over the triangle is that of C.

With barycentric coordinates lambda_i, edge vectors E_e = x_b - x_a and the tensors
S_e = sym(grad lambda_a (x) grad lambda_b), for which E_e.S_f E_e = -delta_ef, the three components
g_e = E_e.C E_e = |phi,E_e|^2 decouple, and for quadratic phi with second derivative K

    C_R = C + sum_e w_e S_e,
    w_e = A (lambda_a lambda_b - 1/6) + B lambda_b lambda_c + G lambda_c lambda_a
          + (A - B - G)/4 lambda_c,
    A = -|K[E_e, E_e]|^2,  B = -|K[E_e, x_c - x_b]|^2,  G = -|K[E_e, x_a - x_c]|^2.
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.mechanics.kinematics import right_cauchy_green

__all__ = ["projected_right_cauchy_green"]


def projected_right_cauchy_green(domain: Any, position: Any, barycentric: Any) -> Any:
    """C_R (2x2) of a quadratic ``position``.

    ``barycentric`` is a discontinuous linear function with the three coordinates lambda_i of each
    cell.
    """
    jacobian = ufl.Jacobian(domain)
    first = ufl.as_vector([jacobian[0, 0], jacobian[1, 0]])
    second = ufl.as_vector([jacobian[0, 1], jacobian[1, 1]])
    edges = [second - first, -second, first]  # opposite vertex 0, 1, 2: from b to c, round the cell
    inverse = ufl.JacobianInverse(domain)
    rows = [ufl.as_vector([inverse[k, 0], inverse[k, 1]]) for k in range(2)]
    slopes = [-(rows[0] + rows[1]), rows[0], rows[1]]
    third = ufl.grad(ufl.grad(position))

    def second_derivative(one: Any, other: Any) -> Any:
        parts = [
            sum(third[k, i, j] * one[i] * other[j] for i in range(2) for j in range(2))
            for k in range(3)
        ]
        return sum(part**2 for part in parts)

    result = right_cauchy_green(ufl.grad(position))
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        edge = edges[c]
        whole = -second_derivative(edge, edge)
        ahead, behind = -second_derivative(edge, edges[a]), -second_derivative(edge, edges[b])
        la, lb, lc = barycentric[a], barycentric[b], barycentric[c]
        share = whole * (la * lb - 1.0 / 6.0) + ahead * lb * lc + behind * lc * la
        share += (whole - ahead - behind) / 4 * lc
        product = ufl.outer(slopes[a], slopes[b])
        result = result + share * (product + product.T) / 2
    return result
