"""Whether three cusps can close the valve, and what would make them (paper section 3.4, step 1).

The readings are those of design.md section 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.sizing import ROUNDING, LengthAdvice, length_advice
from avneo_fem.geometry.triple_contact import TripleContactPoint
from avneo_fem.scene_tables import Competence

__all__ = ["Verdict", "competence_verdict", "range_text"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Verdict:
    """Verdict on a valve: ``reason`` is one line, ``advice`` the lengths that would do."""

    competent: bool
    reason: str
    advice: LengthAdvice


def range_text(limits: tuple[float, float] | None, digits: int = 5, joint: str = " to ") -> str:
    """A range of lengths, both ends rounded inwards to ``digits``; "none" for None.

    A range too narrow for that is written in full.
    """
    if limits is None:
        return "none"
    low, high = limits
    unit = 10.0 ** (floor(log10(high)) + 1 - digits)
    inner = ceil(low / unit) * unit, floor(high / unit) * unit
    if inner[0] > inner[1]:
        return f"{low:.17g}{joint}{high:.17g}"
    return joint.join(f"{end:#.{digits}g}".rstrip(".") for end in inner)


def competence_verdict(
    triple: TripleContactPoint,
    plane: CommissurePlane,
    lengths: Array,
    contact: Array,
    limits: Competence,
) -> Verdict:
    """Verdict of paper section 3.4, step 1, the reason, and lengths that would do.

    Scaling all free edge lengths by a factor f divides nu* by f. In case 1 the point leaves the
    side A_j A_k when c_i comes down to |A_i K_i| / nu_i, that is when l_j and l_k both lose the
    difference.

    Parameters
    ----------
    lengths, contact : (3,) arrays
        l_i and c_i [mm].
    """
    nu = triple.nu_star
    advice = length_advice(plane, lengths, limits)
    reasons = []
    if triple.edge_index is not None:
        i = triple.edge_index
        j, k = sorted({0, 1, 2} - {i})
        excess = contact[i] - np.linalg.norm(plane.points[i] - triple.point) / nu
        reasons.append(
            f"(3.2) has no solution, the triple contact point lies on the side"
            f" A_{j}A_{k} (nu* = {nu:.4g}): cusp {i} is too small for cusps {j} and {k}, whose"
            f" free_edge_length would have to be shorter by {excess:.4g} mm each"
        )
    share = lengths / plane.chord_lengths
    if nu > limits.maximum_nu * (1.0 + ROUNDING):
        worst = _extreme("shortest", int(np.argmin(share)), lengths, plane)
        reasons.append(
            f"nu* = {nu:.4g} > {limits.maximum_nu:g}: the cusps are too small to close{worst}"
        )
    if nu < limits.minimum_nu * (1.0 - ROUNDING):
        worst = _extreme("longest", int(np.argmax(share)), lengths, plane)
        reasons.append(f"nu* = {nu:.4g} < {limits.minimum_nu:g}: the cusps are too large{worst}")
    if not reasons:
        return Verdict(
            True,
            f"the triple contact point lies inside the triangle of the commissures and nu* ="
            f" {nu:.4g} within [{limits.minimum_nu:g}, {limits.maximum_nu:g}]",
            advice,
        )
    return Verdict(False, f"{'; '.join(reasons)}; {_remedies(advice, nu, limits)}", advice)


def _extreme(word: str, cusp: int, lengths: Array, plane: CommissurePlane) -> str:
    """Which cusp is the shortest or longest for its chord; nothing if all are alike."""
    share = lengths / plane.chord_lengths
    if np.ptp(share) < 1e-4 * share.max():
        return ""
    return (
        f", {word} for its chord is cusp {cusp} with free_edge_length = {lengths[cusp]:.4g} mm ="
        f" {share[cusp]:.4g} a_{cusp}"
    )


def _remedies(advice: LengthAdvice, nu: float, limits: Competence) -> str:
    """The advice in words."""
    if advice.for_unit_nu is None:
        text = "no common factor helps"
    else:
        values = ", ".join(f"{x:.4g}" for x in advice.for_unit_nu)
        factors = range_text((nu / limits.maximum_nu, nu / limits.minimum_nu))
        text = (
            f"all free_edge_length times {nu:.4g} give nu* = 1 ({values} mm), times {factors} would"
            " do"
        )
    alone = [
        f"cusp {i} of {range_text(found)} mm"
        for i, found in enumerate(advice.alone)
        if found is not None
    ]
    return f"{text}; changed alone, {', or '.join(alone) if alone else 'no cusp'} would do"
