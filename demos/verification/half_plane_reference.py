"""References of ``half_plane``: the pendulum's separatrix and the elastica."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

__all__ = ["Elastica", "arc", "elasticas", "separatrix"]

Floats = NDArray[np.float64]


def arc(s: Floats, length: float, half: float) -> Floats:
    """(n, 2) places [mm] at arc lengths ``s`` on a circular arc that opens by 2 ``half`` [rad],
    both ends at height 0, the first at the origin."""
    radius, theta = length / (2 * half), half * (1 - 2 * s / length)
    sine, cosine = np.sin(half) - np.sin(theta), np.cos(theta) - np.cos(half)
    return radius * np.c_[sine, cosine]


def separatrix(s: Floats, angle: float, layer: float) -> Floats:
    """(n, 2) places [mm] on a long strip under tension T at arc lengths ``s`` (n,) [mm].

    Solution of D theta'' = T sin theta, theta(0) = ``angle`` [rad], theta(infinity) = 0, with
    ``layer`` = sqrt(D/T): tan(theta/4) = tan(angle/4) exp(-s/layer). Its moment is
    2 sqrt(D T) sin(theta/2), so height and shortening follow by integration.
    """
    theta = 4 * np.arctan(np.tan(angle / 4) * np.exp(-s / layer))
    x = s + 2 * layer * (np.cos(angle / 2) - np.cos(theta / 2))
    z = 2 * layer * (np.sin(angle / 2) - np.sin(theta / 2))
    return np.c_[x, z]


@dataclass(frozen=True)
class Elastica:
    """One loop: ``moment`` [mN] holds its end at the clamp, :meth:`shape` is where it is."""

    moment: float
    solution: Any

    def shape(self, s: Floats) -> Floats:
        """(n, 2) places [mm] at reference arc lengths ``s`` (n,) [mm]."""
        return np.asarray(self.solution(s)[:2]).T


def elasticas(
    angles: Sequence[float],
    half: float,
    length: float,
    axial: float,
    rigidity: float,
    pressure: float = 0.0,
    second_form: bool = False,
) -> list[Elastica]:
    """Rods clamped at ``angles`` at the origin, hinged where the arc of opening 2 ``half`` ends.

    Parameters
    ----------
    angles : sequence of float
        theta(0) [rad], each the start for the next, the first from the arc.
    half, length : float
        See :func:`arc` [rad, mm].
    axial, rigidity : float
        EH [mN/mm] and D [mN mm], both per width: N = EH (lambda - 1), M = D theta'.
    pressure : float
        Follower pressure along -n [kPa]; negative inflates.
    second_form : bool
        Curvature lambda theta', the second fundamental form of the surface (degree 2 and more),
        rather than theta', the rotation per reference length (degree 1). They differ by the
        strain.

    Raises
    ------
    RuntimeError
        When SciPy's ``solve_bvp`` does not converge to 1e-8.
    """
    s = np.linspace(0.0, length, 101)
    theta = half * (1 - 2 * s / length)
    y = np.vstack([arc(s, length, half).T, theta, np.full_like(s, -2 * half * rigidity / length)])
    place, force, answers = arc(np.array([length]), length, half)[0], np.zeros(2), []

    def slope(_s: Floats, y: Floats, p: Floats) -> Floats:
        x, z, theta, moment = y
        cosine, sine = np.cos(theta), np.sin(theta)
        # the pressure along a piece of curve has the resultant p x its chord, turned by 90 degrees
        along, up = p[0] - pressure * z, p[1] + pressure * x
        normal = along * cosine + up * sine
        share = moment**2 / rigidity if second_form else 0.0 * s[0]
        stretch = 1 + (normal - share) / (axial - 3 * share)
        bend = moment / rigidity / (stretch**2 if second_form else 1.0)
        turning = stretch * (along * sine - up * cosine)
        return np.vstack([stretch * cosine, stretch * sine, bend, turning])

    for angle in angles:

        def ends(a: Floats, b: Floats, _p: Floats, angle: float = angle) -> Floats:
            return np.r_[a[:2], a[2] - angle, b[:2] - place, b[3]]

        answer = solve_bvp(slope, ends, s, y, force, tol=1e-8, max_nodes=20000)
        if not answer.success:
            raise RuntimeError(f"elastica at {np.degrees(angle):.0f} degrees: {answer.message}")
        s, y, force = answer.x, answer.y, answer.p
        answers.append(Elastica(float(-y[3, 0]), answer.sol))
    return answers
