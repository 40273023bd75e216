"""All cases of the map, in the order of its rows.

What the base is and how lengths go along with each other is in ``extremes.shaping``; the cases
that are about geometry alone are in ``extremes.geometry_cases``.
"""

from __future__ import annotations

import re
from typing import Any

from avneo_fem.errors import SceneError
from avneo_fem.extremes.case import ExtremeCase
from avneo_fem.extremes.geometry_cases import geometry_cases
from avneo_fem.extremes.shaping import (
    BASE,
    in_other_units,
    of_thickness,
    proportioned,
)

__all__ = ["all_cases", "selected"]

#: a tube of radius R under P is strained by about P R / (E H) while that is small; 0.2 in the base
_INFLATION = "P R / (E H) = {:.2g}: the pressure stretches the membrane several times over"
_INFLATES = r"the pressure stretches the sheet several times over"


def _chord_cut(size: float, radius: float = 3.0) -> float:
    """How far an edge of length h cuts into a surface of radius r: h^2 / 8r [mm]."""
    return size**2 / (8.0 * radius)


def _bearable(thickness: float) -> float:
    """Pressure for which P R / (E H) = 1/2 in the base [kPa]."""
    return 0.5 * 1000.0 * thickness / 12.0


def _material_cases() -> list[ExtremeCase]:
    """E, P, bending, and what the membrane is made of."""
    cases = []
    for e, pressure in ((10.0, 0.08), (300.0, 8.0), (1e4, 8.0), (1e5, 8.0)):
        entries = {**BASE, "material.young_modulus": e, "diastolic_pressure": pressure}
        about = f"E = {e:g} kPa at P = {pressure:g} kPa"
        cases.append(ExtremeCase(f"e-{e:g}", "E", f"{e:g} kPa\nP {pressure:g}", about, entries))
    for e in (10.0, 100.0):
        strain = 8.0 * 12.0 / (e * 0.5)
        cases.append(
            ExtremeCase(
                f"e-{e:g}-full-pressure",
                "E",
                f"{e:g} kPa\nP 8",
                f"E = {e:g} kPa under the whole 8 kPa, P R / (E H) = {strain:.2g}",
                {**BASE, "material.young_modulus": e},
                infeasible=_INFLATION.format(strain) if strain > 10.0 else "",
                diagnosis=_INFLATES if strain > 10.0 else "",
            )
        )
    for pressure in (0.0, 0.01, 1.0, 16.0, 40.0):
        about = f"P = {pressure:g} kPa; E is 1000 kPa"
        entries = {**BASE, "diastolic_pressure": pressure}
        cases.append(ExtremeCase(f"p-{pressure:g}", "P", f"{pressure:g} kPa", about, entries))
    for name, label, about, entries in (
        ("bending-off", "off", "a membrane without bending", {"material.bending": False}),
        (
            "bending-off-svk",
            "off\nStVK",
            "a membrane without bending that softens in compression (1.3)",
            {"material.bending": False, "material.model": "st_venant_kirchhoff"},
        ),
        (
            "bending-on-svk",
            "on\nStVK",
            "the paper's material (1.3), which softens in compression",
            {"material.model": "st_venant_kirchhoff"},
        ),
        (
            "bending-off-thin",
            "off\nH 0.1",
            "a membrane of 0.1 mm, layers and cusps kept as far apart as those of 0.5 mm",
            {"material.bending": False, "template.thickness": 0.1, **_APART},
        ),
    ):
        cases.append(ExtremeCase(name, "bending", label, about, {**BASE, **entries}))
    return cases


#: the clearances that follow from H = 0.5 mm, stated
_APART: dict[str, Any] = {
    "contact.clearance": 0.25,
    "wall.clearance": 0.25,
    "wall.taper": 2.5,
    "layers.clearance": 0.25,
    "layers.unrestricted": 2.0,
    "solver.inside_tolerance": 0.1,
    "solver.barrier_distance": 0.15,
}


def _thickness_cases() -> list[ExtremeCase]:
    """H: thin sheets on finer meshes, thick ones as small cusps with a gap of H."""
    cases = []
    for h, size, is_long in ((0.05, 0.5, True), (0.1, 0.7, True), (0.2, 1.0, False)):
        cases.append(
            ExtremeCase(
                f"h-{h:g}",
                "H",
                f"{h:g}",
                f"H = {h:g} mm at h = {size:g} mm, whose chords cut into curved surfaces by less"
                " than H; P at most E H / 2R",
                {
                    **BASE,
                    **of_thickness(h),
                    "mesh.size": size,
                    "diastolic_pressure": min(8.0, _bearable(h)),
                },
                is_long=is_long,
                patience=2.0 if not is_long else 6.0,
            )
        )
    for h, pressure in ((0.05, _bearable(0.05)), (0.05, 8.0), (0.1, 8.0)):
        name, label = f"h-{h:g}-apart", f"{h:g}\napart"
        if pressure < 8.0:
            name, label = f"{name}-low-pressure", f"{label} P {pressure:.2g}"
        cases.append(
            ExtremeCase(
                name,
                "H",
                label,
                f"H = {h:g} mm, kept as far apart as cusps of 0.5 mm, P = {pressure:.3g} kPa",
                {
                    **BASE,
                    "template.thickness": h,
                    "diastolic_pressure": pressure,
                    **_APART,
                },
            )
        )
    cases.append(
        ExtremeCase(
            "h-0.8",
            "H",
            "0.8",
            "H = gap = 0.8 mm",
            {**BASE, **of_thickness(0.8), "commissures.gap": 0.8},
        )
    )
    for h in (1.0, 1.5, 2.0):
        shape = {**BASE, **of_thickness(h), "commissures.gap": h}
        cases.append(
            ExtremeCase(
                f"h-{h:g}",
                "H",
                f"{h:g}\nL_f 1.2 a",
                f"H = gap = {h:g} mm, cusps of L_f = 1.2 a and J_sl = 0.8",
                proportioned(shape, 1.2, 0.8),
            )
        )
    cases.append(
        ExtremeCase(
            "h-2-large",
            "H",
            "2\nL_f 1.9 a",
            "the large cusps of Experiment 1 from a sheet of 2 mm, gap = H",
            {**BASE, **of_thickness(2.0), "commissures.gap": 2.0},
        )
    )
    return cases


def _mesh_cases() -> list[ExtremeCase]:
    """h from 3 mm to 0.25 mm."""
    cases = []
    for size in (3.0, 2.5, 2.0):
        allowed = min(_chord_cut(size), 0.25)
        cases.append(
            ExtremeCase(
                f"mesh-{size:g}",
                "h",
                f"{size:g}",
                f"h = {size:g} mm; clearances may be missed by {allowed:.3f} mm, what a"
                " chord of that length cuts into a radius of 3 mm, or H/2",
                {
                    **BASE,
                    "mesh.size": size,
                    "solver.inside_tolerance": allowed,
                },
            )
        )
    cases.append(
        ExtremeCase(
            "mesh-3-strict",
            "h",
            "3\nto 1 % H",
            "h = 3 mm with the default tolerance of 1 % of H",
            {**BASE, "mesh.size": 3.0, "solver.inside_tolerance": 0.005},
        )
    )
    cases.append(
        ExtremeCase(
            "mesh-20",
            "h",
            "20",
            "h = 20 mm, a suture line of four pieces",
            {**BASE, "mesh.size": 20.0},
            infeasible="fewer than six pieces of suture line",
            diagnosis=r"mesh\.size = 20\.0: too large",
        )
    )
    for size, patience, is_long in (
        (1.4, 1.0, False),
        (1.0, 2.0, False),
        (0.7, 6.0, True),
        (0.5, 12.0, True),
        (0.25, 60.0, True),
    ):
        cases.append(
            ExtremeCase(
                f"mesh-{size:g}",
                "h",
                f"{size:g}\nto 1 % H",
                f"h = {size:g} mm{', one cusp' if is_long else ''}; default tolerance of 1 % of H",
                {"mesh.size": size},
                is_long=is_long,
                patience=patience,
                cusp=0 if is_long else None,
            )
        )
    return cases


def _step_cases() -> list[ExtremeCase]:
    """Steps of lambda, and contact surfaces without any."""
    cases = [
        ExtremeCase(
            f"lambda-{steps}",
            "lambda",
            f"step {1 / steps:g}",
            f"the contact wedge closes in {steps} steps of lambda",
            {**BASE, "contact.steps": steps},
            patience=2.0 if steps > 50 else 1.0,
        )
        for steps in (1, 100)
    ]
    for method in ("virtual_planes", "symmetry_planes"):
        cases.append(
            ExtremeCase(
                f"lambda-{method.replace('_', '-')}",
                "lambda",
                method.replace("_", "\n"),
                f"contact surfaces: {method}",
                {**BASE, "contact.method": method},
            )
        )
    return cases


def _unit_cases() -> list[ExtremeCase]:
    """The base in other units; the same valve must come out to 1e-8."""
    cases = []
    for name, label, length, stress in (
        ("1024", "x 2^10", 2.0**10, 1.0),
        ("1-1024", "x 2^-10", 2.0**-10, 1.0),
        ("metres", "m", 1e-3, 1.0),
        ("micrometres", "um", 1e3, 1.0),
        ("metres-pascals", "m, Pa", 1e-3, 1e3),
        ("stress-1024", "E, P x 2^10", 1.0, 2.0**10),
    ):
        cases.append(
            ExtremeCase(
                f"units-{name}",
                "units",
                label,
                f"the base with lengths x {length:g} and stresses x {stress:g}, every entry stated",
                in_other_units(BASE, length, stress),
                same_as="base",
                unit=length,
            )
        )
    return cases


def all_cases() -> tuple[ExtremeCase, ...]:
    """Every case; the base, which others are compared with, comes first."""
    base = ExtremeCase("base", "base", "base", "Experiment 1 at h = 1.5 mm", BASE)
    return (
        base,
        *_unit_cases(),
        *_thickness_cases(),
        *_material_cases(),
        *_mesh_cases(),
        *geometry_cases(),
        *_step_cases(),
    )


def selected(
    cases: tuple[ExtremeCase, ...], pattern: str = "", with_long: bool = False
) -> tuple[ExtremeCase, ...]:
    """Cases whose name or group matches a regular expression, with what they are compared with.

    Raises
    ------
    SceneError
        When the expression is none, or matches nothing.
    """
    try:
        wanted = re.compile(pattern)
    except re.error as error:
        raise SceneError("--only", pattern, f"must be a regular expression ({error})") from None
    chosen = {
        case.name
        for case in cases
        if (with_long or not case.is_long)
        and (wanted.search(case.name) or wanted.search(case.group))
    }
    if not chosen:
        groups = ", ".join(dict.fromkeys(case.group for case in cases))
        raise SceneError("--only", pattern, f"matches no case; groups: {groups}")
    chosen |= {case.same_as for case in cases if case.name in chosen and case.same_as}
    return tuple(case for case in cases if case.name in chosen)
