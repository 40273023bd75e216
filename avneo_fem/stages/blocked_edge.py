"""Sutured edges whose tangent half-plane leads straight into the neighbouring cusp.

Next to a commissure the half-plane (3.1) points at the neighbour, whose own sutured edge lies one
thickness away, so the cusp cannot follow it by more than the clearance that is left: next to
nothing. A shell that is clamped there and must keep clear squeezes its first row of triangles to
a thousandth of their area. That row carries no information but ruins the condition of every
matrix; so it is laid down where it must end up, as part of the stitch. Its width is that of a
triangle: under refinement it vanishes, and what is left is an edge that may turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.signed_distance_penalty import SignedDistance
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["LaidRow", "blocked_row", "may_be_missed"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: a row is laid down where less than this share of its height has room
_ROOM = 0.5
_SAMPLES = 40


@dataclass(frozen=True)
class LaidRow:
    """Nodes of the first row that have no room in their half-plane, and where they belong.

    Attributes
    ----------
    nodes : (j,) int array
    foot : (j, 3) array
        Points of the suture line next to which they are laid [mm].
    tangent, inward, normal : (j, 3) arrays
        Frame of the half-plane: along the suture line, into the half-plane, and across it.
    reach : (j,) array
        Distance from the suture line that the clearance allows [mm].
    is_blocked : (k-1,) bool array
        Suture edges whose triangle this is about.
    is_left : (k-1,) bool array
        Suture edges that have no room either, but whose node, at the free edge, cannot be laid
        down without cutting a bend of the suture line: they are free to turn.
    """

    nodes: Ints
    foot: Floats
    tangent: Floats
    inward: Floats
    normal: Floats
    reach: Floats
    is_blocked: NDArray[np.bool_]
    is_left: NDArray[np.bool_]

    @property
    def has_room(self) -> NDArray[np.bool_]:
        """(k-1,) suture edges whose triangle can follow its half-plane."""
        return ~(self.is_blocked | self.is_left)

    def on_the_way(self, points: Floats, share: float) -> Floats:
        """(j, 3) places of nodes at ``points`` (j, 3) after ``share`` of their way.

        The way turns about the suture line into the half-plane while it closes in on the line, so
        that no triangle is turned inside out.
        """
        arm = points - self.foot
        x, y, z = (
            np.einsum("jd,jd->j", arm, axis) for axis in (self.inward, self.normal, self.tangent)
        )
        angle = (1.0 - share) * np.arctan2(y, x)
        radius = np.hypot(x, y) ** (1.0 - share) * self.reach**share
        cosine, sine = (radius * np.cos(angle))[:, None], (radius * np.sin(angle))[:, None]
        rest = ((1.0 - share) * z)[:, None]
        return self.foot + cosine * self.inward + sine * self.normal + rest * self.tangent


def may_be_missed(clearance: Floats, most: float) -> Floats:
    """By how much clearances (n,) may be missed [mm]: ``most``, but half of them at most.

    Neighbours whose edges are sewn on next to each other would cross otherwise. A tenth of
    ``most`` is left where there is no clearance.
    """
    return np.clip(clearance / 2.0, 0.1 * most, most)


def blocked_row(
    mesh: CuspMesh,
    apex: Ints,
    target: Floats,
    conormal: Floats,
    wedge: SignedDistance,
    wall: SignedDistance,
    clearance: Floats,
    slack: float,
    upward: Floats,
) -> LaidRow:
    """The nodes that have no room in their half-plane.

    Parameters
    ----------
    mesh : CuspMesh
    apex : (k-1,) array
        Node opposite each suture edge.
    target : (k, 3) array
        Sutured nodes in place [mm].
    conormal : (k-1, 3) array
        Outward conormal b of the suture edges: the cusp leaves along -b (3.1).
    wedge, wall : SignedDistance
        The closed contact wedge, and the root, which the places do not leave.
    clearance : (n,) array
        d_0 of every node from it [mm].
    slack : float
        By how much d_0 may be missed [mm], see :func:`may_be_missed`.
    upward : (3,) array
        n, normal of the plane of commissures, in which (1.6) measures the free edge's height.
    """
    ends = mesh.points[np.c_[mesh.suture_line[:-1], mesh.suture_line[1:]]]
    side, arm = ends[:, 1] - ends[:, 0], mesh.points[apex] - ends[:, 0]
    share = np.einsum("kd,kd->k", arm, side) / np.einsum("kd,kd->k", side, side)
    height = np.linalg.norm(arm - share[:, None] * side, axis=1)
    along = np.diff(target, axis=0)
    tangent = along / np.linalg.norm(along, axis=1, keepdims=True)
    inward = np.einsum("kd,kd->k", conormal, tangent)[:, None] * tangent - conormal
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    share = np.clip(share, 0.0, 1.0)
    foot = target[:-1] + share[:, None] * along
    at_free_edge = np.isin(apex, mesh.free_edge)
    # the free edge keeps the height over its corner that the template gives it
    corner = np.where(np.arange(len(apex)) < len(apex) / 2, 0, len(apex))
    rise = mesh.points[apex, 1] - mesh.points[mesh.suture_line[corner], 1]
    lifted = target[corner] + np.maximum(rise, 0.0)[:, None] * upward
    foot[at_free_edge] = lifted[at_free_edge]
    reach = np.linspace(0.0, 1.0, _SAMPLES + 1)[1:] * height[:, None]
    samples = foot[:, None] + reach[..., None] * inward[:, None]
    distance = wedge.evaluate(samples.reshape(-1, 3))[0].reshape(reach.shape)
    missing = may_be_missed(np.minimum(clearance[apex], wedge.evaluate(foot)[0]), slack)
    clear = np.logical_and.accumulate(distance >= (clearance[apex] - missing)[:, None], axis=1)
    room = np.maximum(clear.sum(axis=1) / _SAMPLES * height, missing)
    blocked = (room < _ROOM * height) & ~np.isin(apex, mesh.suture_line)
    length = np.linalg.norm(along, axis=1)
    # a node that has to stay at the free edge cannot go near the next bend
    left = blocked & at_free_edge & (_bends(tangent) * length > room)
    blocked &= ~left
    order = np.flatnonzero(blocked)[np.argsort(room[blocked], kind="stable")]
    nodes, first = np.unique(apex[order], return_index=True)
    edge = order[first]
    share = _cleared_of_bends(share, tangent, length, room)
    foot[~at_free_edge] = (target[:-1] + share[:, None] * along)[~at_free_edge]
    # a half-plane along the wall leaves a round root: by reach^2/2R
    place = foot[edge] + room[edge, None] * inward[edge]
    outside, radial, _ = wall.evaluate(place)
    way = place - np.minimum(outside, 0.0)[:, None] * radial - foot[edge]
    reach = np.linalg.norm(way, axis=1)
    way /= reach[:, None]
    along = tangent[edge] - np.einsum("jd,jd->j", tangent[edge], way)[:, None] * way
    along /= np.linalg.norm(along, axis=1)[:, None]
    laid = np.isin(apex, nodes)
    return LaidRow(nodes, foot[edge], along, way, np.cross(along, -way), reach, laid, left & ~laid)


def _cleared_of_bends(share: Floats, tangent: Floats, length: Floats, room: Floats) -> Floats:
    """Places (k-1,) along the suture edges that keep the row from cutting a corner.

    Where the suture line bends by beta, a row laid at distance d would cut the corner between two
    nodes that are both further than d / beta from it. So each node goes near to the end of its
    edge that is away from the commissure.
    """
    count = len(share)
    ahead = np.arange(count) < count / 2
    allowed = room / (2.0 * np.maximum(_bends(tangent), 1e-9)) / length
    from_end = np.minimum(np.where(ahead, 1.0 - share, share), allowed)
    return np.where(ahead, 1.0 - from_end, from_end)


def _bends(tangent: Floats) -> Floats:
    """(k-1,) angle of the suture line at the end of each edge that is away from its commissure."""
    count = len(tangent)
    bend = np.zeros(count + 1)
    cosine = np.einsum("kd,kd->k", tangent[:-1], tangent[1:])
    bend[1:-1] = np.arccos(np.clip(cosine, -1.0, 1.0))
    number = np.arange(count)
    return bend[np.where(number < count / 2, number + 1, number)]
