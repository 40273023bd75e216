"""Aortic root: an ideal cylinder (paper section 4.1) as a signed distance with derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError

__all__ = ["CylinderRoot"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CylinderRoot:
    """Infinite cylinder about the z axis; blood flows towards +z (design.md section 1).

    Parameters
    ----------
    radius : float
        Inner radius R [mm].

    Raises
    ------
    SceneError
        When the radius is not positive and finite.
    """

    radius: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0.0):
            raise SceneError("root.radius", self.radius, "must be a positive number of mm")

    def signed_distance(self, points: Array) -> Array:
        """Distance d (n,) [mm] of points (n, 3) [mm] to the wall, positive inside (paper §1.2)."""
        return np.asarray(self.radius - np.hypot(points[:, 0], points[:, 1]))

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Signed distance with its first and second derivatives.

        Parameters
        ----------
        points : (n, 3) float64
            Positions [mm].

        Returns
        -------
        distance : (n,) float64
            d [mm], positive inside.
        gradient : (n, 3) float64
            Unit vector towards the axis.
        hessian : (n, 3, 3) float64
            -(e_t x e_t)/r with e_t the circumferential direction and r the distance from the
            axis [1/mm].

        Notes
        -----
        d has no derivative on the axis. There (r < 1e-12 R) the gradient is -e_x and the Hessian
        zero: finite values, on a line where d = R and no penalty on the wall acts.
        """
        r = np.hypot(points[:, 0], points[:, 1])
        axis = r < 1e-12 * self.radius
        safe = np.where(axis, 1.0, r)
        cosine = np.where(axis, 1.0, points[:, 0] / safe)
        sine = np.where(axis, 0.0, points[:, 1] / safe)
        zero = np.zeros_like(r)
        gradient = np.column_stack([-cosine, -sine, zero])
        around = np.column_stack([-sine, cosine, zero])
        curvature = np.where(axis, 0.0, -1.0 / safe)
        hessian = curvature[:, None, None] * (around[:, :, None] * around[:, None, :])
        return self.radius - r, gradient, hessian

    def inward_normal(self, points: Array) -> Array:
        """Unit normal n_Sr (n, 3) towards the axis at points (n, 3) [mm]; on the axis -e_x."""
        return self.evaluate(points)[1]
