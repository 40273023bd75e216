"""Folded strips whose layers are as far apart as they were drawn."""

from __future__ import annotations

import numpy as np

from avneo_fem.meshing.cusp_mesh import CuspMesh
from shell_cases import hairpin

Floats = np.ndarray

#: H [mm]
THICKNESS = 0.5
LENGTH, WIDTH = 12.0, 2.0


def strip(size: float = 0.4) -> CuspMesh:
    """Strip 0 < x < 12, 0 < y < 2 of squares of this size cut alternately; sutured at x = 0."""
    count, across = round(LENGTH / size), round(WIDTH / size)
    x, y = np.meshgrid(
        np.linspace(0, LENGTH, count + 1), np.linspace(0, WIDTH, across + 1), indexing="ij"
    )
    node = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (q.ravel() for q in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    odd = (np.add.outer(np.arange(count), np.arange(across)) % 2 == 1).ravel()[:, None]
    first = np.where(odd, np.c_[a, b, d], np.c_[a, b, c])
    second = np.where(odd, np.c_[b, c, d], np.c_[a, c, d])
    return CuspMesh(
        points=np.c_[x.ravel(), y.ravel()],
        triangles=np.r_[first, second],
        suture_line=node[0],
        suture_arc_length=y[0],
        free_edge=node[-1],
    )


def fold(mesh: CuspMesh, gap: float) -> Floats:
    """(n, 3) the strip folded about its middle into two parallel layers ``gap`` apart."""
    return hairpin(mesh, gap)


def cylinder(mesh: CuspMesh, radius: float) -> Floats:
    """(n, 3) the strip rolled without stretch along x."""
    x, y = mesh.points.T
    return np.c_[radius * np.sin(x / radius), y, radius * (1 - np.cos(x / radius))]
