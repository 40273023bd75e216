"""Penalty that pushes nodes to the inside of a signed distance (paper (1.5))."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.term import Foreseen, block_diagonal

__all__ = ["SignedDistance", "SignedDistancePenalty"]

Floats = NDArray[np.float64]
#: nodes that were looked at, and distance, gradient, Hessian of all, infinite and zero elsewhere
_Near = tuple[NDArray[np.bool_], Floats, Floats, Floats]


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

    Notes
    -----
    Distances are asked for only where the force can act: |grad d| <= 1, so a node that was far
    from its clearance is, until it has moved by as much.
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
        self._asked: Floats | None = None
        self._value: tuple[Floats, Floats, Floats] = (np.empty(0),) * 3
        self._near: _Near = (np.empty(0, dtype=bool), *self._value)
        # where each node was when its distance was computed last, and what it was
        self._known_at = np.zeros((len(self.node_areas), 3))
        self._known = np.full(len(self.node_areas), -np.inf)

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance, gradient and Hessian of all nodes (n, 3)."""
        if self._seen is None or not np.array_equal(self._seen, points):
            self._value = self.field.evaluate(points)
            self._seen = self._known_at = points.copy()
            self._known = self._value[0]
        return self._value

    def _where_it_acts(self, points: Floats, further: Floats | float = 0.0) -> _Near:
        """What :meth:`evaluate` says where the force may act, also ``further`` (n,) from here.

        Elsewhere the distance is infinite: the distance of a node that has moved by m since it was
        known to be d is at least d - m.
        """
        moved = np.linalg.norm(points - self._known_at, axis=1)
        near = self._known - moved - further <= self.clearance + self.width / 2
        same = self._asked is not None and np.array_equal(self._asked, points)
        if same and not np.any(near & ~self._near[0]):
            return self._near
        result = (
            near,
            np.full(len(points), np.inf),
            np.zeros((len(points), 3)),
            np.zeros((len(points), 3, 3)),
        )
        if near.any():
            for all_nodes, there in zip(result[1:], self.field.evaluate(points[near]), strict=True):
                all_nodes[near] = there
        self._known_at = np.where(near[:, None], points, self._known_at)
        self._known = np.where(near, result[1], self._known)
        self._asked, self._near = points.copy(), result
        return result

    def shortfall(self, points: Floats) -> Floats:
        """(n,) by how much each node misses its clearance, max(d_0 - d, 0) [mm]."""
        return np.maximum(self.clearance - self.evaluate(points)[0], 0.0)

    def ramp(self, points: Floats) -> Floats:
        """f(d) at the nodes, (n,)."""
        distance = self._where_it_acts(points)[1]
        return np.maximum(1.0 - 2.0 * (distance - self.clearance) / self.width, 0.0)

    def energy(self, points: Floats) -> float:
        """Penalty energy [mN mm]."""
        ramp = self.ramp(points)
        return float(self.stiffness * self.width / 4 * np.dot(self.node_areas, ramp**2))

    def gradient(self, points: Floats) -> Floats:
        """Minus the nodal forces (1.5), (n, 3) [mN]."""
        force = self.stiffness * self.node_areas * self.ramp(points)
        return -force[:, None] * self._where_it_acts(points)[2]

    def hessian(self, points: Floats) -> sp.spmatrix:
        """Consistent tangent, block diagonal (3n, 3n) [mN/mm]."""
        _, _, normal, curvature = self._where_it_acts(points)
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
        _, distance, normal, _ = self._where_it_acts(points, np.linalg.norm(moves, axis=1))
        # where no step reaches, any ramp below zero will do
        distance = np.where(np.isinf(distance), self.clearance + self.width, distance)
        ramp = 1.0 - 2.0 * (distance - self.clearance) / self.width
        ahead = ramp - 2.0 / self.width * np.einsum("nd,nd->n", normal, moves)
        switched = (ahead > 0).astype(int) - (ramp > 0)
        load = self.stiffness * self.node_areas * switched
        blocks = (2.0 / self.width * load)[:, None, None] * normal[:, :, None] * normal[:, None, :]
        return Foreseen(switched, -(load * ramp)[:, None] * normal, block_diagonal(blocks))
