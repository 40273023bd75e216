"""Stretch and stress of a deformed template, for pictures (not used by the solver)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError

__all__ = ["principal_stresses", "principal_stretches"]

Floats = NDArray[np.float64]


def principal_stretches(template: Floats, triangles: NDArray[np.int64], points: Floats) -> Floats:
    """(m, 2) principal stretches of every triangle, the larger first.

    Parameters
    ----------
    template : (n, 2) array
        Flat positions [mm].
    triangles : (m, 3) array
    points : (n, 3) array
        Current positions [mm].
    """
    flat = template[triangles]
    reference = np.stack([flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]], axis=2)
    place = points[triangles]
    current = np.stack([place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]], axis=2)
    gradient = current @ np.linalg.inv(reference)
    return np.linalg.svd(gradient, compute_uv=False)


def principal_stresses(stretches: Floats, model: str, young_modulus: float) -> Floats:
    """(m, 2) principal Cauchy stresses [kPa], lambda_i dpsi/dlambda_i for det F = 1.

    psi is that of ``mechanics.materials`` in principal stretches: E/4 (l1^2 + l2^2 - 2 - 2 ln l1
    l2) for ``neo_hookean``, E/8 ((l1^2 - 1)^2 + (l2^2 - 1)^2) for ``st_venant_kirchhoff``.

    Parameters
    ----------
    stretches : (m, 2) array
    model : str
        ``material.model`` of the scene.
    young_modulus : float
        E [kPa].

    Raises
    ------
    SceneError
        When there is no material of that name.
    """
    square = stretches**2
    if model == "neo_hookean":
        return young_modulus / 2 * (square - 1)
    if model == "st_venant_kirchhoff":
        return young_modulus / 2 * square * (square - 1)
    valid = "must be 'neo_hookean' or 'st_venant_kirchhoff'"
    raise SceneError("material.model", model, valid)
