"""What a picture of the valve consists of: surfaces, lines, light and legend in PyVista."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.valve_geometry import ValveGeometry

__all__ = ["CUSP_COLOURS", "Drawing", "add_legend", "add_light", "add_valve", "drawing_of"]

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

#: Colours of cusp 0, 1, 2; apart from each other also to colour-blind eyes.
CUSP_COLOURS = ("#e8a33d", "#5aa9d6", "#4fae7b")
_SUTURE, _CURVE, _COMMISSURE, _TRIPLE = "#222222", "#1f3fd0", "#d62020", "#18c018"
_ROOT = "#d98880"


@dataclass(frozen=True)
class Drawing:
    """What is shown, see :func:`avneo_fem.results.pictures.draw_valve`."""

    cusps: Sequence[tuple[Array, Indices]]
    radius: float
    suture_lines: Sequence[Array]
    commissures: Array
    triple_contact_point: Array | None
    contact_curves: Sequence[Array]


def drawing_of(geometry: ValveGeometry, cusps: Sequence[tuple[Array, Indices]]) -> Drawing:
    """Cusps, as (points (n, 3) [mm], triangles (m, 3)), with the lines and points of their
    valve."""
    lines = [
        cusp.suture_line.point(np.linspace(0.0, cusp.suture_line.length, 200))
        for cusp in geometry.cusps
    ]
    return Drawing(
        cusps,
        geometry.root.radius,
        lines,
        geometry.commissures.points,
        geometry.triple_contact.point,
        (),
    )


def add_valve(plotter: Any, pyvista: Any, drawing: Drawing, lower: float, upper: float) -> None:
    """Add all actors to the active view."""
    for index, (points, triangles) in enumerate(drawing.cusps):
        surface = pyvista.PolyData.from_regular_faces(np.asarray(points, float), triangles)
        plotter.add_mesh(
            surface,
            color=CUSP_COLOURS[index % 3],
            smooth_shading=True,
            ambient=0.3,
            diffuse=0.75,
            specular=0.2,
            specular_power=15,
        )
        # a rim tells the free edges of neighbouring cusps apart
        rim = surface.extract_feature_edges(
            boundary_edges=True,
            feature_edges=False,
            manifold_edges=False,
            non_manifold_edges=False,
        )
        plotter.add_mesh(rim, color="#404040", line_width=2)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = drawing.radius * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    bottom, top = (circle + np.array([0.0, 0.0, height]) for height in (lower, upper))
    wall = pyvista.StructuredGrid(*np.stack([bottom, top], axis=1).transpose(2, 0, 1)[..., None])
    plotter.add_mesh(wall, color=_ROOT, opacity=0.16, lighting=False)
    for end in (bottom, top):
        plotter.add_mesh(pyvista.lines_from_points(end), color="#b07070", line_width=2)
    lines = [(line, _SUTURE) for line in drawing.suture_lines]
    for line, colour in lines + [(line, _CURVE) for line in drawing.contact_curves]:
        tube = pyvista.lines_from_points(np.asarray(line, float)).tube(
            radius=0.011 * drawing.radius
        )
        plotter.add_mesh(tube, color=colour)
    balls = [(point, _COMMISSURE) for point in np.asarray(drawing.commissures, float)]
    if drawing.triple_contact_point is not None:
        balls.append((np.asarray(drawing.triple_contact_point, float), _TRIPLE))
    for centre, colour in balls:
        ball = pyvista.Sphere(radius=0.03 * drawing.radius, center=centre)
        plotter.add_mesh(ball, color=colour, ambient=0.3)


def add_light(plotter: Any, pyvista: Any) -> None:
    """Light that goes with the camera: the same for every cusp, slanted so that folds show."""
    plotter.remove_all_lights()
    for position, intensity in (((0.0, 0.0, 1.0), 0.8), ((-0.4, 0.5, 0.8), 0.3)):
        light = pyvista.Light(light_type="camera light", intensity=intensity)
        light.position = position
        plotter.add_light(light)


def add_legend(plotter: Any, pyvista: Any, drawing: Drawing, title: str) -> None:
    """Fill the active (narrow) view with the title and what the colours mean."""
    entries = [(f"cusp {k}", CUSP_COLOURS[k % 3]) for k in range(len(drawing.cusps))]
    entries += [("suture line", _SUTURE), ("commissure", _COMMISSURE)]
    if len(drawing.contact_curves):
        entries.append(("contact curve", _CURVE))
    if drawing.triple_contact_point is not None:
        entries.append(("triple contact", _TRIPLE))
    entries.append(("aortic root", _ROOT))
    plotter.add_text(title, position=(0.05, 0.85), viewport=True, font_size=12, color="black")
    for row, (text, colour) in enumerate(entries):
        height = 0.75 - 0.06 * row
        mark = pyvista.Plane(center=(-0.1, height - 0.5, 0.0), i_size=0.025, j_size=0.025)
        plotter.add_mesh(mark, color=colour, lighting=False)
        plotter.add_text(
            text, position=(0.22, height - 0.014), viewport=True, font_size=9, color="black"
        )
    plotter.enable_parallel_projection()
    plotter.camera.position, plotter.camera.focal_point = (0.0, 0.0, 5.0), (0.0, 0.0, 0.0)
    plotter.camera.up = (0.0, 1.0, 0.0)
    # the view is one unit high, so that mark and text use the same fractions
    plotter.camera.parallel_scale = 0.5
    plotter.renderer.reset_camera_clipping_range()
