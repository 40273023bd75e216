"""What the equilibrium asks of a constraint term."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Term", "block_diagonal"]

Floats = NDArray[np.float64]


class Term(Protocol):
    """A conservative force on the nodes of one cusp."""

    def energy(self, points: Floats) -> float:
        """Energy [mN mm] at positions (n, 3)."""

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy [mN]."""

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) second derivative [mN/mm]."""


def block_diagonal(blocks: Floats) -> sp.bsr_matrix:
    """(3n, 3n) matrix of n blocks (n, 3, 3)."""
    count = len(blocks)
    return sp.bsr_matrix((blocks, np.arange(count), np.arange(count + 1)), shape=(3 * count,) * 2)
