"""Contact curve of two neighbouring cusps in the plane of the commissures (paper §3.3.2).

All points are (2,) or (k, 2) arrays in coordinates of that plane, counter-clockwise seen against
its normal. Lengths in mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from avneo_fem.errors import SceneError

__all__ = ["control_points", "curve_length", "deflection_point", "match_length", "rotated"]

Array = NDArray[np.float64]

#: sigma is sought up to here; Experiments 1 to 3 need 0.03 to 2.7.
LARGEST_SIGMA = 1000.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


def rotated(vectors: Array) -> Array:
    """Plane vectors (..., 2) turned by +90 degrees about the normal."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def deflection_point(centre: Array, end: Array, neighbour: Array, circumradius: float) -> Array:
    """B_i, the point towards which the contact curve A_iC is deflected (§3.3.2, design.md §1).

    At distance min(R, |C A_j|) from C, on the ray C A_j if the angle A_iCA_j is at most 90
    degrees, otherwise on C A_i turned by +90 degrees (defined up to an angle of 180 degrees).

    Parameters
    ----------
    centre, end, neighbour : (2,) arrays
        C, A_i and A_j, j = i + 1.
    circumradius : float
        R of the triangle A_0 A_1 A_2 [mm].
    """
    to_end, to_neighbour = end - centre, neighbour - centre
    direction = to_neighbour if to_end @ to_neighbour >= 0.0 else rotated(to_end)
    distance = min(circumradius, float(np.hypot(*to_neighbour)))
    return centre + distance * direction / np.hypot(*direction)


def control_points(
    centre: Array, end: Array, deflection: Array, sigma: float, omega: float
) -> Array:
    """Control polygon (4, 2) Y_i^0 ... Y_i^3 of (3.3a) from C to A_i."""
    share = sigma / (omega + sigma)
    return np.stack(
        [centre, centre + sigma * (deflection - centre), centre + share * (end - centre), end]
    )


def curve_length(polygon: Array) -> float:
    """Length of the cubic Bézier curve with the control polygon (4, 2), to about 1e-15 of it.

    Gauss-Legendre pieces are graded towards the real parts of the complex zeros of the speed,
    where the integrand is all but singular (at t = 0 for small sigma).
    """
    a = np.diff(polygon, axis=0)
    hodograph = 3.0 * np.array([a[0], 2.0 * (a[1] - a[0]), a[0] - 2.0 * a[1] + a[2]])  # ascending
    x, y = hodograph.T
    squared = np.convolve(x, x) + np.convolve(y, y)
    zeros = np.roots(np.trim_zeros(squared[::-1], "f"))
    near = np.unique(np.clip(np.r_[zeros.real, 0.0, 1.0], 0.0, 1.0))
    grades = 0.3 ** np.arange(28)
    knots = np.r_[(near[:, None] - grades).ravel(), (near[:, None] + grades).ravel(), near]
    knots = np.unique(np.clip(knots, 0.0, 1.0))
    half = 0.5 * np.diff(knots)[:, None]
    t = knots[:-1, None] + half * (1.0 + _NODES)
    velocity = hodograph[0] + t[..., None] * (hodograph[1] + t[..., None] * hodograph[2])
    return float(np.sum(half * _WEIGHTS * np.hypot(velocity[..., 0], velocity[..., 1])))


def match_length(
    centre: Array, end: Array, deflection: Array, length: float, omega: float
) -> float:
    """sigma*: the smallest sigma >= 0 whose curve is as near as can be to ``length`` (3.3c).

    design.md §1: matched to c_i, not l_i; 0 (the straight segment) when |A_iC| >= c_i. No
    decrease of the length with sigma was found for any angle up to 90 degrees between B_i and
    A_i; nothing here relies on that but the step of the scan (1/16, then a tenth of sigma), after
    which Brent's method closes in on the first crossing.

    Raises
    ------
    SceneError
        When no sigma up to ``LARGEST_SIGMA`` makes the curve long enough.
    """
    span = float(np.hypot(*(end - centre)))
    if span >= length:
        return 0.0
    # The unit of length is the span, so that the result does not depend on the unit of the scene.
    unit_end, unit_deflection = (end - centre) / span, (deflection - centre) / span
    origin = np.zeros(2)

    def excess(sigma: float) -> float:
        polygon = control_points(origin, unit_end, unit_deflection, sigma, omega)
        return curve_length(polygon) - length / span

    low, high = 0.0, 1.0 / 16.0
    while excess(high) < 0.0:
        low, high = high, high + max(1.0 / 16.0, 0.1 * high)
        if low > LARGEST_SIGMA:
            raise SceneError(
                "template.free_edge_length",
                length,
                f"gives a contact curve too long for its span of {span:.4g} mm between commissure "
                "and triple contact point; use shorter free edges",
            )
    if excess(low) >= 0.0:  # c_i equals |A_iC| to rounding
        return low
    return float(brentq(excess, low, high, xtol=1e-15, rtol=1e-15))
