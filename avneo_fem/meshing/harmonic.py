"""Harmonic extension of a displacement of the sutured edge: the predictor of the boundary path."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["harmonic_extension"]

Floats = NDArray[np.float64]


def harmonic_extension(mesh: CuspMesh, held: NDArray[np.int64], values: Floats) -> Floats:
    """Discrete harmonic functions with given values at the suture line (design.md §3).

    The free edge is left to its natural condition.

    Parameters
    ----------
    mesh : CuspMesh
    held : (k,) array
        Nodes where the values are given, among them the suture line.
    values : (k, d) array
        What to extend.

    Returns
    -------
    (n, d) array
        At all nodes; exactly ``values`` at ``held``.
    """
    corners = mesh.points[mesh.triangles]
    opposite = np.stack([corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3] for k in range(3)], 1)
    local = np.einsum("mid,mjd->mij", opposite, opposite) / (4 * mesh.cell_areas[:, None, None])
    rows = np.repeat(mesh.triangles, 3, axis=1).ravel()
    columns = np.tile(mesh.triangles, (1, 3)).ravel()
    count = len(mesh.points)
    stiffness = sp.csr_matrix((local.ravel(), (rows, columns)), shape=(count, count))
    inside = np.setdiff1d(np.arange(count), held)
    result = np.zeros((count, values.shape[1]))
    result[held] = values
    right = -stiffness[inside][:, held] @ values
    # spsolve drops the second axis of a single column
    result[inside] = spsolve(stiffness[inside][:, inside].tocsc(), right).reshape(right.shape)
    return result
