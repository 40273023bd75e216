"""Direct solves against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from avneo_fem.equilibrium.factorization import Factorization, FactorizationError


def matrix(seed: int, size: int = 40, symmetric: bool = False, shift: float = 0.0) -> sp.csr_matrix:
    """Random sparse, well-conditioned matrix with a full diagonal."""
    random = np.random.default_rng(seed)
    a = sp.random(size, size, 0.1, random_state=seed, data_rvs=random.standard_normal)
    a = a + sp.diags(random.choice([-2.0, 2.0], size) + shift)
    return (a + a.T).tocsr() if symmetric else a.tocsr()


@pytest.mark.parametrize("seed", range(5))
def test_unsymmetric_solution(seed: int) -> None:
    """Truth: numpy.linalg.solve; nothing is counted."""
    a = matrix(seed)
    right = np.random.default_rng(seed).normal(size=40)
    solver = Factorization(symmetric=False)
    assert solver.factorize(a) == 0
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(a.toarray(), right), rtol=1e-8)


@pytest.mark.parametrize("shift", [-8.0, -1.0, 0.0, 1.0, 8.0])
@pytest.mark.parametrize("seed", range(3))
def test_symmetric_solution_and_inertia(seed: int, shift: float) -> None:
    """Truth: numpy.linalg.solve, and the number of negative eigenvalues by eigvalsh."""
    a = matrix(seed, symmetric=True, shift=shift)
    right = np.random.default_rng(seed).normal(size=40)
    solver = Factorization(symmetric=True)
    assert solver.factorize(a) == np.sum(np.linalg.eigvalsh(a.toarray()) < 0)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(a.toarray(), right), rtol=1e-8)


def test_symmetric_part_is_used() -> None:
    """Truth: of an unsymmetric matrix the symmetric solver factorises (A + A^T)/2; the caller's
    matrix is not changed."""
    a = matrix(3)
    kept = a.copy()
    half = (a + a.T).toarray() / 2
    right = np.arange(40.0)
    solver = Factorization(symmetric=True)
    assert solver.factorize(a) == np.sum(np.linalg.eigvalsh(half) < 0)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(half, right), rtol=1e-8)
    assert (a != kept).nnz == 0


@pytest.mark.parametrize("symmetric", [True, False])
def test_sequence_with_changing_values_patterns_and_sizes(symmetric: bool) -> None:
    """Truth: every solve is numpy's, whether values, pattern or size changed since the last."""
    solver = Factorization(symmetric)
    same = matrix(1, symmetric=symmetric)
    sequence = [same, 3 * same, matrix(2, symmetric=symmetric), same, matrix(4, 25, symmetric)]
    for a in sequence:
        right = np.cos(np.arange(a.shape[0]))
        negative = solver.factorize(a)
        if symmetric:
            assert negative == np.sum(np.linalg.eigvalsh(a.toarray()) < 0)
        answer = np.linalg.solve(a.toarray(), right)
        np.testing.assert_allclose(solver.solve(right), answer, rtol=1e-8)
        np.testing.assert_allclose(solver.solve(2 * right), 2 * answer, rtol=1e-8)
    assert solver.count == len(sequence)


def singular() -> dict[str, sp.csr_matrix]:
    random = np.random.default_rng(0)
    thin = random.normal(size=(12, 7))
    path = sp.diags([-np.ones(19), np.r_[1, 2 * np.ones(18), 1], -np.ones(19)], [-1, 0, 1])
    return {
        "zero row": sp.csr_matrix(np.diag([1.0, 0.0, 2.0])),
        "free Laplacian": path.tocsr(),
        "rank 7 of 12": sp.csr_matrix(thin @ thin.T),
    }


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("name", ["zero row", "free Laplacian", "rank 7 of 12"])
def test_singular_is_refused(name: str, symmetric: bool) -> None:
    """Truth: matrices of deficient rank raise; the solver works again with the next matrix."""
    a = singular()[name]
    assert np.linalg.matrix_rank(a.toarray()) < a.shape[0]
    solver = Factorization(symmetric)
    with pytest.raises(FactorizationError):
        solver.factorize(a)
    regular = (a + sp.identity(a.shape[0])).tocsr()
    solver.factorize(regular)
    right = np.ones(a.shape[0])
    answer = np.linalg.solve(regular.toarray(), right)
    np.testing.assert_allclose(solver.solve(right), answer, rtol=1e-8)


def test_badly_scaled_but_regular_is_not_refused() -> None:
    """Truth: stiffnesses ten orders apart, as membrane and bending have, are no singularity."""
    scale = np.logspace(-5, 5, 40)
    a = sp.diags(scale) @ matrix(5, symmetric=True, shift=8.0) @ sp.diags(scale)
    solver = Factorization(symmetric=True)
    assert solver.factorize(a.tocsr()) == np.sum(
        np.linalg.eigvalsh(matrix(5, symmetric=True, shift=8.0).toarray()) < 0
    )
    right = a @ np.ones(40)
    np.testing.assert_allclose(solver.solve(right), np.ones(40), rtol=1e-6)


def test_a_discarded_factorization_frees_its_factors() -> None:
    """Truth: PETSc's objects do not wait for its own garbage collection, so that a sweep over
    many solves does not grow."""
    kept = Factorization(symmetric=True)
    kept.factorize(sp.csr_matrix(np.diag([2.0, 3.0])))
    solver = kept._solver
    assert solver.handle != 0
    del kept
    assert solver.handle == 0


@pytest.mark.parametrize("symmetric", [False, True])
def test_ordering_is_the_one_asked_for(symmetric: bool) -> None:
    """Truth: MUMPS says which ordering it used, INFOG(7); 0 is approximate minimum degree. (Set
    like its other controls it would be overwritten.)"""
    size = 900
    ones = np.ones(size)
    a = sp.diags([-ones[30:], -ones[1:], 4.1 * ones, -ones[1:], -ones[30:]], [-30, -1, 0, 1, 30])
    solver = Factorization(symmetric)
    solver.factorize(a.tocsr())
    assert solver._solver.getPC().getFactorMatrix().getMumpsInfog(7) == 0
