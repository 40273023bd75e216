"""A signed distance known by samples on a grid only: cubic B-splines between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter

from avneo_fem.constraints.signed_distance_penalty import SignedDistance

__all__ = ["Distance", "Lying", "SampledDistance", "distance_to_facets"]

Floats = NDArray[np.float64]
#: signed distance (n,) of points (n, 3)
Distance = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Lying:
    """A volume whose axis is z, laid down: its axis is y, and its y is up."""

    upright: SignedDistance

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Value (n,), gradient (n, 3) and Hessian (n, 3, 3) at ``points`` (n, 3)."""
        order = [0, 2, 1]
        distance, gradient, hessian = self.upright.evaluate(points[:, order])
        return distance, gradient[:, order], hessian[:, order][:, :, order]


def _weights(t: Floats) -> tuple[Floats, Floats, Floats]:
    """(n, 4) values, slopes and curvatures of the four cubic B-splines at 0 <= ``t`` < 1."""
    u = 1 - t
    value = np.c_[u**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * u**2 + 3 * u**3, t**3] / 6
    slope = np.c_[-(u**2), 3 * t**2 - 4 * t, 4 * u - 3 * u**2, t**2] / 2
    return value, slope, np.c_[u, 3 * t - 2, 3 * u - 2, t]


@dataclass(frozen=True)
class SampledDistance:
    """Tricubic spline through samples.

    Parameters
    ----------
    origin : (3,) array
        Place of sample [0, 0, 0] [mm].
    step : float
        Distance of samples [mm].
    coefficients : (i, j, k) array
        Of the B-splines, see :meth:`through`.
    """

    origin: Floats
    step: float
    coefficients: Floats

    @classmethod
    def through(
        cls, distance: Distance, reach: float, width: float, step: float
    ) -> SampledDistance:
        """Samples of ``distance`` for |x|, |z| <= reach, 0 <= y <= width.

        Sixteen more samples on each side of x and z keep the spline's end conditions away.
        """
        across = np.ceil(reach / step) + 16
        axes = [np.arange(-n, n + 1) * step for n in (across, np.ceil(width / step) + 2, across)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        values = distance(points.reshape(-1, 3)).reshape(points.shape[:3])
        return cls(points[0, 0, 0], step, spline_filter(values, order=3, mode="mirror"))

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Value (n,), gradient (n, 3) and Hessian (n, 3, 3) at ``points`` (n, 3)."""
        place = (points - self.origin) / self.step
        # outside the grid, where a trial step may lead, the last piece goes on
        cell = np.clip(np.floor(place).astype(int), 1, np.array(self.coefficients.shape) - 3)
        weights = [_weights(t) for t in (place - cell).T]
        i, j, k = (cell[:, axis, None] + np.arange(-1, 3) for axis in range(3))
        local = self.coefficients[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]

        def derivative(*orders: int) -> Floats:
            first, second, third = (weights[axis][orders.count(axis)] for axis in range(3))
            total = np.einsum("nijk,ni,nj,nk->n", local, first, second, third, optimize=True)
            return np.asarray(total / self.step ** len(orders))

        gradient = np.stack([derivative(a) for a in range(3)], axis=1)
        hessian = np.stack(
            [np.stack([derivative(a, b) for b in range(3)], axis=1) for a in range(3)], axis=1
        )
        return derivative(), gradient, hessian


def distance_to_facets(radius: float, facets: int, points: Floats) -> Floats:
    """(n,) signed distance of ``points`` (n, 3), positive inside, to a cylinder about y made of
    ``facets`` flat strips with their corners on it: libigl, sign by pseudonormals."""
    angle = 2 * np.pi * np.arange(facets) / facets
    ring = radius * np.c_[np.sin(angle), 0 * angle, np.cos(angle)]
    tall = [0.0, 4 * radius, 0.0]
    here = np.arange(facets)
    ahead = (here + 1) % facets
    triangles = np.vstack(
        [np.c_[here, ahead, ahead + facets], np.c_[here, ahead + facets, here + facets]]
    )
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    corners = np.vstack([ring - tall, ring + tall])
    outside = igl.signed_distance(points, corners, triangles.astype(np.int64), kind)[0]
    # the wall is open: which side its triangles face settles the sign
    centre = igl.signed_distance(np.zeros((1, 3)), corners, triangles.astype(np.int64), kind)[0]
    return np.asarray(outside * np.sign(np.ravel(centre)[0]))
