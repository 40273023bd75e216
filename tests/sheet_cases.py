"""Flat and rolled sheets, whose distances and curves are known."""

from __future__ import annotations

from typing import Any

import numpy as np


def sheet(n: int, width: float = 10.0, height: float = 6.0) -> tuple[Any, Any]:
    """(points (m, 2), triangles) of a rectangle with its lower edge's middle at the origin."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 2 * n + 1), np.linspace(0.0, 1.0, n + 1))
    at = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (k.ravel() for k in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    points = np.column_stack([width * x.ravel(), height * y.ravel()])
    return points, np.vstack([np.c_[a, b, c], np.c_[a, c, d]])


def lifted(points: Any, z: float = 0.0) -> Any:
    """The flat points in space."""
    return np.column_stack([points, np.full(len(points), z)])


def rolled(points: Any, radius: float) -> Any:
    """The sheet rolled onto a cylinder about the x axis."""
    angle = points[:, 1] / radius
    return np.column_stack([points[:, 0], radius * np.sin(angle), -radius * np.cos(angle)])
