"""What users care about, measured on the surfaces that a run left, and how it differs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from avneo_fem.errors import SceneError
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.results.cusp_curves import TOUCHING, along, contact_curve, length
from avneo_fem.results.fields import principal_stretches
from avneo_fem.results.surface_distance import samples, surface_distance
from avneo_fem.results.surfaces import read_stl
from avneo_fem.scene import parse_scene
from avneo_fem.valve.suture_valve import mesh_templates

__all__ = ["CuspMeasures", "Errors", "compare_cusps", "measure_cusp", "measure_run", "worst"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class CuspMeasures:
    """One sutured cusp, and what is compared of it.

    Attributes
    ----------
    points, triangles
        Mid-surface, (n, 3) [mm] and (m, 3).
    belly_depth : float
        Greatest depth of the mid-surface under the plane of commissures M [mm].
    free_edge : (k, 3) array
        Places evenly spread by arc length in the template [mm].
    free_edge_height : float
        Their mean height over M [mm].
    free_edge_length : float
        Length in space [mm].
    contact : (m,) array
        Lowest place that touches the contact wedge, as height over M by arc length along the
        wedge; nan where none does [mm].
    stretch : float
        Larger principal stretch of the mid-surface, its 95 % quantile by template area, away from
        the suture (where layers keep their clearance: next to the suture triangles collapse).
    """

    points: Floats
    triangles: Ints
    belly_depth: float
    free_edge: Floats
    free_edge_height: float
    free_edge_length: float
    contact: Floats
    stretch: float


@dataclass(frozen=True)
class Errors:
    """How far one result is from another; names as the columns of tradeoff.csv.

    Distances of the surfaces both ways by area (mean, 95 %, largest), of belly depth, free-edge
    height (mean) and length, the free edges as curves (mean), the contact curves where both touch
    (mean difference in height, nan where they nowhere do), all in mm, and of the stretch.
    """

    surface_mean_mm: float
    surface_95_mm: float
    surface_largest_mm: float
    belly_depth_mm: float
    free_edge_height_mm: float
    free_edge_length_mm: float
    free_edge_mm: float
    contact_curve_mm: float
    stretch: float


def measure_cusp(given: ValveInput, index: int, mesh: CuspMesh, points: Floats) -> CuspMeasures:
    """Measure cusp ``index`` of a scene with its nodes at ``points`` (n, 3) [mm]."""
    scene, plane = given.scene, given.geometry.commissures
    thickness = given.geometry.cusps[index].thickness
    wedge = given.wedges.wedge(index, 1.0)
    clearance = thickness / 2 if scene.contact.clearance is None else scene.contact.clearance

    def height(places: Floats) -> Floats:
        return np.asarray((places - plane.points[0]) @ plane.normal)

    places, _ = samples(points, mesh.triangles)
    touching = places[wedge.signed_distance(places) <= clearance + TOUCHING]
    over_plane = np.column_stack([touching[:, :2], height(touching)])
    edge = along(mesh.points[mesh.free_edge], points[mesh.free_edge], 2001)
    near = mesh.distance_to_suture < scene.layers_unrestricted(thickness)
    away = ~near[mesh.triangles].any(axis=1)
    stretches = principal_stretches(mesh.points, mesh.triangles, points)[:, 0]
    return CuspMeasures(
        points,
        mesh.triangles,
        float(-height(points).min()),
        edge,
        float(height(edge).mean()),
        length(edge),
        contact_curve(over_plane, wedge.polyline3(500, 0.0)[:, :2]),
        _quantile(stretches[away], mesh.cell_areas[away], 0.95),
    )


def _quantile(values: Floats, weights: Floats, share: float) -> float:
    """Smallest value that this share of the weight does not exceed; nan of none."""
    if not len(values):
        return float("nan")
    rising = np.argsort(values)
    reached = weights[rising].cumsum() / weights.sum()
    return float(values[rising[min(int(np.searchsorted(reached, share)), len(values) - 1)]])


def compare_cusps(a: CuspMeasures, b: CuspMeasures) -> Errors:
    """How far cusp ``a`` is from cusp ``b`` of the same scene."""
    surface = surface_distance((a.points, a.triangles), (b.points, b.triangles))
    sides = a.free_edge, b.free_edge
    gaps = [cKDTree(x).query(y)[0] for x, y in (sides, sides[::-1])]
    apart = np.abs(a.contact - b.contact)
    apart = apart[np.isfinite(apart)]
    return Errors(
        *surface,
        abs(a.belly_depth - b.belly_depth),
        abs(a.free_edge_height - b.free_edge_height),
        abs(a.free_edge_length - b.free_edge_length),
        float(np.concatenate(gaps).mean()),
        float(apart.mean()) if len(apart) else float("nan"),
        abs(a.stretch - b.stretch),
    )


def worst(errors: Sequence[Errors]) -> Errors:
    """Of each figure the largest over the cusps; nan only where no cusp has it."""
    values = np.array([[getattr(e, field.name) for field in fields(Errors)] for e in errors])
    largest = np.where(np.isnan(values), -np.inf, values).max(axis=0)
    return Errors(*(float(x) for x in np.where(np.isinf(largest), np.nan, largest)))


def measure_run(report: dict[str, Any], folder: Path) -> dict[int, CuspMeasures]:
    """Measures of the cusps that a run solved (not of copies), by their index.

    Parameters
    ----------
    report : dict
        Its report.json. The template's mesh is made again from the scene in it: surfaces are kept
        as STL, which knows neither nodes nor template.
    folder : Path
        Where its ``cusp_I.stl`` are.

    Raises
    ------
    SceneError
        When a surface is missing or does not belong to the report.
    """
    given = ValveInput.from_scene(parse_scene(report["scene"]))
    meshes = mesh_templates(given)
    found = {}
    for cusp in report["cusps"]:
        index = int(cusp["index"])
        if cusp["copied_from"] is not None:
            continue
        mesh = meshes[index][-1]
        points = _nodes(folder / f"cusp_{index}.stl", mesh)
        found[index] = measure_cusp(given, index, mesh, points)
    return found


def _nodes(path: Path, mesh: CuspMesh) -> Floats:
    """(n, 3) node positions of a surface file, whose triangles are the mesh's in their order."""
    points, triangles = read_stl(path)
    if triangles.shape != mesh.triangles.shape:
        raise SceneError("surface file", str(path), "is not of the mesh of its report.json")
    corners = points[triangles]
    nodes = np.empty((len(mesh.points), 3))
    nodes[mesh.triangles] = corners
    if not np.array_equal(nodes[mesh.triangles], corners):
        raise SceneError("surface file", str(path), "is not of the mesh of its report.json")
    return nodes
