"""The suture map against the integrals of paper section 3.2, step 2."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from avneo_fem.errors import SceneError
from avneo_fem.geometry.stitching import StitchingMap


@st.composite
def maps(draw: st.DrawFn) -> StitchingMap:
    """Maps over the whole admissible range of J_sl."""
    alpha = draw(st.floats(1.05, 8.0))
    share = draw(st.floats(0.01, 0.99))
    length = draw(st.floats(1.0, 200.0))
    return StitchingMap(length, length * (1.0 / alpha + share * (1.0 - 1.0 / alpha)), alpha)


@settings(deadline=None)
@given(maps())
def test_density_is_normalised(stitching: StitchingMap) -> None:
    """Truth: the integral of rho over [0, 1] is 1, by quadrature between the jumps."""
    jumps = stitching.breaks / stitching.csl_length
    edges = [0.0, *jumps, 1.0]
    total = sum(quad(lambda x: float(stitching.density(x)), a, b)[0] for a, b in pairwise(edges))
    assert total == pytest.approx(1.0, rel=1e-10)


@settings(deadline=None)
@given(maps())
def test_density_values(stitching: StitchingMap) -> None:
    """Truth: rho(0) = rho(1) = 1/J and rho(1/2) = 1/(alpha J), jumping at the printed width."""
    ratio = stitching.asl_length / stitching.csl_length
    alpha = stitching.gather_ratio
    assert stitching.stitching_ratio == ratio
    outer, inner = 1.0 / ratio, 1.0 / (alpha * ratio)
    assert stitching.density([0.0, 0.5, 1.0]) == pytest.approx([outer, inner, outer], rel=1e-14)
    half_width = alpha * (1.0 - ratio) / (2.0 * (alpha - 1.0))
    assert stitching.breaks / stitching.csl_length == pytest.approx(
        [0.5 - half_width, 0.5 + half_width], abs=1e-12
    )
    inside = 0.5 + half_width * (1.0 - 1e-9) * np.array([-1.0, 1.0])
    outside = 0.5 + half_width * (1.0 + 1e-9) * np.array([-1.0, 1.0])
    assert stitching.density(inside) == pytest.approx([inner] * 2, rel=1e-14)
    assert stitching.density(outside) == pytest.approx([outer] * 2, rel=1e-14)


@settings(deadline=None)
@given(maps())
def test_map_ends_exactly_and_is_symmetric(stitching: StitchingMap) -> None:
    """Truth: gamma(0) = 0, gamma(l_c) = l_a to the bit; gamma(l_c - s) = l_a - gamma(s); rising."""
    l_c, l_a = stitching.csl_length, stitching.asl_length
    assert stitching.annulus_arc_length([0.0, l_c]).tolist() == [0.0, l_a]
    s = np.linspace(0.0, l_c, 301)
    gamma = stitching.annulus_arc_length(s)
    mirrored = stitching.annulus_arc_length(np.clip(l_c - s, 0.0, l_c))
    assert np.abs(mirrored - (l_a - gamma)).max() < 1e-12 * l_c
    assert np.all(np.diff(gamma) > 0.0)


@settings(deadline=None)
@given(maps())
def test_map_is_the_integral_of_the_density(stitching: StitchingMap) -> None:
    """Truth: gamma(s) = l_a int_0^(s/l_c) rho; midpoint sums between jumps are exact."""
    l_c, l_a = stitching.csl_length, stitching.asl_length
    s = np.unique(np.concatenate([np.linspace(0.0, l_c, 200), stitching.breaks]))
    density = stitching.density((s[:-1] + s[1:]) / (2.0 * l_c))
    integral = l_a / l_c * np.concatenate([[0.0], np.cumsum(density * np.diff(s))])
    assert np.abs(stitching.annulus_arc_length(s) - integral).max() < 1e-9 * l_c


def test_surgical_ratios() -> None:
    """Truth: stitches 3 : 1 about the middle, 1 : 1 near the ends (paper section 2), J = 1/2."""
    stitching = StitchingMap(80.0, 40.0, 3.0)
    assert stitching.breaks == pytest.approx([10.0, 70.0])
    assert stitching.annulus_arc_length([5.0, 10.0, 40.0, 70.0, 76.0]) == pytest.approx(
        [5.0, 10.0, 20.0, 30.0, 36.0]
    )


@pytest.mark.parametrize(
    ("l_c", "words"),
    [
        (40.0, "longer by more than 0 mm"),
        (35.0, "longer by more than 5 mm"),
        (120.0, "shorter by more than 0 mm"),
        (130.0, "shorter by more than 10 mm"),
    ],
)
def test_lengths_that_do_not_fit(l_c: float, words: str) -> None:
    """Truth: 1/alpha < J < 1 strictly; the error says by how much the CSL must change."""
    with pytest.raises(SceneError, match=words) as caught:
        StitchingMap(l_c, 40.0, 3.0, key="cusp.0.template")
    assert caught.value.key == "cusp.0.template"
    assert "between 40 and 120 mm" in caught.value.valid
    StitchingMap(40.0001, 40.0, 3.0)
    StitchingMap(119.9999, 40.0, 3.0)


def test_misuse_is_refused() -> None:
    """Truth: a gather ratio of one or less and arc lengths off the CSL are errors."""
    with pytest.raises(SceneError, match="gather_ratio"):
        StitchingMap(80.0, 40.0, 1.0)
    for wrong in (-0.1, 80.1, np.nan):
        with pytest.raises(ValueError, match="arc lengths"):
            StitchingMap(80.0, 40.0, 3.0).annulus_arc_length([wrong])


def test_inverse() -> None:
    """Truth: gamma of gamma^-1 is the identity; both ends stay."""
    stitching = StitchingMap(40.0, 25.0, 3.0)
    line = np.linspace(0.0, 25.0, 101)
    back = stitching.template_arc_length(line)
    np.testing.assert_allclose(stitching.annulus_arc_length(back), line, atol=1e-12)
    np.testing.assert_array_equal(back[[0, -1]], [0.0, 40.0])
