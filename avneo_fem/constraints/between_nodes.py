"""Clearance of the surface between two nodes that both keep it.

A triangle is flat, the volume's boundary is not: where that bends into the volume, the middle of
an edge comes nearer to it than its ends do. To ask more clearance of the ends would drive them
apart on both sides of a sharp bend, which brings the middle nearer still; so the middle itself is
pushed.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.signed_distance_penalty import SignedDistance, SignedDistancePenalty
from avneo_fem.constraints.term import Foreseen

__all__ = ["BetweenNodesPenalty", "shortfall_between"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: places along an edge that are looked at, as shares of it
_PLACES = np.array([0.2, 0.35, 0.5, 0.65, 0.8])


def shortfall_between(
    field: SignedDistance, points: Floats, edges: Ints, clearance: Floats
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


class BetweenNodesPenalty:
    """The penalty of the nodes at places inside of edges, those of them that are held off.

    Each place weighs as much as its whole edge: a single one that is short is pushed about as
    hard as a node would be.

    Parameters
    ----------
    nodes : SignedDistancePenalty
        That of the nodes. Volume, stiffness, width and clearance, which is linear between nodes,
        are its own at any time.
    edges : (e, 2) array
        All edges.
    areas : (e,) array
        Template area that goes with each [mm^2].

    Attributes
    ----------
    held_off : (e,) bool array
        Edges that are pushed, to be changed with :meth:`hold_off`; none at first.
    """

    def __init__(self, nodes: SignedDistancePenalty, edges: Ints, areas: Floats) -> None:
        self.nodes, self.edges, self.areas = nodes, edges, areas
        self.hold_off(np.zeros(len(edges), dtype=bool))

    def hold_off(self, which: Bools) -> None:
        """Push these edges (e,) and no others."""
        self.held_off = which
        edges, count = self.edges[which], len(self.nodes.node_areas)
        shares = np.tile(_PLACES, len(edges))
        size = len(shares)
        ends = np.repeat(edges, len(_PLACES), axis=0)
        entries = (np.column_stack([1.0 - shares, shares]).ravel(), ends.ravel())
        #: (k, n) weights of the nodes at each place
        self._weights = sp.csr_matrix((*entries, 2 * np.arange(size + 1)), shape=(size, count))
        self._expanded = sp.kron(self._weights, sp.identity(3), "csr")
        self._penalty = SignedDistancePenalty(
            self.nodes.field,
            np.repeat(self.areas[which], len(_PLACES)),
            self.nodes.stiffness,
            self.nodes.width,
            self._weights @ self.nodes.clearance,
        )

    def _places(self) -> SignedDistancePenalty:
        """The penalty of the places, as that of the nodes is now."""
        penalty, nodes = self._penalty, self.nodes
        if penalty.field is not nodes.field:
            penalty.field = nodes.field
        penalty.stiffness, penalty.width = nodes.stiffness, nodes.width
        penalty.clearance = self._weights @ nodes.clearance
        return penalty

    def energy(self, points: Floats) -> float:
        """Penalty energy [mN mm]."""
        return self._places().energy(self._weights @ points)

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy [mN]."""
        return np.asarray(self._weights.T @ self._places().gradient(self._weights @ points))

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) second derivative [mN/mm]."""
        return self._to_nodes(self._places().hessian(self._weights @ points))

    def foreseen(self, points: Floats, moves: Floats) -> Foreseen:
        """What changes when the places that act are those that act after ``moves`` (n, 3)."""
        found = self._places().foreseen(self._weights @ points, self._weights @ moves)
        gradient = np.asarray(self._weights.T @ found.gradient)
        return Foreseen(found.switched, gradient, self._to_nodes(found.hessian))

    def _to_nodes(self, hessian: sp.spmatrix) -> sp.csr_matrix:
        return (self._expanded.T @ hessian.tocsr() @ self._expanded).tocsr()
