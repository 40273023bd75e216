"""The scene: everything a run needs, in one TOML file, checked by a schema.

Units are mm, kPa and mN; angles that people write are in degrees. Every entry has a default
except the ones a run is about (``template`` and ``suture_line`` lengths default to those of the
paper's Experiment 1). Symbols of the paper stand beside the names.
"""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from avneo_fem.errors import SceneError

__all__ = [
    "FIDELITIES",
    "Commissures",
    "Competence",
    "Contact",
    "Cusp",
    "FreeEdge",
    "Material",
    "Mesh",
    "Placement",
    "Root",
    "Scene",
    "Solver",
    "Stitching",
    "SutureLine",
    "Template",
    "Wall",
    "load_scene",
    "parse_scene",
]

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

#: Named bundles for ``--fidelity``: factor on ``mesh.size``.
FIDELITIES: dict[str, float] = {"draft": 2.0, "standard": 1.0, "fine": 0.7, "reference": 0.5}


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, values are not coerced from text, immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Root(_Table):
    """Aortic root: an ideal cylinder about the z axis (paper §4.1)."""

    radius: Positive = Field(12.0, description="R, inner radius of the root [mm]")


class Commissures(_Table):
    """Where the three commissures lie on the rim of the root (paper §4.1)."""

    chord_ratio: tuple[Positive, Positive, Positive] = Field(
        (1.0, 1.0, 1.0), description="a_0 : a_1 : a_2, sides of the triangle A_0 A_1 A_2"
    )
    gap: NonNegative = Field(
        0.5, description="distance along the wall between neighbouring suture-line ends [mm]"
    )


class Template(_Table):
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


class SutureLine(_Table):
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
        135.0, description="theta_D, type B: where the ellipse hands over to the Bezier curve"
    )


class Cusp(_Table):
    """One cusp: its template and the line it is sutured to."""

    template: Template = Field(default_factory=Template)
    suture_line: SutureLine = Field(default_factory=SutureLine)


class Stitching(_Table):
    """Suture map between template and annulus (paper §3.2)."""

    gather_ratio: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = Field(
        3.0, description="alpha_sl, stitch spacing on the cusp over that on the annulus, mid-line"
    )


class Competence(_Table):
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


class Material(_Table):
    """Hyperelastic material of the pericardium, Poisson ratio 0 (paper §1.1)."""

    model: Literal["neo_hookean", "st_venant_kirchhoff"] = Field(
        "neo_hookean", description="membrane energy; the paper's is st_venant_kirchhoff (1.3)"
    )
    young_modulus: Positive = Field(1000.0, description="E [kPa]")
    bending: bool = Field(True, description="Kirchhoff-Love bending (c^b of (1.7))")


class FreeEdge(_Table):
    """Force that keeps the free edge from sagging (paper (1.6))."""

    stiffness: NonNegative = Field(80.0, description="eta_1 [kPa]")
    width: Positive = Field(0.1, description="eta_2 [mm]")
    clearance: Finite = Field(0.0, description="d_0 = -eta_3 [mm]")


class Contact(_Table):
    """Contact wedge between the cusps (paper §3.3.2, (1.5))."""

    stiffness: Positive = Field(16.0, description="eta_1 at the start [kPa]")
    width: Positive = Field(0.1, description="eta_2 [mm]")
    clearance: NonNegative | None = Field(
        None, description="d_0 of the mid-surface [mm]; default half the thickness"
    )
    omega: Positive = Field(0.5, description="omega of (3.3a)")
    steps: Annotated[int, Field(ge=1)] = Field(10, description="number of lambda steps, 0 to 1")
    maximum_stiffness: Positive = Field(4096.0, description="eta_1 is not raised beyond [kPa]")


class Wall(_Table):
    """Contact with the wall of the root (paper §3.4 step 3, (1.5))."""

    stiffness: Positive = Field(8.0, description="eta_1 at the start [kPa]")
    width: Positive = Field(0.5, description="eta_2 [mm]")
    clearance: Finite | None = Field(
        None, description="d_0 of the mid-surface away from the suture [mm]; default H/2"
    )
    taper: NonNegative | None = Field(
        None, description="distance over which d_0 grows from the suture [mm]; default 5 H"
    )
    growth: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = Field(
        4.0, description="factor by which eta_1 is raised until the cusp is inside"
    )
    maximum_stiffness: Positive = Field(4096.0, description="eta_1 is not raised beyond [kPa]")


class Mesh(_Table):
    """Triangulation of the template."""

    size: Positive = Field(0.7, description="h, target edge length [mm]")


class Placement(_Table):
    """Where the flat template starts (paper §3.2, step 1)."""

    c0: NonNegative = Field(1.0, description="c^0, distance from the chord in units of R")
    c1: Positive = Field(0.1, description="c^1, increment of that distance")


class Solver(_Table):
    """Continuation and Newton iteration."""

    tolerance: Positive = Field(
        1e-8, description="final residual relative to the pressure load P x area"
    )
    path_tolerance: Positive = Field(
        1e-4, description="the same for the equilibria on the way"
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
    inside_tolerance: Positive = Field(
        0.05, description="wedge and wall may be short of their clearance by [mm]"
    )


class Scene(_Table):
    """A complete, resolved scene. Build it in code or with :func:`load_scene`.

    ``template`` and ``suture_line`` hold for all three cusps; ``cusp``, when given, lists three
    tables that override single entries of them.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")] = Field(
        "scene", description="names the output folder out/NAME"
    )
    diastolic_pressure: Positive = Field(8.0, description="P [kPa]")
    root: Root = Field(default_factory=Root)
    commissures: Commissures = Field(default_factory=Commissures)
    cusp: tuple[Cusp, Cusp, Cusp] = Field(default_factory=lambda: (Cusp(), Cusp(), Cusp()))
    stitching: Stitching = Field(default_factory=Stitching)
    competence: Competence = Field(default_factory=Competence)
    material: Material = Field(default_factory=Material)
    free_edge: FreeEdge = Field(default_factory=FreeEdge)
    contact: Contact = Field(default_factory=Contact)
    wall: Wall = Field(default_factory=Wall)
    mesh: Mesh = Field(default_factory=Mesh)
    placement: Placement = Field(default_factory=Placement)
    solver: Solver = Field(default_factory=Solver)
    reuse_congruent: bool = Field(
        True, description="solve congruent cusps once and rotate the result"
    )
    fidelity: Literal["draft", "standard", "fine", "reference"] = Field(
        "standard", description="quality bundle; multiplies mesh.size by 2, 1, 0.7, 0.5"
    )

    @property
    def mesh_size(self) -> float:
        """Target edge length after ``fidelity`` [mm]."""
        return self.mesh.size * FIDELITIES[self.fidelity]


def _known_keys(path: tuple[Any, ...]) -> list[str]:
    """Keys the schema knows at the table addressed by ``path``."""
    model: Any = Scene
    extra: list[str] = ["template", "suture_line"]
    for part in path:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part)
        annotation = Cusp if part == "cusp" else getattr(field, "annotation", None)
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return []
        model, extra = annotation, []
    return sorted([*model.model_fields, *extra])


def _scene_error(error: ValidationError) -> SceneError:
    """First schema violation as one line naming key, value and what would be valid."""
    first = error.errors()[0]
    location = tuple(first["loc"])
    key = ".".join(str(part) for part in location) or "scene"
    value = first.get("input")
    if first["type"] == "extra_forbidden":
        known = _known_keys(location[:-1])
        near = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(known)}"
        return SceneError(key, value, f"unknown key; {hint}")
    message = first["msg"][0].lower() + first["msg"][1:]
    return SceneError(key, value, message.replace("input should be", "must be"))


def _merge(base: dict[str, Any], override: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in override.items():
        old = merged.get(key)
        both = isinstance(old, dict) and isinstance(value, dict)
        merged[key] = _merge(old, value) if both else value  # type: ignore[arg-type]
    return merged


def _tuples(value: Any) -> Any:
    """TOML arrays as tuples: the schema is strict and its sequences are immutable."""
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def parse_scene(data: dict[str, Any]) -> Scene:
    """Validate a scene given as nested dictionaries (what a TOML file parses to).

    Raises
    ------
    SceneError
        For the first violation, with key, value and what would be valid.
    """
    data = dict(data)
    common = {key: data.pop(key) for key in ("template", "suture_line") if key in data}
    for key, table in common.items():
        if not isinstance(table, dict):
            raise SceneError(key, table, f"must be a table [{key}]")
    cusps = data.pop("cusp", [{}, {}, {}])
    if not isinstance(cusps, list | tuple) or len(cusps) != 3:
        raise SceneError("cusp", cusps, "must be exactly three [[cusp]] tables, cusp 0, 1, 2")
    for index, cusp in enumerate(cusps):
        if not isinstance(cusp, dict):
            raise SceneError(f"cusp.{index}", cusp, "must be a [[cusp]] table")
    data["cusp"] = [_merge(common, cusp) for cusp in cusps]
    try:
        # the common tables are validated on their own first: errors then name the key as written
        Cusp.model_validate(common)
        return Scene.model_validate(_tuples(data))
    except ValidationError as error:
        raise _scene_error(error) from None


def load_scene(path: str | Path, fidelity: str | None = None) -> Scene:
    """Read and validate a scene file.

    Raises
    ------
    SceneError
        When the file is missing, is not TOML or violates the schema.
    """
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError("scene file", str(path), f"cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError("scene file", str(path), f"is not valid TOML: {error}") from None
    data.setdefault("name", path.stem.replace("_", "-"))
    if fidelity is not None:
        data["fidelity"] = fidelity
    return parse_scene(data)
