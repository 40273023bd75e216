"""The contact wedge in space: a planar section extruded along the commissure normal (3.6)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.planar_wedge import PlanarWedge
from avneo_fem.geometry.rounded_wedge import RoundedWedge

__all__ = ["ContactWedge"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactWedge:
    """Contact wedge of one cusp for one lambda, a cylinder along the commissure normal.

    Parameters
    ----------
    section : PlanarWedge or RoundedWedge
        The wedge in the plane of the commissures.
    frame : CommissurePlane
        Plane coordinates: origin in the circumcentre of the commissures, first axis towards A_0.
    cusp_index : int
    lam : float
        lambda of (3.5), 0 to 1; 1 for contact planes, which have no path.
    """

    section: PlanarWedge | RoundedWedge
    frame: CommissurePlane
    cusp_index: int
    lam: float

    def rounded(self, radius: float) -> ContactWedge:
        """What a disc of ``radius`` [mm] can reach of this wedge: without kinks up to there."""
        section = self.section
        whole = section.section if isinstance(section, RoundedWedge) else section
        return replace(self, section=RoundedWedge(whole, radius))

    def signed_distance(self, points: Array) -> Array:
        """Signed distance (n,) [mm] of points (n, 3), positive on the cusp's own side."""
        return self.section.signed_distance(self.frame.project(points))[0]

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Signed distance with its first and second derivatives.

        Parameters
        ----------
        points : (n, 3) array
            Current positions [mm]. NaN gives NaN.

        Returns
        -------
        d : (n,) array
            Signed distance [mm], positive on the cusp's own side, independent of the coordinate
            along the normal.
        gradient : (n, 3) array
            Unit vectors; on the curve its normal, at the apex the angle pseudo-normal.
        hessian : (n, 3, 3) array
            [1/mm] -kappa / (1 - kappa d) t tᵀ (kappa > 0 where the curve bends into the wedge),
            (I - g gᵀ - n nᵀ) / d where the apex is closest, 0 on the extensions and, by
            convention, at the apex itself.

        Notes
        -----
        The gradient jumps on the medial axis, where two points of the curve are closest. The
        Hessian jumps there, where the closest point changes from curve to extension (the normal
        lines at A_(i+1) and A_(i+2)) and from curve to apex; its factor 1 - kappa d is kept at
        or above 1e-12, which matters at centres of curvature only. All these sets have no volume.
        """
        distance, normal, bending = self.section.signed_distance(self.frame.project(points))
        gradient = normal @ self.frame.basis.T
        across = np.stack([-normal[:, 1], normal[:, 0]], axis=1) @ self.frame.basis.T
        hessian = across[:, :, None] * across[:, None, :]
        hessian *= bending[:, None, None]
        return distance, gradient, hessian

    def curve(self, n_per_piece: int = 200, extension: float = 10.0) -> Array:
        """Points (m, 2) along the section, in plane coordinates.

        From ``extension`` mm beyond A_(i+1) over the apex to as far beyond A_(i+2);
        ``n_per_piece`` points on each of the two curves and on each extension.
        """
        return self.section.polyline(n_per_piece, extension)

    def polyline3(self, n_per_piece: int = 200, extension: float = 10.0) -> Array:
        """The same as :meth:`curve` in space, (m, 3), in the plane of the commissures."""
        return self.frame.embed(self.curve(n_per_piece, extension))
