"""Angles of the commissures and lengths of the contact curves (paper sections 3.1 and 3.3).

Throughout, (i, j, k) is a positive permutation of (0, 1, 2): j = i + 1, k = i + 2 modulo 3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError

__all__ = [
    "angles_of_sides",
    "commissure_angles",
    "commissure_directions",
    "contact_lengths",
    "quasi_optimal_lengths",
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
    return angles_of_sides(a)


def angles_of_sides(sides: Array) -> Array:
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
