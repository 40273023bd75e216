"""Planar paths of analytic pieces, parametrised by arc length.

Template and suture lines (paper Fig. 7) are straight lines, arcs and one Bezier curve; their
lengths enter the stitching map, so arc length is computed to rounding, not from a polyline.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.geometry.segments import Segment

__all__ = ["PlanarPath"]

Array = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_NODES, _WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


class _Piece:
    """One segment with its table of arc lengths at panel edges."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        edges = np.linspace(0.0, 1.0, 5)
        while True:  # halve the panels on which 16 Gauss points are not yet exact to rounding
            middle = (edges[:-1] + edges[1:]) / 2.0
            panels = self._integral(edges[:-1], middle) + self._integral(middle, edges[1:])
            defect = np.abs(self._integral(edges[:-1], edges[1:]) - panels)
            coarse = (defect > 2e-15 * panels.sum()) & (np.diff(edges) > 2.0**-40)
            if not coarse.any():
                break
            edges = np.sort(np.concatenate([edges, middle[coarse]]))
        self._edges, self._panels = edges, panels
        self._cumulative = np.concatenate([[0.0], np.cumsum(panels)])
        self.length = float(self._cumulative[-1])
        if not np.isfinite(self.length):
            raise ValueError(f"a segment must have finite coordinates: {segment}")

    def _speed(self, t: Array) -> Array:
        return np.asarray(np.linalg.norm(self.segment.derivative(t), axis=1))

    def _integral(self, start: Array, end: Array) -> Array:
        """Arc length (n,) [mm] between parameters start (n,) and end (n,)."""
        t = start[:, None] + (end - start)[:, None] * _NODES
        return (end - start) * (self._speed(t.ravel()).reshape(t.shape) @ _WEIGHTS)

    def parameter(self, s: Array) -> Array:
        """Parameter t (n,) at arc length s (n,) in [0, length]; Newton kept in a bracket."""
        k = np.clip(np.searchsorted(self._cumulative, s, "right") - 1, 0, self._panels.size - 1)
        start, low, high = self._edges[k], self._edges[k], self._edges[k + 1]
        target = s - self._cumulative[k]
        t = low + (high - low) * np.minimum(target / self._panels[k], 1.0)
        for _ in range(80):
            error = self._integral(start, t) - target
            low, high = np.where(error <= 0.0, t, low), np.where(error >= 0.0, t, high)
            speed = self._speed(t)
            step = np.divide(error, speed, out=np.full_like(t, np.inf), where=speed > 0.0)
            bracketed = (t - step >= low) & (t - step <= high)
            moved = np.where(bracketed, t - step, (low + high) / 2.0)
            done = np.all(np.abs(moved - t) <= 1e-15)
            t = moved
            if done:
                break
        # the ends of a path are corners and commissures: hit them exactly
        return np.where(s <= 0.0, 0.0, np.where(s >= self.length, 1.0, t))


class PlanarPath:
    """Chain of segments, parametrised by arc length s in [0, length] [mm].

    Parameters
    ----------
    segments : sequence of Segment
        Each starts where the one before it ends; segments of zero length are dropped.

    Attributes
    ----------
    length : float
        Total length [mm], relative error about 1e-14.
    breaks : (k + 1,) float64
        Arc lengths of the joints, from 0 to ``length`` [mm].

    Raises
    ------
    ValueError
        When neighbouring segments do not meet, all have zero length, or one is not finite.
    """

    def __init__(self, segments: Sequence[Segment]) -> None:
        self._pieces = [piece for piece in map(_Piece, segments) if piece.length > 0.0]
        if not self._pieces:
            raise ValueError("a path needs a segment of positive length")
        self.breaks: Array = np.cumsum([0.0, *(piece.length for piece in self._pieces)])
        self.breaks.flags.writeable = False
        self.length = float(self.breaks[-1])
        for before, after in zip(self._pieces[:-1], self._pieces[1:], strict=True):
            gap = after.segment.point(np.zeros(1)) - before.segment.point(np.ones(1))
            if np.linalg.norm(gap) > 1e-9 * self.length:
                raise ValueError(f"segments do not meet: {before.segment}, {after.segment}")

    def point(self, s: ArrayLike) -> Array:
        """Points (n, 2) [mm] at arc lengths s (n,) [mm]; ValueError outside [0, length]."""
        return self._evaluate(s, lambda segment, t: segment.point(t))

    def tangent(self, s: ArrayLike) -> Array:
        """Unit tangents (n, 2) at arc lengths s (n,) [mm], at a joint that of the later segment.

        Raises
        ------
        ValueError
            When s leaves [0, length], or where a Bezier curve has zero speed.
        """
        derivative = self._evaluate(s, lambda segment, t: segment.derivative(t))
        speed = np.linalg.norm(derivative, axis=1, keepdims=True)
        if np.any(speed == 0.0):
            raise ValueError("the path has no tangent where a segment's speed vanishes")
        return np.asarray(derivative / speed)

    def _evaluate(self, s: ArrayLike, function: Callable[[Segment, Array], Array]) -> Array:
        length = np.atleast_1d(np.asarray(s, dtype=float))
        slack = 1e-9 * self.length
        if length.ndim != 1 or not np.all((length >= -slack) & (length <= self.length + slack)):
            raise ValueError(f"arc lengths must be one array in [0, {self.length}]")
        last = len(self._pieces) - 1
        which = np.clip(np.searchsorted(self.breaks, length, "right") - 1, 0, last)
        values = np.empty((length.size, 2))
        for k, piece in enumerate(self._pieces):
            here = which == k
            if here.any():
                local = length[here] - self.breaks[k]
                # at the end of the path the difference of breaks may round below the length
                local[length[here] >= self.breaks[k + 1]] = piece.length
                t = piece.parameter(np.clip(local, 0.0, piece.length))
                values[here] = function(piece.segment, t)
        return values
