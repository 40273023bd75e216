"""Pareto front, dominated settings and the line of advice on rows whose answer is plain."""

from __future__ import annotations

from avneo_fem.tradeoff.advice import advice, dominated_settings, front, usable
from avneo_fem.tradeoff.settings import SECOND_PATH
from tradeoff_cases import errors, row

ROWS = [
    row("draft", 10.0, 0.5),
    row("standard", 80.0, 0.18),
    row("standard, approximate", 20.0, 0.3),
    row("slow", 90.0, 0.4),
    row("wrong", 1.0, 0.1, verdict="not verified"),
    row("crashed", 1.0, None, verdict="failed"),
    row("fine", 160.0, 0.1),
    row("reference", 600.0, 0.0),
    row(SECOND_PATH, 700.0, 0.2),
]
SCATTER = errors(0.2)


def test_front() -> None:
    """Truth: of verified settings, those that are nearer than all faster ones; the reference is
    at 0 by definition and has no part in it."""
    assert [r.name for r in usable(ROWS)] == [
        "draft",
        "standard",
        "standard, approximate",
        "slow",
        "fine",
    ]
    assert [r.name for r in front(ROWS)] == ["draft", "standard, approximate", "standard", "fine"]


def test_dominated() -> None:
    """Truth: slower and in no figure better; below the scatter there is no better."""
    assert dominated_settings(ROWS, None) == {"slow": "standard, approximate"}
    assert dominated_settings(ROWS, SCATTER) == {
        "slow": "standard, approximate",
        "fine": "standard",
    }
    belly = [row("a", 1.0, 0.3, belly_depth_mm=1.0), row("b", 2.0, 0.4, belly_depth_mm=0.9)]
    assert dominated_settings(belly, None) == {}
    assert dominated_settings(belly, errors(0.2, belly_depth_mm=1.1)) == {"b": "a"}


def test_dominated_within_the_spread() -> None:
    """Truth: a time within the spread of the timings is not faster; a single fold ranks nothing;
    a figure that one does not have counts against it."""
    pair = [row("a", 10.0, 0.3), row("b", 11.0, 0.4, spread=2.0)]
    assert dominated_settings(pair, None) == {}
    pair = [row("a", 10.0, 0.3, surface_largest_mm=9.0), row("b", 11.0, 0.4)]
    assert dominated_settings(pair, None) == {"b": "a"}
    pair = [row("a", 10.0, 0.3, contact_curve_mm=float("nan")), row("b", 11.0, 0.4)]
    assert dominated_settings(pair, None) == {}


def test_advice() -> None:
    """Truth: the fastest within the target; ratios of the times above."""
    assert advice(ROWS, SCATTER, 0.3) == (
        'for 0.3 mm use "standard, approximate" (0.30 mm in 20 s): 4.0x faster than standard, '
        "8.0x faster than fine, 30.0x faster than reference; equally fine solutions differ by "
        "0.20 mm, so less cannot be told apart"
    )
    assert advice(ROWS, SCATTER).startswith('for 0.2 mm use "standard" (0.18 mm in 80 s): 2.0x')
    assert advice(ROWS, errors(0.201)).startswith('for 0.3 mm use "standard, approximate"')
    assert advice(ROWS, SCATTER, 0.6).startswith('for 0.6 mm use "draft" (0.50 mm in 10 s): 8.0x')


def test_advice_that_cannot_be_given() -> None:
    """Truth: not below the scatter, not without reference or other settings; without a scatter it
    is said to be unknown, and where nothing is near enough the nearest is named."""
    assert advice(ROWS, SCATTER, 0.1).startswith("no advice for 0.1 mm: equally fine solutions")
    assert advice(ROWS[:-2], SCATTER).startswith("no advice: the reference was not verified")
    unverified = [*ROWS[:-2], row("reference", 600.0, 0.0, verdict="not verified")]
    assert advice(unverified, None).startswith("no advice: the reference was not verified")
    assert advice(ROWS[-2:], SCATTER) == "no advice: no other setting was verified"
    assert advice(ROWS, None).endswith("the scatter of equally fine solutions is not known")
    assert advice([ROWS[0], ROWS[-2]], SCATTER).startswith(
        'no setting is within 0.2 mm of the reference; the nearest is "draft" with 0.50 mm in 10 s'
    )
