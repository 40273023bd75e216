"""The damping term and the block matrix against Taylor's theorem and dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.proximal import ProximalTerm
from avneo_fem.constraints.term import block_diagonal

RNG = np.random.default_rng(3)
CENTRE, POINTS = RNG.normal(size=(5, 3)), RNG.normal(size=(5, 3))
AREAS = RNG.uniform(0.5, 2.0, 5)


def test_energy_by_hand() -> None:
    """Truth: mu/2 S |x - c|^2 for one node: 4/2 * 3 * (1 + 4 + 4)."""
    term = ProximalTerm(np.zeros((1, 3)), np.array([3.0]), 4.0)
    point = np.array([[1.0, 2.0, -2.0]])
    assert term.energy(point) == 54.0
    assert term.gradient(point).tolist() == [[12.0, 24.0, -24.0]]


def test_quadratic_exactly() -> None:
    """Truth: a quadratic equals its second-order Taylor polynomial, for any step."""
    term = ProximalTerm(CENTRE, AREAS, 0.7)
    for size in (1e-3, 1.0, 1e3):
        step = size * RNG.normal(size=POINTS.shape)
        change = (term.hessian(POINTS) @ step.ravel()).reshape(-1, 3)
        expected = np.vdot(term.gradient(POINTS), step) + np.vdot(step, change) / 2
        found = term.energy(POINTS + step) - term.energy(POINTS)
        assert found == pytest.approx(expected, rel=1e-9)
        found_change = term.gradient(POINTS + step) - term.gradient(POINTS)
        assert found_change == pytest.approx(change, rel=1e-9, abs=1e-14)


def test_least_at_the_centre_and_positive_definite() -> None:
    """Truth: energy and force vanish at c; the smallest stiffness is mu min S."""
    term = ProximalTerm(CENTRE, AREAS, 0.7)
    assert term.energy(CENTRE) == 0.0
    assert not term.gradient(CENTRE).any()
    eigenvalues = np.linalg.eigvalsh(term.hessian(POINTS).toarray())
    assert eigenvalues[0] == pytest.approx(0.7 * AREAS.min(), rel=1e-13)
    assert eigenvalues[-1] == pytest.approx(0.7 * AREAS.max(), rel=1e-13)


def test_translation_and_rotation() -> None:
    """Truth: moving points and centre together changes nothing but the direction of the force."""
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    shift = np.array([10.0, -4.0, 7.0])
    one = ProximalTerm(CENTRE, AREAS, 0.7)
    two = ProximalTerm(CENTRE @ turn.T + shift, AREAS, 0.7)
    moved = POINTS @ turn.T + shift
    assert two.energy(moved) == pytest.approx(one.energy(POINTS), rel=1e-12)
    assert two.gradient(moved) == pytest.approx(one.gradient(POINTS) @ turn.T, abs=1e-12)


def test_block_diagonal() -> None:
    """Truth: the dense matrix with the blocks on its diagonal, none of them transposed."""
    blocks = RNG.normal(size=(4, 3, 3))
    dense = np.zeros((12, 12))
    for n, block in enumerate(blocks):
        dense[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = block
    assert np.array_equal(block_diagonal(blocks).toarray(), dense)
