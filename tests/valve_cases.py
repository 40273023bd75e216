"""The paper's three experiments as scenes, for the tests that build whole valves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from avneo_fem.geometry.commissure import quasi_optimal_lengths
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import load_scene, parse_scene

DEMOS = Path(__file__).parents[1] / "demos"

GAMMA = (1.5, 1.0, 1.25)
SCENES: dict[int, dict[str, Any]] = {
    1: {},
    2: {
        "commissures": {"chord_ratio": [8.0, 9.0, 6.0]},
        "suture_line": {"type": "B"},
        "cusp": [
            {"template": {"free_edge_length": 39.0 * g, "belly_radius": 16.5 * g}} for g in GAMMA
        ],
    },
}


def build(data: dict[str, Any]) -> ValveGeometry:
    """Geometry of a scene given as nested dictionaries."""
    return ValveGeometry.from_scene(parse_scene(data))


def quasi_optimal(scale: float = 1.0) -> dict[str, Any]:
    """Experiment 3, or the same with all L_f scaled."""
    ratio = {"chord_ratio": [6.0, 4.0, 5.0]}
    sizes = [{"template": {"free_edge_length": x, "belly_radius": 9.0}} for x in (27.0, 20.0, 23.0)]
    lengths = scale * quasi_optimal_lengths(
        build({"commissures": ratio, "cusp": sizes}).commissures.chord_lengths
    )
    cusps = [
        {"template": {"free_edge_length": float(x), "belly_radius": float(11.0 * x / 26.0)}}
        for x in lengths
    ]
    return {"commissures": ratio, "cusp": cusps}


def experiment(number: int, source: str) -> ValveGeometry:
    """One of the paper's runs, from code or from its demo."""
    if source == "demo":
        return ValveGeometry.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))
    return build(SCENES[number] if number in SCENES else quasi_optimal())
