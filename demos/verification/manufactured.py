r"""Manufactured solutions: does the error fall with the mesh at the rate that theory gives?

A benchmark with a printed answer checks one figure. Here the whole field is checked: a smooth
solution is made up, the load that it needs is worked out by hand, and the shell must find it
again. What is asked is not the error, which can be bought with triangles, but the *order*: halve
the mesh size h, and the error must fall by 2^order. One wrong term anywhere spoils it.

*Membrane* (``manufactured_membrane.py``). The unit square is stretched by a quarter to a half
and bulged out of its plane; nonlinear elasticity, both materials, bending switched off. Lagrange
elements of degree k must reach order k + 1 in the positions (L2 norm) and k in their gradient.

*Plate* (``manufactured_plate.py``). A clamped unit square bends by a polynomial. The moments of a
shell of degree k must reach order k in the energy norm, the deflection k + 1, and 2 for k = 1.
(Hellan-Herrmann-Johnson method: Comodi, Math. Comp. 52 (1989) 17; Morley's element, to which
k = 1 belongs, has 2 as well: Arnold & Brezzi, RAIRO M2AN 19 (1985) 7.) The error of the moments is
taken in the moments themselves and not from the difference of energies |W_h - W|: that one
converges at twice the order of what the load sees, so it would say more about the deflection.

Sequences of three (quick) or four meshes, structured (all triangles alike) and unstructured (nodes
moved at random, triangulated anew, so that no symmetry helps). Target: theory +- 0.2, the slope
being fitted to all meshes of a sequence.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from cell_fields import observed_order
from manufactured_membrane import membrane_errors
from manufactured_plate import plate_errors
from record import Row

__all__ = ["draw", "rows"]

#: triangles along a side; the plate of degree 1 starts finer, where its order has settled
_COLUMNS: dict[int, tuple[int, ...]] = {1: (8, 16, 24, 32), 2: (4, 8, 16, 24), 3: (4, 8, 12, 16)}
_TOLERANCE = 0.2
_SOURCES = {
    "membrane": "Lagrange elements of degree k: k + 1 in L2, k in H1 (Ciarlet 1978, ch. 3)",
    "plate": "Hellan-Herrmann-Johnson: k in the moments, k + 1 (k = 1: 2) in L2 (Comodi 1989)",
}
_QUANTITIES = {
    "membrane": ("order of positions (L2)", "order of gradient (L2)"),
    "plate": ("order of deflection (L2)", "order of moments (energy norm)"),
}


@cache
def _errors(
    problem: str, degree: int, columns: int, structured: bool, material: str
) -> tuple[float, float]:
    if problem == "membrane":
        return membrane_errors(degree, columns, structured, material)
    return plate_errors(degree, columns, structured)


def _theory(problem: str, degree: int) -> tuple[int, int]:
    """Orders of the field in L2 and of its energy norm."""
    return (2 if degree == 1 else degree + 1), degree


def _sequence(
    problem: str, degree: int, columns: Sequence[int], structured: bool, material: str
) -> list[Row]:
    found = np.array([_errors(problem, degree, n, structured, material) for n in columns])
    sizes = 1 / np.array(columns, dtype=float)
    kind = "structured" if structured else "unstructured"
    law = f", {material.replace('_', ' ')}" if problem == "membrane" else ""
    case = f"{problem}, degree {degree}, {kind}, {columns[0]} to {columns[-1]} a side{law}"
    return [
        Row(
            "manufactured",
            case,
            quantity,
            observed_order(sizes, errors),
            float(order),
            _TOLERANCE,
            _SOURCES[problem],
            absolute=True,
        )
        for quantity, errors, order in zip(
            _QUANTITIES[problem], found.T, _theory(problem, degree), strict=True
        )
    ]


def rows(full: bool) -> list[Row]:
    """Observed orders, two rows a sequence; ``full`` adds a finer mesh, structured meshes and the
    neo-Hookean membrane."""
    result = []
    for degree, columns in _COLUMNS.items():
        used = columns if full else columns[:3]
        for structured in (False, True) if full else (False,):
            for material in ("st_venant_kirchhoff", "neo_hookean") if full else ("neo_hookean",):
                result += _sequence("membrane", degree, used, structured, material)
            result += _sequence("plate", degree, used, structured, "")
    return result


def draw(axes: Any) -> None:
    """Errors over mesh size (unstructured, quick level) with lines of the theory's slope."""
    for degree, columns in _COLUMNS.items():
        sizes = 1 / np.array(columns[:3], dtype=float)
        for problem, material, mark in (("membrane", "neo_hookean", "o"), ("plate", "", "s")):
            found = [_errors(problem, degree, n, False, material) for n in columns[:3]]
            for errors, order, filled in zip(
                np.transpose(found), _theory(problem, degree), ("none", f"C{degree}"), strict=True
            ):
                axes.loglog(sizes, errors[-1] * (sizes / sizes[-1]) ** order, "-", c="0.7", lw=1)
                axes.loglog(sizes, errors, mark, c=f"C{degree}", mfc=filled, ms=5)
        axes.plot([], [], "-", c=f"C{degree}", label=f"degree {degree}")
    axes.set_xlabel("mesh size h [mm]")
    axes.set_ylabel("error: membrane [mm], plate relative")
    axes.set_title("circles membrane, squares plate; open L2, filled energy norm", fontsize="small")
    axes.legend(fontsize="small")
