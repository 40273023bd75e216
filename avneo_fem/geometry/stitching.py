"""Suture map between template and annulus (paper section 3.2, step 2)."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError

__all__ = ["StitchingMap"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StitchingMap:
    """Piecewise linear map gamma of arc length on the CSL to arc length on the ASL.

    Stitches are spaced alike on both lines near the commissures (chi = 1) and ``gather_ratio``
    times wider on the cusp about the middle (chi = 1/alpha_sl).

    Parameters
    ----------
    csl_length, asl_length : float
        l_c and l_a [mm].
    gather_ratio : float
        alpha_sl > 1.
    key : str
        Scene name for errors.

    Attributes
    ----------
    stitching_ratio : float
        J_sl = l_a / l_c.
    half_width : float
        alpha_sl (1 - J_sl) / (2 (alpha_sl - 1)): |theta - 1/2| where rho jumps.
    breaks : (2,) float64
        Arc lengths on the CSL where rho jumps [mm].

    Raises
    ------
    SceneError
        Unless 1/alpha_sl < J_sl < 1; names the lengths that would do.
    """

    csl_length: float
    asl_length: float
    gather_ratio: float
    key: InitVar[str] = "template"
    stitching_ratio: float = field(init=False)
    half_width: float = field(init=False)
    breaks: Array = field(init=False)

    def __post_init__(self, key: str) -> None:
        l_c, l_a, alpha = self.csl_length, self.asl_length, self.gather_ratio
        if not alpha > 1.0:
            raise SceneError("stitching.gather_ratio", alpha, "must be above 1")
        if not (l_c > 0.0 and l_a > 0.0 and 1.0 / alpha < l_a / l_c < 1.0):
            change = (
                f"longer by more than {l_a - l_c:.4g} mm"
                if l_c <= l_a
                else f"shorter by more than {l_c - alpha * l_a:.4g} mm"
            )
            raise SceneError(
                key,
                l_c,
                f"J_sl = l_a/l_c = {l_a:.6g}/{l_c:.6g} = {l_a / l_c:.4g} must lie between"
                f" 1/gather_ratio = {1.0 / alpha:.4g} and 1: the suture line of the template must"
                f" be between {l_a:.6g} and {alpha * l_a:.6g} mm long, that is {change}",
            )
        ratio = l_a / l_c
        half_width = alpha * (1.0 - ratio) / (2.0 * (alpha - 1.0))
        first = max(l_c * (0.5 - half_width), 0.0)
        breaks = np.array([first, l_c - first])
        breaks.flags.writeable = False
        for name, value in (
            ("stitching_ratio", ratio),
            ("half_width", half_width),
            ("breaks", breaks),
        ):
            object.__setattr__(self, name, value)

    def density(self, theta: ArrayLike) -> Array:
        """Normalised length distribution rho (n,) at theta = s/l_c (n,) in [0, 1]."""
        outer = np.abs(np.asarray(theta, dtype=float) - 0.5) >= self.half_width
        return np.where(outer, 1.0, 1.0 / self.gather_ratio) / self.stitching_ratio

    def annulus_arc_length(self, s: ArrayLike) -> Array:
        """Gamma = l_a int_0^(s/l_c) rho: arc length (n,) on the ASL [mm] (paper §3.2, step 2).

        Parameters
        ----------
        s : (n,) array_like
            Arc lengths on the CSL in [0, l_c] [mm]. gamma(0) = 0 and gamma(l_c) = l_a exactly.

        Raises
        ------
        ValueError
            When s leaves [0, l_c] by more than rounding.
        """
        length = np.atleast_1d(np.asarray(s, dtype=float))
        slack = 1e-9 * self.csl_length
        if not np.all((length >= -slack) & (length <= self.csl_length + slack)):
            raise ValueError(f"arc lengths must lie in [0, {self.csl_length}]")
        first, last = self.breaks
        # chi = 1 on the outer parts, so gamma has the same distance from either end as s
        knots = [0.0, first, last, self.csl_length]
        values = [0.0, first, self.asl_length - first, self.asl_length]
        return np.asarray(np.interp(length, knots, values))

    def template_arc_length(self, s: ArrayLike) -> Array:
        """gamma^-1: arc length (n,) on the CSL of arc lengths (n,) on the ASL [mm]."""
        first, last = self.breaks
        knots = [0.0, first, self.asl_length - first, self.asl_length]
        return np.interp(np.asarray(s, dtype=float), knots, [0.0, first, last, self.csl_length])
