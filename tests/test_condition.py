"""The condition number against NumPy's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from avneo_fem.equilibrium.condition import condition_number


class Matrix:
    """A system whose tangent is given."""

    def __init__(self, tangent: np.ndarray, free: np.ndarray) -> None:
        self._tangent, self.free = sp.csr_matrix(tangent), free

    def tangent(self, _state: Any) -> sp.csr_matrix:
        """The same everywhere."""
        return self._tangent


def estimated(tangent: np.ndarray, free: np.ndarray | None = None) -> float:
    """Of a dense matrix."""
    free = np.arange(len(tangent)) if free is None else free
    return condition_number(Matrix(tangent, free), np.empty(0))  # type: ignore[arg-type]


def random_matrix(seed: int, shift: float) -> np.ndarray:
    """Not symmetric; with negative eigenvalues where ``shift`` is small."""
    a = np.random.default_rng(seed).normal(size=(30, 30))
    return np.asarray(a @ a.T + shift * np.eye(30) + 0.1 * (a - a.T))


@pytest.mark.parametrize("shift", [-5.0, 0.1, 10.0])
@pytest.mark.parametrize("seed", range(4))
def test_against_numpy(seed: int, shift: float) -> None:
    """Truth: numpy.linalg.cond in the 1-norm of the symmetric part, scaled by its diagonal: the
    estimate is no more, and no less than a third."""
    a = random_matrix(seed, shift)
    symmetric = (a + a.T) / 2
    root = 1 / np.sqrt(np.abs(np.diag(symmetric)))
    exact = np.linalg.cond(root[:, None] * symmetric * root, 1)
    assert exact / 3 <= estimated(a) <= exact * (1 + 1e-9)


def test_units_and_held_unknowns() -> None:
    """Truth: other units of the unknowns scale rows and columns, and change nothing; nor does what
    belongs to unknowns that are held."""
    a = random_matrix(7, 0.5)
    units = np.where(np.arange(30) % 3 == 0, 1024.0, 2.0**-7)
    assert estimated(units[:, None] * a * units) == pytest.approx(estimated(a), rel=1e-9)
    larger = np.pad(a, (0, 5), constant_values=9.0)
    assert estimated(larger, np.arange(30)) == pytest.approx(estimated(a), rel=1e-12)


def test_singular() -> None:
    """Truth: the condition number of a singular matrix is infinite."""
    assert estimated(np.ones((4, 4))) == np.inf
    assert estimated(np.eye(3)) == pytest.approx(1.0)
