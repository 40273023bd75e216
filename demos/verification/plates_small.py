"""Small deflections of plates: figures of the textbook, and the order at which they are reached.

The problems, their sources and what is special about hinged circular plates: see ``plates.py``.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cell_fields import observed_order
from plate_problems import circular_plate, small_deflection, square_plate
from record import Row

__all__ = ["small_rows"]

Floats = NDArray[np.float64]

_BOOK = "Timoshenko & Woinowsky-Krieger 1959"
_SQUARE = {True: 1.265319087e-3, False: 4.062352661e-3}
_SQUARE_SOURCE = {True: f"{_BOOK}, s. 44; digits: Ritz", False: f"{_BOOK}, s. 30 (Navier)"}
_NAME = {True: "clamped", False: "hinged"}
_POLYGON = "straight sides: second order"

#: (clamped, full): degree: (rings, tolerances of deflection, and of clamp moment or rim slope)
_CIRCLES = {
    (True, False): {1: (8, 4e-2, 6e-3), 2: (4, 6e-4, 8e-3), 3: (4, 6e-4, 8e-3)},
    (True, True): {1: (16, 1.2e-2, 2e-3), 2: (16, 3e-6, 5e-4), 3: (8, 8e-5, 2e-3)},
    (False, False): {1: (8, 2e-3, 1.2e-2), 2: (4, 1e-2, 4e-3), 3: (4, 8e-3, 4e-3)},
    (False, True): {1: (16, 4e-4, 3e-3), 2: (16, 5e-4, 2.5e-4), 3: (8, 2e-3, 1e-3)},
}
#: (clamped, full): degree: (columns, tolerance)
_SQUARES = {
    (True, False): {1: (16, 8e-2), 2: (8, 2e-3), 3: (4, 1.2e-3)},
    (True, True): {1: (32, 2e-2), 2: (32, 1e-5), 3: (16, 3e-6)},
    (False, False): {1: (16, 8e-3), 2: (8, 1e-4), 3: (4, 1e-4)},
    (False, True): {1: (32, 2e-3), 2: (32, 6e-7), 3: (16, 5e-7)},
}


@cache
def _circle(degree: int, rings: int, clamped: bool, corners: bool) -> tuple[str, Floats]:
    plate = circular_plate(degree, rings, clamped, corners)
    return plate.name, np.array(small_deflection(plate))


@cache
def _square(degree: int, columns: int, clamped: bool, structured: bool) -> tuple[str, float]:
    plate = square_plate(degree, columns, clamped, structured)
    return plate.name, small_deflection(plate)[0]


def _small_circles(full: bool) -> list[Row]:
    result = []
    for clamped in (True, False):
        targets = {True: (1 / 64, 1 / 8), False: (5 / 64, 1 / 8)}[clamped]
        # slopes come second in the answer, clamp moments third
        second = 2 if clamped else 1
        words = (
            "w D/(q a^4), centre",
            "clamp moment/(q a^2)" if clamped else "rim slope D/(q a^3)",
        )
        for degree, (rings, *tolerances) in _CIRCLES[clamped, full].items():
            name, found = _circle(degree, rings, clamped, True)
            case = f"circular, {_NAME[clamped]}, small, {name}"
            for word, value, target, tolerance in zip(
                words, found[[0, second]], targets, tolerances, strict=True
            ):
                source = f"{_BOOK}, s. 16"
                result.append(Row("plates", case, word, value, target, tolerance, source))
    return result


def _small_squares(full: bool) -> list[Row]:
    result = []
    for clamped in (True, False):
        for degree, (columns, tolerance) in _SQUARES[clamped, full].items():
            for structured in (True, False) if full else (False,):
                name, value = _square(degree, columns, clamped, structured)
                kind = "structured" if structured else "unstructured"
                case = f"square, {_NAME[clamped]}, small, {name}, {kind}"
                result.append(
                    Row(
                        "plates",
                        case,
                        "w D/(q a^4), centre",
                        value,
                        _SQUARE[clamped],
                        tolerance,
                        _SQUARE_SOURCE[clamped],
                    )
                )
    return result


def _order(
    case: str, sizes: Sequence[int], errors: Floats, order: float, tolerance: float, why: str
) -> Row:
    observed = observed_order(1 / np.array(sizes, dtype=float), np.abs(errors))
    return Row("plates", case, "order of w, centre", observed, order, tolerance, why, absolute=True)


def _orders(full: bool) -> list[Row]:
    result = []
    series = [(False, 1, (8, 16)), (False, 2, (4, 8)), (False, 3, (4, 8))]
    if full:
        series = [(False, 1, (8, 16, 32)), (False, 2, (8, 16, 32)), (False, 3, (4, 8, 16))]
        series += [(True, 1, (8, 16, 32)), (True, 2, (8, 16, 32))]
    for clamped, degree, columns in series:
        errors = np.array([_square(degree, n, clamped, True)[1] for n in columns])
        case = f"square, {_NAME[clamped]}, degree {degree}, {columns[0]} to {columns[-1]} a side"
        result.append(
            _order(case, columns, errors - _SQUARE[clamped], 2.0 * degree, 0.2, "2k, as energy")
        )
    if not full:
        return result
    # (clamped, degree, corners only, order, tolerance)
    for clamped, degree, corners, order, tolerance in (
        (True, 1, True, 2.0, 0.2),
        (False, 2, True, 2.0, 0.3),
        (False, 3, True, 2.0, 0.3),
        (False, 2, False, 1.0, 0.2),
        (False, 3, False, 1.0, 0.2),
    ):
        rings = (2, 4, 8) if degree == 3 else (4, 8, 16)
        errors = np.array([_circle(degree, n, clamped, corners)[1][0] for n in rings])
        rim = "" if clamped or corners else ", whole polygon held (the paradox's trace)"
        case = f"circular, {_NAME[clamped]}{rim}, degree {degree}, {rings[0]} to {rings[-1]} rings"
        target = (1 if clamped else 5) / 64
        result.append(_order(case, rings, errors - target, order, tolerance, _POLYGON))
    return result


def small_rows(full: bool) -> list[Row]:
    """Deflections, rim slopes and clamp moments, and orders of the deflection."""
    return _small_circles(full) + _small_squares(full) + _orders(full)
