"""Small deflections: one linear solve with the tangent of the flat shell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from solving import Problem

__all__ = ["follower_load", "respond"]

Floats = NDArray[np.float64]


def respond(problem: Problem, load: Floats) -> Floats:
    """(size,) linear change of the state under ``load`` (size,), moments and forces as in
    ``CuspSystem.dead_load``. Bending and stretching of a flat plate do not feel each other, so
    that the in-plane positions are left out."""
    problem.hold(lambda places: np.ones(len(places), dtype=bool), (0, 1))
    free = problem.system.free
    tangent = problem.model.tangent(problem.state)[free][:, free].tocsc()
    response = np.zeros(problem.model.size)
    response[free] = splu(tangent).solve(load[free])
    return response


def follower_load(problem: Problem, pressure: float) -> Floats:
    """(size,) forces of a follower pressure [kPa] on the shell as it stands."""
    model = problem.model
    without = model.residual(problem.state)
    model.pressure, before = pressure, model.pressure
    load = without - model.residual(problem.state)
    model.pressure = before
    return np.asarray(load)
