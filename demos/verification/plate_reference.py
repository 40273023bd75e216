"""Reference for circular plates: the axisymmetric shell, solved as ordinary equations.

The plate is the geometrically exact Kirchhoff-Love shell with the membrane energy
E H/(2 (1 - nu^2)) (e_s^2 + e_t^2 + 2 nu e_s e_t), e Green's strain, and the bending energy
D/2 (k_s^2 + k_t^2 + 2 nu k_s k_t), k_ij = phi_,ij . n. For nu = 0 that is what ``avneo_fem``
discretises with its St. Venant-Kirchhoff material; nu is kept so that the reference itself can be
held against published figures, most of which are for nu = 0.3.

Lengths in radii a, forces in E H/(1 - nu^2), moments in D/a: with the meridian r(x), z(x), its
stretch lambda and slope beta (r' = lambda cos beta, z' = lambda sin beta), k_s = lambda beta' and
k_t = r sin beta / x^2, the first variation of the energy less p x (enclosed volume) gives four
equations of first order, for r, beta, the moment m = lambda (k_s + nu k_t) and the radial force
x f. The vertical force is known: p r^2/2. No finite element and no code of ``avneo_fem`` in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

__all__ = ["CircularPlate", "perturbation_coefficient"]

Floats = NDArray[np.float64]

#: the axis is left out up to this radius; that changes deflections by about 1e-9
_HOLE = 1e-3


@dataclass(frozen=True)
class CircularPlate:
    """Circular plate under follower pressure whose rim cannot move.

    Attributes
    ----------
    slenderness : float
        H/a.
    clamped : bool
        Rim clamped, or free to turn.
    poisson_ratio : float
        nu.
    """

    slenderness: float
    clamped: bool
    poisson_ratio: float = 0.0

    @property
    def _bending(self) -> float:
        """D over E H a^2/(1 - nu^2)."""
        return self.slenderness**2 / 12

    def _rates(self, x: Floats, y: Floats, pressure: float) -> Floats:
        """(5, k) derivatives of (r, beta, m, f, z) at radii x (k,)."""
        nu, bending = self.poisson_ratio, self._bending
        r, beta, moment, force, _ = y
        sine, cosine, hoop = np.sin(beta), np.cos(beta), r / x
        bend_t, strain_t = hoop * sine / x, (hoop**2 - 1) / 2
        lift = pressure * hoop * r / 2
        pull = force * cosine + lift * sine
        stretch = np.ones_like(x)
        # force along the meridian: dW/dlambda = pull, where m and not k_s is given
        for _ in range(30):
            bend_s = moment / stretch - nu * bend_t
            strain = (stretch**2 - 1) / 2 + nu * strain_t
            rest = strain * stretch + bending * moment * bend_s / stretch**2 - pull
            slope = (
                strain
                + stretch**2
                - bending * moment * (2 * bend_s / stretch**3 + moment / stretch**4)
            )
            stretch = stretch - rest / slope
        bend_s = moment / stretch - nu * bend_t
        force_t = (strain_t + nu * (stretch**2 - 1) / 2) * hoop
        moment_t = bend_t + nu * bend_s
        turning = stretch * (force * sine - lift * cosine) / bending
        return np.array(
            [
                stretch * cosine,
                bend_s / stretch,
                (moment_t * hoop * cosine - moment) / x + turning,
                (force_t + bending * moment_t * sine / x - force) / x
                - pressure * stretch * sine * hoop,
                stretch * sine,
            ]
        )

    def _ends(self, inner: Floats, outer: Floats, pressure: float) -> Floats:
        """What must vanish: r and beta are odd at the axis, the rim is held."""
        rates = self._rates(np.array([_HOLE]), inner[:, None], pressure)[:, 0]
        odd = inner[:2] - _HOLE * rates[:2]
        return np.r_[odd, outer[0] - 1, outer[1] if self.clamped else outer[2], outer[4]]

    def solve(self, loads: Floats, tolerance: float = 1e-9) -> list[tuple[Floats, Floats]]:
        """Equilibria at increasing loads q a^4/(64 D H), each started from the one before.

        Returns
        -------
        list of ((k,), (5, k)) arrays
            Radii x and (r, beta, m, f, z), in the units above.

        Raises
        ------
        RuntimeError
            When ``solve_bvp`` does not reach its tolerance.
        """
        x = np.linspace(_HOLE, 1.0, 60)
        y = np.array([x, 0 * x, 0 * x, 0 * x, 0 * x])
        results = []
        for load in loads:
            pressure = -64 * float(load) * self._bending * self.slenderness

            def rates(s: Floats, v: Floats, p: float = pressure) -> Floats:
                return self._rates(s, v, p)

            def ends(inner: Floats, outer: Floats, p: float = pressure) -> Floats:
                return self._ends(inner, outer, p)

            found = solve_bvp(rates, ends, x, y, tol=tolerance, max_nodes=50_000)
            if not found.success:
                raise RuntimeError(f"reference plate at load {load}: {found.message}")
            x, y = found.x, found.y
            results.append((x, y))
        return results

    def deflections(self, loads: Floats, tolerance: float = 1e-9) -> Floats:
        """(l,) central deflection over thickness at increasing loads q a^4/(64 D H)."""
        heights = [y[4, 0] - x[0] * y[1, 0] / 2 for x, y in self.solve(loads, tolerance)]
        return np.abs(heights) / self.slenderness


def perturbation_coefficient(poisson_ratio: float) -> float:
    """c in q a^4/(64 D H) = w/H + c (w/H)^3 + ..., the exact start of the clamped plate's curve.

    von Karman's equations expanded in the central deflection (lengths in a, H for w), by exact
    arithmetic with polynomials: w1 = (1 - x^2)^2 stretches the plate by u, and the forces of u on
    w1 bend it by w3, whose centre is kept.
    """
    nu, x = poisson_ratio, Polynomial([0.0, 1.0])
    slope = ((1 - x**2) ** 2).deriv()

    def over_x(polynomial: Polynomial) -> Polynomial:
        return Polynomial(polynomial.coef[1:])

    # u'' + u'/x - u/x^2 = -w'w'' - (1 - nu) w'^2/(2x), term by term; u(1) = 0
    right = -slope * slope.deriv() - (1 - nu) / 2 * over_x(slope**2)
    powers = np.arange(len(right.coef)) + 2
    moved = Polynomial(np.r_[0.0, 0.0, right.coef / (powers**2 - 1)])
    u = moved - moved(1.0) * x
    force = 12 * (u.deriv() + slope**2 / 2 + nu * over_x(u))  # N_s over D/H^2
    # b'' + b'/x - b/x^2 = N_s w' - (share of the load, 32 c x): b = w3', b(1) = 0
    right = force * slope
    powers = np.arange(len(right.coef)) + 2
    bent = Polynomial(np.r_[0.0, 0.0, right.coef / (powers**2 - 1)])
    bent = bent - bent(1.0) * x
    loaded = 4 * (x**3 - x)  # the slope of w1, which the load 1 gives
    return float(-bent.integ()(1.0) / loaded.integ()(1.0))
