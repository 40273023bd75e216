r"""How the angle between a triangle and a director changes, derived by hand.

UFL differentiates an angle into long code. At an edge with template tangent tau and outward normal
nu let T = F tau, N = F nu, a = N x T (the normal times the area stretch). The director p stands at
theta = A.tau + atan2(p.mu, p.n) against the triangle. The frame (mu, n, t = T/|T|) turns with the
rotation vector w when phi moves by delta phi; its part along t changes the angle by -w.t =
n . grad(delta phi) g with F g = mu, its other parts act as far as p leans along the edge. Written
out, in rational functions of the deformation gradient,

    delta theta = delta A.tau + 1/|T| ( a . (|T|^2 G nu - (T.N) G tau) / |a|^2
                                        + (p.T) (p x T) . G tau / |p x T|^2 ),   G = grad delta phi.

Only the second derivative is left to UFL: docs/kernel_speed.md has what that buys.
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl

__all__ = ["turn_variation"]


def turn_variation(gradient: Any, virtual: Any, director: Any, normal: Any) -> Any:
    """Variation of the angle from a triangle's normal to a fixed director.

    Parameters
    ----------
    gradient, virtual : UFL (3, 2)
        F and G, the gradients of the position and of its variation.
    director : UFL (3,)
        p, of any length, not along the edge.
    normal : UFL (2,)
        nu, outward unit normal of the edge in the template.
    """
    tangent = ufl.as_vector([-normal[1], normal[0]])
    along, across = gradient * tangent, gradient * normal
    area, beside = ufl.cross(across, along), ufl.cross(director, along)
    square = ufl.dot(along, along)
    slope = square * (virtual * normal) - ufl.dot(along, across) * (virtual * tangent)
    tilt = ufl.dot(area, slope) / ufl.dot(area, area)
    lean = ufl.dot(director, along) * ufl.dot(beside, virtual * tangent) / ufl.dot(beside, beside)
    return (tilt + lean) / ufl.sqrt(square)
