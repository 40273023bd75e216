"""When the pressure is more than the sheet can carry."""

from __future__ import annotations

import re

import pytest

from avneo_fem.results.inflation import inflation, inflation_warning
from avneo_fem.scene import Scene, parse_scene, scaled_scene

THIN = {"cusp": [{"template": {"thickness": h}} for h in (0.5, 0.05, 0.5)]}


def test_strain_of_a_tube() -> None:
    """Truth: hoop stress P R / H over E; the thinnest cusp decides; units do not."""
    assert inflation(Scene()) == pytest.approx(8.0 * 12.0 / (1000.0 * 0.5))
    assert inflation(parse_scene(THIN)) == pytest.approx(1.92)
    scaled = parse_scene(scaled_scene(Scene(), 1e-3, 1e3))
    assert inflation(scaled) == pytest.approx(inflation(Scene()))


def test_what_would_do_does() -> None:
    """Truth: with either value that the warning names, there is none."""
    assert inflation_warning(Scene()) is None
    text = inflation_warning(parse_scene(THIN))
    assert text is not None
    assert text.startswith("P R / (E H) = 1.9:")
    pressure = float(re.findall(r"below ([\d.]+) kPa", text)[0])
    modulus = float(re.findall(r"above ([\d.]+) kPa", text)[0])
    for entries in (
        {"diastolic_pressure": 0.999 * pressure},
        {"material": {"young_modulus": 1.001 * modulus}},
    ):
        assert inflation_warning(parse_scene({**THIN, **entries})) is None
