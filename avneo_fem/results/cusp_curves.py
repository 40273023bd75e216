"""Curves on a sutured cusp that results are compared by: free edge, mid-line, contact curve."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from avneo_fem.results.surface_distance import to_surface

__all__ = ["BIN", "TOUCHING", "along", "contact_curve", "length", "mid_line", "sag"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: beyond its clearance, a cusp this close to its wedge touches it [mm]
TOUCHING = 0.05
#: of the contact curve [mm]
BIN = 0.5


def length(line: Floats) -> float:
    """Length of a polyline (n, d) [mm]."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def along(points: Floats, positions: Floats, count: int = 401) -> Floats:
    """(count, 3) places of a polyline, evenly spread by its arc length in the template (n, 2)."""
    arc = np.r_[0.0, np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()]
    wanted = np.linspace(0.0, arc[-1], count)
    return np.column_stack([np.interp(wanted, arc, x) for x in positions.T])


def mid_line(template: Floats, triangles: Ints, positions: Floats, count: int = 401) -> Floats:
    """(count, 3) places of the mid-line x = 0 of the template, from suture to free edge."""
    flat = np.column_stack([template, np.zeros(len(template))])
    middle = np.abs(template[:, 0]) < 1e-6 * np.ptp(template[:, 0])
    ends = template[middle, 1]
    wanted = np.zeros((count, 3))
    wanted[:, 1] = np.linspace(ends.min(), ends.max(), count)
    _, face, closest = to_surface(wanted, flat, triangles)
    a, b, c = (flat[triangles[face, k]] for k in range(3))
    weights = igl.barycentric_coordinates(closest, a, b, c)
    return np.einsum("kc,kcd->kd", weights, positions[triangles[face]])


def sag(line: Floats) -> float:
    """Largest distance of a curve from the straight line between its ends [mm]."""
    chord = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
    away = line - line[0]
    return float(np.linalg.norm(away - np.outer(away @ chord, chord), axis=1).max())


def contact_curve(places: Floats, wedge: Floats, width: float = BIN) -> Floats:
    """(m,) lowest z of what touches, by arc length along the wedge (n, 2); nan where none does.

    Parameters
    ----------
    places : (k, 3) array
        Places of the cusp that touch the wedge [mm].
    wedge : (n, 2) array
        The wedge from above, as a fine polyline [mm].
    width : float
        Arc length that shares one value [mm].
    """
    arc = np.r_[0.0, np.linalg.norm(np.diff(wedge, axis=0), axis=1).cumsum()]
    row = (arc[cKDTree(wedge).query(places[:, :2])[1]] / width).astype(int)
    lowest = np.full(int(arc[-1] / width) + 1, np.inf)
    np.minimum.at(lowest, row, places[:, 2])
    return np.where(np.isfinite(lowest), lowest, np.nan)
