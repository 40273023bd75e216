"""What the equilibrium asks of a constraint term."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Foreseeing", "Foreseen", "Limiting", "Term", "block_diagonal"]

Floats = NDArray[np.float64]


class Term(Protocol):
    """A conservative force on the nodes of one cusp."""

    def energy(self, points: Floats) -> float:
        """Energy [mN mm] at positions (n, 3)."""

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy [mN]."""

    def hessian(self, points: Floats) -> sp.spmatrix:
        """(3n, 3n) second derivative [mN/mm]."""


@dataclass(frozen=True)
class Foreseen:
    """What changes in a term when what acts is what acts after a step.

    Attributes
    ----------
    switched : (k,) int array
        For each thing that can act: 1 where it begins to, -1 where it ceases to, else 0.
    gradient : (n, 3) array
        To be added to the term's gradient [mN].
    hessian : (3n, 3n) sparse matrix
        To be added to the term's Hessian [mN/mm].
    """

    switched: NDArray[np.int_]
    gradient: Floats
    hessian: sp.spmatrix


@runtime_checkable
class Foreseeing(Protocol):
    """A term that acts in places only, and can tell where it will after a step."""

    def foreseen(self, points: Floats, moves: Floats) -> Foreseen:
        """Change at positions (n, 3) when ``moves`` (n, 3) are taken; linearised distances."""


@runtime_checkable
class Limiting(Protocol):
    """A term whose meaning is lost when a step is too long."""

    def largest_share(self, points: Floats, moves: Floats) -> float:
        """Share of ``moves`` (n, 3) at positions (n, 3) that may be taken, 0..1."""


def block_diagonal(blocks: Floats) -> sp.bsr_matrix:
    """(3n, 3n) matrix of n blocks (n, 3, 3)."""
    count = len(blocks)
    return sp.bsr_matrix((blocks, np.arange(count), np.arange(count + 1)), shape=(3 * count,) * 2)
