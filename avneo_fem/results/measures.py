"""How well a sutured cusp meets its suture line, its clamp and its free edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["clamp_error_deg", "free_edge_sag_mm", "suture_error_mm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]


def _edge_triangles(triangles: Indices, edges: Indices) -> Indices:
    """Triangle that holds each edge in its own sense of rotation, -1 where none does."""
    base = np.array([int(triangles.max(initial=0)) + 1, 1])
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2) @ base
    order = np.argsort(directed)
    wanted = edges @ base
    place = order[np.minimum(np.searchsorted(directed[order], wanted), len(order) - 1)]
    return np.where(directed[place] == wanted, place // 3, -1)


def suture_error_mm(points: Array, targets: Array) -> float:
    """Largest distance of a sutured node (k, 3) from its target (k, 3)."""
    if np.shape(points) != np.shape(targets):
        raise ValueError(f"{np.shape(points)} sutured nodes but {np.shape(targets)} targets")
    return float(np.linalg.norm(points - targets, axis=1).max(initial=0.0))


def clamp_error_deg(
    points: Array,
    triangles: Indices,
    suture_edges: Indices,
    prescribed_conormal: Array,
) -> tuple[float, float]:
    """Angle about each sutured edge between the cusp and the prescribed half-plane (3.1).

    Parameters
    ----------
    points : (n, 3) array
        Node positions [mm].
    triangles : (m, 3) array of int
        Corners, counter-clockwise in the template.
    suture_edges : (k, 2) array of int
        Boundary edges, either way round.
    prescribed_conormal : (k, 3) array
        Outward conormal b of (3.1); only its part perpendicular to the edge counts.

    Returns
    -------
    tuple of float
        Largest, and root mean square weighted by edge length [degrees]. The angle is between b and
        the outward conormal μ = t × n of the edge's flat triangle: a cusp that is perfectly
        clamped and curved shows its curvature times half the triangle's height. ``nan`` when a
        triangle at the suture has no area.

    Raises
    ------
    ValueError
        Without an edge, and for one that is not on the boundary or has no length or a conormal
        along it.
    """
    forward = _edge_triangles(triangles, suture_edges)
    backward = _edge_triangles(triangles, suture_edges[:, ::-1])
    wrong = (forward >= 0) == (backward >= 0)
    if not len(wrong) or wrong.any():
        bad = suture_edges[wrong].tolist()[:1]
        raise ValueError(f"suture edges must each be an edge of exactly one triangle; not: {bad}")
    along = np.where(forward[:, None] >= 0, suture_edges, suture_edges[:, ::-1])
    corners = points[triangles[np.maximum(forward, backward)]]
    edge = points[along[:, 1]] - points[along[:, 0]]
    length = np.linalg.norm(edge, axis=1)
    if not (length > 0.0).all():
        raise ValueError("a suture edge has no length")
    tangent = edge / length[:, None]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    conormal = np.cross(tangent, normal)
    part = np.einsum("ki,ki->k", prescribed_conormal, tangent)[:, None]
    across = prescribed_conormal - part * tangent
    if not (np.linalg.norm(across, axis=1) > 1e-9).all():
        raise ValueError("a prescribed conormal is zero or lies along its suture edge")
    sine = np.einsum("ki,ki->k", np.cross(conormal, across), tangent)
    cosine = np.einsum("ki,ki->k", conormal, across)
    angle = np.degrees(np.abs(np.arctan2(sine, cosine)))
    # a triangle without area has no tangent: atan2(0, 0) would call it perfect
    angle[~(np.linalg.norm(normal, axis=1) > 0.0)] = np.nan
    return float(angle.max()), float(np.sqrt(length @ angle**2 / length.sum()))


def free_edge_sag_mm(
    points: Array,
    template_height: Array,
    plane_point: Array,
    normal: Array,
    clearance: float,
) -> float:
    """Largest sag of the free edge below the height that (1.6) prescribes, 0 when none.

    Parameters
    ----------
    points : (k, 3) array
        Current positions Q_n of the nodes of the free edge [mm].
    template_height : (k,) array
        (P_n − N_0)·e_2, their height over the corners in the template [mm].
    plane_point, normal : (3,) arrays
        A_0 and the unit normal n of the plane of commissures.
    clearance : float
        d_0 = −η_3 [mm].
    """
    height = (points - plane_point) @ np.asarray(normal)
    return float((template_height + clearance - height).max(initial=0.0))
