"""Distances of pairs and the edges' mollifier against minimisation and Taylor's theorem."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from avneo_fem.constraints.pair_distance import (
    PARALLEL,
    edge_mollifier,
    pair_distance,
    pair_distance_derivatives,
)

KINDS = pytest.mark.parametrize("is_edges", [False, True], ids=["point-triangle", "edges"])


def pairs(count: int, seed: int) -> np.ndarray:
    """Random corners (k, 4, 3), about 1 apart: nearest places of every kind occur."""
    return np.random.default_rng(seed).normal(size=(count, 4, 3))


@KINDS
def test_against_ipctk(is_edges: bool) -> None:
    """Truth: ipctk's distance (it gives the square), gradient and Hessian, for all its kinds of
    nearest places."""
    corners = pairs(400, 1)
    distance, weights = pair_distance(corners, is_edges)
    gradient, hessian = pair_distance_derivatives(corners, weights, is_edges)
    kinds = set()
    name = "edge_edge" if is_edges else "point_triangle"
    value, slope, bend, kind = (
        getattr(ipctk, f"{name}_distance{part}") for part in ("", "_gradient", "_hessian", "_type")
    )
    for k, four in enumerate(corners):
        kinds.add(kind(*four))
        assert distance[k] ** 2 == pytest.approx(value(*four), rel=1e-10)
        expected = 2 * distance[k] * gradient[k]
        np.testing.assert_allclose(expected, slope(*four), atol=1e-9)
        second = 2 * (np.outer(gradient[k], gradient[k]) + distance[k] * hessian[k])
        size = np.abs(second).max()
        np.testing.assert_allclose(second, bend(*four), atol=1e-8 * size)
    assert len(kinds) == (9 if is_edges else 7)


@KINDS
def test_rigid_motions_and_balance(is_edges: bool) -> None:
    """Truth: a shift of all corners changes nothing: gradient sums to 0, Hessian kills shifts."""
    corners = pairs(50, 2)
    distance, weights = pair_distance(corners, is_edges)
    gradient, hessian = pair_distance_derivatives(corners, weights, is_edges)
    moved = corners + np.array([3.0, -4.0, 5.0])
    assert pair_distance(moved, is_edges)[0] == pytest.approx(distance)
    np.testing.assert_allclose(gradient.reshape(-1, 4, 3).sum(axis=1), 0.0, atol=1e-12)
    shifts = np.tile(np.eye(3), (4, 1))
    size = np.abs(hessian).max(axis=(1, 2))[:, None, None]
    np.testing.assert_allclose(hessian @ shifts / size, 0.0, atol=1e-10)


def test_mollifier_against_ipctk() -> None:
    """Truth: ipctk's, with its threshold; 1 at a right angle, 0 for parallel edges."""
    corners = pairs(200, 3)
    corners[:, 3] = corners[:, 2] + (corners[:, 1] - corners[:, 0]) + 0.02 * corners[:, 3]
    rest = pairs(200, 4)
    sides = np.square(rest[:, [1, 3]] - rest[:, [0, 2]]).sum(axis=2).prod(axis=1)
    factor, slope, bend = edge_mollifier(corners, sides)
    for k, four in enumerate(corners):
        limit = PARALLEL * sides[k]
        assert factor[k] == pytest.approx(ipctk.edge_edge_mollifier(*four, limit), abs=1e-12)
        expected = ipctk.edge_edge_mollifier_gradient(*four, limit)
        np.testing.assert_allclose(slope[k], expected, atol=1e-9 * (1 + np.abs(expected).max()))
        expected = ipctk.edge_edge_mollifier_hessian(*four, limit)
        np.testing.assert_allclose(bend[k], expected, atol=1e-9 * (1 + np.abs(expected).max()))
    assert (factor < 1).sum() > 50
    assert (factor == 1).sum() > 20
    crossed = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1]]])
    along = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]]])
    assert edge_mollifier(crossed, np.ones(1))[0] == 1.0
    assert edge_mollifier(along, np.ones(1))[0] == 0.0
