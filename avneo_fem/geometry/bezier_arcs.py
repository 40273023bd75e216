"""Two joined Bézier curves with straight extensions, cut into arcs with distance bounds.

Tables for :mod:`avneo_fem.geometry.planar_wedge`; they depend on the curves only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.contact_curve import rotated
from avneo_fem.geometry.polynomial_minimum import bernstein_from_power

__all__ = ["CUTS", "BezierArcs"]

Array = NDArray[np.float64]

#: Arcs per curve; the cheapest of 4 to 16.
CUTS = 8
_THIRDS = np.arange(4.0)[:, None] / 3.0
#: a_0 ... a_3 of a_0 + a_1 t + a_2 t^2 + a_3 t^3 from the four control points
_POWER_FROM_BEZIER = np.array(
    [[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], dtype=float
)


def _straightened(polygon: Array) -> Array:
    """The polygon, or the evenly spaced one of the same segment if it is straight.

    A straight polygon may start with coinciding points (sigma = 0), where the tangent vanishes.
    """
    start, span = polygon[0], polygon[3] - polygon[0]
    inner, square = polygon[1:3] - start, span @ span
    along = inner @ span / square
    off = np.abs(inner @ rotated(span)) / square
    if off.max() <= 1e-14 and along.min() >= -1e-14 and along.max() <= 1.0 + 1e-14:
        return start + _THIRDS * span
    return polygon


@dataclass(frozen=True, eq=False)
class BezierArcs:
    """Tables of k Bézier arcs (k / 2 of each curve), followed by the two rays in ``power``.

    Attributes
    ----------
    power : (4, k + 2, 2) array
        a_0 ... a_3 of the point a_0 + a_1 u + a_2 u^2 + a_3 u^3; rays have unit a_1 [mm].
    side : (k + 2,) array
        +1 where the tangent turned by +90 degrees points into the wedge, else -1.
    deviation : (k,) array
        No point of the arc is farther than this from its chord's point with the same u [mm].
    constant, slope : (6, k) and (2, 6, k) arrays
        Bernstein coefficients of (y - p) . y' = constant - (p - a_0) . slope.
    """

    power: Array
    side: Array
    deviation: Array
    constant: Array
    slope: Array

    @classmethod
    def from_polygons(cls, polygons: Array) -> BezierArcs:
        """Cut the two control polygons (2, 4, 2) into arcs."""
        a = np.einsum(
            "kj,cjx->kcx", _POWER_FROM_BEZIER, np.stack([_straightened(p) for p in polygons])
        )
        t = (np.arange(CUTS) / CUTS)[None, :, None]
        a = a[:, :, None, :]  # (4, 2, arc, 2)
        arcs = np.stack(
            [
                a[0] + t * (a[1] + t * (a[2] + t * a[3])),
                (a[1] + t * (2.0 * a[2] + t * 3.0 * a[3])) / CUTS,
                (a[2] + t * 3.0 * a[3]) / CUTS**2,
                np.broadcast_to(a[3], (2, CUTS, 2)) / CUTS**3,
            ]
        ).reshape(4, -1, 2)
        # |y - chord| <= max |y''| / 8, and y'' is linear in u
        second = np.stack([2.0 * arcs[2], 2.0 * arcs[2] + 6.0 * arcs[3]])
        deviation = np.hypot(second[..., 0], second[..., 1]).max(axis=0) / 8.0
        dot = np.einsum("ikx,jkx->ijk", arcs, arcs)
        zero = np.zeros_like(deviation)
        constant = [zero, dot[1, 1], 3.0 * dot[1, 2], 4.0 * dot[1, 3] + 2.0 * dot[2, 2]]
        constant += [5.0 * dot[2, 3], 3.0 * dot[3, 3]]
        slope = np.zeros((2, 6, zero.size))
        for order in range(3):
            slope[:, order] = (order + 1.0) * arcs[order + 1].T
        bernstein = bernstein_from_power(5)
        rays = np.zeros((4, 2, 2))
        rays[0], rays[1] = polygons[:, 3], polygons[:, 3] - polygons[:, 2]
        rays[1] /= np.hypot(rays[1, :, 0], rays[1, :, 1])[:, None]
        return cls(
            power=np.concatenate([arcs, rays], axis=1),
            side=np.r_[np.ones(CUTS), -np.ones(CUTS), 1.0, -1.0],
            deviation=deviation,
            constant=bernstein @ np.stack(constant),
            slope=bernstein @ slope,
        )

    def candidates(
        self, x: Array, y: Array, bound: Array
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pairs (arc, point) that hold every point's closest arc, by distances to the chords.

        Single precision halves the cost; the slack covers its error.

        Parameters
        ----------
        x, y : (n,) arrays
            Points in plane coordinates [mm].
        bound : (n,) array
            Their distances to something else: farther arcs are left out [mm].
        """
        size = self.deviation.size
        start = self.power[0, :size].astype(np.float32)[:, :, None]
        chord = self.power[1:, :size].sum(axis=0)
        unit = (chord / (chord * chord).sum(axis=1)[:, None]).astype(np.float32)[:, :, None]
        leg = chord.astype(np.float32)[:, :, None]
        slack = self.deviation + 1e-5 * np.abs(self.power[0]).max()
        slack32 = slack.astype(np.float32)[:, None]
        dx, dy = x.astype(np.float32) - start[:, 0], y.astype(np.float32) - start[:, 1]
        u = dx * unit[:, 0]
        u += dy * unit[:, 1]
        np.minimum(np.maximum(u, 0.0, out=u), 1.0, out=u)
        dx -= u * leg[:, 0]
        dy -= u * leg[:, 1]
        dx *= dx
        dy *= dy
        dx += dy
        distance = np.sqrt(dx, out=dx)
        nearest = np.minimum((distance + slack32).min(axis=0), bound.astype(np.float32))
        nearest *= np.float32(1.0 + 1e-5)
        distance -= slack32
        return np.nonzero(distance <= nearest)  # type: ignore[return-value]
