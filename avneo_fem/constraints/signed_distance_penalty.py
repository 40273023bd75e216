"""Penalty that pushes nodes to the inside of a signed distance (paper (1.5))."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.term import Foreseen, block_diagonal

__all__ = ["SignedDistance", "SignedDistancePenalty"]

Floats = NDArray[np.float64]


class SignedDistance(Protocol):
    """A constraint volume: d > 0 inside."""

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Value (n,), gradient (n, 3) and Hessian (n, 3, 3) at ``points`` (n, 3)."""


class SignedDistancePenalty:
    """Nodal force eta_1 S_n f(d) grad d with f(d) = max(1 - 2 (d - d_0)/eta_2, 0).

    S_n is the *reference* area of node n: so the force has an energy, eta_1 S_n eta_2/4 f^2,
    which the line search needs. (The paper weighs with the current area, which differs only in
    how a penalty parameter is spread over the nodes.)

    Parameters
    ----------
    field : SignedDistance
        The volume to stay in.
    node_areas : (n,) array
        S_n [mm^2].
    stiffness, width : float
        eta_1 [kPa], eta_2 [mm].
    clearance : (n,) array
        d_0 of every node [mm]: below d_0 + eta_2/2 the force acts, at d_0 it is eta_1 S_n.
    """

    def __init__(
        self,
        field: SignedDistance,
        node_areas: Floats,
        stiffness: float,
        width: float,
        clearance: Floats,
    ) -> None:
        self.node_areas = node_areas
        self.field = field
        self.stiffness, self.width, self.clearance = stiffness, width, clearance

    @property
    def field(self) -> SignedDistance:
        """The volume to stay in; may be replaced between solves."""
        return self._field

    @field.setter
    def field(self, field: SignedDistance) -> None:
        self._field = field
        self._seen: Floats | None = None
        self._value: tuple[Floats, Floats, Floats] = (np.empty(0),) * 3

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance, gradient and Hessian; the last answer is kept."""
        if self._seen is None or not np.array_equal(self._seen, points):
            self._value = self.field.evaluate(points)
            self._seen = points.copy()
        return self._value

    def shortfall(self, points: Floats) -> Floats:
        """(n,) by how much each node misses its clearance, max(d_0 - d, 0) [mm]."""
        return np.maximum(self.clearance - self.evaluate(points)[0], 0.0)

    def ramp(self, points: Floats) -> Floats:
        """f(d) at the nodes, (n,)."""
        distance = self.evaluate(points)[0]
        return np.maximum(1.0 - 2.0 * (distance - self.clearance) / self.width, 0.0)

    def energy(self, points: Floats) -> float:
        """Penalty energy [mN mm]."""
        ramp = self.ramp(points)
        return float(self.stiffness * self.width / 4 * np.dot(self.node_areas, ramp**2))

    def gradient(self, points: Floats) -> Floats:
        """Minus the nodal forces (1.5), (n, 3) [mN]."""
        force = self.stiffness * self.node_areas * self.ramp(points)
        return -force[:, None] * self.evaluate(points)[1]

    def hessian(self, points: Floats) -> sp.spmatrix:
        """Consistent tangent, block diagonal (3n, 3n) [mN/mm]."""
        _, normal, curvature = self.evaluate(points)
        ramp = self.ramp(points)
        load = self.stiffness * self.node_areas
        rate = load * 2.0 / self.width * (ramp > 0)
        blocks = rate[:, None, None] * normal[:, :, None] * normal[:, None, :]
        return block_diagonal(blocks - (load * ramp)[:, None, None] * curvature)

    def foreseen(self, points: Floats, moves: Floats) -> Foreseen:
        """What changes when the nodes that act are those that act after ``moves`` (n, 3).

        A node on its way into the ramp is not in :meth:`hessian`, one on its way out still is; a
        Newton step that knows neither runs into the ramp and is cut short. Linearised distance.
        """
        distance, normal, _ = self.evaluate(points)
        ramp = 1.0 - 2.0 * (distance - self.clearance) / self.width
        ahead = ramp - 2.0 / self.width * np.einsum("nd,nd->n", normal, moves)
        switched = (ahead > 0).astype(int) - (ramp > 0)
        load = self.stiffness * self.node_areas * switched
        blocks = (2.0 / self.width * load)[:, None, None] * normal[:, :, None] * normal[:, None, :]
        return Foreseen(switched, -(load * ramp)[:, None] * normal, block_diagonal(blocks))
