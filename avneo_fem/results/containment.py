"""Whether a surface is inside the root and inside its contact wedge, by brute force.

The root is a cylinder of radius R about the z axis, the plane of commissures is normal to it
(design.md §1, geometry); the contact wedge is a curve in that plane, swept along z. Lengths in mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "edges_outside_wedge_mm",
    "min_wall_distance",
    "outside_root_mm",
    "outside_wedge_mm",
    "wall_excess",
    "wedge_distance",
]

Array = NDArray[np.float64]
_ROWS = 1024  # points per block: bounds the memory
_HALVINGS = 4  # of an edge


def wall_excess(points: Array, radius: float) -> Array:
    """How far each of ``points`` (n, 3) lies outside the root -> (n,) [mm], negative inside."""
    excess: Array = np.hypot(points[:, 0], points[:, 1]) - radius
    return excess


def outside_root_mm(points: Array, radius: float) -> float:
    """Largest depth of the surface outside the root, 0 when inside.

    The distance from the axis is convex, so in a flat triangle it is largest at a corner: nodes
    are enough.
    """
    return float(wall_excess(points, radius).max(initial=0.0))


def min_wall_distance(
    points: Array, radius: float, distance_to_suture: Array, taper: float
) -> float:
    """Smallest distance from the wall of nodes at least ``taper`` from the suture in the template.

    Negative outside the root; ``inf`` when no node is that far from the suture.
    """
    away = np.asarray(distance_to_suture) >= taper
    return float((-wall_excess(points[away], radius)).min(initial=np.inf))


def _closed_far_away(polyline: Array, extent: float) -> Array:
    """Polygon: the curve with both ends extended straight, joined by an arc around everything."""
    middle = polyline.mean(axis=0)
    far = 10.0 * (extent + np.ptp(polyline, axis=0).max())
    ends = []
    for end, before in ((polyline[0], polyline[1]), (polyline[-1], polyline[-2])):
        direction = (end - before) / np.linalg.norm(end - before)
        along = (end - middle) @ direction
        across = (end - middle) @ (end - middle) - far**2
        ends.append(end + direction * (np.sqrt(along**2 - across) - along))
    start, stop = (np.arctan2(*(point - middle)[::-1]) for point in ends)
    # which way round does not matter: only whether two points are on the same side does
    angle = np.linspace(stop, start, 34)[1:-1]
    arc = middle + far * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.vstack([ends[0], polyline, ends[1], arc])


def _contains(polygon: Array, points: Array) -> NDArray[np.bool_]:
    """Even-odd rule; each edge holds its lower end only, so a ray through a corner counts once."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, 0, None], points[:, 1, None]
    spans = (a[:, 1] <= y) != (b[:, 1] <= y)
    right_of: Array = (b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])
    left = np.where(b[:, 1] > a[:, 1], right_of, -right_of) > 0.0
    inside: NDArray[np.bool_] = (spans & left).sum(axis=1) % 2 == 1
    return inside


def _signed(points: Array, curve: Array, polygon: Array) -> Array:
    a, along = curve[:-1], np.diff(curve, axis=0)
    square = np.einsum("si,si->s", along, along)
    offset = points[:, None] - a
    t = np.clip(np.einsum("nsi,si->ns", offset, along) / square, 0.0, 1.0)
    gap = offset - t[..., None] * along
    distance = np.sqrt(np.einsum("nsi,nsi->ns", gap, gap).min(axis=1))
    return np.where(_contains(polygon, points), distance, -distance)


def wedge_distance(points: Array, polyline: Array, inside_reference: Array) -> Array:
    """Signed distance of each point from the contact wedge by brute force.

    Parameters
    ----------
    points : (n, 3) array
        Positions; only x and y matter, the wedge is swept along z (3.4).
    polyline : (m, 2) array
        Dense wedge curve A_(i+1) → apex → A_(i+2), with or without its straight extensions;
        both ends are extended here. It must not cross itself.
    inside_reference : (2,) array
        A point known to be on the cusp's own side, off the curve.

    Returns
    -------
    (n,) array
        Positive on the side of ``inside_reference``.

    Raises
    ------
    ValueError
        When the curve has fewer than two points or the reference lies on it.
    """
    curve = np.asarray(polyline, dtype=float)
    curve = curve[np.append(True, np.diff(curve, axis=0).any(axis=1))]
    if len(curve) < 2:
        raise ValueError("the wedge curve needs at least two different points")
    plane, reference = points[:, :2], np.asarray(inside_reference, dtype=float)[None]
    everything = np.vstack([plane, reference])
    polygon = _closed_far_away(curve, float(np.abs(everything - curve.mean(axis=0)).max()))
    # the last edges belong to the far arc, the first and the one before it are the extensions
    extended = polygon[: len(curve) + 2]
    side = _signed(reference, extended, polygon)[0]
    if abs(side) < 1e-9:
        raise ValueError(f"inside_reference {reference[0].tolist()} lies on the wedge curve")
    blocks = [_signed(plane[k : k + _ROWS], extended, polygon) for k in range(0, len(plane), _ROWS)]
    return np.sign(side) * np.concatenate([np.empty(0), *blocks])


def outside_wedge_mm(points: Array, polyline: Array, inside_reference: Array) -> float:
    """Largest depth of the nodes beyond the wedge, 0 when inside; see :func:`wedge_distance`."""
    return float((-wedge_distance(points, polyline, inside_reference)).max(initial=0.0))


def edges_outside_wedge_mm(
    points: Array, triangles: NDArray[np.int_], polyline: Array, inside_reference: Array
) -> float:
    """Largest depth of the edges of ``triangles`` (m, 3) beyond the wedge, 0 when inside.

    A flat triangle cuts the bends of a curved wedge though its nodes are inside. Edges are halved
    where what lies between two places can be outside, to sixteenths at most. See
    :func:`wedge_distance`.
    """
    distance = wedge_distance(points, polyline, inside_reference)
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends = np.unique(sides, axis=0)
    place, value = points[ends], distance[ends]
    deepest = float((-distance).max(initial=0.0))
    for _ in range(_HALVINGS):
        # no place is nearer to the wedge than the ends of its piece less the way there
        length = np.linalg.norm(place[:, 1] - place[:, 0], axis=1)
        near = value.sum(axis=1) - length < -2.0 * deepest
        place, value = place[near], value[near]
        if not len(place):
            break
        middle = place.mean(axis=1)
        there = wedge_distance(middle, polyline, inside_reference)
        deepest = max(deepest, float((-there).max()))
        place = np.concatenate([np.stack([place[:, k], middle], axis=1) for k in (0, 1)])
        value = np.concatenate([np.stack([value[:, k], there], axis=1) for k in (0, 1)])
    return deepest
