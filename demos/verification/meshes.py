"""Meshes of the benchmarks: strips, squares and discs, structured and not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["disc", "strip"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _mesh(points: Floats, triangles: Ints, suture_line: Ints, free_edge: Ints) -> CuspMesh:
    pieces = np.linalg.norm(np.diff(points[suture_line], axis=0), axis=1)
    return CuspMesh(points, triangles, suture_line, np.r_[0.0, np.cumsum(pieces)], free_edge)


def _triangles(points: Floats) -> Ints:
    """Delaunay triangles of a convex cloud, counter-clockwise, without slivers on the rim."""
    triangles = Delaunay(points).simplices.astype(np.int64)
    u, v = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    triangles[area < 0] = triangles[area < 0][:, [0, 2, 1]]
    return triangles[np.abs(area) > 1e-9 * np.ptp(points) ** 2]


def strip(
    columns: int, rows: int, length: float, width: float, structured: bool = True
) -> CuspMesh:
    """[0, length] x [0, width] with 2 columns rows triangles; the top is the free edge.

    Unstructured: inner nodes are moved at random by up to a fifth of the spacing and triangulated
    anew.
    """
    i, j = (k.ravel() for k in np.meshgrid(np.arange(columns + 1), np.arange(rows + 1)))
    points = np.c_[i * length / columns, j * width / rows]
    node = np.arange(len(points)).reshape(rows + 1, columns + 1)
    if structured:
        a, b, c, d = (
            k.ravel() for k in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1])
        )
        triangles = np.vstack([np.c_[a, b, c], np.c_[a, c, d]]).astype(np.int64)
    else:
        random = np.random.default_rng(columns * 100 + rows)
        inside = (i > 0) & (i < columns) & (j > 0) & (j < rows)
        size = np.array([length / columns, width / rows])
        points[inside] += 0.2 * size * random.uniform(-1, 1, (inside.sum(), 2))
        if rows == 1:  # nothing inside to move: cut the rectangles along random diagonals
            triangles = _random_diagonals(node, random)
        else:
            triangles = _triangles(points / size) if columns != rows else _triangles(points)
    suture = np.r_[node[::-1, 0], node[0, 1:], node[1:, -1]]
    return _mesh(points, triangles, suture, node[-1])


def _random_diagonals(node: Ints, random: np.random.Generator) -> Ints:
    a, b, c, d = (k.ravel() for k in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]))
    rising = random.random(len(a))[:, None] < 0.5
    first = np.where(rising, np.c_[a, b, c], np.c_[a, b, d])
    second = np.where(rising, np.c_[a, c, d], np.c_[b, c, d])
    return np.vstack([first, second]).astype(np.int64)


def disc(rings: int, radius: float = 1.0, jitter: float = 0.1) -> CuspMesh:
    """Disc about the origin, 6 rings^2 triangles; the upper half circle is the free edge."""
    random = np.random.default_rng(rings)
    points = [np.zeros((1, 2))]
    for ring in range(1, rings + 1):
        angle = np.pi + 2 * np.pi * np.arange(6 * ring) / (6 * ring)
        points.append(radius * ring / rings * np.c_[np.cos(angle), np.sin(angle)])
    cloud = np.vstack(points)
    rim = len(cloud) - 6 * rings + np.arange(6 * rings)
    inside = np.arange(len(cloud)) < rim[0]
    cloud[inside] += jitter * radius / rings * random.uniform(-1, 1, (int(inside.sum()), 2))
    half = 3 * rings
    return _mesh(cloud, _triangles(cloud), rim[: half + 1], np.r_[rim[0], rim[: half - 1 : -1]])
