"""The picture of the valve, drawn off-screen with PyVista."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import AvneoError
from avneo_fem.results.drawing import Drawing, add_legend, add_light, add_valve
from avneo_fem.results.writing import written_whole

__all__ = ["PictureError", "draw_valve"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

_VIEWS = (
    ("from the aorta", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    ("from the ventricle", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ("from the side", (1.0, -0.75, 0.75), (0.0, 0.0, 1.0)),
)


class PictureError(AvneoError):
    """The picture cannot be drawn on this machine; the results are not affected."""


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _pyvista() -> Any:
    """PyVista, set up to draw without a display.

    Raises
    ------
    PictureError
        When it is not installed, or when VTK would end the process rather than raise.
    """
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        # VTK ends the process without it
        if not _loads("libEGL.so.1"):
            raise PictureError("valve.png needs libEGL.so.1 (Debian package libegl1)")
    try:
        import pyvista
    except ImportError as error:
        raise PictureError(f"valve.png needs pyvista (pip install '.[viz]'): {error}") from None
    return pyvista


def _demand_renderer(plotter: Any) -> None:
    """Raise PictureError where VTK's last resort is left: without its library it would crash."""
    if plotter.render_window.GetClassName() == "vtkOSOpenGLRenderWindow" and not any(
        map(_loads, ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"))
    ):
        raise PictureError("valve.png: VTK finds no display, no EGL device and no OSMesa here")


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
    pyvista = _pyvista()
    drawing = Drawing(
        cusps, radius, suture_lines, commissures, triple_contact_point, contact_curves
    )
    heights = np.concatenate([points[:, 2] for points, _ in cusps])
    margin = 0.15 * radius
    lower, upper = height_range or (heights.min() - margin, heights.max() + margin)
    middle = np.array([0.0, 0.0, (lower + upper) / 2.0])
    plotter = None
    try:
        plotter = pyvista.Plotter(
            off_screen=True,
            shape=(1, len(_VIEWS) + 1),
            col_weights=[1.0] * len(_VIEWS) + [0.33],
            window_size=list(size),
            border=False,
        )
        _demand_renderer(plotter)
        for number, (label, direction, up) in enumerate(_VIEWS):
            plotter.subplot(0, number)
            plotter.set_background("white")
            add_valve(plotter, pyvista, drawing, lower, upper)
            along = np.asarray(direction) / np.linalg.norm(direction)
            plotter.camera.position = middle + 8.0 * radius * along
            plotter.camera.focal_point = middle
            plotter.camera.up = up
            plotter.enable_parallel_projection()
            plotter.camera.parallel_scale = 1.3 * radius
            plotter.renderer.reset_camera_clipping_range()
            plotter.add_text(label, position="lower_edge", font_size=11, color="black")
            add_light(plotter, pyvista)
        plotter.subplot(0, len(_VIEWS))
        plotter.set_background("white")
        add_legend(plotter, pyvista, drawing, title)
        plotter.enable_anti_aliasing("ssaa")
        with written_whole(path) as temporary:
            plotter.screenshot(str(temporary))
    except RuntimeError as error:
        raise PictureError(f"{path}: VTK cannot draw here: {error}") from error
    finally:
        if plotter is not None:
            plotter.close()
