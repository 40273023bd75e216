"""Coordinates in the plane of the three commissures (paper §3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError

__all__ = ["CommissurePlane"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CommissurePlane:
    """Plane M: origin in the circumcentre of A_0 A_1 A_2, first axis towards A_0.

    Parameters
    ----------
    origin : (3,) array
        Circumcentre [mm].
    basis : (3, 2) array
        Orthonormal axes as columns; the second is the first turned by +90 degrees about n.
    circumradius : float
        R of (3.3) [mm].
    """

    origin: Array
    basis: Array
    circumradius: float

    @classmethod
    def from_commissures(cls, commissures: Array, normal: Array) -> CommissurePlane:
        """Plane through A_i (3, 3) with normal n (3,), about which they go counter-clockwise.

        Raises
        ------
        SceneError
            When the A_i lie on a line, or n is not normal to their plane or points backwards.
        """
        to_second, to_third = commissures[1] - commissures[0], commissures[2] - commissures[0]
        cross = np.cross(to_second, to_third)
        area, length = float(np.linalg.norm(cross)), float(np.linalg.norm(normal))
        squares = to_second @ to_second, to_third @ to_third
        if area <= 1e-9 * max(squares):
            raise SceneError("commissures", commissures.tolist(), "must not lie on a line")
        # compared as vectors: a cosine would let an angle of 1e-5 pass unseen
        if length == 0.0 or np.abs(cross / area - normal / length).max() > 1e-7:
            raise SceneError(
                "normal",
                normal.tolist(),
                "must be normal to the plane of the commissures and see them counter-clockwise",
            )
        to_centre = np.cross(squares[0] * to_third - squares[1] * to_second, cross)
        to_centre /= 2.0 * area**2
        radius = float(np.linalg.norm(to_centre))
        first = -to_centre / radius
        # the plane's own normal, exact to rounding whatever the tolerance above lets pass
        basis = np.stack([first, np.cross(cross / area, first)], axis=1)
        return cls(commissures[0] + to_centre, basis, radius)

    def project(self, points: Array) -> Array:
        """Plane coordinates (..., 2) of points (..., 3)."""
        return (points - self.origin) @ self.basis

    def embed(self, points: Array) -> Array:
        """Points (..., 3) in space of plane coordinates (..., 2)."""
        return self.origin + points @ self.basis.T
