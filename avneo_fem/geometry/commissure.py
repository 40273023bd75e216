"""Commissures, contact lengths and the point of triple contact (paper section 3.3.1).

Throughout, (i, j, k) is a positive permutation of (0, 1, 2): j = i + 1, k = i + 2 modulo 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError

__all__ = [
    "CommissurePlane",
    "TripleContactPoint",
    "commissure_angles",
    "commissure_directions",
    "contact_lengths",
    "quasi_optimal_lengths",
    "triple_contact_point",
    "triple_contact_points",
]

Array = NDArray[np.float64]

_J, _K = np.array([1, 2, 0]), np.array([2, 0, 1])


def commissure_angles(chord_ratio: Sequence[float], key: str = "commissures.chord_ratio") -> Array:
    """Angles alpha_i (3,) [radians] of the triangle with sides a_0 : a_1 : a_2.

    The wall's arc opposite to A_i, between the other two commissures, is 2 alpha_i.

    Raises
    ------
    SceneError
        When a side is not shorter than the other two together.
    """
    a = np.asarray(chord_ratio, dtype=float)
    for i in range(3):
        limit = a[_J[i]] + a[_K[i]]
        if not 0.0 < a[i] < limit:
            raise SceneError(
                key,
                tuple(chord_ratio),
                "the three chords must form a triangle:"
                f" a_{i} = {a[i]:.6g} must lie between 0 and a_{_J[i]} + a_{_K[i]} = {limit:.6g}",
            )
    return _angles_of_sides(a)


def _angles_of_sides(sides: Array) -> Array:
    """Angles (..., 3) [radians] opposite to sides (..., 3); pi, 0, 0 where they do not close.

    The half-angle form of the law of cosines, which keeps its digits in thin triangles.
    """
    rest = np.maximum(sides[..., _J] + sides[..., _K] - sides, 0.0)
    perimeter = sides.sum(axis=-1, keepdims=True)
    root = np.sqrt(rest[..., _J] * rest[..., _K])
    return np.asarray(2.0 * np.arctan2(root, np.sqrt(perimeter * rest)))


def commissure_directions(alpha: ArrayLike) -> Array:
    """Polar angles (3,) [radians] of A_0, A_1, A_2 seen from +z (design.md section 1).

    A_0 lies on the +x axis; cusp i spans the arc 2 alpha_i from A_j counter-clockwise to A_k.
    """
    angle = np.asarray(alpha, dtype=float)
    return np.array([0.0, 2.0 * angle[2], 2.0 * (angle[2] + angle[0])])


@dataclass(frozen=True, eq=False)
class CommissurePlane:
    """Plane of the commissures A_0, A_1, A_2 (paper section 3.1).

    Parameters
    ----------
    points : (3, 3) array_like
        A_i row by row [mm].

    Attributes
    ----------
    origin : (3,) float64
        A_0 [mm], origin of the plane's coordinates.
    normal : (3,) float64
        n = (A_1 - A_0) x (A_2 - A_0), normalised; towards the aorta.
    basis : (2, 3) float64
        Orthonormal rows e_0 (towards A_1) and e_1 = n x e_0.
    chord_lengths : (3,) float64
        a_i = |A_j A_k| [mm].
    circumradius, centre : float and (3,) float64
        R and centre of the circle through the commissures [mm].

    Raises
    ------
    SceneError
        When the points lie on a line.
    """

    points: Array

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=float)
        points.flags.writeable = False
        object.__setattr__(self, "points", points)
        a = self.chord_lengths
        if not np.linalg.norm(self._area_vector) > 1e-12 * a.max() ** 2:
            raise SceneError("commissures", points.tolist(), "must be three points not on a line")

    @cached_property
    def _area_vector(self) -> Array:
        return np.cross(self.points[1] - self.points[0], self.points[2] - self.points[0])

    @cached_property
    def origin(self) -> Array:
        return self.points[0]

    @cached_property
    def normal(self) -> Array:
        return np.asarray(self._area_vector / np.linalg.norm(self._area_vector))

    @cached_property
    def basis(self) -> Array:
        first = (self.points[1] - self.points[0]) / self.chord_lengths[2]
        return np.array([first, np.cross(self.normal, first)])

    @cached_property
    def chord_lengths(self) -> Array:
        return np.asarray(np.linalg.norm(self.points[_J] - self.points[_K], axis=1))

    @cached_property
    def circumradius(self) -> float:
        return float(self.chord_lengths.prod() / (2.0 * np.linalg.norm(self._area_vector)))

    @cached_property
    def centre(self) -> Array:
        square = self.chord_lengths**2
        weights = square * (square[_J] + square[_K] - square)  # barycentric coordinates
        return np.asarray(weights @ self.points / weights.sum())

    def to_plane(self, points: Array) -> Array:
        """Coordinates (n, 2) [mm] in ``basis`` of the projections of points (n, 3) [mm]."""
        return np.asarray((points - self.origin) @ self.basis.T)

    def from_plane(self, points: Array) -> Array:
        """Points (n, 3) [mm] of the plane with coordinates (n, 2) [mm] in ``basis``."""
        return np.asarray(self.origin + points @ self.basis)


def contact_lengths(commissure_lengths: ArrayLike, key: str = "cusp") -> Array:
    """Lengths c_k = (l_i + l_j - l_k)/2 (3,) of the contact curves A_k C [mm].

    Solves l_i = c_j + c_k of paper section 3.3 (misprinted there, see design.md section 1).

    Parameters
    ----------
    commissure_lengths : (3,) array_like
        l_i = L_f of cusp i [mm].

    Raises
    ------
    SceneError
        When one cusp is as long as the other two together, so that its c_k <= 0.
    """
    l = np.asarray(commissure_lengths, dtype=float)  # noqa: E741 - the paper's symbol
    c = (l[_J] + l[_K] - l) / 2.0
    if not np.all(c > 0.0):
        k = int(np.argmin(c))
        low, high = abs(l[_J[k]] - l[_K[k]]), l[_J[k]] + l[_K[k]]
        raise SceneError(
            f"{key}.{k}.template.free_edge_length",
            float(l[k]),
            f"contact length c_{k} = {c[k]:.6g} mm must be positive:"
            f" with the other two cusps the length must lie between {low:.6g} and {high:.6g} mm",
        )
    return np.asarray(c)


def quasi_optimal_lengths(chord_lengths: ArrayLike) -> Array:
    """Shortest lengths l_i = 2 a_i / sqrt(3) (3,) [mm] that close surely (Proposition 3.2)."""
    return 2.0 * np.asarray(chord_lengths, dtype=float) / np.sqrt(3.0)


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
    sine = np.maximum(np.sin(alpha + _angles_of_sides(sides * contact)), 0.0)
    weight = sine / contact
    # in case 1 the weights mean nothing; they may vanish there
    total = np.where(edge, 1.0, weight.sum(axis=1))
    interior = np.einsum("mi,mip->mp", weight, commissures) / total[:, None]
    quotient = np.where(edge, 1.0, np.sum(c_j * c_k * sine, axis=1))
    point = np.where(edge[:, None], divider[row, side], interior)
    nu = np.where(edge, dilation[row, side], np.sqrt(doubled_area[:, 0] / quotient))
    return point, nu, np.where(edge, side, -1)
