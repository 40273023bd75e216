"""Templates that the tests of the meshes share: the paper's and two odd ones."""

from __future__ import annotations

from functools import cache

from avneo_fem.geometry.template import CuspTemplate
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.scene import Template
from valve_cases import experiment

TEMPLATES = {
    "experiment 1": CuspTemplate(Template()),
    **{
        f"experiment {number}, cusp {index}": experiment(number, "demo").cusps[index].template
        for number in (2, 3)
        for index in range(3)
    },
    "apex below the corners": CuspTemplate(Template(free_edge_height=-5.0)),
    "high apex": CuspTemplate(Template(free_edge_height=15.0)),
}


@cache
def mesh_of(name: str, size: float) -> CuspMesh:
    """The triangulated template, made once per test run."""
    return triangulate_template(TEMPLATES[name], size)
