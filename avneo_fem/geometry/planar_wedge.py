"""Signed distance to two joined Bézier curves with straight extensions, in the plane.

The section of a cusp's contact wedge: ray <- A_(i+1) <- apex -> A_(i+2) -> ray (design.md §1).
A point solves its closest-point quintic only on the arcs that a bound on the distance from arc
to chord does not rule out, so the result is globally right.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.bezier_arcs import CUTS, BezierArcs
from avneo_fem.geometry.contact_curve import rotated
from avneo_fem.geometry.polynomial_minimum import minimise_on_unit_interval

__all__ = ["PlanarWedge"]

Array = NDArray[np.float64]


#: Feet this close to the apex, in units of the polygons' size, are the apex.
_APEX = 1e-14


def _start_tangent(polygon: Array) -> Array:
    """Unit tangent (2,) at t = 0: towards the first control point that is not the start.

    A first leg so short that the curve turns away from it within ``_APEX`` does not count.
    """
    legs = polygon[1:] - polygon[0]
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    first = int(np.argmax(lengths > np.sqrt(_APEX) * lengths.max()))
    return legs[first] / lengths[first]


@dataclass(frozen=True, eq=False)
class PlanarWedge:
    """Curve ray <- A_(i+1) <- apex -> A_(i+2) -> ray, positive on the side to its right.

    Parameters
    ----------
    polygons : (2, 4, 2) array
        Control points from the apex to A_(i+1) and to A_(i+2) [mm].
    """

    polygons: Array
    arcs: BezierArcs = field(init=False, repr=False)
    apex_normal: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "arcs", BezierArcs.from_polygons(self.polygons))
        first, second = (_start_tangent(p) for p in self.polygons)
        normal = rotated(first) - rotated(second)
        if np.hypot(*normal) < 1e-7:  # the curves touch at the apex: an opening of zero degrees
            normal = first + second
        object.__setattr__(self, "apex_normal", normal / np.hypot(*normal))

    def nearest(self, points: Array) -> tuple[NDArray[np.intp], Array]:
        """Closest points as piece numbers (n,) (arcs, then the two rays) and parameters u (n,)."""
        arcs = self.arcs
        x, y = np.ascontiguousarray(points.T)
        piece, u, square = self._nearest_on_rays(x, y)
        arc, point = arcs.candidates(x, y, np.sqrt(square))
        if not arc.size:
            return piece, u
        a = arcs.power[:, arc]
        x, y = x[point] - a[0, :, 0], y[point] - a[0, :, 1]
        quintic = arcs.constant[:, arc] - x * arcs.slope[0][:, arc] - y * arcs.slope[1][:, arc]
        root, stationary = minimise_on_unit_interval(quintic)
        x -= root * (a[1, :, 0] + root * (a[2, :, 0] + root * a[3, :, 0]))
        y -= root * (a[1, :, 1] + root * (a[2, :, 1] + root * a[3, :, 1]))
        # A cut is never closest on its own: it must not tie by rounding with a root nearby.
        cut = ~stationary & ((root > 0.0) | (arc % CUTS > 0))
        on_arcs = (x * x + y * y) * (1.0 + 1e-9 * cut)
        worst_first = np.argsort(-on_arcs)
        worst_first = worst_first[(on_arcs < square[point])[worst_first]]
        piece[point[worst_first]] = arc[worst_first]  # of repeated indices the last one stays
        u[point[worst_first]] = root[worst_first]
        return piece, u

    def _nearest_on_rays(self, x: Array, y: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Piece (n,), parameter (n,) and squared distance (n,) of the closer extension."""
        first = self.arcs.deviation.size
        (start_x, start_y), (along_x, along_y) = self.arcs.power[:2, first:].transpose(0, 2, 1)
        dx, dy = x - start_x[:, None], y - start_y[:, None]
        u = np.maximum(dx * along_x[:, None] + dy * along_y[:, None], 0.0)
        dx -= u * along_x[:, None]
        dy -= u * along_y[:, None]
        square = dx * dx + dy * dy
        second = square[1] < square[0]
        return first + second, np.where(second, u[1], u[0]), square.min(axis=0)

    def signed_distance(self, points: Array) -> tuple[Array, Array, Array]:
        """Signed distance, its gradient and its curvature across the gradient.

        Parameters
        ----------
        points : (n, 2) array
            In plane coordinates [mm]. NaN gives NaN.

        Returns
        -------
        distance : (n,) array
            d [mm], positive inside the wedge.
        gradient : (n, 2) array
            Unit vectors g.
        bending : (n,) array
            h [1/mm]; the Hessian is h r rᵀ with r = g turned by 90 degrees.
        """
        arcs = self.arcs
        piece, u = self.nearest(points)
        a = arcs.power[:, piece]
        u1 = u[:, None]
        along = u1 * (a[1] + u1 * (a[2] + u1 * a[3]))
        away = (points - a[0]) - along
        velocity = a[1] + u1 * (2.0 * a[2] + 3.0 * u1 * a[3])
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        near = np.flatnonzero((piece % CUTS == 0) & (piece < arcs.deviation.size) & (u < 1e-3))
        legs = np.abs(self.polygons - self.polygons[:, :1]).max()
        vertex = near[np.abs(along[near]).max(axis=1) <= _APEX * legs]
        speed[vertex] = 1.0  # it may be 0 there; what follows is replaced below
        normal = rotated(velocity) * (arcs.side[piece] / speed)[:, None]
        distance = np.einsum("nx,nx->n", away, normal)
        bend = 2.0 * a[2] + 6.0 * u1 * a[3]
        kappa = np.einsum("nx,nx->n", bend, normal) / (speed * speed)
        # 1 - kappa d is 0 only at a centre of curvature, where there is no Hessian: keep it finite
        bending = -kappa / np.maximum(1.0 - kappa * distance, 1e-12)
        distance[vertex], normal[vertex], bending[vertex] = self._at_apex(points[vertex])
        return distance, normal, bending

    def _at_apex(self, points: Array) -> tuple[Array, Array, Array]:
        """:meth:`signed_distance` of points whose closest point is the apex."""
        away = points - self.polygons[0, 0]
        length = np.hypot(away[:, 0], away[:, 1])
        sign = np.where(away @ self.apex_normal < 0.0, -1.0, 1.0)
        there = length == 0.0
        inverse = np.where(there, 0.0, sign / np.where(there, 1.0, length))
        normal = np.where(there[:, None], self.apex_normal, away * inverse[:, None])
        return sign * length, normal, inverse

    def polyline(self, count: int, extension: float) -> Array:
        """Points (m, 2) along the curve, from beyond A_(i+1) over the apex to beyond A_(i+2)."""
        t = np.linspace(0.0, 1.0, count)[:, None]
        basis = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
        halves = []
        for polygon, direction in zip(self.polygons, self.arcs.power[1, -2:], strict=True):
            halves.append(np.vstack([basis @ polygon, polygon[3] + extension * t[1:] * direction]))
        return np.vstack([halves[0][::-1], halves[1][1:]])

    def crosses_itself(self, count: int = 64, extension: float = 100.0) -> bool:
        """Whether two segments of a polyline of the section meet away from their common ends.

        ``count`` points per curve: loops smaller than their spacing go unnoticed. The extensions
        are one segment each, ``extension`` times as long as the control polygons are wide.
        """
        points = self.polyline(count, extension * float(np.ptp(self.polygons)))
        # polyline() samples the extensions too; their inner points are of no use here
        points = np.vstack([points[:1], points[count - 1 : -(count - 1)], points[-1:]])
        start, leg = points[:-1], np.diff(points, axis=0)
        turned = rotated(leg)
        across = turned @ leg.T  # [i, j]: leg i x leg j
        gap = start[None] - start[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = -np.einsum("ijx,jx->ij", gap, turned) / across
            s = -np.einsum("ijx,ix->ij", gap, turned) / across
        index = np.arange(len(leg))
        length = np.hypot(leg[:, 0], leg[:, 1])
        # segments on one line (lambda = 0) do not cross, whatever rounding makes of r and s
        skew = np.abs(across) > 1e-12 * np.outer(length, length)
        apart = skew & (index[None] - index[:, None] > 1)
        return bool(np.any(apart & (r >= 0.0) & (r <= 1.0) & (s >= 0.0) & (s <= 1.0)))
