"""How far the surface between two nodes is from a clearance that both of them keep.

A triangle is flat, the volume's boundary is not: where that bends into the volume, the middle of
an edge comes nearer to it than its ends do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.signed_distance_penalty import SignedDistance

__all__ = ["shortfall_between"]

Floats = NDArray[np.float64]

#: places along an edge that are looked at, as shares of it
_PLACES = (0.2, 0.35, 0.5, 0.65, 0.8)


def shortfall_between(
    field: SignedDistance, points: Floats, edges: NDArray[np.int64], clearance: Floats
) -> Floats:
    """By how much the inside of each edge misses the clearance of its ends.

    Parameters
    ----------
    field : SignedDistance
    points : (n, 3) array
        Nodes [mm].
    edges : (e, 2) array
        Their numbers at the ends of the edges.
    clearance : (n,) array
        Of the nodes [mm], linear between them.

    Returns
    -------
    (e,) array
        max(d_0 - d, 0) at the worst of the places looked at [mm]; how the nodes themselves
        keep theirs does not count.
    """
    result = np.zeros(len(edges))
    start, stop = points[edges[:, 0]], points[edges[:, 1]]
    # nothing between two nodes is nearer to the boundary than this: |grad d| = 1
    distance = field.evaluate(points)[0][edges].sum(axis=1)
    length = np.linalg.norm(stop - start, axis=1)
    near = np.flatnonzero((distance - length) / 2.0 < clearance[edges].max(axis=1))
    for share in _PLACES:
        place = start[near] + share * (stop - start)[near]
        wanted = clearance[edges[near]] @ np.array([1.0 - share, share])
        result[near] = np.maximum(result[near], wanted - field.evaluate(place)[0])
    return result
