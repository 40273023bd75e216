"""Triangulate a template with gmsh: nodes on the true curves, same mesh for the same input."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["TemplateOutline", "triangulate_template"]

Floats = NDArray[np.float64]

#: to what the outline is rounded, in units of the edge length
_GRID = 2.0**-30


class _Path(Protocol):
    @property
    def breaks(self) -> Floats: ...
    def point(self, s: Floats) -> Floats: ...


class TemplateOutline(Protocol):
    """The two boundary curves of a template."""

    @property
    def suture_line(self) -> _Path: ...
    @property
    def free_edge(self) -> _Path: ...


def _divide(breaks: Floats, size: float, at_ends: int = 1) -> Floats:
    """Arc lengths that divide every smooth piece evenly into lengths close to ``size``.

    The first and the last piece are divided into ``at_ends`` at least.
    """
    pieces = list(pairwise(breaks))
    least = np.ones(len(pieces), dtype=int)
    least[[0, -1]] = at_ends
    parts = [
        np.linspace(start, stop, max(fewest, round((stop - start) / size)) + 1)[:-1]
        for fewest, (start, stop) in zip(least, pieces, strict=True)
    ]
    return np.r_[np.concatenate(parts), breaks[-1]]


def _with_joints(breaks: Floats, joints: Sequence[float] | Floats, size: float) -> Floats:
    """Breaks and those joints that leave no piece shorter than half of ``size``."""
    for joint in joints:
        if np.abs(breaks - joint).min() >= size / 2:
            breaks = np.sort(np.r_[breaks, joint])
    return breaks


def triangulate_template(
    template: TemplateOutline,
    size: float,
    joints: Sequence[float] | Floats = (),
    at_ends: int = 1,
) -> CuspMesh:
    """Mesh a template with target edge length ``size`` [mm].

    Parameters
    ----------
    template : TemplateOutline
    size : float
    joints : (j,) array
        Arc lengths on its suture line [mm] where a node is wanted; one that would make an edge
        shorter than half of ``size`` is left out.
    at_ends : int
        Edges at least of the first and of the last piece of the suture line, up to the first joint.

    Notes
    -----
    The boundary is divided evenly in arc length between the joints of its curves, so boundary
    nodes lie on the curves to rounding; gmsh fills the inside (frontal Delaunay).

    Raises
    ------
    SceneError
        When ``mesh.size`` is too large for the template (fewer than 6 pieces of suture line).
    """
    breaks = _with_joints(np.asarray(template.suture_line.breaks), joints, size)
    suture = _divide(breaks, size, at_ends)
    free = _divide(np.asarray(template.free_edge.breaks), size)
    if len(_divide(breaks, size)) < 7:
        largest = float(template.suture_line.breaks[-1]) / 8
        raise SceneError(
            "mesh.size", size, f"too large for this template; use at most {largest:.3g} mm"
        )
    outline = np.vstack(
        [template.suture_line.point(suture), template.free_edge.point(free)[-2:0:-1]]
    )
    points, triangles = _fill(outline, size)
    number, ahead = len(suture), len(outline)
    free_edge = np.r_[0, np.arange(ahead - 1, number - 1, -1), number - 1]
    return CuspMesh(points, triangles, np.arange(number), suture, free_edge)


def _fill(outline: Floats, size: float) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles inside a counter-clockwise polygon, whose points come first in the result.

    gmsh sees lengths in units of ``size``, rounded: its tolerances are absolute, and where two
    points would do equally well the last bit decides which it takes. So the same template in
    another unit has the same mesh.
    """
    points, triangles = _fill_units(np.round(outline / size / _GRID) * _GRID)
    points *= size
    points[: len(outline)] = outline
    return points, triangles


def _fill_units(outline: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """The same with a target edge length of 1."""
    interrupt = signal.getsignal(signal.SIGINT)  # before the import, which resets it already
    import gmsh

    gmsh.initialize([], False)
    try:
        for option, value in (
            ("General.Terminal", 0),
            ("General.NumThreads", 1),
            ("Mesh.Algorithm", 6),
            ("Mesh.MeshSizeExtendFromBoundary", 0),
            ("Mesh.MeshSizeFromPoints", 0),
            ("Mesh.MeshSizeMin", 1.0),
            ("Mesh.MeshSizeMax", 1.0),
            ("Mesh.RandomSeed", 1),
        ):
            gmsh.option.setNumber(option, value)
        gmsh.model.add("cusp")
        geo = gmsh.model.geo
        corners = [geo.addPoint(x, y, 0.0, 1.0) for x, y in outline]
        lines = [
            geo.addLine(start, stop)
            for start, stop in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
        for line in lines:
            geo.mesh.setTransfiniteCurve(line, 2)
        geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        kinds, _, nodes = gmsh.model.mesh.getElements(2)
        triangle_nodes = nodes[list(kinds).index(2)]
        on_corner = [int(gmsh.model.mesh.getNodes(0, corner)[0][0]) for corner in corners]
    finally:
        gmsh.finalize()
        if interrupt is not None:
            signal.signal(signal.SIGINT, interrupt)
    place = {int(tag): row for row, tag in enumerate(tags)}
    xy = coordinates.reshape(-1, 3)[:, :2]
    cells = np.array([place[int(tag)] for tag in triangle_nodes]).reshape(-1, 3)
    boundary = np.array([place[tag] for tag in on_corner])
    inside = np.setdiff1d(np.unique(cells), boundary)
    order = np.r_[boundary, inside]
    renumber = np.full(len(xy), -1)
    renumber[order] = np.arange(len(order))
    points = xy[order].copy()
    cells = renumber[cells]
    u, v = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]]
    flipped = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0
    cells[flipped] = cells[flipped][:, [0, 2, 1]]
    return points, cells.astype(np.int64)
