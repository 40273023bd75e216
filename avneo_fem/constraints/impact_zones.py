"""Rigid impact zones: groups of nodes that collide move as rigid bodies, so they cannot cross.

Bridson, Fedkiw, Anderson, SIGGRAPH 2002, section 7.5. A straight path from one rigid placement
to another is an affine map at every instant, regular for turns below 180 degrees, so it keeps a
zone free of crossings. Zones only grow: in the worst case all becomes one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

__all__ = ["ImpactZones", "rigid_motion"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: [rad] a straight path to a turn by an angle shrinks lengths half-way to cos(angle / 2) of them:
#: 0.27 here, which no collision detection takes for a collision; 0 at 180 degrees
_LARGEST_TURN = 2.6


def rigid_motion(start: Floats, end: Floats, mass: Floats) -> tuple[Floats, Floats]:
    """Rotation R and translation t, x -> R x + t, nearest to moving ``start`` to ``end`` (k, 3).

    Least squares weighed with ``mass`` (k,): the correction from ``end`` has neither momentum nor
    moment. Of the rotations that do equally well, as about the line through two nodes, the
    smallest (to 1e-10). Turns by more than 2.6 rad are cut to that. Kabsch, Acta Cryst. A32
    (1976) 922.
    """
    share = mass / mass.sum()
    centre, goal = share @ start, share @ end
    first, second = start - centre, end - goal
    covariance = (share[:, None] * second).T @ first
    covariance += 1e-10 * np.linalg.norm(covariance) * np.eye(3)
    left, _, right = np.linalg.svd(covariance)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))  # a rotation, not a mirror image
    turn = Rotation.from_matrix(left @ right).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if angle > _LARGEST_TURN:
        turn *= _LARGEST_TURN / angle
    rotation: Floats = Rotation.from_rotvec(turn).as_matrix()
    return rotation, goal - rotation @ centre


class ImpactZones:
    """Zones of one step, none at first.

    Parameters
    ----------
    before : (n, 3) array
        Positions at the start of the step [mm].
    mass : (n,) array
        Of the nodes; that of held ones is not looked at.
    held : (n,) bool array
        Nodes that are not to be moved.
    """

    def __init__(self, before: Floats, mass: Floats, held: Bools) -> None:
        self._before, self._mass, self._held = before, mass, held
        self._labels = np.arange(len(before))

    def merge(self, nodes: Ints) -> bool:
        """Put the nodes of each row (k, 4), and the zones they are in, into one zone.

        False when they all were already.
        """
        joined = self._labels[nodes]
        start, end = np.repeat(joined[:, 0], 3), joined[:, 1:].ravel()
        new = start != end
        count = len(self._labels)
        links = coo_matrix((np.ones(new.sum()), (start[new], end[new])), shape=(count, count))
        self._labels = connected_components(links, directed=False)[1].astype(np.int64)[self._labels]
        return bool(new.any())

    def size(self) -> tuple[int, int]:
        """Number of zones, and of nodes in them."""
        sizes = np.bincount(self._labels)
        return int((sizes > 1).sum()), int(sizes[sizes > 1].sum())

    def moved(self, after: Floats) -> Floats:
        """Positions (n, 3) [mm] like ``after``, but with every zone moved rigidly.

        A zone takes the momentum its nodes have in ``after``. With held nodes it follows the
        rigid motion nearest to theirs, so it stays at ``before`` when they do; they themselves
        end where ``after`` has them.
        """
        moved = after.copy()
        for zone in np.flatnonzero(np.bincount(self._labels) > 1):
            nodes = np.flatnonzero(self._labels == zone)
            held = self._held[nodes]
            leading = nodes[held] if held.any() else nodes
            weight = np.ones(len(leading)) if held.any() else self._mass[leading]
            free = nodes[~held]
            if np.array_equal(self._before[leading], after[leading]):
                moved[free] = self._before[free]  # exactly
                continue
            rotation, shift = rigid_motion(self._before[leading], after[leading], weight)
            moved[free] = self._before[free] @ rotation.T + shift
        return moved
