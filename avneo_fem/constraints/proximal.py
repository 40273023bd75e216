"""Damping towards a previous state: one implicit step of a gradient flow."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["ProximalTerm"]

Floats = NDArray[np.float64]


class ProximalTerm:
    """mu/2 sum_n S_n |x_n - c_n|^2.

    Parameters
    ----------
    centre : (n, 3) array
        Positions c the nodes are held to [mm].
    node_areas : (n,) array
        S_n [mm^2].
    damping : float
        mu [kPa/mm].
    """

    def __init__(self, centre: Floats, node_areas: Floats, damping: float) -> None:
        self.centre, self.node_areas, self.damping = centre, node_areas, damping

    def energy(self, points: Floats) -> float:
        """Energy [mN mm]."""
        return float(
            self.damping / 2 * np.dot(self.node_areas, ((points - self.centre) ** 2).sum(1))
        )

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) [mN]."""
        return self.damping * self.node_areas[:, None] * (points - self.centre)

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) diagonal [mN/mm]."""
        return sp.diags(np.repeat(self.damping * self.node_areas, 3))
