"""Analytic pieces of planar paths: straight lines, elliptic arcs and Bezier curves (paper Fig. 7).

Lengths are in mm; every piece runs over t in [0, 1].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Arc", "Bezier", "Line", "Segment"]

Array = NDArray[np.float64]


class Segment(Protocol):
    """A smooth curve over t in [0, 1]: ``point`` and ``derivative`` map (n,) to (n, 2) [mm]."""

    def point(self, t: Array) -> Array: ...

    def derivative(self, t: Array) -> Array: ...


@dataclass(frozen=True)
class Line:
    """Straight segment from ``start`` to ``end`` [mm]."""

    start: tuple[float, float]
    end: tuple[float, float]

    def point(self, t: Array) -> Array:
        """Points (n, 2) [mm] at t (n,)."""
        # this form hits both ends exactly
        return np.outer(1.0 - t, self.start) + np.outer(t, self.end)

    def derivative(self, t: Array) -> Array:
        """d point / dt (n, 2) [mm] at t (n,)."""
        return np.tile(np.subtract(self.end, self.start), (t.size, 1))


@dataclass(frozen=True)
class Arc:
    """Elliptic arc centre + (a cos u, b sin u), u from ``start`` to ``end`` [radians]."""

    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    start: float
    end: float

    def point(self, t: Array) -> Array:
        """Points (n, 2) [mm] at t (n,)."""
        u = (1.0 - t) * self.start + t * self.end
        return np.add(self.centre, np.column_stack([np.cos(u), np.sin(u)]) * self.semi_axes)

    def derivative(self, t: Array) -> Array:
        """d point / dt (n, 2) [mm] at t (n,)."""
        u = (1.0 - t) * self.start + t * self.end
        slope = np.column_stack([-np.sin(u), np.cos(u)]) * self.semi_axes
        return slope * (self.end - self.start)


@dataclass(frozen=True)
class Bezier:
    """Bezier curve of degree len(control) - 1 >= 1; control points [mm]."""

    control: tuple[tuple[float, float], ...]

    def point(self, t: Array) -> Array:
        """Points (n, 2) [mm] at t (n,)."""
        return _bernstein(len(self.control) - 1, t) @ np.array(self.control)

    def derivative(self, t: Array) -> Array:
        """d point / dt (n, 2) [mm] at t (n,)."""
        degree = len(self.control) - 1
        return _bernstein(degree - 1, t) @ (degree * np.diff(np.array(self.control), axis=0))


def _bernstein(degree: int, t: Array) -> Array:
    """Bernstein polynomials b_k^degree(t), (n, degree + 1) (paper (3.3b))."""
    k = np.arange(degree + 1)
    binomials = np.array([comb(degree, i) for i in k], dtype=float)
    return np.asarray(binomials * t[:, None] ** k * (1.0 - t[:, None]) ** (degree - k))
