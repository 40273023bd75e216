"""Plates under uniform pressure: round and square, clamped and hinged, small and large bending.

*The problem.* A plate of thickness H = 0.5 mm, Young's modulus E = 1000 kPa, nu = 0, with radius
or side a = 25 mm, is pushed by a pressure q. Its rim cannot move; it is clamped or free to turn.
D = E H^3/12 is its bending rigidity.

*Small deflections* (Timoshenko & Woinowsky-Krieger, Theory of Plates and Shells, 1959):

- circular, clamped: w = q a^4/(64 D) in the centre, moment q a^2/8 of the clamp (section 16);
- circular, hinged: w = (5 + nu)/(1 + nu) q a^4/(64 D), slope q a^3/(8 (1 + nu) D) of the rim;
- square, hinged: w = 0.00406235 q a^4/D (Navier's series, section 30), for any nu;
- square, clamped: w = 0.00126532 q a^4/D (section 44 has 0.00126; the digits are from our own
  Ritz solution with polynomials up to degree 26, converged to 1e-9), for any nu.

*Large deflections.* The plate stretches and stiffens: w/H is 0.77 at q a^4/(64 D H) = 1 and 2.45
at 10. The reference is the exact axisymmetric shell, solved to 1e-8 as ordinary equations
(``plate_reference.py``). For a square no published figures independent of nu were found.

*Order.* Deflections of the centre of squares converge at the order 2k of the energy on structured
meshes (clamped, degree 3: 4.9 instead of 6, the solution is not smooth enough in the corners). A
circle meshed with straight-sided triangles is a polygon, which is what limits degrees 2 and 3.

*Babuska's paradox.* A hinged polygon does not tend to the hinged disc as its sides get many: along
a straight side that is held the plate has no curvature, which stiffens it. Its limit is that of
nu = 1, 3 instead of 5 times q a^4/(64 D). What happens here:

- a fixed 12-gon meshed ever finer, its whole boundary held: degree 1 gives 5.49, 4.36, 3.90, 3.64,
  degree 2 4.00, 3.73, 3.53, 3.39, degree 3 3.73, 3.53, 3.39 (mesh halved each time);
- one edge a side, its whole boundary held: all tend to 5, because a straight edge knows its slope
  and moment as polynomials only. Degree 1, which can hold corners only, does so at order 2 (so
  found Arnold & Walker, SIAM J. Numer. Anal. 58 (2020) 2829), degrees 2 and 3 at order 1: still
  2.7 % off on a 96-gon with 1536 triangles;
- one edge a side, corners held, which lie on the circle: order 2 for degrees 2 and 3 too, and
  0.03 % off there.

So hinged rims are held at their corners only. A clamped rim has no paradox; its polygon is given
the area of the disc, so that the rim is on average where the circle is.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plate_problems import SIZE, THICKNESS, circular_plate, deflections
from plate_reference import CircularPlate
from plates_small import small_rows
from record import Row

__all__ = ["draw", "rows"]

Floats = NDArray[np.float64]

#: q a^4/(64 D H)
_LOADS = {True: (1.0, 4.0, 10.0), False: (0.2, 1.0, 3.0)}
_NAME = {True: "clamped", False: "hinged"}

_REFERENCE = "axisymmetric shell as ordinary equations, 1e-8"
#: (clamped, full): degree: (rings, tolerance) for large deflections
_LARGE = {
    (True, False): {1: (8, 3e-2), 2: (4, 2e-3), 3: (2, 3e-3)},
    (True, True): {1: (16, 1e-2), 2: (16, 4e-5), 3: (8, 6e-5)},
    (False, False): {1: (8, 4e-3), 2: (4, 1.4e-2)},
    (False, True): {1: (16, 5e-4), 2: (16, 9e-4), 3: (8, 3.5e-3)},
}


@cache
def _reference(clamped: bool, loads: tuple[float, ...]) -> Floats:
    return CircularPlate(THICKNESS / SIZE, clamped).deflections(np.array(loads), 1e-8)


def _large(full: bool) -> list[Row]:
    result = []
    for clamped in (True, False):
        loads = _LOADS[clamped] if full else _LOADS[clamped][:2]
        reference = _reference(clamped, loads)
        for degree, (rings, tolerance) in _LARGE[clamped, full].items():
            plate = circular_plate(degree, rings, clamped)
            found = deflections(plate, np.array(loads))
            for load, value, target in zip(loads, found, reference, strict=True):
                case = f"circular, {_NAME[clamped]}, q a^4/(64 D H) = {load:g}, {plate.name}"
                result.append(
                    Row("plates", case, "w/H, centre", value, target, tolerance, _REFERENCE)
                )
    return result


def rows(full: bool) -> list[Row]:
    """Deflections, slopes, clamp moments and orders; quick: coarse meshes, two loads."""
    return small_rows(full) + _large(full)


def draw(axes: Any) -> None:
    """Central deflection over load, degree 2 with 96 triangles on the reference's curve."""
    for clamped, colour in ((True, "C0"), (False, "C1")):
        most = _LOADS[clamped][-1]
        fine = tuple(float(load) for load in most * np.linspace(0.05, 1, 15) ** 1.5)
        axes.plot(fine, _reference(clamped, fine), c=colour, label=f"{_NAME[clamped]}, exact shell")
        linear = np.array([0.0, 2.6 if clamped else 0.52])
        axes.plot(linear, linear * (1 if clamped else 5), ":", c=colour, label="small deflections")
        loads = most * np.linspace(0.1, 1, 6)
        found = deflections(circular_plate(2, 4, clamped), loads)
        axes.plot(loads, found, "o", c=colour, mfc="none", label="degree 2, 96 triangles")
    axes.set_xlabel("load q a$^4$/(64 D H)")
    axes.set_ylabel("central deflection w/H")
    axes.legend(fontsize="small")
