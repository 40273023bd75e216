"""A planar wedge whose inner corners are rounded, so that its signed distance has no valley.

Where the wedge opens by less than 180 degrees, or bends into itself more tightly than a radius
rho, two of its points are closest to a point inside: the distance has a ridge there, its penalty
a valley with a kink at the bottom, and a node that is pressed into the corner has no equilibrium
that Newton's method could find. So the wedge is rounded to what a disc of radius rho can reach
("opened", in the language of morphology): up to rho from the boundary its distance is then smooth
across the corner. With rho = d_0 + eta_2/2 the corner of the volume that a penalty leaves free is
the same as before, and its force a linear spring towards that corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.bezier_arcs import CUTS
from avneo_fem.geometry.planar_wedge import PlanarWedge

__all__ = ["RoundedWedge"]

Array = NDArray[np.float64]

_SAMPLES = 400
_BISECTIONS = 60


@dataclass(frozen=True, eq=False)
class RoundedWedge:
    """The union of all discs of a radius that lie in a wedge.

    Places on the section are numbers s: t = |s| of the curve to A_(i+1) for -1 <= s < 0 and of
    that to A_(i+2) for 0 <= s <= 1; beyond, 1 + the distance along the extension.

    Parameters
    ----------
    section : PlanarWedge
    radius : float
        rho [mm]; 0 rounds nothing.

    Attributes
    ----------
    corners : list of ((2,) array, (float, float))
        Centre of the rounding disc and the places between which it touches the section.
    """

    section: PlanarWedge
    radius: float

    @cached_property
    def corners(self) -> list[tuple[Array, tuple[float, float]]]:
        """See above; sought when first asked for, as many a wedge on the way never is."""
        return self._corners() if self.radius > 0.0 else []

    def _offset(self, place: Array) -> Array:
        """Points (n, 2) at the radius from places (n,), straight into the wedge."""
        arcs, half = self.section.arcs, np.signbit(place)
        t = np.abs(place)
        on_ray = t > 1.0
        arc = np.minimum((t * CUTS).astype(int), CUTS - 1)
        piece = np.where(on_ray, arcs.deviation.size + ~half, arc + CUTS * ~half)
        u = np.where(on_ray, t - 1.0, t * CUTS - arc)[:, None]
        a = arcs.power[:, piece]
        velocity = a[1] + u * (2.0 * a[2] + 3.0 * u * a[3])
        # a curve may start without a velocity (sigma = 0 is straightened, but rounding may be left)
        speed = np.maximum(np.hypot(velocity[:, 0], velocity[:, 1]), 1e-300)
        inward = np.stack([-velocity[:, 1], velocity[:, 0]], axis=1)
        inward *= (arcs.side[piece] / speed)[:, None]
        return np.asarray(a[0] + u * (a[1] + u * (a[2] + u * a[3])) + self.radius * inward)

    def _fits(self, place: Array) -> NDArray[np.bool_]:
        """Whether the disc that touches the section at places (n,) lies in the wedge."""
        distance = self.section.signed_distance(self._offset(place))[0]
        size = float(np.ptp(self.section.polygons))
        return np.asarray(distance >= self.radius - 1e-9 * size)

    def _corners(self) -> list[tuple[Array, tuple[float, float]]]:
        """The corners in which the disc does not reach the section."""
        # denser at the apex, where the curves may bend most
        half = np.linspace(0.0, 1.0, _SAMPLES) ** 2
        size = float(np.ptp(self.section.polygons))
        ray = 1.0 + np.linspace(0.0, size, _SAMPLES // 4)[1:]
        side = np.r_[half, ray]
        place = np.r_[-side[::-1], side]
        fits = self._fits(place)
        leave = np.flatnonzero(fits[:-1] & ~fits[1:])
        back = np.flatnonzero(~fits[:-1] & fits[1:])
        found = []
        for last in leave:
            behind = back[back > last]
            if not behind.size:
                break  # the wedge stays narrower than the disc: there is no other side
            ends = self._ends(place, int(last), int(behind[0]))
            centre = self._offset(np.array(ends)).mean(axis=0)
            found.append((centre, ends))
        return found

    def _ends(self, place: Array, leave: int, back: int) -> tuple[float, float]:
        """Places between which the disc does not touch, by bisection."""
        good = place[[leave, back + 1]]
        bad = place[[leave + 1, back]]
        for _ in range(_BISECTIONS):
            middle = (good + bad) / 2.0
            fits = self._fits(middle)
            good, bad = np.where(fits, middle, good), np.where(fits, bad, middle)
        return float(good[0]), float(good[1])

    def signed_distance(self, points: Array) -> tuple[Array, Array, Array]:
        """As :meth:`PlanarWedge.signed_distance`; the distance of the rounded wedge up to rho.

        Deeper inside it is that of the wedge itself.
        """
        distance, gradient, bending = self.section.signed_distance(points)
        near = np.flatnonzero(distance < self.radius)
        if not near.size or not self.corners:
            return distance, gradient, bending
        place = self._place(points[near])
        for centre, (first, last) in self.corners:
            inside = near[(place > first) & (place < last)]
            away = centre - points[inside]
            length = np.hypot(away[:, 0], away[:, 1])
            there = length == 0.0
            inverse = np.where(there, 0.0, 1.0 / np.where(there, 1.0, length))
            distance[inside] = self.radius - length
            gradient[inside] = np.where(there[:, None], gradient[inside], away * inverse[:, None])
            bending[inside] = -inverse
        return distance, gradient, bending

    def _place(self, points: Array) -> Array:
        """Places (n,) of the closest points of the section."""
        arcs = self.section.arcs
        piece, u = self.section.nearest(points)
        on_ray = piece >= arcs.deviation.size
        t = np.where(on_ray, 1.0 + u, (piece % CUTS + u) / CUTS)
        return np.asarray(-t * arcs.side[piece])

    def polyline(self, count: int, extension: float) -> Array:
        """:meth:`PlanarWedge.polyline` of the wedge itself."""
        return self.section.polyline(count, extension)
