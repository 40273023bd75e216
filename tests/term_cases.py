"""The check that every constraint term must pass: energy, gradient and Hessian belong together."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.term import Term
from shell_cases import taylor_orders


def check_derivatives(term: Term, points: np.ndarray, direction: np.ndarray) -> None:
    """Taylor remainders of energy and gradient are of order two; the Hessian is symmetric.

    Parameters
    ----------
    points, direction : (n, 3) arrays
        Where, and which way; the steps are 2^-5 ... 2^-8 of ``direction`` [mm].
    """
    slope = np.vdot(term.gradient(points), direction)
    hessian = term.hessian(points).toarray()
    change = (hessian @ direction.ravel()).reshape(-1, 3)
    for function, derivative in ((term.energy, slope), (term.gradient, change)):
        orders = taylor_orders(function, derivative, points, direction, 2.0**-5)
        assert orders == pytest.approx(2, abs=0.05)
    assert np.abs(hessian - hessian.T).max() < 1e-12 * np.abs(hessian).max()
