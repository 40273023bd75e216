"""Layers of one cusp keep off each other: ipctk's barrier and its collision filter.

Li et al., Incremental Potential Contact, ACM Trans. Graph. 39 (2020) 49. A state that starts
free of crossings stays so: every step is shortened to what continuous collision detection allows.
"""

from __future__ import annotations

import ipctk
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["SelfContact"]

Floats = NDArray[np.float64]

ipctk.set_num_threads(1)


class SelfContact:
    """Barrier between non-adjacent parts of one triangulated surface.

    The energy is kappa sum_c b(d_c) over all pairs (point and triangle, edge and edge) closer than
    ``distance``, b(d) = -(d^2 - dhat^2)^2 ln(d^2/dhat^2) [mm^4], edge pairs mollified where they
    are nearly parallel. So kappa is in mN/mm^3; the energy is not weighed with areas and grows
    with the number of pairs.

    Parameters
    ----------
    rest_points : (n, 3) array
        Stress-free positions [mm].
    triangles : (m, 3) array
    distance : float
        dhat: the barrier acts below it [mm].
    stiffness : float
        kappa [mN/mm^3].
    """

    def __init__(
        self, rest_points: Floats, triangles: NDArray[np.int64], distance: float, stiffness: float
    ) -> None:
        faces = np.asfortranarray(triangles.astype(np.int32))
        self.mesh = ipctk.CollisionMesh(np.asfortranarray(rest_points), ipctk.edges(faces), faces)
        self.project = True
        self._distance = distance
        self.stiffness = stiffness
        self._seen: Floats | None = None
        self._collisions = ipctk.NormalCollisions()
        # the default, TightInclusion, may not end on aligned layers (design.md section 3)
        self._ccd = ipctk.AdditiveCCD()

    @property
    def distance(self) -> float:
        """The barrier acts below it [mm]; fixed, because the kept contacts depend on it."""
        return self._distance

    @property
    def stiffness(self) -> float:
        """Factor kappa of the barrier energy [mN/mm^3]; may be changed between solves."""
        return self._stiffness

    @stiffness.setter
    def stiffness(self, value: float) -> None:
        self._stiffness = value
        self._barrier = ipctk.BarrierPotential(dhat=self.distance, stiffness=value)

    def _at(self, points: Floats) -> Floats:
        """Build the collisions at ``points``, unless they are those of the last call."""
        place = np.asfortranarray(points)
        if self._seen is None or not np.array_equal(self._seen, points):
            self._collisions.build(self.mesh, place, self.distance)
            self._seen = points.copy()
        return place

    def collisions(self, points: Floats) -> int:
        """Number of active contacts at points (n, 3) [mm]."""
        self._at(points)
        return len(self._collisions)

    def closest(self, points: Floats) -> float:
        """Smallest distance among active contacts [mm]; ``distance`` when there is none."""
        place = self._at(points)
        if not len(self._collisions):
            return self.distance
        # ipctk returns the square
        return float(np.sqrt(self._collisions.compute_minimum_distance(self.mesh, place)))

    def intersects(self, points: Floats) -> bool:
        """Whether any two triangles cross at points (n, 3) [mm]."""
        return bool(ipctk.has_intersections(self.mesh, np.asfortranarray(points)))

    def step_fraction(self, points: Floats, step: Floats) -> float:
        """Share of ``step`` (n, 3) [mm] that is free of collisions, 0..1.

        ``points`` (n, 3) [mm] must be free of crossings.
        """
        return float(
            ipctk.compute_collision_free_stepsize(
                self.mesh,
                np.asfortranarray(points),
                np.asfortranarray(points + step),
                narrow_phase_ccd=self._ccd,
            )
        )

    def energy(self, points: Floats) -> float:
        """Barrier energy [mN mm] at points (n, 3) [mm]."""
        place = self._at(points)
        return float(self._barrier(self._collisions, self.mesh, place))

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy [mN]."""
        place = self._at(points)
        return np.asarray(self._barrier.gradient(self._collisions, self.mesh, place)).reshape(-1, 3)

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) [mN/mm]; contacts are made positive semi-definite while ``project`` is set."""
        place = self._at(points)
        kind = ipctk.PSDProjectionMethod
        method = kind.CLAMP if self.project else kind.NONE
        return self._barrier.hessian(self._collisions, self.mesh, place, method)
