"""The plane of the three commissures and coordinates in it (paper sections 3.1 and 3.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError

__all__ = ["CommissurePlane"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CommissurePlane:
    """Plane M of the commissures: origin in their circumcentre, first axis towards A_0.

    Parameters
    ----------
    points : (3, 3) array_like
        A_i row by row [mm], counter-clockwise seen from the aorta.

    Attributes
    ----------
    normal : (3,) float64
        n = (A_1 - A_0) x (A_2 - A_0), normalised; towards the aorta.
    origin : (3,) float64
        Circumcentre of A_0 A_1 A_2 [mm].
    basis : (3, 2) float64
        Orthonormal axes as columns; the second is the first turned by +90 degrees about n.
    circumradius : float
        R of (3.3) [mm].
    chord_lengths : (3,) float64
        a_i = |A_j A_k| [mm].

    Raises
    ------
    SceneError
        When the points are not three finite points, or lie on a line.
    """

    points: Array
    normal: Array = field(init=False, repr=False)
    origin: Array = field(init=False, repr=False)
    basis: Array = field(init=False, repr=False)
    circumradius: float = field(init=False, repr=False)
    chord_lengths: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=float)
        if points.shape != (3, 3) or not np.isfinite(points).all():
            raise SceneError("commissures", points.tolist(), "must be finite, of shape (3, 3)")
        to_second, to_third = points[1] - points[0], points[2] - points[0]
        squares = to_second @ to_second, to_third @ to_third
        cross = np.cross(to_second, to_third)
        area = float(np.linalg.norm(cross))
        if not area > 1e-9 * max(squares):
            raise SceneError("commissures", points.tolist(), "must be three points not on a line")
        normal = cross / area
        to_centre = np.cross(squares[0] * to_third - squares[1] * to_second, cross)
        to_centre /= 2.0 * area**2
        radius = float(np.linalg.norm(to_centre))
        first = -to_centre / radius
        object.__setattr__(self, "circumradius", radius)
        arrays = {
            "points": points,
            "normal": normal,
            "origin": points[0] + to_centre,
            "basis": np.stack([first, np.cross(normal, first)], axis=1),
            "chord_lengths": np.linalg.norm(points[[1, 2, 0]] - points[[2, 0, 1]], axis=1),
        }
        for name, value in arrays.items():
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    def project(self, points: Array) -> Array:
        """Plane coordinates (..., 2) [mm] of the projections of points (..., 3) [mm]."""
        return (points - self.origin) @ self.basis

    def embed(self, points: Array) -> Array:
        """Points (..., 3) [mm] in space of plane coordinates (..., 2) [mm]."""
        return self.origin + points @ self.basis.T
