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

    Parameters
    ----------
    rest_points : (n, 3) array
        Stress-free positions.
    triangles : (m, 3) array
    distance : float
        The barrier acts below it [mm].
    stiffness : float
        Factor of the barrier energy.
    """

    def __init__(
        self, rest_points: Floats, triangles: NDArray[np.int64], distance: float, stiffness: float
    ) -> None:
        faces = np.asfortranarray(triangles.astype(np.int32))
        self.mesh = ipctk.CollisionMesh(
            np.asfortranarray(rest_points), ipctk.edges(faces), faces
        )
        self.distance = distance
        self.project = True
        self.stiffness = stiffness
        self._seen: Floats | None = None
        self._collisions = ipctk.NormalCollisions()
        self._ccd = ipctk.AdditiveCCD()

    @property
    def stiffness(self) -> float:
        """Factor of the barrier energy."""
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
        """Number of active contacts."""
        self._at(points)
        return len(self._collisions)

    def closest(self, points: Floats) -> float:
        """Smallest distance among active contacts [mm]; ``distance`` when there is none."""
        place = self._at(points)
        if not len(self._collisions):
            return self.distance
        return float(np.sqrt(self._collisions.compute_minimum_distance(self.mesh, place)))

    def intersects(self, points: Floats) -> bool:
        """Whether any two triangles cross."""
        return bool(ipctk.has_intersections(self.mesh, np.asfortranarray(points)))

    def step_fraction(self, points: Floats, step: Floats) -> float:
        """Share of ``step`` (n, 3) that is free of collisions, 0..1."""
        return float(
            ipctk.compute_collision_free_stepsize(
                self.mesh,
                np.asfortranarray(points),
                np.asfortranarray(points + step),
                narrow_phase_ccd=self._ccd,
            )
        )

    def energy(self, points: Floats) -> float:
        """Barrier energy."""
        place = self._at(points)
        return float(self._barrier(self._collisions, self.mesh, place))

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative."""
        place = self._at(points)
        return np.asarray(self._barrier.gradient(self._collisions, self.mesh, place)).reshape(-1, 3)

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n); contacts are made positive semi-definite while ``project`` is set."""
        place = self._at(points)
        kind = ipctk.PSDProjectionMethod
        method = kind.CLAMP if self.project else kind.NONE
        return self._barrier.hessian(self._collisions, self.mesh, place, method)
