"""Whether contact surfaces leave a cusp room between them and the wall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.cusp_geometry import CuspGeometry
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene_schema import Scene

__all__ = ["narrow_room_warning", "require_suture_room"]

Array = NDArray[np.float64]

_SAMPLES = 400
#: by which share it must be wider on both sides of a narrow place
_WIDER = 0.2


def _along_the_line(cusp: CuspGeometry, wedges: ContactWedgeFamily) -> tuple[Array, Array]:
    """Points (n, 3) of a suture line, and how far each is from the cusp's wedge (n,) [mm]."""
    line = cusp.suture_line
    points = line.point(np.linspace(0.0, line.length, _SAMPLES + 1))
    return points, wedges.wedge(cusp.index, 1.0).signed_distance(points)


def narrow_room_warning(geometry: ValveGeometry, wedges: ContactWedgeFamily) -> str | None:
    """Where a contact surface passes nearer to the wall than the cusp is thick; None if nowhere.

    Beside its commissures every cusp has less, that is how it is sewn on; what counts is a narrow
    place between two wider ones, as beside a flat angle of the triangle A_0 A_1 A_2. Sheet that is
    drawn in there is squeezed, or stretched over it.
    """
    found = []
    for cusp in geometry.cusps:
        points, room = _along_the_line(cusp, wedges)
        wider = np.minimum(np.maximum.accumulate(room), np.maximum.accumulate(room[::-1])[::-1])
        margin = _WIDER * np.maximum(room, 0.1 * cusp.thickness)
        narrow = np.flatnonzero((room < cusp.thickness) & (wider > room + margin))
        if narrow.size:
            least = narrow[np.argmin(room[narrow])]
            degrees = np.degrees(np.arctan2(points[least, 1], points[least, 0])) % 360.0
            found.append(
                f"the contact surface of cusp {cusp.index} passes {room[least]:.2f} mm from the"
                f" wall at {degrees:.0f} degrees, where the cusp is {cusp.thickness:g} mm thick"
            )
    return "; ".join(found) + ": triangles there may be stretched" if found else None


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
        _, distance = _along_the_line(cusp, wedges)
        if distance.min() < -scene.inside_tolerance(cusp.thickness):
            share = 100.0 * float((distance < 0.0).mean())
            raise SceneError(
                "template.free_edge_length",
                [each.template.free_edge_length for each in scene.cusp],
                f"the contact surface of cusp {cusp.index} passes behind its suture line by"
                f" {-distance.min():.2f} mm, over {share:.0f} % of it; use shorter free edges, or"
                ' contact.method = "virtual_planes"',
            )
