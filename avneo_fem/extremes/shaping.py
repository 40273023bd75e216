"""Templates and roots of given proportions, as scene entries by dotted key."""

from __future__ import annotations

import tomllib
from math import sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.extremes.case import ExtremeCase, flat, scene_text
from avneo_fem.geometry.commissure import commissure_angles
from avneo_fem.geometry.suture_line import AorticSutureLine
from avneo_fem.geometry.template import corner_height_for
from avneo_fem.geometry.valve_geometry import commissure_plane
from avneo_fem.scene import Scene, parse_scene, scaled_scene

__all__ = [
    "BASE",
    "chords_by_angles",
    "in_other_units",
    "of_thickness",
    "proportioned",
    "root_of",
    "scene_of_entries",
    "suture_line_lengths",
]

#: By how much clearances may be missed, in units of H. A triangle of h = 1.5 mm cuts h^2/8r = 0.1
#: mm into a surface of radius r = 3 mm; a quarter of Experiment 1's contact surface is as curved.
_SHORT = 0.2
#: Experiment 1, whose lengths are the schema's defaults, on a coarse mesh
BASE: dict[str, Any] = {"mesh.size": 1.5, "solver.inside_tolerance": _SHORT * 0.5}
#: R_s : L_f of the paper's experiments 3 and 4
_BELLY = 11.0 / 26.0


def scene_of_entries(entries: dict[str, Any]) -> Scene:
    """The scene of dotted entries, checked."""
    text = scene_text(ExtremeCase("shape", "", "", "", entries))
    return parse_scene(tomllib.loads(text))


def suture_line_lengths(scene: Scene) -> NDArray[np.float64]:
    """l_a of the three cusps [mm]."""
    radius, gap = scene.root.radius, scene.commissures.gap
    widths = 2.0 * radius * commissure_angles(scene.commissures.chord_ratio) - gap
    return np.array(
        [
            AorticSutureLine(radius, 0.0, float(width), cusp.suture_line).length
            for width, cusp in zip(widths, scene.cusp, strict=True)
        ]
    )


def proportioned(entries: dict[str, Any], alpha: float, ratio: float) -> dict[str, Any]:
    """Entries with cusps of L_f = alpha a_i and J_sl = ratio, for which H_i is found.

    The belly is R_s = 11/26 alpha times the breadth that it has to span: the chord, or the
    diameter of the root for a cusp that goes round more than half of it.

    Raises
    ------
    ValueError
        When no corner height gives that stitching ratio.
    """
    scene = scene_of_entries(entries)
    angles = commissure_angles(scene.commissures.chord_ratio)
    chords = commissure_plane(scene).chord_lengths
    breadth = np.where(angles > np.pi / 2, 2.0 * scene.root.radius, chords)
    lengths = suture_line_lengths(scene)
    cusps = []
    for i in range(3):
        sizes = {
            "free_edge_length": float(alpha * chords[i]),
            "belly_radius": float(_BELLY * alpha * breadth[i]),
        }
        template = scene.cusp[i].template.model_copy(update=sizes)
        height = corner_height_for(float(lengths[i]) / ratio, template)
        if height is None:
            raise ValueError(f"no corner height gives J_sl = {ratio} at L_f = {alpha} a")
        cusps.append(flat({"template": {**sizes, "corner_height": height}}))
    if "cusp" not in entries and np.ptp(chords) < 1e-9 * chords.max():
        return {**entries, **cusps[0]}
    old = entries.get("cusp", [{}, {}, {}])
    return {**entries, "cusp": [{**a, **b} for a, b in zip(old, cusps, strict=True)]}


def chords_by_angles(*degrees: float) -> list[float]:
    """Sides of the triangle A_0 A_1 A_2 with these three angles [degrees], which sum to 180."""
    return [sin(np.radians(angle)) for angle in degrees]


def of_thickness(thickness: float) -> dict[str, Any]:
    """H [mm], and clearances that may be missed by as much of it as in the base."""
    return {"template.thickness": thickness, "solver.inside_tolerance": _SHORT * thickness}


def root_of(radius: float) -> dict[str, Any]:
    """Root, template, suture line, gap and mesh of Experiment 1 in proportion to R [mm].

    The thickness, and the widths and clearances of the penalties, keep their defaults.
    """
    s = radius / 12.0
    scene = Scene()
    template, line = scene.cusp[0].template, scene.cusp[0].suture_line
    lengths = {
        "root.radius": scene.root.radius,
        "commissures.gap": scene.commissures.gap,
        "template.free_edge_length": template.free_edge_length,
        "template.free_edge_height": template.free_edge_height,
        "template.corner_height": template.corner_height,
        "template.belly_radius": template.belly_radius,
        "suture_line.commissure_height": line.commissure_height,
        "suture_line.belly_depth": line.belly_depth,
        "mesh.size": BASE["mesh.size"],
    }
    return {key: value * s for key, value in lengths.items()}


def in_other_units(entries: dict[str, Any], length: float, stress: float = 1.0) -> dict[str, Any]:
    """Entries with every length, stress and force stated in another unit."""
    data = scaled_scene(scene_of_entries(entries), length, stress)
    data.pop("name")
    return flat(data)
