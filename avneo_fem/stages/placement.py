"""Step 1 of the method: the flat template upright in the root (paper §3.2, step 1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError

__all__ = ["pierces", "place_template"]

Floats = NDArray[np.float64]

#: Distances from the chord that are tried; k = 0, 1, 2, ... below it.
_TRIALS = 200
#: Share of a triangle by which a hit may miss it: rounding must not let a line through a seam.
_SEAM = 1e-12


def pierces(curve: Floats, corners: Floats) -> bool:
    """Whether a polyline (k, 3) meets any of the triangles (m, 3, 3), their borders included."""
    origin = corners[:, 0]
    normal = np.cross(corners[:, 1] - origin, corners[:, 2] - origin)
    heights = curve @ normal.T - np.einsum("md,md->m", origin, normal)
    piece, triangle = np.nonzero(heights[:-1] * heights[1:] <= 0)
    below, above = heights[piece, triangle], heights[piece + 1, triangle]
    start, end = curve[piece], curve[piece + 1]
    # a piece that crosses the plane shrinks to the crossing; one that lies in it is kept whole
    crossing = below != above
    share = np.divide(below, below - above, out=np.zeros(len(below)), where=crossing)
    place = start + share[:, None] * (end - start)
    start, end = (np.where(crossing[:, None], place, point) for point in (start, end))
    first, last = np.zeros(len(piece)), np.ones(len(piece))
    for corner in range(3):  # clip at the three sides
        foot = corners[triangle, corner]
        inward = np.cross(normal[triangle], corners[triangle, (corner + 1) % 3] - foot)
        slack = _SEAM * np.einsum("nd,nd->n", normal[triangle], normal[triangle])
        at_start = np.einsum("nd,nd->n", start - foot, inward) + slack
        at_end = np.einsum("nd,nd->n", end - foot, inward) + slack
        slope = at_start - at_end
        cut = np.divide(at_start, slope, out=np.full(len(slope), np.inf), where=slope != 0)
        first = np.where(at_start < 0, np.maximum(first, cut), first)
        last = np.where(at_end < 0, np.minimum(last, cut), last)
        first = np.where((at_start < 0) & (at_end < 0), np.inf, first)
    return bool((first <= last).any())


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
        Template; its symmetry axis is x = 0, its corners lie at y = ``corner_level`` [mm].
    triangles : (m, 3) array
    corner_level : float
        Height of N_0 and N_1 in the template, which comes to lie in the plane M [mm].
    chord : two (3,) arrays
        A_(i+1) and A_(i+2), between which cusp i hangs [mm].
    opposite : (3,) array
        A_i; the template stands off the chord towards it [mm].
    normal : (3,) array
        n, unit normal of M towards the aorta.
    radius : float
        R of the commissure circle; the distance tried is (c0 + c1 k) R, k = 0, 1, 2, ... [mm].
    suture_curve : (k, 3) array
        The aortic suture line as a polyline, which the template must not cross [mm].
    c0, c1 : float
        c^0 and c^1.

    Returns
    -------
    (positions (n, 3) [mm], k)

    Raises
    ------
    SceneError
        When 200 steps of c1 do not bring the template off its suture line.
    """
    first, second = chord
    along = (second - first) / np.linalg.norm(second - first)
    towards = np.cross(normal, along)
    towards *= np.sign(np.dot(towards, opposite - first))
    middle = (first + second) / 2
    for k in range(_TRIALS):
        corner = middle + (c0 + c1 * k) * radius * towards
        placed = corner + points[:, :1] * along + (points[:, 1:] - corner_level) * normal
        if not pierces(suture_curve, placed[triangles]):
            return placed, k
    raise SceneError(
        "placement.c1",
        c1,
        f"must be larger: {_TRIALS} steps of it leave the template on its aortic suture line",
    )
