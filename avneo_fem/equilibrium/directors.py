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
        Prescribed outward conormal b of every suture edge: the cusp leaves along -b (3.1).
    """
    edges = model.mesh.suture_edges
    # edges are stored smaller index first, which along the suture line is its own direction
    tangent = _edge_tangents(model, state[model.position_dofs])[edges]
    wanted = _across(np.cross(conormal, tangent), tangent)
    now = current_directors(model, state)[edges]
    sine = np.einsum("ed,ed->e", np.cross(now, wanted), tangent)
    return np.arctan2(sine, np.einsum("ed,ed->e", now, wanted))
