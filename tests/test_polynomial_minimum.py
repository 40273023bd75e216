"""Global minima on [0, 1] of batches of polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.polynomial_minimum import (
    bernstein_from_power,
    minimise_on_unit_interval,
)


def _antiderivative(power, u):
    return sum(c * u ** (k + 1) / (k + 1) for k, c in enumerate(power))


def _minimise(power):
    return minimise_on_unit_interval(bernstein_from_power(len(power) - 1) @ power)


def _reference(power):
    """Smallest antiderivative (m,) over the ends and all eigenvalue roots in [0, 1]."""
    best = np.minimum(0.0, _antiderivative(power, 1.0))
    for column in range(power.shape[1]):
        roots = np.roots(power[::-1, column])
        roots = np.clip(roots.real[np.abs(roots.imag) < 1e-6], 0.0, 1.0)
        if roots.size:
            best[column] = min(best[column], _antiderivative(power[:, column], roots).min())
    return best


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 6, 7])
def test_random_polynomials_against_companion_eigenvalues(degree):
    """Truth: the least value over all real roots from numpy.roots and the two ends."""
    rng = np.random.default_rng(degree)
    roots = rng.uniform(-0.3, 1.3, (degree, 600))
    power = np.stack([np.poly(r)[::-1] for r in roots.T], axis=1) * rng.choice([-1, 1], 600)
    power[:, ::3] = rng.normal(size=(degree + 1, 200))
    u, stationary = _minimise(power)
    scale = np.abs(power).sum(axis=0)
    assert u.min() >= 0.0
    assert u.max() <= 1.0
    assert np.all(np.abs(_antiderivative(power, u) - _reference(power)) <= 1e-13 * scale)
    value = sum(c * u**k for k, c in enumerate(power))
    assert np.all(np.abs(value[stationary]) <= 1e-11 * scale[stationary])
    assert np.all((u[~stationary] == 0.0) | (u[~stationary] == 1.0))


def test_power_to_bernstein_reproduces_values():
    """Truth: the definition of the Bernstein basis."""
    from math import comb

    rng = np.random.default_rng(0)
    power, u = rng.normal(size=(6, 40)), rng.random(40)
    b = bernstein_from_power(5) @ power
    value = sum(comb(5, k) * b[k] * u**k * (1 - u) ** (5 - k) for k in range(6))
    np.testing.assert_allclose(value, sum(c * u**k for k, c in enumerate(power)), atol=1e-13)


def test_close_roots_are_told_apart():
    """Truth: (u - a)(u - b)(u - c) with b - a down to 1e-7; minima at a and c, by construction."""
    gaps = np.geomspace(1e-7, 1e-1, 60)
    a, b, c = np.full(60, 0.3), 0.3 + gaps, np.full(60, 0.95)
    cubic = np.stack([-a * b * c, a * b + b * c + a * c, -(a + b + c), np.ones(60)])
    u, stationary = _minimise(cubic)
    assert stationary.all()
    np.testing.assert_allclose(u, 0.95, atol=1e-12)  # the deeper well for every gap
    mirrored = np.stack([np.poly([0.05, 0.7 - g, 0.7])[::-1] for g in gaps], axis=1)
    np.testing.assert_allclose(_minimise(mirrored)[0], 0.05, atol=1e-12)


def test_double_triple_and_quintuple_roots():
    """Truth: an odd-order root is the minimum; an even-order one is passed over."""
    for order, where in ((3, 1 / 3), (5, 0.6)):
        u, _ = _minimise(np.poly([where] * order)[::-1][:, None])
        assert abs(u[0] - where) < 10.0 ** (-14 / order)
    u, stationary = _minimise(np.poly([0.37, 0.37, 0.8])[::-1][:, None])
    assert stationary[0]
    assert abs(u[0] - 0.8) < 1e-12
    u, _ = _minimise(np.poly([0.37, 0.37])[::-1][:, None])  # f >= 0: smallest at 0
    assert u[0] == 0.0


def test_falling_root_at_the_very_start():
    """Truth: u (u - 1/2) has its minimum at 1/2, although 0 is a root as well (and so nearly)."""
    for shift in (0.0, 1e-18, -1e-18, 1e-15, -1e-15):
        for exact in (np.array([shift, -0.5, 1.0]), np.array([shift, 0.0, -0.5, 1.0])):
            u, stationary = _minimise(exact[:, None])
            assert stationary[0]
            assert abs(u[0] - 0.5) < 1e-12


def test_ends_and_degenerate_input():
    """Truth: f of one sign has its minimum at an end; leading zeros lower the degree only."""
    rows = np.array([[1.0, 0, 0], [-1.0, 0, 0], [-0.25, 1, 0], [0.3, -1, 0], [0.7, -1, 0]]).T
    u, stationary = _minimise(rows)
    np.testing.assert_allclose(u, [0.0, 1.0, 0.25, 1.0, 0.0], atol=1e-15)
    assert stationary.tolist() == [False, False, True, False, False]
    assert _minimise(np.zeros((6, 0)))[0].shape == (0,)
    u, _ = _minimise(np.full((6, 2), np.nan))
    assert u.shape == (2,)


def test_scale_and_reflection():
    """Truth: u does not depend on a positive factor, and u -> 1 - u under reflection."""
    rng = np.random.default_rng(5)
    b = rng.normal(size=(6, 2000))
    u, _ = minimise_on_unit_interval(b)
    np.testing.assert_allclose(minimise_on_unit_interval(1e-9 * b)[0], u, atol=1e-9)
    np.testing.assert_allclose(minimise_on_unit_interval(-b[::-1])[0], 1.0 - u, atol=1e-9)
