"""Tables of the scene that describe the method: material, constraints, mesh and solver.

Units are mm, kPa and mN. Symbols of the paper stand beside the names; a unit in brackets in a
description ends up in docs/scene.md.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from avneo_fem.scene_tables import Finite, NonNegative, Positive, Table

__all__ = [
    "Clamp",
    "Contact",
    "ContactMethod",
    "FreeEdge",
    "Layers",
    "Material",
    "Mesh",
    "Placement",
    "Solver",
    "Wall",
]


#: Contact surfaces of the cusps: the paper's, those of its [5] and those of its [13, 14].
ContactMethod = Literal["bezier", "virtual_planes", "symmetry_planes"]


class Material(Table):
    """Hyperelastic material of the pericardium, Poisson ratio 0 (paper §1.1)."""

    model: Literal["neo_hookean", "st_venant_kirchhoff"] = Field(
        "neo_hookean", description="membrane energy; the paper's is st_venant_kirchhoff (1.3)"
    )
    young_modulus: Positive = Field(
        1000.0,
        description="E [kPa]; stiffnesses of free edge, contact, wall, clamp and layers that are"
        " not stated are their defaults times E / 1000 kPa",
    )
    bending: bool = Field(True, description="Kirchhoff-Love bending (c^b of (1.7))")


class FreeEdge(Table):
    """Force that keeps the free edge from sagging (paper (1.6))."""

    stiffness: NonNegative = Field(80.0, description="eta_1 [kPa]")
    width: Positive = Field(0.1, description="eta_2 [mm]")
    clearance: Finite = Field(0.0, description="d_0 = -eta_3 [mm]")


class Contact(Table):
    """Contact wedge between the cusps (paper §3.3.2, (1.5))."""

    method: ContactMethod = Field(
        "bezier",
        description="contact surfaces: the paper's curved ones, reached by lambda steps;"
        " half-planes through triple contact point and commissures (its [5]); the symmetry planes"
        " of equal cusps (its [13, 14]). Planes are there at once, without omega and steps",
    )
    stiffness: Positive = Field(16.0, description="eta_1 at the start [kPa]")
    width: Positive = Field(0.1, description="eta_2 [mm]")
    clearance: NonNegative | None = Field(
        None, description="d_0 of the mid-surface [mm]; default half the thickness"
    )
    omega: Positive = Field(0.5, description="omega of (3.3a)")
    steps: Annotated[int, Field(ge=1)] = Field(10, description="number of lambda steps, 0 to 1")
    maximum_stiffness: Positive = Field(1e6, description="eta_1 is not raised beyond [kPa]")


class Clamp(Table):
    """How firmly the sutured edge is held in its tangent half-plane (paper (3.1))."""

    stiffness: Positive = Field(1e4, description="k at the start [mN]")
    maximum_stiffness: Positive = Field(1e6, description="k is not raised beyond [mN]")
    tolerance_degrees: Positive = Field(
        5.0, description="rms angle between cusp and half-plane that is allowed [degrees]"
    )


class Wall(Table):
    """Contact with the wall of the root (paper §3.4 step 3, (1.5))."""

    stiffness: Positive = Field(
        64.0,
        description="eta_1 at the start [kPa]; with Table 1's 8 kPa a coarse cusp can slip behind"
        " its own sutured edge before the wall stops it",
    )
    width: Positive = Field(
        0.1, description="eta_2 [mm]; Table 1's 0.5 mm would push the clamped edge off the wall"
    )
    clearance: Finite | None = Field(
        None, description="d_0 of the mid-surface away from the suture [mm]; default H/2"
    )
    taper: NonNegative | None = Field(
        None,
        description="distance over which d_0 grows from the suture [mm]; default 5 H, at least 2 h",
    )
    growth: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = Field(
        10.0, description="factor at most by which eta_1 is raised until the cusp is inside"
    )
    maximum_stiffness: Positive = Field(1e6, description="eta_1 is not raised beyond [kPa]")


class Layers(Table):
    """How near the layers of one cusp, which never cross, may come to each other."""

    clearance: NonNegative | None = Field(
        None,
        description="distance that layers keep away from the suture [mm]; 0 asks only that they do"
        " not cross, default half the thickness",
    )
    unrestricted: NonNegative | None = Field(
        None,
        description="distance from the suture in the template within which they may come nearer,"
        " since the gather leaves no room [mm]; default 4 H",
    )
    stiffness: Positive = Field(16.0, description="eta_1 at the start [kPa]")
    width: Positive = Field(0.1, description="eta_2 [mm]")
    maximum_stiffness: Positive = Field(1e6, description="eta_1 is not raised beyond [kPa]")


class Mesh(Table):
    """Triangulation of the template."""

    size: Positive = Field(0.7, description="h, target edge length [mm]")
    refinements: Annotated[int, Field(ge=0, le=8)] | None = Field(
        None,
        description="the cusp starts on a mesh of 2^refinements h, whose triangles are split into"
        " four that many times on the way; default as many as leave it at most R/4",
    )


class Placement(Table):
    """Where the flat template starts (paper §3.2, step 1)."""

    c0: NonNegative = Field(1.0, description="c^0, distance from the chord in units of R")
    c1: Positive = Field(0.1, description="c^1, increment of that distance")


class Solver(Table):
    """Continuation and Newton iteration."""

    quality: Literal["equilibrium", "approximate"] = Field(
        "equilibrium",
        description="equilibrium converges every level without ever crossing; approximate does so"
        " on the first mesh only, and then resolves collisions and takes a few damped iterations",
    )
    approximate_iterations: Annotated[int, Field(ge=1)] = Field(
        3, description="iterations a level of quality approximate, on refined meshes"
    )
    tolerance: Positive = Field(
        1e-8,
        description="final residual relative to the load: P x area, or, where that is more,"
        " 0.05 E H sqrt(area)",
    )
    path_tolerance: Positive = Field(
        1e-2,
        description="the same for the equilibria on the way; 1e-4 leads to the same end in twice"
        " the iterations",
    )
    boundary_steps: Annotated[int, Field(ge=1)] = Field(
        20, description="nominal steps of the sutured edge from template to suture line"
    )
    clamp_steps: Annotated[int, Field(ge=1)] = Field(
        5, description="nominal steps that turn the sutured edge into its tangent half-plane"
    )
    smallest_step: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        1.0 / 256.0, description="a nominal step may be divided down to this share of itself"
    )
    maximum_iterations: Annotated[int, Field(ge=1)] = Field(
        400, description="Newton iterations that one step of a stage may spend"
    )
    barrier_distance: Positive | None = Field(
        None, description="self-contact acts below it [mm]; default min(0.3 H, 0.2 h)"
    )
    barrier_stiffness: Positive = Field(
        0.05, description="self-contact stiffness in units of E H over barrier_distance squared"
    )
    inside_tolerance: Positive | None = Field(
        None,
        description="wedge and wall may be short of their clearance by [mm]; default 1 % of H, so"
        " that cusps are 0.98 H apart; of quality approximate: the mid-surface may lie outside"
        " wedge and root by [mm], default 10 % of H",
    )
