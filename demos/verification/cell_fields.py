"""Finite-element fields rebuilt cell by cell as plain polynomials, to measure errors in them.

Nothing of the finite-element library is used: in every triangle the polynomial through the nodal
values is found from its Vandermonde matrix. So a wrong node order would show as a wrong order of
convergence instead of cancelling out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.equilibrium.high_order_shell import HighOrderShell
from avneo_fem.equilibrium.shell_model import ShellModel

__all__ = ["Samples", "boundary", "observed_order", "sampled", "sampled_on_cells", "value_at"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Samples:
    """A field and its gradient at the quadrature points of every cell.

    Attributes
    ----------
    points : (m, q, 2) array
        Where, in template coordinates [mm].
    weights : (m, q) array
        Quadrature weights [mm^2].
    values, gradients : (m, q, c) and (m, q, c, 2) arrays
        The field with c components and its gradient.
    """

    points: Floats
    weights: Floats
    values: Floats
    gradients: Floats

    def norm(self, difference: Floats) -> float:
        """L2 norm of a field (m, q, ...) over the mesh."""
        squares = (difference**2).reshape(*self.weights.shape, -1).sum(axis=2)
        return float(np.sqrt((self.weights * squares).sum()))


def _square_rule(count: int) -> tuple[Floats, Floats]:
    """Quadrature of the triangle (0,0), (1,0), (0,1): Gauss rules in Duffy's coordinates.

    Exact to degree 2 count - 2; barycentric coordinates (q, 3) and weights (q,) that sum to 1.
    """
    place, weight = np.polynomial.legendre.leggauss(count)
    place, weight = (place + 1) / 2, weight / 2
    s, t = (k.ravel() for k in np.meshgrid(place, place, indexing="ij"))
    weights = 2 * (weight[:, None] * weight).ravel() * (1 - s)
    return np.c_[(1 - s) * (1 - t), s, (1 - s) * t], weights


def _exponents(degree: int) -> Ints:
    return np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)])


def _monomials(places: Floats, exponents: Ints, derivative: int | None = None) -> Floats:
    """(..., b) monomials, or their derivatives in a direction, at places (..., 2)."""
    factor = np.ones(len(exponents))
    powers = exponents
    if derivative is not None:
        factor = exponents[:, derivative].astype(float)
        powers = np.maximum(exponents - np.eye(2, dtype=np.int64)[derivative], 0)
    return factor * places[..., None, 0] ** powers[:, 0] * places[..., None, 1] ** powers[:, 1]


@dataclass(frozen=True)
class _Cells:
    """Corners (m, 3, 2), centres (m, 1, 2) and sizes (m, 1, 1) of the cells."""

    corners: Floats
    centre: Floats
    size: Floats

    def local(self, places: Floats) -> Floats:
        """Places (m, q, 2) in coordinates of each cell, about -1 to 1."""
        return (places - self.centre) / self.size


def _cells(model: ShellModel) -> tuple[_Cells, Ints]:
    """The cells in the model's own order and their nodes (m, b)."""
    nodes = model.cell_nodes if isinstance(model, HighOrderShell) else model.mesh.triangles
    corners = model.node_points[nodes[:, :3]]
    size = np.ptp(corners, axis=1).max(axis=1)[:, None, None]
    return _Cells(corners, corners.mean(axis=1, keepdims=True), size), nodes


def _fit(cells: _Cells, places: Floats, values: Floats, degree: int) -> Floats:
    """(m, b, c) coefficients of the polynomials through ``values`` (m, b, ...) at (m, b, 2)."""
    basis = _monomials(cells.local(places), _exponents(degree))
    return np.linalg.solve(basis, values.reshape(*values.shape[:2], -1))


def _evaluated(cells: _Cells, coefficients: Floats, degree: int, count: int) -> Samples:
    exponents = _exponents(degree)
    barycentric, weights = _square_rule(count)
    points = np.einsum("qk,mkd->mqd", barycentric, cells.corners)
    places = cells.local(points)
    u, v = (cells.corners[:, k] - cells.corners[:, 0] for k in (1, 2))
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    field = _monomials(places, exponents) @ coefficients
    slopes = [_monomials(places, exponents, d) @ coefficients / cells.size for d in (0, 1)]
    return Samples(points, area[:, None] * weights, field, np.stack(slopes, axis=-1))


def sampled(model: ShellModel, values: Floats, count: int = 6) -> Samples:
    """Nodal ``values`` (n, c) of the positions' space at count^2 quadrature points a cell."""
    cells, nodes = _cells(model)
    degree = model.parameters.degree
    coefficients = _fit(cells, model.node_points[nodes], values[nodes], degree)
    return _evaluated(cells, coefficients, degree, count)


def sampled_on_cells(model: ShellModel, values: Floats, degree: int, count: int = 6) -> Samples:
    """Cellwise ``values`` (m, b, c) of a discontinuous field of degree 0, 1 or 2, given in the
    middle, at the corners, or there and at the middles of the opposite sides."""
    cells, _ = _cells(model)
    middles = (cells.corners[:, [1, 0, 0]] + cells.corners[:, [2, 2, 1]]) / 2
    places = (cells.centre, cells.corners, np.concatenate([cells.corners, middles], axis=1))[degree]
    return _evaluated(cells, _fit(cells, places, values, degree), degree, count)


def value_at(model: ShellModel, values: Floats, place: tuple[float, float]) -> Floats:
    """The field with these nodal ``values`` (n, c) at one place of the template, (c,)."""
    cells, nodes = _cells(model)
    here = np.asarray(place) - cells.corners[:, 0]
    sides = np.swapaxes(cells.corners[:, 1:] - cells.corners[:, :1], 1, 2)
    inside = np.linalg.solve(sides, here[..., None])[..., 0]
    cell = int(np.argmax(np.c_[inside, 1 - inside.sum(axis=1)].min(axis=1)))
    degree = model.parameters.degree
    coefficients = _fit(cells, model.node_points[nodes], values[nodes], degree)
    local = (np.asarray(place) - cells.centre[cell, 0]) / cells.size[cell, 0, 0]
    return np.asarray(_monomials(local, _exponents(degree)) @ coefficients[cell])


def boundary(places: Floats) -> NDArray[np.bool_]:
    """Whether places (k, 2) lie on the boundary of the unit square."""
    return (np.abs(places - 0.5) > 0.5 - 1e-9).any(axis=1)


def observed_order(sizes: Floats, errors: Floats) -> float:
    """Slope of log(error) over log(mesh size), fitted by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
