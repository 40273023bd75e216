"""The scene: everything a run needs, in one TOML file, checked by a schema.

Units are mm, kPa and mN; angles that people write are in degrees. Every entry has a default:
those of the lengths of ``template`` and ``suture_line`` are the paper's Experiment 1. All entries
are listed in docs/scene.md. This module is the public entrance; the parts lie in ``scene_tables``
and ``scene_method`` (the tables), ``scene_schema`` (:class:`Scene`), ``scene_fidelity`` (bundles of
defaults), ``scene_file`` (reading) and ``scene_overrides`` (``--set``).
"""

from __future__ import annotations

from avneo_fem.scene_fidelity import FIDELITIES, Fidelity
from avneo_fem.scene_file import load_scene, parse_scene
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
from avneo_fem.scene_scaling import scaled_scene
from avneo_fem.scene_schema import Scene
from avneo_fem.scene_tables import (
    Commissures,
    Competence,
    Cusp,
    Root,
    Stitching,
    SutureLine,
    Template,
)

__all__ = [
    "FIDELITIES",
    "Clamp",
    "Commissures",
    "Competence",
    "Contact",
    "Cusp",
    "Fidelity",
    "FreeEdge",
    "Layers",
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
    "scaled_scene",
]
