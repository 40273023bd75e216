"""Free-edge lengths that close a valve, against Proposition 3.2 and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.geometry.commissure import contact_lengths, quasi_optimal_lengths
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.sizing import closing_lengths, competent, length_advice
from avneo_fem.geometry.triple_contact import triple_contact_point
from avneo_fem.scene import Competence
from commissure_cases import random_triangles
from contact_wedge_cases import commissures

LIMITS = Competence()


def plane_of(ratio: tuple[float, ...]) -> CommissurePlane:
    return CommissurePlane(np.pad(commissures(ratio), ((0, 0), (0, 1))))


def nu_star(plane: CommissurePlane, lengths: np.ndarray) -> tuple[float, str]:
    found = triple_contact_point(plane.points, contact_lengths(lengths))
    return found.nu_star, found.case


def dilation(chords: np.ndarray) -> float:
    """Closed form of the alpha for which l = alpha a gives nu* = 1.

    The circles about A_i with radii x (s - a_i), s the half perimeter, meet in C (X(3513), Remark
    3.2): Tartaglia's volume of the flat tetrahedron A_0 A_1 A_2 C vanishes, a quadratic in x^2.
    """
    a, d = chords**2, (chords.sum() / 2.0 - chords) ** 2
    j, k = [1, 2, 0], [2, 0, 1]
    quadratic = np.sum(a * d * (d[j] + d[k] - d)) - np.sum(a * d[j] * d[k])
    linear = np.sum(a * d * (a[j] + a[k] - a))
    constant = -a.prod()
    # the smaller root, in the form that survives quadratic = 0 (equal chords)
    root = np.sqrt(max(linear**2 - 4.0 * quadratic * constant, 0.0))
    return float(np.sqrt(-2.0 * constant / (linear + root)))


@pytest.mark.parametrize("ratio", [(1, 1, 1), (6, 4, 5), (8, 9, 6), (5, 5, 9.5), (3, 9, 7)])
def test_closing_lengths_in_closed_form(ratio: tuple[float, ...]) -> None:
    """Truth: the dilation of X(3513) in closed form; those lengths give nu* = 1 and (3.2); equal
    chords need 2/sqrt(3), all others less (Proposition 3.2)."""
    plane = plane_of(ratio)
    found, chords = closing_lengths(plane), plane.chord_lengths
    np.testing.assert_allclose(found, dilation(chords) * chords, rtol=1e-12)
    assert nu_star(plane, found) == (pytest.approx(1.0, rel=1e-13), "interior")
    factor = found[0] / chords[0] * np.sqrt(3.0) / 2.0
    assert factor == pytest.approx(1.0, rel=1e-13) if ratio == (1, 1, 1) else factor < 1.0 - 1e-4


def test_proposition_3_2_on_random_commissures() -> None:
    """Truth: nu* = 1 for the closing lengths and nu* = alpha sqrt(3)/2 for the quasi-optimal ones,
    with alpha in closed form, for triangles of every shape."""
    for points in random_triangles(400, 21):
        plane = CommissurePlane(points)
        assert nu_star(plane, closing_lengths(plane))[0] == pytest.approx(1.0, rel=1e-12)
        nu, case = nu_star(plane, quasi_optimal_lengths(plane.chord_lengths))
        assert nu == pytest.approx(dilation(plane.chord_lengths) * np.sqrt(3.0) / 2.0, rel=1e-7)
        assert nu <= 1.0 + 1e-12
        assert case == "interior"


@pytest.mark.parametrize("unit", [1e-3, 7.0])
def test_sizes_scale_with_the_valve(unit: float) -> None:
    """Truth: there is no length in Propositions 3.1 and 3.2 but the valve's own."""
    plane, lengths = plane_of((8, 9, 6)), np.array([58.5, 39.0, 48.75])
    scaled = CommissurePlane(unit * plane.points)
    np.testing.assert_allclose(closing_lengths(scaled), unit * closing_lengths(plane), rtol=1e-12)
    one, other = (length_advice(p, u * lengths, LIMITS) for p, u in ((plane, 1.0), (scaled, unit)))
    assert other.for_unit_nu is one.for_unit_nu is None
    for a, b in zip(one.alone, other.alone, strict=True):
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert b == pytest.approx(unit * np.array(a), rel=1e-9)


def test_competent() -> None:
    """Truth: Proposition 3.1 one by one: the limits of nu*, case 1, and a contact length <= 0; the
    limits themselves are competent."""
    plane = plane_of((1, 1, 1))
    chord = plane.chord_lengths[0]
    nu_1 = 2.0 / np.sqrt(3.0) * chord
    sets = np.array(
        [
            [nu_1] * 3,
            [nu_1 / 1.05] * 3,
            [nu_1 / 1.051] * 3,
            [nu_1 / 0.5] * 3,
            [nu_1 / 0.499] * 3,
            [20.0, 39.0, 39.0],  # case 1
            [20.0, 39.0, 19.0],  # c_1 = 0
        ]
    )
    expected = [True, True, False, True, False, False, False]
    assert competent(plane, sets, LIMITS).tolist() == expected


def test_advice_together() -> None:
    """Truth: in proportion, nu* is what the advice says: 1, nu_max and nu_min."""
    plane, lengths = plane_of((6, 4, 5)), np.array([30.0, 24.0, 27.0])
    advice = length_advice(plane, lengths, LIMITS)
    assert advice.for_unit_nu is not None
    assert advice.together is not None
    np.testing.assert_allclose(np.array(advice.for_unit_nu) / lengths, advice.for_unit_nu[0] / 30.0)
    assert nu_star(plane, np.array(advice.for_unit_nu))[0] == pytest.approx(1.0, rel=1e-13)
    for end, limit in ((0, 1.05), (1, 0.5)):
        sizes = np.array([pair[end] for pair in advice.together])
        assert nu_star(plane, sizes)[0] == pytest.approx(limit, rel=1e-13)


@pytest.mark.parametrize(
    ("ratio", "lengths"),
    [
        ((1, 1, 1), (39.0, 39.0, 39.0)),
        ((8, 9, 6), (58.5, 39.0, 48.75)),  # Experiment 2, case 1
        ((6, 4, 5), (25.0, 17.0, 21.0)),  # a little too small
        ((1, 1, 1), (20.0, 23.0, 23.0)),
    ],
)
def test_advice_for_one_cusp(ratio: tuple[float, ...], lengths: tuple[float, ...]) -> None:
    """Truth: the ends of the range are competent, a hair beyond them is not, and no
    competent length lies between the range and the present one; None only where a scan finds none.
    """
    plane, present = plane_of(ratio), np.array(lengths)
    is_now = competent(plane, present[None], LIMITS)[0]

    def closes(i: int, values: list[float] | np.ndarray) -> np.ndarray:
        sizes = np.tile(present, (len(values), 1))
        sizes[:, i] = values
        return competent(plane, sizes, LIMITS)

    for i, found in enumerate(length_advice(plane, present, LIMITS).alone):
        j, k = (i + 1) % 3, (i + 2) % 3
        scan = np.linspace(abs(present[j] - present[k]), present[j] + present[k], 33337)
        good = scan[closes(i, scan)]
        if found is None:
            assert good.size == 0
            continue
        low, high = found
        assert closes(i, [low, high, low - 1e-6, high + 1e-6]).tolist() == [
            True,
            True,
            False,
            False,
        ]
        assert (low <= present[i] <= high) == is_now
        near = good[np.argmin(np.abs(good - present[i]))]
        assert low - 0.005 <= near <= high + 0.005
