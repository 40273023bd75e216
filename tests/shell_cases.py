"""Small meshes, states and a Taylor test shared by the tests of the shell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, cKDTree

from avneo_fem.equilibrium.directors import start_directors
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.meshing.cusp_mesh import CuspMesh
from meshes import disc as disc

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: E, H for which D = E H^3/12 = 1 and the membrane's E H = 1.2e-7: bending alone
BENDING_ALONE: dict[str, float] = {
    "young_modulus": 12e-12,
    "thickness": 1e4,
    "pressure": 0.0,
    "free_edge_stiffness": 0.0,
}
#: the reverse: E H = 1, D = 1e-16/12
MEMBRANE_ALONE: dict[str, float] = {
    "young_modulus": 1e8,
    "thickness": 1e-8,
    "pressure": 0.0,
    "free_edge_stiffness": 0.0,
}
PRESSURE_ALONE: dict[str, float] = {"young_modulus": 0.0, "free_edge_stiffness": 0.0}
FREE_EDGE_ALONE: dict[str, float] = {"young_modulus": 0.0, "pressure": 0.0}


def triangulated(points: Floats, suture_line: Ints, free_edge: Ints) -> CuspMesh:
    """Delaunay mesh of a convex point cloud, counter-clockwise."""
    triangles = Delaunay(points).simplices.astype(np.int64)
    u, v = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    triangles[area < 0] = triangles[area < 0][:, [0, 2, 1]]
    triangles = triangles[np.abs(area) > 1e-9]  # slivers between boundary nodes on a line
    pieces = np.linalg.norm(np.diff(points[suture_line], axis=0), axis=1)
    return CuspMesh(points, triangles, suture_line, np.r_[0.0, np.cumsum(pieces)], free_edge)


def strip(columns: int, rows: int, length: float, width: float, jitter: float = 0.2) -> CuspMesh:
    """Unstructured mesh of [0, length] x [0, width]; the top is the free edge."""
    random = np.random.default_rng(columns * 100 + rows)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(columns + 1), np.arange(rows + 1)))
    points = np.c_[i * length / columns, j * width / rows]
    inside = (i > 0) & (i < columns) & (j > 0) & (j < rows)
    size = np.array([length / columns, width / rows])
    points[inside] += jitter * size * random.uniform(-1, 1, (inside.sum(), 2))
    node = np.arange(len(points)).reshape(rows + 1, columns + 1)
    suture = np.r_[node[::-1, 0], node[0, 1:], node[1:, -1]]
    return triangulated(points, suture, node[-1])


def renumbered(mesh: CuspMesh, new_number: Ints) -> CuspMesh:
    """The same mesh with node k called ``new_number[k]``."""
    points = np.empty_like(mesh.points)
    points[new_number] = mesh.points
    return CuspMesh(
        points,
        new_number[mesh.triangles],
        new_number[mesh.suture_line],
        mesh.suture_arc_length,
        new_number[mesh.free_edge],
    )


def shell(mesh: CuspMesh, **parameters: Any) -> ShellModel:
    """Model with the given parameters."""
    return ShellModel(mesh, ShellParameters(**parameters))


def state_at(model: ShellModel, positions: Floats) -> Floats:
    """State with these node positions (n, 3) and directors along the mean normals."""
    state = np.zeros(model.size)
    state[model.position_dofs] = positions
    return start_directors(model, state)


def flat(mesh: CuspMesh, height: float = 0.0) -> Floats:
    """(n, 3) the template itself in the plane z = height."""
    return np.c_[mesh.points, np.full(len(mesh.points), height)]


def rotation(seed: int) -> Floats:
    """Random proper rotation (3, 3)."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def rough(model: ShellModel, seed: int) -> Floats:
    """Random state far from flat: bent, stretched, rotated, with random director angles."""
    random = np.random.default_rng(seed)
    x, y = model.mesh.points.T
    size = np.sqrt(model.mesh.area / len(x))
    bump = 0.3 * np.sin(2 * x + random.uniform(0, 6)) * np.cos(1.5 * y + random.uniform(0, 6))
    positions = np.c_[1.1 * x + 0.1 * y, 0.9 * y, bump]
    positions += 0.1 * size * random.uniform(-1, 1, positions.shape)
    state = state_at(model, positions @ rotation(seed).T)
    state[model.angle_dofs] = 0.2 * random.uniform(-1, 1, len(model.angle_dofs))
    return state


def edge_match(first: CuspMesh, second: CuspMesh) -> Ints:
    """Row in ``second.edges`` of every edge of ``first``, found by its midpoint."""
    middle = [mesh.points[mesh.edges].mean(axis=1) for mesh in (first, second)]
    return cKDTree(middle[1]).query(middle[0])[1]


def taylor_orders(
    function: Callable[[Floats], Any],
    derivative: Any,
    state: Floats,
    direction: Floats,
    largest: float = 2e-3,
) -> Floats:
    """Observed orders of |f(u + h d) - f(u) - h f'd| as h is halved three times."""
    start = np.asarray(function(state))
    steps = largest / 2.0 ** np.arange(4)
    rests = [
        np.linalg.norm(np.asarray(function(state + h * direction)) - start - h * derivative)
        for h in steps
    ]
    return np.diff(np.log(rests)) / np.diff(np.log(steps))


def unit_direction(model: ShellModel, seed: int) -> Floats:
    """Random direction in positions and angles, largest entry about 1."""
    return np.random.default_rng(seed).uniform(-1, 1, model.size)


def evaluated(expression: Any) -> Floats:
    """Number, vector or matrix that a UFL expression of numbers stands for."""
    places = list(np.ndindex(expression.ufl_shape))
    return np.array([float((expression[k] if k else expression)(())) for k in places]).reshape(
        expression.ufl_shape
    )


def merit(model: ShellModel, base: Floats) -> Callable[[Floats], float]:
    """Energy less the work of the pressure since ``base``; potential of the residual at base."""
    return lambda state: model.energy(state) - model.pressure_work(state, base)


def hairpin(mesh: CuspMesh, gap: float) -> Floats:
    """(n, 3) a strip along x folded without stretch about its middle into two layers ``gap`` apart.

    The lower layer lies in z = 0, its fold is half a circle.
    """
    x, y = mesh.points.T
    radius, middle = gap / 2, x.max() / 2
    start = middle - np.pi * radius / 2
    angle = np.clip((x - start) / radius, 0, np.pi)
    beyond = np.maximum(x - start - np.pi * radius, 0)
    along = np.minimum(x, start) + radius * np.sin(angle) - beyond
    return np.c_[along, y, radius * (1 - np.cos(angle))]
