"""Global minima of many polynomials on [0, 1] at once, with no root missed.

The closest point of a Bézier curve minimises a polynomial whose derivative, a quintic, changes
sign from - to + there. The paper (§3.3.2) finds all its roots by Jenkins-Traub, one point at a
time; here Descartes' rule of signs in the Bernstein basis isolates the roots (bisecting where it
leaves a doubt), and safeguarded Newton iterations sharpen them, for all points together.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

__all__ = ["bernstein_from_power", "minimise_on_unit_interval"]

Array = NDArray[np.float64]

_TOLERANCE = 1e-12  # of a root, in units of the interval; Newton has then converged to rounding
_DEEPEST = 32  # bisections; only roots this close (2**-32) to double ones are left unseparated


def bernstein_from_power(degree: int) -> Array:
    """Matrix (degree + 1, degree + 1) that takes power coefficients to Bernstein coefficients.

    Both are in ascending order: sum_k c_k u^k = sum_k b_k binom(n, k) u^k (1 - u)^(n - k).
    """
    n = range(degree + 1)
    return np.array([[comb(j, k) / comb(degree, k) for k in n] for j in n], dtype=float)


def _halving(degree: int) -> Array:
    """Matrix (n, n) of de Casteljau's rule: Bernstein coefficients on [0, 1/2] from [0, 1]."""
    n = range(degree + 1)
    return np.array([[comb(j, k) / 2.0**j for k in n] for j in n], dtype=float)


_POWER = {n: np.linalg.inv(bernstein_from_power(n)) for n in range(1, 8)}
_LEFT = {n: _halving(n) for n in range(1, 8)}
_RIGHT = {n: np.ascontiguousarray(_LEFT[n][::-1, ::-1]) for n in range(1, 8)}


def minimise_on_unit_interval(bernstein: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Where on [0, 1] the antiderivative of each polynomial is smallest.

    Parameters
    ----------
    bernstein : (n + 1, m) array
        Bernstein coefficients (ascending) of m polynomials f of degree n, 1 <= n <= 7.

    Returns
    -------
    u : (m,) array
        Global minimiser over [0, 1] of g(u), g' = f. A polynomial with NaN gets 1.
    stationary : (m,) bool array
        True where u is a root of f (from - to +), False where it is an end of the interval.
    """
    return _minimise(bernstein, 0)


def _minimise(b: Array, depth: int) -> tuple[Array, NDArray[np.bool_]]:
    degree = b.shape[0] - 1
    positive = b > 0.0
    # Counting a zero as negative never lowers the number of sign changes, so the bound holds.
    changes = np.count_nonzero(positive[1:] != positive[:-1], axis=0)
    first, last = positive[0], positive[-1]
    u = np.where(first, 0.0, 1.0)  # right when f has one sign
    rises = (changes == 1) & last
    falls = (changes == 1) & first
    if depth >= _DEEPEST:
        falls |= changes > 1
    else:
        hard = np.flatnonzero(changes > 1)
    stationary = rises.copy()
    if rises.any():
        u[rises] = _rising_root(_POWER[degree] @ (b if rises.all() else b[:, rises]))
    if falls.any():  # a maximum inside: g(1) - g(0) is the mean of the Bernstein coefficients
        u[falls] = np.where(b[:, falls].sum(axis=0) < 0.0, 1.0, 0.0)
    if depth < _DEEPEST and hard.size:
        u[hard], stationary[hard] = _split(b[:, hard], depth)
    return u, stationary


def _split(b: Array, depth: int) -> tuple[Array, NDArray[np.bool_]]:
    """Minimise on both halves and keep the better one."""
    degree = b.shape[0] - 1
    left, left_stationary = _minimise(_LEFT[degree] @ b, depth + 1)
    right, right_stationary = _minimise(_RIGHT[degree] @ b, depth + 1)
    left, right = 0.5 * left, 0.5 + 0.5 * right
    power = (_POWER[degree] @ b) / np.arange(1.0, degree + 2.0)[:, None]
    excess = _horner(power, right) * right - _horner(power, left) * left
    # The common end of the halves, when it ties with a root next to it, must not win by rounding.
    bonus = 1e-12 * np.abs(b).max(axis=0)
    excess += bonus * left_stationary - bonus * right_stationary
    take_right = excess < 0.0
    return (
        np.where(take_right, right, left),
        np.where(take_right, right_stationary, left_stationary),
    )


def _horner(power: Array, u: Array) -> Array:
    value = power[-1].copy()
    for c in power[-2::-1]:
        value *= u
        value += c
    return value


def _rising_root(power: Array) -> Array:
    """The root in [0, 1] of each f with f(0) <= 0 < f(1) and one root; power (n + 1, m) -> (m,).

    Newton's step is taken while it stays in the bracket and at least halves the one before;
    otherwise the bracket is bisected, so that it always ends. Finished roots leave the batch.
    """
    size = power.shape[1]
    result = np.empty(size)
    index = np.arange(size)
    low, high, previous = np.zeros(size), np.ones(size), np.ones(size)
    start, end = power[0], power.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u = np.clip(start / (start - end), 0.0, 1.0)
        while index.size:
            value, slope = power[-1].copy(), np.zeros(index.size)
            for c in power[-2::-1]:
                slope *= u
                slope += value
                value *= u
                value += c
            below = value <= 0.0
            low, high = np.where(below, u, low), np.where(below, high, u)
            newton = u - value / slope
            step = np.abs(newton - u)
            rising = slope > 0.0  # f(0) may be 0 without the rising root being there
            good = rising & (newton >= low) & (newton <= high) & (step <= 0.5 * previous)
            tiny = rising & (step <= _TOLERANCE)
            u = np.where(good | tiny, newton, 0.5 * (low + high))
            previous = np.where(good, step, high - low)
            # written so that a NaN, which no bracket can hold, also ends
            busy = ~tiny & (high - low > _TOLERANCE)
            if not busy.all():
                result[index[~busy]] = np.clip(u[~busy], 0.0, 1.0)
                index, power, u = index[busy], power[:, busy], u[busy]
                low, high, previous = low[busy], high[busy], previous[busy]
    return result
