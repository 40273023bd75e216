"""Whether three cusps can close the valve (paper section 3.4, step 1; design.md section 1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.triple_contact import TripleContactPoint
from avneo_fem.scene import Competence

__all__ = ["competence_verdict"]

Array = NDArray[np.float64]


def competence_verdict(
    triple: TripleContactPoint, plane: CommissurePlane, contact: Array, limits: Competence
) -> tuple[bool, str]:
    """Verdict of paper section 3.4, step 1, and the reason in one sentence.

    Scaling all free edge lengths by a factor f divides nu* by f. In case 1 the point leaves the
    side A_j A_k when c_i comes down to |A_i K_i| / nu_i, that is when l_j and l_k both lose the
    difference.
    """
    nu = triple.nu_star
    reasons = []
    if triple.edge_index is not None:
        i = triple.edge_index
        j, k = sorted({0, 1, 2} - {i})
        excess = contact[i] - np.linalg.norm(plane.points[i] - triple.point) / nu
        reasons.append(
            f"(3.2) has no solution, the triple contact point lies on the side"
            f" A_{j}A_{k}: cusp {i} is too small for cusps {j} and {k}, whose"
            f" free_edge_length would have to be shorter by {excess:.4g} mm each"
        )
    if nu > limits.maximum_nu:
        reasons.append(f"nu* = {nu:.4g} > {limits.maximum_nu:g}: the cusps are too small to close")
    if nu < limits.minimum_nu:
        reasons.append(f"nu* = {nu:.4g} < {limits.minimum_nu:g}: the cusps are too large")
    if not reasons:
        return True, (
            f"the triple contact point lies inside the triangle of the commissures and nu* ="
            f" {nu:.4g} within [{limits.minimum_nu:g}, {limits.maximum_nu:g}]"
        )
    return False, f"{'; '.join(reasons)}; all free_edge_length times {nu:.4g} give nu* = 1"
