"""Edge directors of the bending model: start, renewal, and the clamped suture edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.equilibrium.shell_model import ShellModel

__all__ = ["clamp_rotation", "current_directors", "renew_directors", "start_directors"]

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


def start_directors(model: ShellModel, state: Floats) -> Floats:
    """Directors along the mean normal of the adjacent triangles; returns the state, angles 0."""
    if not model.parameters.bending:
        return state
    points = state[model.position_dofs]
    a, b, c = (points[model.mesh.triangles[:, k]] for k in range(3))
    normal = _unit(np.cross(b - a, c - a))
    cells = model.mesh.edge_cells
    other = np.where(cells[:, 1] >= 0, cells[:, 1], cells[:, 0])
    tangent = _edge_tangents(model, points)
    model.set_directors(_across(normal[cells[:, 0]] + normal[other], tangent))
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
    """Make the current directors the reference ones; the same surface, all angles 0.

    Nothing in the energy changes; it keeps p_e well away from the direction of its edge, where
    its part across the edge would vanish.
    """
    if not model.parameters.bending:
        return state
    model.set_directors(current_directors(model, state))
    result = state.copy()
    result[model.angle_dofs] = 0.0
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
