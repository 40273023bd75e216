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


#: below this angle at renewal the apex's height over the half-plane stands for the angle [rad]
_NEAR = np.radians(60.0)
#: a triangle that was turned by more has not been turned the whole way [rad]
_OVER = np.radians(225.0)
#: share of the way to a turn of 90 degrees that a step may go
_TURN = 0.9


class ClampPenalty:
    """Energy k/2 sum_e l_e theta_e^2 over the suture edges, which do not move.

    For edges that were within 60 degrees of their half-plane at the last :meth:`renew`, theta is
    measured as the apex's height over the half-plane in units of its distance from the edge at
    that time. To first order that is the angle, but it has no singularity where a triangle is
    squeezed against its edge, and its Hessian is positive.

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
    reference : (2, k) array
        What :meth:`renew` notes: the angles from which further rotations are counted [rad], and
        the distances of the apexes from their edges [mm], infinite before the first renewal.
    active : (k,) bool array
        Edges the term acts on; all at first.
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
        self.reference = np.stack([np.zeros(len(apex)), np.full(len(apex), np.inf)])
        self.active = np.ones(len(apex), dtype=bool)

    def _polar(self, points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Angle, squared distance from the edge, and the arm across it: radial, turned by 90."""
        cosine, sine = np.cos(self.reference[0])[:, None], np.sin(self.reference[0])[:, None]
        first = cosine * self._inward + sine * self._normal
        second = cosine * self._normal - sine * self._inward
        arm = points[self.apex] - self._origin
        x, y = np.einsum("kd,kd->k", arm, first), np.einsum("kd,kd->k", arm, second)
        radial = x[:, None] * first + y[:, None] * second
        turning = x[:, None] * second - y[:, None] * first
        # an apex on its edge has no angle; where heights count, none is asked for
        square = np.maximum(x**2 + y**2, np.finfo(float).tiny ** 0.25)
        return self.reference[0] + np.arctan2(y, x), square, radial, turning

    def angles(self, points: Floats) -> Floats:
        """(k,) theta_e from -b towards t x b, counted without a jump since :meth:`renew` [rad]."""
        return self._polar(points)[0]

    def rms_angle(self, points: Floats) -> float:
        """Root mean square of theta along the suture line [rad]."""
        return float(np.sqrt(np.average(self.angles(points) ** 2, weights=self._line_lengths)))

    def renew(self, points: Floats) -> None:
        """Count further rotations, and measure heights, from the present state."""
        angle, square, _, _ = self._polar(points)
        self.reference = np.stack([self._unwound(angle), np.sqrt(square)])

    @staticmethod
    def _unwound(angle: Floats) -> Floats:
        """Angles (k,) without full turns.

        An apex that passes by beyond an end of its edge goes round the edge's line, and its angle
        by 360 degrees, but the triangle has not turned round its edge: that is no way back. What
        has been turned over, by little more than 180 degrees, has its way back.
        """
        return angle - 2 * np.pi * np.sign(angle) * (np.abs(angle) > _OVER)

    def largest_share(self, points: Floats, moves: Floats) -> float:
        """Share of ``moves`` (n, 3) after which no triangle has turned by 90 degrees, 0..1.

        A flat triangle that is squeezed against its edge could otherwise pass through it within
        one step and come out on the other side, turned by 180 degrees: nothing else notices.
        """
        _, square, radial, _ = self._polar(points)
        towards = -np.einsum("kd,kd->k", radial, moves[self.apex])
        blocking = self.active & (towards > _TURN * square)
        return float((_TURN * square[blocking] / towards[blocking]).min(initial=1.0))

    @property
    def _near(self) -> NDArray[np.bool_]:
        return np.isfinite(self.reference[1]) & (np.abs(self.reference[0]) < _NEAR)

    @property
    def _scale(self) -> Floats:
        return np.where(self._near, self.reference[1], 1.0)

    def _height(self, points: Floats) -> Floats:
        """(k,) height of the apex over the half-plane in units of its arm at renewal."""
        arm = points[self.apex] - self._origin
        return np.einsum("kd,kd->k", arm, self._normal) / self._scale

    @property
    def _weights(self) -> Floats:
        return self.lengths * self.active

    def energy(self, points: Floats) -> float:
        """Energy [mN mm]."""
        measure = np.where(self._near, self._height(points), self.angles(points))
        return float(self.stiffness / 2 * np.dot(self._weights, measure**2))

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) [mN]."""
        angle, square, _, turning = self._polar(points)
        slope = np.where(self._near[:, None], self._slope(), turning / square[:, None])
        measure = np.where(self._near, self._height(points), angle)
        result = np.zeros((self.count, 3))
        np.add.at(result, self.apex, (self.stiffness * self._weights * measure)[:, None] * slope)
        return result

    def _slope(self) -> Floats:
        return self._normal / self._scale[:, None]

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) [mN/mm]."""
        angle, square, radial, turning = self._polar(points)
        slope = np.where(self._near[:, None], self._slope(), turning / square[:, None])
        mixed = radial[:, :, None] * turning[:, None, :]
        bend = -(mixed + mixed.transpose(0, 2, 1)) / (square**2)[:, None, None]
        bend[self._near] = 0.0
        blocks = slope[:, :, None] * slope[:, None, :] + angle[:, None, None] * bend
        total = np.zeros((self.count, 3, 3))
        np.add.at(total, self.apex, (self.stiffness * self._weights)[:, None, None] * blocks)
        return block_diagonal(total)
