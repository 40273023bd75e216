"""How far a cusp is from what it must hold at the end: clearances, half-planes, layers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.between_nodes import shortfall_between
from avneo_fem.stages.blocked_edge import may_be_missed
from avneo_fem.stages.cusp_setup import CuspSetup

__all__ = ["bulging", "may_be_missed_by_nodes", "outside", "shortfalls"]

Floats = NDArray[np.float64]

#: share of the tolerance that may be missing at nodes, as the judge also looks between them
_AT_NODES = 0.5
#: and between nodes
_BETWEEN = 0.8


def may_be_missed_by_nodes(setup: CuspSetup) -> float:
    """By how much nodes may miss clearances [mm]."""
    return _AT_NODES * setup.scene.inside_tolerance(setup.cusp.thickness)


def outside(setup: CuspSetup, points: Floats) -> tuple[float, float]:
    """Largest depth of a node (n, 3) outside the root and outside the contact wedge [mm]."""
    wall, wedge = setup.wall.evaluate(points)[0], setup.wedge.evaluate(points)[0]
    return float((-wall).max(initial=0.0)), float((-wedge).max(initial=0.0))


def _held(setup: CuspSetup) -> NDArray[np.bool_]:
    """(n,) nodes that are sutured or laid down, and cannot give way."""
    held = np.zeros(len(setup.mesh.points), dtype=bool)
    held[setup.mesh.suture_line] = held[setup.row.nodes] = True
    return held


def _largest_at_nodes(values: Floats, edges: NDArray[np.int64], count: int) -> Floats:
    """(count,) largest of the values (e,) >= 0 of the edges (e, 2) at each node; 0 without any."""
    result = np.zeros(count)
    for ends in edges.T:
        np.maximum.at(result, ends, values)
    return result


def shortfalls(setup: CuspSetup, points: Floats) -> tuple[float, float, float, float]:
    """How far wall, wedge, clamp and layers are from what they must hold.

    Parameters
    ----------
    setup : CuspSetup
    points : (n, 3) array
        Nodes [mm].

    Returns
    -------
    (wall, wedge, clamp, layers)
        Largest miss of the clearances [mm], sutured and laid nodes apart; within the taper a node
        need only be inside the root, and where there is little clearance from the wedge a miss
        weighs more. Clamp: rms angle to the half-plane [degrees].
    """
    inside, free = may_be_missed_by_nodes(setup), ~_held(setup)
    distance = setup.wall.evaluate(points)[0]
    tapered = setup.wall.clearance < setup.wall.clearance.max()
    wall = np.where(tapered, -distance, setup.wall.clearance - distance)
    weight = inside / may_be_missed(setup.wedge.clearance, inside)
    wedge = weight * setup.wedge.shortfall(points)
    clamp = setup.clamp.rms_angle(points) if setup.scene.material.bending else 0.0
    return (
        float(wall[free].max(initial=0.0)),
        float(wedge[free].max(initial=0.0)),
        float(np.degrees(clamp)),
        setup.layers.shortfall(points),
    )


def bulging(setup: CuspSetup, points: Floats) -> Floats:
    """By how much edges from a node miss the clearance from the wedge, where that is too much.

    Next to the commissures neighbouring cusps lie at their clearance on both sides of the wedge,
    and one end of the edges to the stitch cannot give way: as much as is judged. Elsewhere a flat
    triangle that cuts a bend of the wedge has room on the other side of it, unless triangles are
    large, or stretched: half of the clearance.

    Parameters
    ----------
    setup : CuspSetup
    points : (n, 3) array
        Nodes [mm].

    Returns
    -------
    (n,) array
        0 at nodes that cannot give way [mm].
    """
    held, edges = _held(setup), setup.mesh.edges
    edges = edges[~held[edges].all(axis=1)]
    clearance = setup.wedge_clearance
    short = shortfall_between(setup.wedge.field, points, edges, clearance)
    judged = _BETWEEN * setup.scene.inside_tolerance(setup.cusp.thickness)
    half = clearance[edges].mean(axis=1) / 2.0
    allowed = np.where(held[edges].any(axis=1), np.minimum(judged, half), half)
    short[short <= allowed] = 0.0
    return np.where(held, 0.0, _largest_at_nodes(short, edges, len(points)))
