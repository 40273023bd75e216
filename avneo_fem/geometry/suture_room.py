"""Whether every cusp has its own suture line on its side of its contact surfaces."""

from __future__ import annotations

import numpy as np

from avneo_fem.errors import SceneError
from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene_schema import Scene

__all__ = ["require_suture_room"]

_SAMPLES = 400


def require_suture_room(scene: Scene, geometry: ValveGeometry, wedges: ContactWedgeFamily) -> None:
    """Refuse a valve in which a contact surface passes behind the suture line of its cusp.

    The contact curves (3.3) of large cusps turn in a spiral. Between a flat angle of the triangle
    A_0 A_1 A_2 and the wall there may be no room for that: the curve then reaches the wall, and the
    sutured edge, which does not move, lies beyond the surface that the cusp has to keep.

    Parameters
    ----------
    scene : Scene
        How much of that ``solver.inside_tolerance`` allows.
    geometry : ValveGeometry
    wedges : ContactWedgeFamily

    Raises
    ------
    SceneError
        Names the free edges, the cusp, and how far and how much of its line lies beyond.
    """
    for cusp in geometry.cusps:
        line = cusp.suture_line
        points = line.point(np.linspace(0.0, line.length, _SAMPLES + 1))
        distance = wedges.wedge(cusp.index, 1.0).signed_distance(points)
        if distance.min() < -scene.inside_tolerance(cusp.thickness):
            share = 100.0 * float((distance < 0.0).mean())
            raise SceneError(
                "template.free_edge_length",
                [each.template.free_edge_length for each in scene.cusp],
                f"the contact surface of cusp {cusp.index} passes behind its suture line by"
                f" {-distance.min():.2f} mm, over {share:.0f} % of it; use shorter free edges, or"
                ' contact.method = "virtual_planes"',
            )
