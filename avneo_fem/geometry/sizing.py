"""Which free-edge lengths close a valve: what Propositions 3.1 and 3.2 of the paper say of sizes.

Throughout, l_i is the free-edge length L_f of cusp i and a_i the chord that it spans; scaling all
l_i by a factor f moves the triple contact point nowhere and divides nu* by f.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.commissure import contact_lengths
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.triple_contact import triple_contact_point, triple_contact_points
from avneo_fem.scene_tables import Competence

__all__ = ["LengthAdvice", "closing_lengths", "competent", "length_advice"]

Array = NDArray[np.float64]

_J, _K = np.array([1, 2, 0]), np.array([2, 0, 1])
#: nu* computed to rounding is not held to its limits more closely than this, relative
ROUNDING = 1e-9
_SAMPLES, _HALVINGS = 1000, 40


def closing_lengths(plane: CommissurePlane) -> Array:
    """Shortest lengths l_i = alpha a_i (3,) [mm] that just close: nu* = 1.

    By Proposition 3.2 the triple contact point of lengths in proportion to the chords satisfies
    (3.2) and does not depend on alpha, so that alpha is nu* of l_i = a_i. It is 2/sqrt(3) for
    three equal chords and less for all others.
    """
    chords = plane.chord_lengths
    return triple_contact_point(plane.points, contact_lengths(chords)).nu_star * chords


def competent(plane: CommissurePlane, lengths: Array, limits: Competence) -> NDArray[np.bool_]:
    """Which of many sets of cusps close (paper section 3.4, step 1).

    Parameters
    ----------
    lengths : (m, 3) array
        l_i [mm] of each set.

    Returns
    -------
    (m,) bool
        Whether all c_i > 0, (3.2) has a solution and nu* is within its limits.
    """
    contact = (lengths[:, _J] + lengths[:, _K] - lengths) / 2.0
    found = contact.min(axis=1) > 0.0
    points = np.broadcast_to(plane.points, (int(found.sum()), 3, 3))
    _, nu, side = triple_contact_points(points, contact[found])
    low, high = limits.minimum_nu * (1.0 - ROUNDING), limits.maximum_nu * (1.0 + ROUNDING)
    found[found] = (side < 0) & (nu >= low) & (nu <= high)
    return found


@dataclass(frozen=True)
class LengthAdvice:
    """Free-edge lengths [mm] that make a valve competent.

    Attributes
    ----------
    for_unit_nu : tuple of 3 floats, or None
        In the present proportions: nu* = 1. None when (3.2) has no solution, which no common
        factor changes.
    together : tuple of 3 ranges, or None
        In the present proportions: nu* within its limits. A range is a pair (low, high).
    alone : tuple of 3 ranges or None
        For each cusp, the others kept: the range of competent lengths nearest to the present one;
        None where there is none.
    """

    for_unit_nu: tuple[float, ...] | None
    together: tuple[tuple[float, float], ...] | None
    alone: tuple[tuple[float, float] | None, ...]


def length_advice(plane: CommissurePlane, lengths: Array, limits: Competence) -> LengthAdvice:
    """Lengths that would make a valve competent, all in proportion or one cusp alone.

    Parameters
    ----------
    lengths : (3,) array
        Present l_i [mm], each shorter than the other two together.
    """
    triple = triple_contact_point(plane.points, contact_lengths(lengths))
    alone = tuple(_range_alone(plane, lengths, i, limits) for i in range(3))
    if triple.case == "edge":
        return LengthAdvice(None, None, alone)
    unit = [float(x) for x in triple.nu_star * lengths]
    together = tuple((x / limits.maximum_nu, x / limits.minimum_nu) for x in unit)
    return LengthAdvice(tuple(unit), together, alone)


def _range_alone(
    plane: CommissurePlane, lengths: Array, cusp: int, limits: Competence
) -> tuple[float, float] | None:
    """The nearest range of competent lengths of one cusp, by samples and halving.

    Ranges narrower than the samples' spacing, a thousandth of what is geometrically possible,
    may go unnoticed.
    """
    j, k = _J[cusp], _K[cusp]
    shortest, longest = abs(lengths[j] - lengths[k]), lengths[j] + lengths[k]
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    samples = np.sort(np.r_[shortest + share * (longest - shortest), lengths[cusp]])

    def closes(values: Array) -> NDArray[np.bool_]:
        sets = np.tile(lengths, (len(values), 1))
        sets[:, cusp] = values
        return competent(plane, sets, limits)

    good = closes(samples)
    if not good.any():
        return None
    nearest = np.flatnonzero(good)[np.argmin(np.abs(samples[good] - lengths[cusp]))]
    bad = np.flatnonzero(~good)
    before, after = bad[bad < nearest], bad[bad > nearest]
    first = before[-1] + 1 if before.size else 0
    last = after[0] - 1 if after.size else samples.size - 1
    inner = samples[[first, last]]
    outer = np.array(
        [
            samples[first - 1] if before.size else shortest,
            samples[last + 1] if after.size else longest,
        ]
    )
    for _ in range(_HALVINGS):
        middle = (inner + outer) / 2.0
        inside = closes(middle)
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    return float(inner[0]), float(inner[1])
