"""Cases of the map that are about the shapes of cusps and root."""

from __future__ import annotations

from typing import Any

from avneo_fem.extremes.case import ExtremeCase
from avneo_fem.extremes.shaping import (
    BASE,
    chords_by_angles,
    of_thickness,
    proportioned,
    root_of,
)

__all__ = ["geometry_cases"]


def _ratio_cases() -> list[ExtremeCase]:
    """J_sl between its limits 1/alpha_sl = 1/3 and 1, and beyond them."""
    cases = []
    for ratio, alpha in (
        (0.335, 1.9),
        (0.4, 1.9),
        (0.6, 1.4),
        (0.8, 1.16),
        (0.9, 1.16),
        (0.97, 1.16),
        (0.995, 1.16),
    ):
        cases.append(
            ExtremeCase(
                f"j-{ratio:g}",
                "J_sl",
                f"{ratio:g}\nL_f {alpha:g} a",
                f"J_sl = {ratio:g} with L_f = {alpha:g} a, R_s = 11/26 L_f",
                proportioned(BASE, alpha, ratio),
            )
        )
    for ratio, alpha, why in (
        (0.32, 1.9, "more gathered than 3 : 1 everywhere"),
        (1.005, 1.16, "a cusp suture line shorter than the aortic one"),
    ):
        cases.append(
            ExtremeCase(
                f"j-{ratio:g}",
                "J_sl",
                f"{ratio:g}",
                f"J_sl = {ratio:g}, outside its limits",
                proportioned(BASE, alpha, ratio),
                infeasible=why,
                diagnosis=r"J_sl = .* must lie between 1/gather_ratio",
            )
        )
    return cases


def _size_cases() -> list[ExtremeCase]:
    """L_f / a from 1.0 to 2.8, at stitching ratios that the length allows."""
    cases = []
    for alpha, ratio in (
        (1.0, 0.9),
        (1.1, 0.75),
        (1.3, 0.65),
        (1.5, 0.6),
        (2.1, 0.5),
        (2.5, 0.42),
        (2.6, 0.41),
    ):
        cases.append(
            ExtremeCase(
                f"l-{alpha:g}",
                "L_f/a",
                f"{alpha:g}\nJ {ratio:g}",
                f"L_f = {alpha:g} a at J_sl = {ratio:g}, R_s = 11/26 L_f",
                proportioned(BASE, alpha, ratio),
            )
        )
    shape = proportioned(BASE, 2.8, 0.38)
    cases += [
        ExtremeCase(
            "l-2.8",
            "L_f/a",
            "2.8\nJ 0.38",
            "L_f = 2.8 a at J_sl = 0.38, R_s = 11/26 L_f",
            shape,
            infeasible="contact curves of 2.8 a / sqrt(3) turn so far that they meet the wall",
            diagnosis=r"the contact surface of cusp \d passes behind its suture line",
        ),
        ExtremeCase(
            "l-2.8-planes",
            "L_f/a",
            "2.8\nplanes",
            "the same with virtual planes as contact surfaces",
            {**shape, "contact.method": "virtual_planes"},
        ),
    ]
    for alpha, ratio, why in ((1.0, 0.9, "small to close"), (2.6, 0.41, "large")):
        cases.append(
            ExtremeCase(
                f"l-{alpha:g}-policy-error",
                "L_f/a",
                f"{alpha:g}\nerror",
                f'L_f = {alpha:g} a with competence.policy = "error"',
                {**proportioned(BASE, alpha, ratio), "competence.policy": "error"},
                infeasible=f"the cusps are too {why}, and the scene asks for an error then",
                diagnosis=rf"the cusps are too {why}",
            )
        )
    return cases


def _angle_cases() -> list[ExtremeCase]:
    """Angles of the triangle of commissures from 15 to 150 degrees."""
    cases = []
    for angles, alpha, ratio, size in (
        ((70.0, 60.0, 50.0), 1.5, 0.6, 1.5),
        ((90.0, 45.0, 45.0), 1.5, 0.6, 1.5),
        ((75.0, 75.0, 30.0), 1.5, 0.6, 1.3),
        ((110.0, 35.0, 35.0), 1.3, 0.7, 1.3),
        ((120.0, 30.0, 30.0), 1.1, 0.8, 1.0),
        ((82.5, 82.5, 15.0), 1.5, 0.7, 1.0),
    ):
        text = "-".join(f"{angle:g}" for angle in angles)
        entries = _with_depths({**BASE, "mesh.size": size}, angles)
        entries = proportioned(entries, alpha, ratio)
        cases.append(
            ExtremeCase(
                f"angles-{text}",
                "angles",
                text.replace("-", " "),
                f"commissure triangle of {text} degrees, cusps in proportion to their chords; H_b"
                " in proportion to the arc, at most 10 mm",
                entries,
                patience=2.0,
            )
        )
    large = (110.0, 35.0, 35.0)
    cases.append(
        ExtremeCase(
            "angles-110-35-35-large",
            "angles",
            "110 35 35\nL_f 1.5 a",
            "commissure triangle of 110-35-35 degrees, cusps of 1.5 chords",
            proportioned(_with_depths(dict(BASE), large), 1.5, 0.7),
            infeasible="the contact surface of a narrow cusp passes behind its own suture line",
            diagnosis=r"the contact surface of cusp \d passes behind its suture line",
        )
    )
    for angles, alpha in (((120.0, 30.0, 30.0), 1.3), ((150.0, 15.0, 15.0), 1.5)):
        text = "-".join(f"{angle:g}" for angle in angles)
        shape = _with_depths({**BASE, "mesh.size": 1.0}, angles)
        entries = proportioned(shape, alpha, 0.8)
        about = f"commissure triangle of {text} degrees"
        cases += [
            ExtremeCase(
                f"angles-{text}-large",
                "angles",
                text.replace("-", " ") + f"\nL_f {alpha:g} a",
                about,
                entries,
                infeasible="the curved contact surfaces of the two narrow cusps cross",
                diagnosis=r"the contact curves of cusp \d cross each other",
            ),
            ExtremeCase(
                f"angles-{text}-planes",
                "angles",
                text.replace("-", " ") + "\nplanes",
                f"{about}, with virtual planes as contact surfaces, which do not cross",
                {**entries, "contact.method": "virtual_planes"},
                patience=2.0,
            ),
        ]
    cases.append(
        ExtremeCase(
            "angles-flat",
            "angles",
            "1 : 1 : 2",
            "chords of 1 : 1 : 2, which form no triangle",
            {**BASE, "commissures.chord_ratio": [1.0, 1.0, 2.0]},
            infeasible="the commissures would lie on a line",
            diagnosis=r"chord_ratio = .* must form a triangle",
        )
    )
    return cases


def _with_depths(entries: dict[str, Any], angles: tuple[float, ...]) -> dict[str, Any]:
    """Chords of the angles; suture lines as deep as their share of the circumference allows."""
    depths = [min(10.0, 10.0 * angle / 60.0) for angle in angles]
    return {
        **entries,
        "commissures.chord_ratio": chords_by_angles(*angles),
        "cusp": [{"suture_line.belly_depth": depth} for depth in depths],
    }


def _root_cases() -> list[ExtremeCase]:
    """R from 2 to 40 mm, all of Experiment 1's lengths in proportion."""
    cases = []
    for radius, thickness in ((2.0, 0.08), (4.0, 0.16), (20.0, 0.8), (40.0, 1.6)):
        cases.append(
            ExtremeCase(
                f"r-{radius:g}",
                "R",
                f"{radius:g}\nH {thickness:g}",
                f"R = {radius:g} mm, all lengths of Experiment 1 in proportion, H = {thickness:g}"
                " mm; widths of the penalties as they are",
                {**root_of(radius), **of_thickness(thickness)},
            )
        )
    for radius, thickness, size in ((8.0, 0.5, 1.0), (20.0, 0.5, 2.0)):
        cases.append(
            ExtremeCase(
                f"r-{radius:g}-h-{thickness:g}",
                "R",
                f"{radius:g}\nH {thickness:g}",
                f"R = {radius:g} mm, all lengths in proportion but H = {thickness:g} mm",
                {**root_of(radius), **of_thickness(thickness), "mesh.size": size},
                patience=2.0,
            )
        )
    return cases


def _gap_cases() -> list[ExtremeCase]:
    """Gap between neighbouring suture lines, down to none."""
    cases = []
    for gap in (2.0, 0.25, 0.1, 0.02):
        about = f"gap = {gap:g} mm between neighbouring suture lines, H = 0.5 mm"
        entries = {**BASE, "commissures.gap": gap}
        cases.append(ExtremeCase(f"gap-{gap:g}", "gap", f"{gap:g}", about, entries))
    cases += [
        ExtremeCase(
            "gap-0",
            "gap",
            "0",
            "no gap: neighbouring cusps share a straight part of their suture lines",
            {**BASE, "commissures.gap": 0.0},
            infeasible="neighbouring cusps would be sewn to the same line",
            diagnosis=r"commissures\.gap = 0\.0: must be above 0",
        ),
        ExtremeCase(
            "gap-26",
            "gap",
            "26",
            "a gap wider than the arcs between commissures",
            {**BASE, "commissures.gap": 26.0},
            infeasible="no room for the suture lines",
            diagnosis=r"commissures\.gap = 26\.0: leaves no room",
        ),
    ]
    return cases


def _gather_cases() -> list[ExtremeCase]:
    """alpha_sl from 1.01 to 10."""
    cases = []
    for gather, shape in (
        (1.01, proportioned(BASE, 1.16, 0.995)),
        (1.2, proportioned(BASE, 1.16, 0.9)),
        (1.5, proportioned(BASE, 1.3, 0.75)),
        (2.0, dict(BASE)),
        (10.0, dict(BASE)),
    ):
        cases.append(
            ExtremeCase(
                f"gather-{gather:g}",
                "alpha_sl",
                f"{gather:g}",
                f"stitches {gather:g} times as far apart on the cusp as on the annulus"
                + ("; small cusps, J_sl near 1" if gather < 2.0 else ""),
                {**shape, "stitching.gather_ratio": gather},
            )
        )
    cases.append(
        ExtremeCase(
            "gather-1.5-large",
            "alpha_sl",
            "1.5\nJ 0.53",
            "cusps gathered more than alpha_sl = 1.5 allows",
            {**BASE, "stitching.gather_ratio": 1.5},
            infeasible="J_sl = 0.53 < 1/1.5",
            diagnosis=r"J_sl = .* must lie between 1/gather_ratio",
        )
    )
    return cases


def _template_cases() -> list[ExtremeCase]:
    """Templates close to those that do not exist, and beyond."""
    cases = [
        ExtremeCase(f"template-{name}", "template", label, about, {**BASE, **entries})
        for name, label, about, entries in (
            (
                "low-edge",
                "H_f -9",
                "a free edge cut 9 mm below its corners",
                {"template.free_edge_height": -9.0},
            ),
            (
                "high-edge",
                "H_f 12",
                "a free edge 12 mm above its corners",
                {"template.free_edge_height": 12.0},
            ),
            (
                "tangents-gone",
                "R_s .999 q",
                "corners that nearly touch the belly arc",
                {"template.belly_radius": 0.999 * (11.5**2 + 19.5**2) ** 0.5},
            ),
            (
                "corners-low",
                "H_i 0.05",
                "corners hardly above the centre of the belly arc",
                {"template.corner_height": 0.05},
            ),
            (
                "pointed-belly",
                "R_s 6",
                "a pointed belly of R_s = 6 mm",
                {"template.belly_radius": 6.0},
            ),
        )
    ]
    cases += [
        ExtremeCase(
            "template-collapsed",
            "template",
            "H_f -H_i",
            "a free edge through the centre of the belly arc",
            {**BASE, "template.free_edge_height": -11.5},
            infeasible="the template's boundary is not simple there by definition",
            diagnosis=r"template\.free_edge_height = -11\.5: .*H_f > -corner_height",
        ),
        ExtremeCase(
            "template-inside",
            "template",
            "R_s > q",
            "corners inside the belly arc",
            {**BASE, "template.belly_radius": 23.0},
            infeasible="there are no tangents from the corners to the arc",
            diagnosis=r"template\.belly_radius = 23\.0: the corners must lie outside",
        ),
    ]
    return cases


def geometry_cases() -> tuple[ExtremeCase, ...]:
    """All of them."""
    return (
        *_ratio_cases(),
        *_size_cases(),
        *_angle_cases(),
        *_root_cases(),
        *_gap_cases(),
        *_gather_cases(),
        *_template_cases(),
    )
