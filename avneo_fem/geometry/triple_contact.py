"""The point of triple contact of the three cusps (paper section 3.3.1, Proposition 3.1).

Throughout, (i, j, k) is a positive permutation of (0, 1, 2): j = i + 1, k = i + 2 modulo 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.geometry.commissure import angles_of_sides

__all__ = ["TripleContactPoint", "triple_contact_point", "triple_contact_points"]

Array = NDArray[np.float64]

_J, _K = np.array([1, 2, 0]), np.array([2, 0, 1])


@dataclass(frozen=True, eq=False)
class TripleContactPoint:
    """Point C of triple contact and dilation nu* (Proposition 3.1).

    ``case`` is "interior" when (3.2) holds, |A_i C| = nu* c_i for all i. It is "edge" when C = K_i
    lies on the side A_j A_k, and ``edge_index`` is that i.
    """

    point: Array
    nu_star: float
    case: Literal["interior", "edge"]
    edge_index: int | None


def triple_contact_point(commissures: ArrayLike, contact: ArrayLike) -> TripleContactPoint:
    """Triple contact point of one triangle: A_i (3, 3) [mm], c (3,) > 0 [mm]; Proposition 3.1.

    C minimises max_i |A_i C| / c_i, and nu* is that minimum. See :func:`triple_contact_points`.
    """
    points, nu, side = triple_contact_points(np.array([commissures]), np.array([contact]))
    edge = int(side[0]) if side[0] >= 0 else None
    case: Literal["interior", "edge"] = "interior" if edge is None else "edge"
    return TripleContactPoint(points[0], float(nu[0]), case, edge)


def triple_contact_points(commissures: Array, contact: Array) -> tuple[Array, Array, NDArray]:
    """Triple contact points of many triangles (Proposition 3.1).

    Parameters
    ----------
    commissures : (m, 3, 3) float64
        A_i of each triangle [mm], not on a line.
    contact : (m, 3) float64
        Contact lengths c_i > 0 [mm].

    Returns
    -------
    point : (m, 3) float64
        C [mm].
    nu_star : (m,) float64
        nu*.
    side : (m,) int
        i where C = K_i lies on the side A_j A_k (case 1), -1 where (3.2) holds (case 2).

    Raises
    ------
    ValueError
        When a contact length is not positive.

    Notes
    -----
    In case 2 an inversion about A_0 turns the circles of Apollonius |A_i C| : |A_j C| = c_i : c_j
    into circles whose radii and distance are as a_1 c_1, a_2 c_2 and a_0 c_0. With beta_i the
    angles of the triangle with sides a_i c_i, C sees the side A_j A_k under alpha_i + beta_i <= pi,
    so its barycentric weights are sin(alpha_i + beta_i)/c_i, all positive: no root to choose, no
    cancellation. The areas of the three parts of the triangle give nu*.
    """
    if not np.all(contact > 0.0):
        raise ValueError("contact lengths must be positive")
    a_j, a_k, c_j, c_k = commissures[:, _J], commissures[:, _K], contact[:, _J], contact[:, _K]
    sides = np.linalg.norm(a_j - a_k, axis=2)
    divider = (c_k[..., None] * a_j + c_j[..., None] * a_k) / (c_j + c_k)[..., None]  # K_i
    dilation = sides / (c_j + c_k)  # nu_i
    margin = np.linalg.norm(commissures - divider, axis=2) - dilation * contact
    # at most one margin is negative, because the minimiser of max |A_i C|/c_i is unique
    row, side = np.arange(len(contact)), np.argmin(margin, axis=1)
    edge = margin[row, side] < 0.0

    u, v = a_j - commissures, a_k - commissures
    doubled_area = np.linalg.norm(np.cross(u, v), axis=2)  # three times the same
    alpha = np.arctan2(doubled_area, np.sum(u * v, axis=2))
    sine = np.maximum(np.sin(alpha + angles_of_sides(sides * contact)), 0.0)
    weight = sine / contact
    # in case 1 the weights mean nothing; they may vanish there
    total = np.where(edge, 1.0, weight.sum(axis=1))
    interior = np.einsum("mi,mip->mp", weight, commissures) / total[:, None]
    quotient = np.where(edge, 1.0, np.sum(c_j * c_k * sine, axis=1))
    point = np.where(edge[:, None], divider[row, side], interior)
    nu = np.where(edge, dilation[row, side], np.sqrt(doubled_area[:, 0] / quotient))
    return point, nu, np.where(edge, side, -1)
