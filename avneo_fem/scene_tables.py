"""Tables of the scene that describe the valve: root, commissures, cusps and their stitching.

Units are mm, kPa and mN; angles that people write are in degrees. Symbols of the paper stand
beside the names; a unit in brackets in a description ends up in docs/scene.md.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = [
    "Commissures",
    "Competence",
    "Cusp",
    "Finite",
    "NonNegative",
    "Positive",
    "Root",
    "Stitching",
    "SutureLine",
    "Table",
    "Template",
]

#: Numbers a scene is made of; none of them may be infinite or not a number.
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Table(BaseModel):
    """A TOML table: unknown keys are errors, values are not coerced from text, immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Root(Table):
    """Aortic root: an ideal cylinder about the z axis (paper §4.1)."""

    radius: Positive = Field(12.0, description="R, inner radius of the root [mm]")


class Commissures(Table):
    """Where the three commissures lie on the rim of the root (paper §4.1)."""

    chord_ratio: tuple[Positive, Positive, Positive] = Field(
        (1.0, 1.0, 1.0), description="a_0 : a_1 : a_2, sides of the triangle A_0 A_1 A_2"
    )
    gap: NonNegative = Field(
        0.5,
        description="distance along the wall between neighbouring suture-line ends [mm]; paper §3.1"
        " asks for at least (H_i + H_j)/2, a smaller gap is allowed",
    )


class Template(Table):
    """Flat four-parameter cusp template (paper Fig. 7c)."""

    free_edge_length: Positive = Field(39.0, description="L_f, distance between the corners [mm]")
    free_edge_height: Finite = Field(
        2.5, description="H_f, apex of the free edge above the corners [mm]"
    )
    corner_height: Positive = Field(
        11.5, description="H_i, corners above the centre of the belly arc [mm]"
    )
    belly_radius: Positive = Field(16.5, description="R_s, radius of the belly arc [mm]")
    thickness: Positive = Field(0.5, description="H, thickness of the pericardium [mm]")


class SutureLine(Table):
    """Aortic suture line (ASL), unfolded (paper Fig. 7a, 7b)."""

    type: Literal["A", "B"] = Field("A", description="A: half ellipse; B: skewed (Fig. 7b)")
    commissure_height: Positive = Field(
        2.5, description="H_c, height of the straight parts at the commissures [mm]"
    )
    belly_depth: Positive = Field(10.0, description="H_b, depth of the curved part below them [mm]")
    skew: Annotated[float, Field(gt=0.5, lt=1.0, allow_inf_nan=False)] = Field(
        0.8, description="a_s, type B: horizontal semi-axis as a share of the width"
    )
    ellipse_end_degrees: Annotated[float, Field(gt=90.0, lt=180.0, allow_inf_nan=False)] = Field(
        135.0,
        description="theta_D, type B: where the ellipse hands over to the Bezier curve [degrees]",
    )


class Cusp(Table):
    """One cusp: its template and the line it is sutured to."""

    template: Template = Field(default_factory=Template)
    suture_line: SutureLine = Field(default_factory=SutureLine)


class Stitching(Table):
    """Suture map between template and annulus (paper §3.2)."""

    gather_ratio: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = Field(
        3.0, description="alpha_sl, stitch spacing on the cusp over that on the annulus, mid-line"
    )


class Competence(Table):
    """When a set of cusps is called competent (paper §3.4, step 1)."""

    minimum_nu: Annotated[float, Field(gt=0.0, lt=1.0, allow_inf_nan=False)] = Field(
        0.5, description="nu_min: below it the cusps are too large for the root"
    )
    maximum_nu: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = Field(
        1.05, description="nu_max: above it the valve cannot close"
    )
    policy: Literal["warn", "error"] = Field(
        "warn", description="what to do when the verdict is 'not competent'"
    )
