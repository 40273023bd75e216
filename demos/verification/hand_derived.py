r"""First variations of the bending terms, derived by hand.

The kernels of ``mechanics.bending`` and ``mechanics.hybrid_bending`` come from an energy that UFL
differentiates twice. Here the first derivative is written down, in rational functions of the
deformation gradient, and only the second is left to UFL: much less code to compile and run.

At an edge with template tangent tau and outward normal nu let T = F tau, N = F nu, a = N x T (the
normal times the area stretch). The director p stands at theta = A.tau + atan2(p.mu, p.n) against
the triangle. The frame (mu, n, t = T/|T|) turns with the rotation vector w when phi moves by
delta phi; its part along t changes the angle by -w.t = n . grad(delta phi) g with F g = mu, its
other parts act as far as p leans along the edge. Written out,

    delta theta = delta A.tau + 1/|T| ( a . (|T|^2 G nu - (T.N) G tau) / |a|^2
                                        + (p.T) (p x T) . G tau / |p x T|^2 ),   G = grad delta phi.

The bending force of the linear shell is D kappa : delta kappa; that of the others is the work
m_nunu delta theta on the edges and, in the cells, with delta n = -F C^-1 G^T n,

    -m : (grad grad delta phi . n + grad grad phi . delta n).
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.equilibrium.high_order_shell import HighOrderShell
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.mechanics.bending import _to_edge_midpoints, edge_rotations
from avneo_fem.mechanics.hybrid_bending import symmetric
from avneo_fem.mechanics.kinematics import area_vector, right_cauchy_green
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = [
    "HandDerivedHighOrderShell",
    "HandDerivedShell",
    "bending_force_density",
    "hand_derived_shell",
    "moment_force_in_cells",
    "moment_force_on_edges",
    "turn_variation",
]


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


def bending_force_density(
    domain: Any,
    state: tuple[Any, Any],
    virtual: tuple[Any, Any],
    director: Any,
    direction: Any,
    rigidity: Any,
) -> Any:
    """D kappa : delta kappa [mN/mm], variation of ``mechanics.bending.bending_energy_density``.

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


def moment_force_on_edges(
    position: Any, virtual: tuple[Any, Any], director: Any, moment: Any, normal: Any
) -> Any:
    """m_nunu delta theta, variation of ``mechanics.hybrid_bending.moment_on_edges``.

    ``virtual`` holds the variations of position and rotation.
    """
    tangent = ufl.as_vector([-normal[1], normal[0]])
    turn = turn_variation(ufl.grad(position), ufl.grad(virtual[0]), director, normal)
    return ufl.dot(normal, symmetric(moment) * normal) * (ufl.dot(virtual[1], tangent) + turn)


def moment_force_in_cells(position: Any, virtual: Any, moment: Any) -> Any:
    """Variation of ``mechanics.hybrid_bending.moment_on_cells``."""
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


class HandDerivedShell(ShellModel):
    """``ShellModel`` with :func:`bending_force_density` as its bending force."""

    def _bending(self, rigidity: Any, test: Any) -> tuple[Any, Any]:
        energy, _ = super()._bending(rigidity, test)
        force = bending_force_density(
            self.domain,
            self._split(self._state),
            self._split(test),
            self._director,
            self._direction,
            rigidity,
        )
        return energy, force * self._dx(1)


class HandDerivedHighOrderShell(HighOrderShell):
    """``HighOrderShell`` with the forces of the moments derived by hand."""

    def _moment_force(self, work: Any, test: Any) -> Any:
        position, _ = self._split(self._state)
        virtual, moment = self._split(test), ufl.as_vector(ufl.split(self._moment))
        force = self._around_cells(
            lambda normal: moment_force_on_edges(position, virtual, self._director, moment, normal)
        )
        degree = self.parameters.degree
        if degree > 1:
            force += moment_force_in_cells(position, virtual[0], moment) * self._dx(2 * degree - 1)
        return force


def hand_derived_shell(mesh: CuspMesh, parameters: ShellParameters) -> ShellModel:
    """As ``high_order_shell.shell_model``, with forces derived by hand."""
    kind = HandDerivedShell if parameters.degree == 1 else HandDerivedHighOrderShell
    return kind(mesh, parameters)
