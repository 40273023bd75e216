"""Which parts of one triangulated surface are near each other, or meet on their way.

A pair is a point and a triangle, or two edges, that share no node. Its weights are signed: with
them the four nodes give the vector from the nearest point of the second part to that of the first.
ipctk 1.6.0 finds the pairs; additive continuous collision detection (Li, Kaufman, Jiang,
Codimensional incremental potential contact, ACM Trans. Graph. 40 (2021) 170) times them.
"""

from __future__ import annotations

from dataclasses import dataclass

import ipctk
import numpy as np
from numpy.typing import NDArray

__all__ = ["Contacts", "colliding_pairs", "collision_mesh", "nearby_pairs", "nearest_weights"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

ipctk.set_num_threads(1)

#: two parts collide where they come within this share of their first gap (at most the thickness)
FLOOR = 0.1
#: least gap asked of a colliding pair, in the same measure: above FLOOR, or it would come back
LEAST = 0.25
_ROWS = 100_000  # pairs at a time: bounds the memory
_STEPS = 100_000  # of one detection; what is not decided by then counts as a collision
_TIE = 1e-9  # nearest points this close to equally near: the first is taken, whatever the rounding
_EDGE_PAIR, _POINT_PAIR = ipctk.EdgeEdgeCandidate(0, 0), ipctk.FaceVertexCandidate(0, 0)


@dataclass(frozen=True)
class Contacts:
    """Pairs that must end up apart: ``normals . (weights x nodes) >= gaps``.

    Attributes
    ----------
    nodes : (k, 4) int array
        Point and triangle, or first and second edge.
    weights : (k, 4) array
        Signed barycentric coordinates of the two nearest points.
    normals : (k, 3) array
        Unit vector from the second part to the first.
    gaps : (k,) array
        Distance along the normal to end with [mm].
    """

    nodes: Ints
    weights: Floats
    normals: Floats
    gaps: Floats

    def __len__(self) -> int:
        return len(self.nodes)

    def replaced_by(self, newer: Contacts) -> Contacts:
        """Both together; of a pair that is in both, what ``newer`` says."""
        nodes = np.concatenate([newer.nodes, self.nodes])
        first = np.unique(nodes, axis=0, return_index=True)[1]
        joined = (
            np.concatenate([getattr(newer, name), getattr(self, name)])[first]
            for name in ("nodes", "weights", "normals", "gaps")
        )
        return Contacts(*joined)


def collision_mesh(points: Floats, triangles: Ints) -> ipctk.CollisionMesh:
    """ipctk's mesh of the surface with nodes (n, 3) [mm] and triangles (m, 3)."""
    faces = np.asfortranarray(triangles.astype(np.int32))
    return ipctk.CollisionMesh(np.asfortranarray(points), ipctk.edges(faces), faces)


def _on_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    """(k,) place 0..1 on each segment nearest to its point."""
    along = end - start
    square = np.einsum("ki,ki->k", along, along)
    share = np.einsum("ki,ki->k", point - start, along)
    return np.clip(np.divide(share, square, out=np.zeros_like(square), where=square > 0), 0, 1)


def _end_weights(corners: Floats, point: int, start: int, end: int) -> Floats:
    """Signed weights (k, 4) of node ``point`` and its nearest point of the segment."""
    share = _on_segment(corners[:, point], corners[:, start], corners[:, end])
    weights = np.zeros(corners.shape[:2])
    weights[:, point], weights[:, start], weights[:, end] = 1.0, share - 1.0, -share
    return weights


def _interior(u: Floats, v: Floats, w: Floats) -> tuple[Floats, Floats, Bools]:
    """Least-squares coordinates of w = a u + b v, and where they are well defined."""
    uu, uv, vv, uw, vw = (
        np.einsum("ki,ki->k", p, q) for p, q in ((u, u), (u, v), (v, v), (u, w), (v, w))
    )
    determinant = uu * vv - uv * uv
    usable = determinant > 1e-14 * uu * vv
    scale = np.where(usable, determinant, 1.0)
    return (vv * uw - uv * vw) / scale, (uu * vw - uv * uw) / scale, usable


def nearest_weights(corners: Floats, is_edges: bool) -> Floats:
    """Signed weights (k, 4) of the nearest points of pairs with nodes (k, 4, 3) [mm]."""
    p = [corners[:, k] for k in range(4)]
    if is_edges:
        s, t, usable = _interior(p[1] - p[0], p[2] - p[3], p[2] - p[0])
        usable &= (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
        inner = np.stack([1 - s, s, t - 1, -t], axis=1)
        outer = [_end_weights(corners, 0, 2, 3), _end_weights(corners, 1, 2, 3)]
        outer += [-_end_weights(corners, 2, 0, 1), -_end_weights(corners, 3, 0, 1)]
    else:
        s, t, usable = _interior(p[2] - p[1], p[3] - p[1], p[0] - p[1])
        usable &= (s >= 0) & (t >= 0) & (s + t <= 1)
        inner = np.stack([np.ones_like(s), s + t - 1, -s, -t], axis=1)
        outer = [_end_weights(corners, 0, *side) for side in ((1, 2), (2, 3), (3, 1))]
    choices = np.stack([np.where(usable[:, None], inner, outer[0]), *outer])
    offsets = np.einsum("ckn,kni->cki", choices, corners)
    squares = np.einsum("cki,cki->ck", offsets, offsets)
    chosen = np.argmax(squares <= (1 + _TIE) * squares.min(axis=0), axis=0)
    weights: Floats = choices[chosen, np.arange(len(corners))]
    return weights


def _direction(corners: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Unit vectors (k, 3) between the nearest points (zero where they meet), distances (k,)."""
    offset = np.einsum("kn,kni->ki", weights, corners)
    distance = np.linalg.norm(offset, axis=1)
    return offset / np.where(distance > 0, distance, 1.0)[:, None], distance


def _candidates(mesh: ipctk.CollisionMesh, found: ipctk.Candidates) -> list[tuple[Ints, bool]]:
    """Nodes of the pairs that ipctk's boxes leave, in blocks; and whether of edges."""
    faces, edges = np.asarray(mesh.faces, np.int64), np.asarray(mesh.edges, np.int64)
    points = np.array(
        [(c.vertex_id, c.face_id) for c in found.fv_candidates], dtype=np.int64
    ).reshape(-1, 2)
    lines = np.array([(c.edge0_id, c.edge1_id) for c in found.ee_candidates], dtype=np.int64)
    lines = np.sort(lines.reshape(-1, 2), axis=1)
    lists = (
        (np.column_stack([points[:, 0], faces[points[:, 1]]]), False),
        (np.column_stack([edges[lines[:, 0]], edges[lines[:, 1]]]), True),
    )
    return [
        (nodes[k : k + _ROWS], is_edges)
        for nodes, is_edges in lists
        for k in range(0, len(nodes), _ROWS)
    ]


def _joined(parts: list[Contacts]) -> Contacts:
    """All in one, sorted: the order in which ipctk finds pairs turns with the surface."""
    none = Contacts(np.empty((0, 4), np.int64), np.empty((0, 4)), np.empty((0, 3)), np.empty(0))
    joined = none
    for part in parts:
        joined = joined.replaced_by(part)
    return joined


def nearby_pairs(
    mesh: ipctk.CollisionMesh,
    points: Floats,
    thickness: float,
    share: float,
    rest: Floats | None = None,
) -> Contacts:
    """Pairs nearer than ``thickness``, to be moved apart by ``share`` of what they lack.

    Parameters
    ----------
    mesh : ipctk.CollisionMesh
    points : (n, 3) array
        Positions [mm].
    thickness : float
        Distance to keep [mm].
    share : float
        Part of the lacking distance to add, 0..1.
    rest : (n, 3) array, optional
        Stress-free positions [mm]: no pair is asked to be farther apart than there, or a fine
        mesh would push its own neighbours away.
    """
    found = ipctk.Candidates()
    found.build(mesh, np.asfortranarray(points), thickness / 2)
    parts = []
    for nodes, is_edges in _candidates(mesh, found):
        weights = nearest_weights(points[nodes], is_edges)
        normals, distance = _direction(points[nodes], weights)
        wanted = np.full(len(nodes), thickness)
        if rest is not None:
            apart = _direction(rest[nodes], nearest_weights(rest[nodes], is_edges))[1]
            wanted = np.minimum(wanted, apart)
        lacking = wanted - distance
        near = (lacking > 0) & (distance > 0)
        gaps = distance + share * lacking
        parts.append(Contacts(nodes[near], weights[near], normals[near], gaps[near]))
    return _joined(parts)


def _parted(normal: Floats, corners: Floats, is_edges: bool) -> Floats:
    """(k,) width of the gap that planes with these normals (k, 3) see between the two parts."""
    height = (corners @ normal[:, :, None])[:, :, 0]
    sides = 2 if is_edges else 1
    gap: Floats = height[:, :sides].min(axis=1) - height[:, sides:].max(axis=1)
    return gap


def _not_plainly_apart(start: Floats, end: Floats, thickness: float, is_edges: bool) -> Ints:
    """Rows left by the planes across the way from centre to centre, at the start and the end."""
    sides = 2 if is_edges else 1
    rows = np.arange(len(start))
    for corners in (start, end):
        seen = corners[rows]
        across = seen[:, :sides].mean(axis=1) - seen[:, sides:].mean(axis=1)
        across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
        gap = np.minimum(
            _parted(across, start[rows], is_edges), _parted(across, end[rows], is_edges)
        )
        rows = rows[gap <= FLOOR * thickness]
    return rows


def _passing(start: Floats, end: Floats, thickness: float, is_edges: bool) -> tuple[Ints, Floats]:
    """Rows of the pairs that meet on the way from ``start`` to ``end`` (k, 4, 3), and when."""
    rows = _not_plainly_apart(start, end, thickness, is_edges)
    corners = start[rows]
    normal, distance = _direction(corners, nearest_weights(corners, is_edges))
    floor = FLOOR * np.minimum(distance, thickness)
    # a plane that parts them at both ends parts them all the way
    doubtful = _parted(normal, end[rows], is_edges) <= floor
    rows, distance, floor = rows[doubtful], distance[doubtful], floor[doubtful]
    kind = _EDGE_PAIR if is_edges else _POINT_PAIR
    times = np.full(len(rows), np.nan)
    for k, row in enumerate(rows):
        if distance[k] == 0.0:
            times[k] = 0.0
            continue
        # ipctk stops at (1 - rescaling) of the first gap
        detection = ipctk.AdditiveCCD(_STEPS, 1.0 - floor[k] / distance[k])
        meets, time = kind.ccd(start[row].ravel(), end[row].ravel(), narrow_phase_ccd=detection)
        times[k] = time if meets else np.nan
    meeting = ~np.isnan(times)
    return rows[meeting], times[meeting]


def colliding_pairs(
    mesh: ipctk.CollisionMesh,
    before: Floats,
    after: Floats,
    thickness: float,
    changed: Bools | None = None,
) -> Contacts:
    """Pairs that meet while all nodes move straight from ``before`` to ``after`` (n, 3) [mm].

    They are to end as far apart, along the normal at first touch, as they began, but no farther
    than ``thickness`` [mm]. Where the two already touch the normal is zero. Only pairs with a
    node that is ``changed`` (n,) are looked at; all, if not given.
    """
    own = np.arange(1, len(before) + 1)
    # patches do not collide with themselves: all unchanged nodes are one
    patches = own if changed is None else np.where(changed, own, 0)
    mesh.can_collide = ipctk.make_vertex_patches_filter(patches.astype(np.int32))
    start, end = np.asfortranarray(before), np.asfortranarray(after)
    found = ipctk.Candidates()
    found.build(mesh, start, end)
    # at once for all: stricter than FLOOR, so if this lets the whole step pass there is nothing
    whole = ipctk.AdditiveCCD(_STEPS, 1.0 - FLOOR)
    if found.compute_collision_free_stepsize(mesh, start, end, narrow_phase_ccd=whole) == 1.0:
        return _joined([])
    parts = []
    for nodes, is_edges in _candidates(mesh, found):
        start, end = before[nodes], after[nodes]
        rows, times = _passing(start, end, thickness, is_edges)
        start, end, nodes = start[rows], end[rows], nodes[rows]
        first = _direction(start, nearest_weights(start, is_edges))[1]
        touch = start + times[:, None, None] * (end - start)
        weights = nearest_weights(touch, is_edges)
        normals, _ = _direction(touch, weights)
        along = np.einsum("kn,kni,ki->k", weights, start, normals)
        gaps = np.clip(along, LEAST * np.minimum(first, thickness), thickness)
        parts.append(Contacts(nodes, weights, normals, gaps))
    return _joined(parts)
