"""VTK off-screen through PyVista: whether this machine can draw, and one view of the valve."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from avneo_fem.errors import AvneoError
from avneo_fem.results.drawing import Drawing, add_light, add_valve
from avneo_fem.results.writing import written_whole

__all__ = ["VIEWS", "PictureError", "add_view", "picture"]

#: Views by name: where the camera stands, and what is up.
VIEWS = {
    "from the aorta": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "from the ventricle": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "from the side": ((1.0, -0.75, 0.75), (0.0, 0.0, 1.0)),
}


class PictureError(AvneoError):
    """The picture cannot be drawn on this machine; the results are not affected."""


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _pyvista(name: str) -> Any:
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
            raise PictureError(f"{name} needs libEGL.so.1 (Debian package libegl1)")
    try:
        import pyvista
    except ImportError as error:
        raise PictureError(f"{name} needs pyvista (pip install '.[viz]'): {error}") from None
    return pyvista


def _demand_renderer(plotter: Any, name: str) -> None:
    """Raise PictureError where VTK's last resort is left: without its library it would crash."""
    if plotter.render_window.GetClassName() == "vtkOSOpenGLRenderWindow" and not any(
        map(_loads, ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"))
    ):
        raise PictureError(f"{name}: VTK finds no display, no EGL device and no OSMesa here")


@contextmanager
def picture(path: str | Path, size: tuple[int, int], **layout: Any) -> Iterator[tuple[Any, Any]]:
    """PyVista's plotter and module to fill with views; the PNG file is written at the end.

    Parameters
    ----------
    path : str or Path
        ``….png``, written whole or not at all.
    size : (int, int)
        Width and height [pixels].
    **layout
        ``shape``, ``col_weights`` and ``row_weights`` of the plotter.

    Raises
    ------
    PictureError
        When this machine cannot draw it.
    """
    path = Path(path)
    pyvista = _pyvista(path.name)
    plotter = None
    try:
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size), border=False, **layout)
        _demand_renderer(plotter, path.name)
        yield plotter, pyvista
        plotter.enable_anti_aliasing("ssaa")
        with written_whole(path) as temporary:
            plotter.screenshot(str(temporary))
    except RuntimeError as error:
        raise PictureError(f"{path}: VTK cannot draw here: {error}") from error
    finally:
        if plotter is not None:
            plotter.close()


def add_view(
    plotter: Any,
    pyvista: Any,
    drawing: Drawing,
    view: str,
    heights: tuple[float, float],
    label: str,
) -> None:
    """Fill the active view: the valve in parallel projection, ``label`` below it.

    Parameters
    ----------
    view : str
        One of ``VIEWS``.
    heights : (float, float)
        Lower and upper end of the root that is drawn [mm].
    """
    lower, upper = heights
    middle = np.array([0.0, 0.0, (lower + upper) / 2.0])
    direction, up = VIEWS[view]
    plotter.set_background("white")
    add_valve(plotter, pyvista, drawing, lower, upper)
    along = np.asarray(direction) / np.linalg.norm(direction)
    plotter.camera.position = middle + 8.0 * drawing.radius * along
    plotter.camera.focal_point = middle
    plotter.camera.up = up
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 1.3 * drawing.radius
    plotter.renderer.reset_camera_clipping_range()
    plotter.add_text(label, position="lower_edge", font_size=11, color="black")
    add_light(plotter, pyvista)
