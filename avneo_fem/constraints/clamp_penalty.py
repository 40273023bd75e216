"""Holds the first row of triangles in the tangent half-plane of the suture line (paper (3.1)).

A clamped Kirchhoff-Love shell leaves its edge tangentially and turns away within a boundary
layer of length sqrt(D/T), T the membrane tension: here about 0.3 mm, less than a triangle. The
director of the edge alone (``equilibrium.directors``) then says little about the triangles. This
term acts on the angle theta between a suture edge's triangle and its half-plane; under refinement
theta and with it the term vanish.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from avneo_fem.constraints.term import block_diagonal

__all__ = ["ClampPenalty"]

Floats = NDArray[np.float64]


class ClampPenalty:
    """Energy k/2 sum_e l_e theta_e^2 over the suture edges, which do not move.

    Parameters
    ----------
    count : int
        Number n of nodes.
    apex : (k,) array
        Node opposite each suture edge.
    edges : (k, 2, 3) array
        Ends of the edges on the suture line, in its direction [mm].
    conormal : (k, 3) array
        Prescribed outward conormal b: the cusp leaves along -b.
    lengths : (k,) array
        l_e, lengths of the edges in the template [mm].
    stiffness : float
        k [mN].

    Attributes
    ----------
    turned : (k,) array
        Angles from which further rotations are counted [rad].
    """

    def __init__(
        self,
        count: int,
        apex: NDArray[np.int64],
        edges: Floats,
        conormal: Floats,
        lengths: Floats,
        stiffness: float = 0.0,
    ) -> None:
        self.count, self.apex, self.lengths, self.stiffness = count, apex, lengths, stiffness
        along = edges[:, 1] - edges[:, 0]
        self._line_lengths = np.linalg.norm(along, axis=1)
        tangent = along / np.linalg.norm(along, axis=1, keepdims=True)
        across = conormal - np.einsum("kd,kd->k", conormal, tangent)[:, None] * tangent
        self._origin = edges[:, 0]
        self._inward = -across / np.linalg.norm(across, axis=1, keepdims=True)
        self._normal = np.cross(tangent, -self._inward)
        self.turned = np.zeros(len(apex))

    def _polar(self, points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Angle, squared distance from the edge, and the arm across it: radial, turned by 90."""
        cosine, sine = np.cos(self.turned)[:, None], np.sin(self.turned)[:, None]
        first = cosine * self._inward + sine * self._normal
        second = cosine * self._normal - sine * self._inward
        arm = points[self.apex] - self._origin
        x, y = np.einsum("kd,kd->k", arm, first), np.einsum("kd,kd->k", arm, second)
        radial = x[:, None] * first + y[:, None] * second
        turning = x[:, None] * second - y[:, None] * first
        return self.turned + np.arctan2(y, x), x**2 + y**2, radial, turning

    def angles(self, points: Floats) -> Floats:
        """(k,) theta_e from -b towards t x b, counted without a jump since :meth:`renew` [rad]."""
        return self._polar(points)[0]

    def rms_angle(self, points: Floats) -> float:
        """Root mean square of theta along the suture line [rad]."""
        return float(np.sqrt(np.average(self.angles(points) ** 2, weights=self._line_lengths)))

    def renew(self, points: Floats) -> None:
        """Count further rotations from the present angles."""
        self.turned = self.angles(points)

    def energy(self, points: Floats) -> float:
        """Energy [mN mm]."""
        return float(self.stiffness / 2 * np.dot(self.lengths, self.angles(points) ** 2))

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) [mN]."""
        angle, square, _, turning = self._polar(points)
        result = np.zeros((self.count, 3))
        force = (self.stiffness * self.lengths * angle / square)[:, None] * turning
        np.add.at(result, self.apex, force)
        return result

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) [mN/mm]: k l (grad theta grad theta^T + theta grad grad theta)."""
        angle, square, radial, turning = self._polar(points)
        load = self.stiffness * self.lengths
        mixed = radial[:, :, None] * turning[:, None, :]
        bend = -(mixed + mixed.transpose(0, 2, 1)) / (square**2)[:, None, None]
        blocks = turning[:, :, None] * turning[:, None, :] / (square**2)[:, None, None]
        total = np.zeros((self.count, 3, 3))
        np.add.at(total, self.apex, load[:, None, None] * (blocks + angle[:, None, None] * bend))
        return block_diagonal(total)
