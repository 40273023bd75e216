"""Step 1 of the method: the flat template upright in the root (paper §3.2, step 1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SolveError

__all__ = ["place_template", "pierces"]

Floats = NDArray[np.float64]


def pierces(curve: Floats, corners: Floats) -> bool:
    """Whether a polyline (k, 3) crosses any of the triangles (m, 3, 3)."""
    origin = corners[:, 0]
    first, second = corners[:, 1] - origin, corners[:, 2] - origin
    normal = np.cross(first, second)
    heights = np.einsum("kmd,md->km", curve[:, None] - origin[None], normal)
    below, above = heights[:-1], heights[1:]
    piece, triangle = np.nonzero(below * above <= 0)
    drop = below[piece, triangle] - above[piece, triangle]
    share = np.divide(below[piece, triangle], drop, out=np.zeros(len(drop)), where=drop != 0)
    place = curve[piece] + share[:, None] * (curve[piece + 1] - curve[piece])
    arm, area = place - origin[triangle], normal[triangle]
    scale = np.einsum("nd,nd->n", area, area)
    u = np.einsum("nd,nd->n", np.cross(arm, second[triangle]), area) / scale
    v = np.einsum("nd,nd->n", np.cross(first[triangle], arm), area) / scale
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1)).any())


def place_template(
    points: Floats,
    triangles: NDArray[np.int64],
    corner_level: float,
    chord: tuple[Floats, Floats],
    opposite: Floats,
    normal: Floats,
    radius: float,
    suture_curve: Floats,
    c0: float = 1.0,
    c1: float = 0.1,
) -> tuple[Floats, int]:
    """Positions of the flat template and the k of the placement search.

    Parameters
    ----------
    points : (n, 2) array
        Template; its symmetry axis is x = 0, its corners lie at y = ``corner_level``.
    triangles : (m, 3) array
    chord : two (3,) arrays
        A_(i+1) and A_(i+2), between which cusp i hangs.
    opposite : (3,) array
        A_i; the template stands off the chord towards it.
    normal : (3,) array
        n, towards the aorta.
    radius : float
        R of the commissure circle; the distance tried is (c0 + c1 k) R, k = 0, 1, 2, ...
    suture_curve : (k, 3) array
        The aortic suture line as a polyline, which the template must not cross.

    Returns
    -------
    (positions (n, 3), k)
    """
    first, second = chord
    along = (second - first) / np.linalg.norm(second - first)
    towards = np.cross(normal, along)
    towards *= np.sign(np.dot(towards, opposite - first))
    middle = (first + second) / 2
    for k in range(200):
        corner = middle + (c0 + c1 * k) * radius * towards
        placed = corner + points[:, :1] * along + (points[:, 1:] - corner_level) * normal
        if not pierces(suture_curve, placed[triangles]):
            return placed, k
    raise SolveError("placement: no distance from the chord keeps the template off its suture line")
