"""The scene as one immutable object: the tables and what holds for the whole run."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from avneo_fem.scene_fidelity import FIDELITIES, with_bundle
from avneo_fem.scene_method import (
    Clamp,
    Contact,
    FreeEdge,
    Layers,
    Material,
    Mesh,
    Placement,
    Solver,
    Wall,
)
from avneo_fem.scene_stiffness import with_stiffnesses
from avneo_fem.scene_tables import (
    Commissures,
    Competence,
    Cusp,
    NonNegative,
    Root,
    Stitching,
    Table,
)

__all__ = ["Scene"]


#: strain that the pressure on the way causes at least
_PATH_STRAIN = 0.1


class Scene(Table):
    """A complete, resolved scene. Build it in code or with :func:`avneo_fem.scene.load_scene`.

    ``template`` and ``suture_line`` hold for all three cusps; ``cusp``, when given, lists three
    tables that override single entries of them. Entries that are not given take the default of
    ``fidelity`` (:mod:`avneo_fem.scene_fidelity`), stiffnesses of penalties in proportion to E
    (:mod:`avneo_fem.scene_stiffness`), so a dumped scene states what was used and
    parses to itself; ``mesh.size`` stays as written, and :attr:`mesh_size` is what it comes to.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")] = Field(
        "scene",
        description="names the output folder out/NAME; a file without it is named after itself",
    )
    diastolic_pressure: NonNegative = Field(
        8.0,
        description="P [kPa]; where that hardly strains the cusp, 0.1 E H / R acts on the way and"
        " is let down to P at its end",
    )
    root: Root = Field(default_factory=Root)
    commissures: Commissures = Field(default_factory=Commissures)
    cusp: tuple[Cusp, Cusp, Cusp] = Field(default_factory=lambda: (Cusp(), Cusp(), Cusp()))
    stitching: Stitching = Field(default_factory=Stitching)
    competence: Competence = Field(default_factory=Competence)
    material: Material = Field(default_factory=Material)
    free_edge: FreeEdge = Field(default_factory=FreeEdge)
    contact: Contact = Field(default_factory=Contact)
    wall: Wall = Field(default_factory=Wall)
    clamp: Clamp = Field(default_factory=Clamp)
    layers: Layers = Field(default_factory=Layers)
    mesh: Mesh = Field(default_factory=Mesh)
    placement: Placement = Field(default_factory=Placement)
    solver: Solver = Field(default_factory=Solver)
    reuse_congruent: bool = Field(
        True, description="solve congruent cusps once and rotate the result"
    )
    fidelity: Literal["draft", "standard", "fine", "reference"] = Field(
        "standard", description="bundle of defaults, see above"
    )

    @model_validator(mode="before")
    @classmethod
    def _defaults_that_follow(cls, data: Any) -> Any:
        return with_stiffnesses(with_bundle(data)) if isinstance(data, dict) else data

    @property
    def mesh_size(self) -> float:
        """Target edge length after ``fidelity`` [mm]."""
        return self.mesh.size * FIDELITIES[self.fidelity].size_factor

    @property
    def refinements(self) -> int:
        """How often the first mesh is split on the way to ``mesh_size``."""
        chosen = self.mesh.refinements
        if chosen is not None:
            return chosen
        return max(0, int(np.floor(np.log2(self.root.radius / 4 / self.mesh_size))))

    def path_pressure(self, thickness: float) -> float:
        """Pressure on a cusp of this thickness until its first row is in place [kPa].

        P, but at least 0.1 E H / R, which strains the cusp by about 10 %: with less, nothing
        unfolds a cusp whose edge turns.
        """
        least = _PATH_STRAIN * self.material.young_modulus * thickness / self.root.radius
        return max(self.diastolic_pressure, least)

    def wall_taper(self, thickness: float) -> float:
        """Distance over which the clearance of a cusp of this thickness from the wall grows [mm].

        Not less than two triangles: the first row lies along the wall.
        """
        chosen = self.wall.taper
        return max(5.0 * thickness, 2.0 * self.mesh_size) if chosen is None else chosen

    def layer_clearance(self, thickness: float) -> float:
        """Distance that layers of a cusp of this thickness keep away from its suture [mm]."""
        chosen = self.layers.clearance
        return thickness / 2 if chosen is None else chosen

    def layers_unrestricted(self, thickness: float) -> float:
        """Distance from the suture within which layers of this thickness are left alone [mm]."""
        chosen = self.layers.unrestricted
        return 4 * thickness if chosen is None else chosen

    def inside_tolerance(self, thickness: float) -> float:
        """By how much a cusp of this thickness may be short of its clearances [mm]."""
        chosen = self.solver.inside_tolerance
        share = 0.01 if self.solver.quality == "equilibrium" else 0.1
        return share * thickness if chosen is None else chosen
