"""Condition of the equations at a state: how many digits a linear solve there may cost."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, onenormest

from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.factorization import Factorization, FactorizationError

__all__ = ["condition_number"]

Floats = NDArray[np.float64]


def condition_number(system: CuspSystem, state: Floats) -> float:
    """Condition number of the undamped tangent's symmetric part, made 1 on its diagonal.

    Positions and angles have no common unit; scaled by its diagonal the matrix has none, and its
    condition does not depend on that of length. Estimated in the 1-norm (W. W. Hager, SIAM J. Sci.
    Stat. Comput. 5 (1984) 311; SciPy): seldom less than a third of the true one, never more.

    Parameters
    ----------
    system : CuspSystem
    state : (size,) array

    Returns
    -------
    float
        Infinite when the matrix cannot be factorised.
    """
    free = system.free
    tangent = system.tangent(state)[free][:, free]
    symmetric = 0.5 * (tangent + tangent.T)
    diagonal = np.abs(symmetric.diagonal())
    scale = sp.diags(1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
    scaled = (scale @ symmetric @ scale).tocsr()
    factorization = Factorization(symmetric=True)
    try:
        factorization.factorize(scaled)
    except FactorizationError:
        return np.inf

    def solve(right: Floats) -> Floats:
        return factorization.solve(right.ravel())

    inverse = LinearOperator(scaled.shape, matvec=solve, rmatvec=solve, dtype=float)
    # one column: with more the start is random, and a report would differ from the next
    return float(abs(scaled).sum(axis=0).max() * onenormest(inverse, t=1))
