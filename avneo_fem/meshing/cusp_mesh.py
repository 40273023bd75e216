"""The triangulated template: arrays only, whoever made them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["CuspMesh"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class CuspMesh:
    """Linear triangles of a flat template with its two boundary curves.

    Attributes
    ----------
    points : (n, 2) array
        Template coordinates [mm].
    triangles : (m, 3) array
        Vertex indices, counter-clockwise.
    suture_line : (k,) array
        Nodes of the cusp suture line from N_0 over the belly to N_1.
    suture_arc_length : (k,) array
        Arc length of these nodes on the true curve [mm].
    free_edge : (j,) array
        Nodes of the free edge from N_0 over its apex to N_1.
    """

    points: Floats
    triangles: Ints
    suture_line: Ints
    suture_arc_length: Floats
    free_edge: Ints

    @cached_property
    def _edge_table(self) -> tuple[Ints, Ints, Ints]:
        sides = self.triangles[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 2)
        edges, inverse = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        inverse = inverse.ravel()
        of_cell = inverse.reshape(-1, 3)
        cells = np.full((len(edges), 2), -1)
        cell = np.repeat(np.arange(len(self.triangles)), 3)
        order = np.argsort(inverse, kind="stable")
        first = np.r_[True, np.diff(inverse[order]) > 0]
        cells[inverse[order][first], 0] = cell[order][first]
        cells[inverse[order][~first], 1] = cell[order][~first]
        return edges, of_cell, cells

    @property
    def edges(self) -> Ints:
        """(e, 2) vertex pairs, the smaller index first."""
        return self._edge_table[0]

    @property
    def cell_edges(self) -> Ints:
        """(m, 3) edge opposite each vertex of each triangle."""
        return self._edge_table[1]

    @property
    def edge_cells(self) -> Ints:
        """(e, 2) triangles at an edge; -1 where there is none."""
        return self._edge_table[2]

    @cached_property
    def cell_areas(self) -> Floats:
        """(m,) areas [mm^2]."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        u, v = b - a, c - a
        return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])

    @property
    def area(self) -> float:
        """Area of the triangulated template [mm^2]."""
        return float(self.cell_areas.sum())

    @cached_property
    def node_areas(self) -> Floats:
        """(n,) a third of the area of the triangles at each node, as in (1.4)-(1.5) [mm^2]."""
        weights = np.repeat(self.cell_areas / 3, 3)
        count = len(self.points)
        return np.asarray(np.bincount(self.triangles.ravel(), weights, minlength=count), float)

    @cached_property
    def suture_edges(self) -> Ints:
        """(k-1,) edge index of each piece of the suture line, from N_0 to N_1."""
        return self.edges_between(self.suture_line)

    def edges_between(self, chain: Ints) -> Ints:
        """(j-1,) edge index of each piece of a chain of nodes (j,)."""
        base = np.array([len(self.points), 1])
        pairs = np.sort(np.c_[chain[:-1], chain[1:]], axis=1)
        return np.searchsorted(self.edges @ base, pairs @ base)

    @cached_property
    def distance_to_suture(self) -> Floats:
        """(n,) distance in the template from each node to the suture polyline [mm]."""
        start = self.points[self.suture_line[:-1]]
        side = self.points[self.suture_line[1:]] - start
        away = self.points[:, None, :] - start[None]
        share = np.einsum("nkd,kd->nk", away, side) / np.einsum("kd,kd->k", side, side)
        rest = away - np.clip(share, 0.0, 1.0)[..., None] * side[None]
        return np.sqrt(np.einsum("nkd,nkd->nk", rest, rest).min(axis=1))
