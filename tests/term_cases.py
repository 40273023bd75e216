"""Checks that every constraint term must pass: energy, gradient and Hessian belong together."""

from __future__ import annotations

import numpy as np

from avneo_fem.constraints.term import Term

STEPS = 2.0 ** -np.arange(4, 9)


def taylor_orders(
    term: Term, points: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Orders of the remainders of energy and gradient after their linear parts; 2 when right.

    Parameters
    ----------
    points, direction : (n, 3) arrays
        Where, and which way; the steps are 2^-4 ... 2^-8 of ``direction`` [mm].
    """
    energy, gradient = term.energy(points), term.gradient(points)
    slope = np.vdot(gradient, direction)
    change = (term.hessian(points) @ direction.ravel()).reshape(-1, 3)
    of_energy, of_gradient = [], []
    for h in STEPS:
        moved = points + h * direction
        of_energy.append(abs(term.energy(moved) - energy - h * slope))
        of_gradient.append(np.linalg.norm(term.gradient(moved) - gradient - h * change))
    return tuple(-np.diff(np.log2(rest)) for rest in (of_energy, of_gradient))  # type: ignore[return-value]
