"""Edge directors of the bending model: start, renewal, and the clamped suture edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.equilibrium.high_order_shell import HighOrderShell
from avneo_fem.equilibrium.shell_model import ShellModel

__all__ = [
    "clamp_rotation",
    "current_directors",
    "renew_directors",
    "start_directors",
    "turn_directors",
]

Floats = NDArray[np.float64]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _edge_tangents(model: ShellModel, points: Floats) -> Floats:
    """(e, 3) unit vectors along the edges, in the order of ``mesh.edges``."""
    edges = model.mesh.edges
    return _unit(points[edges[:, 1]] - points[edges[:, 0]])


def _suture_sense(model: ShellModel) -> Floats:
    """(k-1, 1): 1 where a suture edge is stored along the suture line, -1 where against it."""
    line = model.mesh.suture_line
    return np.where(line[:-1] < line[1:], 1.0, -1.0)[:, None]


def _across(vectors: Floats, tangent: Floats) -> Floats:
    """Unit part of ``vectors`` orthogonal to ``tangent``."""
    return _unit(vectors - np.einsum("ed,ed->e", vectors, tangent)[:, None] * tangent)


def _mean_normals(model: ShellModel, points: Floats, tangent: Floats) -> Floats:
    """(e, 3) mean unit normal of the triangles at each edge; one's own where they oppose."""
    a, b, c = (points[model.mesh.triangles[:, k]] for k in range(3))
    normal = _unit(np.cross(b - a, c - a))
    cells = model.mesh.edge_cells
    first = normal[cells[:, 0]]
    mean = first + normal[np.where(cells[:, 1] >= 0, cells[:, 1], cells[:, 0])]
    folded = np.linalg.norm(mean, axis=1) < 1e-6
    return _across(np.where(folded[:, None], first, mean), tangent)


def start_directors(model: ShellModel, state: Floats) -> Floats:
    """Directors along the mean normal of the adjacent triangles; returns the state, angles 0."""
    if not model.parameters.bending:
        return state
    if isinstance(model, HighOrderShell):
        return model.start_directors(state)
    points = state[model.position_dofs]
    model.set_directors(_mean_normals(model, points, _edge_tangents(model, points)))
    result = state.copy()
    result[model.angle_dofs] = 0.0
    return result


def current_directors(model: ShellModel, state: Floats) -> Floats:
    """(e, 3) unit directors of a state: p_e across the edge, turned about it by alpha_e."""
    tangent = _edge_tangents(model, state[model.position_dofs])
    across = _across(model.directors, tangent)
    angle = state[model.angle_dofs][:, None]
    return np.cos(angle) * across + np.sin(angle) * np.cross(tangent, across)


def renew_directors(model: ShellModel, state: Floats) -> Floats:
    """Measure the same directors from the present mean normals: p_e moves, alpha_e follows.

    Nothing in the energy changes. It keeps p_e away from the direction of its edge, where its
    part across the edge would vanish, and close to the normals of its triangles: so the angle
    between them, which has a jump at 180 degrees, stays small, and alpha_e counts large rotations
    of a clamped edge without one.
    """
    if not model.parameters.bending:
        return state
    if isinstance(model, HighOrderShell):
        return model.renew_directors(state)
    points = state[model.position_dofs]
    tangent = _edge_tangents(model, points)
    before = _across(model.directors, tangent)
    after = _mean_normals(model, points, tangent)
    sine = np.einsum("ed,ed->e", np.cross(before, after), tangent)
    result = state.copy()
    result[model.angle_dofs] -= np.arctan2(sine, np.einsum("ed,ed->e", before, after))
    model.set_directors(after)
    return result


def turn_directors(
    model: ShellModel, state: Floats, edges: NDArray[np.int64], angle: Floats
) -> Floats:
    """State with the directors of some edges (k,) turned by ``angle`` (k,) [rad] about these
    edges as stored in ``mesh.edges``."""
    result = state.copy()
    if isinstance(model, HighOrderShell):
        result[model.angle_dofs[edges]] += (
            np.asarray(angle)[:, None] * model.unit_rotations()[edges]
        )
    else:
        result[model.angle_dofs[edges]] += angle
    return result


def clamp_rotation(model: ShellModel, state: Floats, conormal: Floats) -> Floats:
    """(k-1,) rotation about each suture edge from its director to the clamped one [rad].

    Parameters
    ----------
    conormal : (k-1, 3) array
        Prescribed outward conormal b of every suture edge: the cusp leaves along -b (3.1). Its
        part along the edge is ignored.

    Returns
    -------
    (k-1,) array in (-pi, pi]
        Positive about the edge as stored in ``mesh.edges``: added to the edge's entries of
        ``angle_dofs`` it makes the current director the clamped one.
    """
    edges = model.mesh.suture_edges
    tangent = _edge_tangents(model, state[model.position_dofs])[edges]
    # the suture line has the cusp on its left, so normal = b x (direction of the line)
    wanted = _across(np.cross(conormal, _suture_sense(model) * tangent), tangent)
    now = current_directors(model, state)[edges]
    sine = np.einsum("ed,ed->e", np.cross(now, wanted), tangent)
    return np.arctan2(sine, np.einsum("ed,ed->e", now, wanted))
