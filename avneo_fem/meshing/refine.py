"""Nested meshes: every triangle split into four, boundary nodes on the true curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.triangulate import TemplateOutline, triangulate_template

__all__ = ["nested_meshes", "prolong", "refine"]

Floats = NDArray[np.float64]


def refine(mesh: CuspMesh, template: TemplateOutline) -> CuspMesh:
    """Split every triangle of a mesh into four.

    Vertices keep their numbers; number n + e is the middle of edge e, on the suture line the
    point half-way along the true curve (the free edge is straight between its nodes).
    """
    count = len(mesh.points)
    middle = count + np.arange(len(mesh.edges))
    points = np.vstack([mesh.points, mesh.points[mesh.edges].mean(axis=1)])
    a, b, c = mesh.triangles.T
    opposite_a, opposite_b, opposite_c = middle[mesh.cell_edges].T
    triangles = np.vstack(
        [
            np.c_[a, opposite_c, opposite_b],
            np.c_[b, opposite_a, opposite_c],
            np.c_[c, opposite_b, opposite_a],
            np.c_[opposite_a, opposite_b, opposite_c],
        ]
    )
    arc = _interleaved(
        mesh.suture_arc_length, (mesh.suture_arc_length[1:] + mesh.suture_arc_length[:-1]) / 2
    )
    suture_line = _interleaved(mesh.suture_line, middle[mesh.suture_edges])
    points[suture_line[1::2]] = template.suture_line.point(arc[1::2])
    free_edge = _interleaved(mesh.free_edge, middle[mesh.edges_between(mesh.free_edge)])
    return CuspMesh(points, triangles, suture_line, arc, free_edge)


def nested_meshes(
    template: TemplateOutline,
    size: float,
    refinements: int,
    fewer_will_do: bool = True,
    joints: Sequence[float] | Floats = (),
) -> list[CuspMesh]:
    """Meshes of a template, each a refinement of the one before, the last of edge length ``size``.

    With ``fewer_will_do`` the first mesh is made finer where the template is too small for it;
    ``joints`` are arc lengths (j,) of the suture line where a node is wanted [mm].

    Raises
    ------
    SceneError
        When the first mesh is too coarse for the template.
    """
    try:
        # one edge from the free edge to the first bend would leave no room for a first row
        at_ends = 2 if refinements == 0 and len(joints) else 1
        meshes = [triangulate_template(template, size * 2.0**refinements, joints, at_ends)]
    except SceneError as error:
        if refinements == 0:
            raise
        if not fewer_will_do:
            raise SceneError(
                "mesh.refinements",
                refinements,
                f"the first mesh, {size * 2.0**refinements:.3g} mm, is too coarse: {error.valid};"
                " take fewer, or leave it out",
            ) from None
        return nested_meshes(template, size, refinements - 1, joints=joints)
    for _ in range(refinements):
        meshes.append(refine(meshes[-1], template))
    return meshes


def prolong(mesh: CuspMesh, values: Floats) -> Floats:
    """Nodal values (n, ...) of a mesh as those of its refinement, (n + e, ...): the same
    piecewise linear function."""
    return np.concatenate([values, values[mesh.edges].mean(axis=1)])


def _interleaved(ends: NDArray[Any], between: NDArray[Any]) -> NDArray[Any]:
    result = np.empty(len(ends) + len(between), dtype=ends.dtype)
    result[::2], result[1::2] = ends, between
    return result
