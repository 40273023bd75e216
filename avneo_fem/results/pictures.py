"""Pictures of valves, drawn off-screen with PyVista."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from avneo_fem.results.drawing import Drawing, add_legend
from avneo_fem.results.rendering import VIEWS, PictureError, add_view, picture

__all__ = ["Panel", "PictureError", "draw_grid", "draw_valve"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]


@dataclass(frozen=True)
class Panel:
    """One field of a grid of valves: what, seen from where (a name in ``VIEWS``), and its label."""

    drawing: Drawing
    view: str
    label: str


def _heights(drawing: Drawing) -> tuple[float, float]:
    """Part of the root that the cusps need, with a margin [mm]."""
    heights = np.concatenate([points[:, 2] for points, _ in drawing.cusps])
    margin = 0.15 * drawing.radius
    return float(heights.min() - margin), float(heights.max() + margin)


def draw_valve(
    path: str | Path,
    cusps: Sequence[tuple[Array, Indices]],
    radius: float,
    suture_lines: Sequence[Array],
    commissures: Array,
    *,
    triple_contact_point: Array | None = None,
    contact_curves: Sequence[Array] = (),
    height_range: tuple[float, float] | None = None,
    title: str = "",
    size: tuple[int, int] = (2000, 700),
) -> None:
    """Draw the valve from the aorta, from the ventricle and from the side as a PNG file.

    Parameters
    ----------
    path : str or Path
        ``….png``, written whole or not at all.
    cusps : sequence of (points (n, 3), triangles (m, 3))
        The mid-surfaces [mm].
    radius : float
        R of the root, a cylinder about the z axis [mm].
    suture_lines : sequence of (k, 3) arrays
        Aortic suture lines, drawn dark [mm].
    commissures : (3, 3) array
        A_0, A_1, A_2, red balls [mm].
    triple_contact_point : (3,) array, optional
        C, a green ball [mm].
    contact_curves : sequence of (k, 3) arrays
        Curves A_iC in the plane of commissures, blue [mm].
    height_range : (lower, upper), optional
        Part of the root to draw [mm]; by default what the cusps need.
    title : str
        Put above the legend.
    size : (int, int)
        Width and height [pixels].

    Raises
    ------
    PictureError
        When this machine cannot draw it.
    """
    drawing = Drawing(
        cusps, radius, suture_lines, commissures, triple_contact_point, contact_curves
    )
    heights = height_range or _heights(drawing)
    count = len(VIEWS)
    with picture(path, size, shape=(1, count + 1), col_weights=[1.0] * count + [0.33]) as drawn:
        plotter, pyvista = drawn
        for number, view in enumerate(VIEWS):
            plotter.subplot(0, number)
            add_view(plotter, pyvista, drawing, view, heights, view)
        plotter.subplot(0, count)
        plotter.set_background("white")
        add_legend(plotter, pyvista, drawing, title)


def draw_grid(
    path: str | Path, rows: Sequence[Sequence[Panel | None]], *, field: tuple[int, int] = (600, 640)
) -> None:
    """Draw several valves as a grid, all to the same scale if their roots are, as a PNG file.

    Parameters
    ----------
    path : str or Path
        ``….png``, written whole or not at all.
    rows : sequence of sequences of Panel or None
        All rows of one length; None leaves a field white.
    field : (int, int)
        Width and height of one field [pixels].

    Raises
    ------
    ValueError
        For rows that are empty or of different lengths.
    PictureError
        When this machine cannot draw it.
    """
    widths = {len(row) for row in rows}
    if len(widths) != 1 or widths == {0}:
        raise ValueError(f"rows must be of one length, at least 1; got {sorted(widths)}")
    shape = (len(rows), widths.pop())
    with picture(path, (field[0] * shape[1], field[1] * shape[0]), shape=shape) as drawn:
        plotter, pyvista = drawn
        for i, row in enumerate(rows):
            for j, panel in enumerate(row):
                plotter.subplot(i, j)
                plotter.set_background("white")
                if panel is not None:
                    heights = _heights(panel.drawing)
                    add_view(plotter, pyvista, panel.drawing, panel.view, heights, panel.label)
