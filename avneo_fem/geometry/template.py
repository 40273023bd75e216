"""Flat four-parameter template of a cusp (paper Fig. 7c; design.md section 1).

The centre of the belly arc is the origin, the corners are N_0 = (-L_f/2, H_i) and
N_1 = (L_f/2, H_i). The cusp suture line (CSL) runs from N_0 along a tangent to the arc of radius
R_s, round the bottom and back up to N_1; the free edge is two straight segments over the apex
(0, H_i + H_f).

The template exists when H_f > -H_i and R_s < q, q^2 = H_i^2 + L_f^2/4. Then its boundary is
simple: along every piece of it the polar angle about the origin grows monotonically, once round.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, atan, hypot, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from avneo_fem import scene
from avneo_fem.errors import SceneError
from avneo_fem.geometry.curve import PlanarPath
from avneo_fem.geometry.segments import Arc, Line

__all__ = ["CuspTemplate", "corner_height_for", "free_edge_length_for", "suture_length"]


def _angles(parameters: scene.Template) -> tuple[float, float, float]:
    """Length of one tangent [mm]; polar angle of its foot and half angle of the arc [radians].

    The first angle is measured from +y, the second is phi of design.md section 1.
    """
    p = parameters
    q = hypot(p.corner_height, p.free_edge_length / 2.0)
    tangent = sqrt((q - p.belly_radius) * (q + p.belly_radius))
    foot = atan(p.free_edge_length / (2.0 * p.corner_height)) + acos(p.belly_radius / q)
    return tangent, foot, pi - foot


def suture_length(parameters: scene.Template) -> float:
    """Length l_c = 2 R_s phi + 2 sqrt(q^2 - R_s^2) of the CSL [mm] (design.md section 1)."""
    tangent, _, phi = _angles(parameters)
    return 2.0 * (parameters.belly_radius * phi + tangent)


def free_edge_length_for(length: float, parameters: scene.Template) -> float | None:
    """Free edge length L_f [mm] that gives the CSL a wanted length, all else kept.

    Parameters
    ----------
    length : float
        Wanted length l_c of the CSL [mm].
    parameters : scene.Template
        Its ``free_edge_length`` is ignored.

    Returns
    -------
    float or None
        L_f on the branch L_f >= 2 R_s, where l_c grows with it; None when the CSL is longer than
        wanted even at L_f = 2 R_s, where it is shortest: l_c = pi R_s + 2 H_i.
    """

    def too_long(half: float) -> bool:
        changed = parameters.model_copy(update={"free_edge_length": 2.0 * half})
        return suture_length(changed) > length

    # l_c >= |N_0 N_1| = L_f bounds the wanted value from above
    half = _largest(too_long, parameters.belly_radius, length / 2.0)
    return None if half is None else 2.0 * half


def corner_height_for(length: float, parameters: scene.Template) -> float | None:
    """Corner height H_i [mm] that gives the CSL a wanted length, all else kept.

    Parameters
    ----------
    length : float
        Wanted length l_c of the CSL [mm], which grows with H_i.
    parameters : scene.Template
        Its ``corner_height`` is ignored.

    Returns
    -------
    float or None
        H_i; None when the CSL is longer than wanted even for the lowest corners, where they touch
        the belly arc or H_i = 0.
    """

    def too_long(height: float) -> bool:
        return suture_length(parameters.model_copy(update={"corner_height": height})) > length

    half, radius = parameters.free_edge_length / 2.0, parameters.belly_radius
    lowest = sqrt((radius - half) * (radius + half)) if radius > half else 0.0
    # a hair above, where the template exists; l_c >= 2 H_i bounds the wanted value from above
    return _largest(too_long, lowest + 1e-9 * (radius + half), length / 2.0)


def _largest(too_long: Callable[[float], bool], low: float, high: float) -> float | None:
    """The largest value that is not too long, by halving; None if ``low`` already is."""
    if too_long(low):
        return None
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (low, middle) if too_long(middle) else (middle, high)
    return (low + high) / 2.0


class CuspTemplate:
    """A template that exists.

    Parameters
    ----------
    parameters : scene.Template
        The four lengths and the thickness [mm].
    key : str
        Scene name of the table, for errors.

    Attributes
    ----------
    suture_line : PlanarPath
        CSL from N_0 over the bottom to N_1.
    free_edge : PlanarPath
        From N_0 over the apex to N_1.
    corners : (2, 2) float64
        N_0 and N_1 [mm].
    suture_length, free_edge_length : float
        Lengths of the two paths [mm] (mind: ``parameters.free_edge_length`` is L_f).
    intercommissural_length : float
        l = |N_0 N_1| = L_f [mm] (paper section 3.3).
    area : float
        Area [mm^2]: R_s t + R_s^2 phi + (H_i + H_f) L_f / 2, t the length of a tangent.
    thickness : float
        H [mm].

    Raises
    ------
    SceneError
        When there is no such template; names the dimension and the value that would do.
    """

    def __init__(self, parameters: scene.Template, key: str = "template") -> None:
        p = parameters
        half, height, radius = p.free_edge_length / 2.0, p.corner_height, p.belly_radius
        if p.free_edge_height <= -height:
            raise SceneError(
                f"{key}.free_edge_height",
                p.free_edge_height,
                "the free edge must stay above the centre of the belly arc:"
                f" H_f > -corner_height = {-height:.6g} mm",
            )
        if radius >= hypot(height, half):
            # R_s >= q implies R_s > H_i and R_s > L_f/2, so both roots are real
            raise SceneError(
                f"{key}.belly_radius",
                radius,
                "the corners must lie outside the belly arc:"
                f" R_s < sqrt(H_i^2 + L_f^2/4) = {hypot(height, half):.6g} mm,"
                f" or corner_height > {sqrt(radius**2 - half**2):.6g} mm,"
                f" or free_edge_length > {2.0 * sqrt(radius**2 - height**2):.6g} mm",
            )
        self.parameters, self.thickness = p, p.thickness
        tangent, foot, phi = _angles(p)
        left, right = (-half, height), (half, height)
        apex = (0.0, height + p.free_edge_height)
        touch_x, touch_y = radius * np.sin(foot), radius * np.cos(foot)
        self.suture_line = PlanarPath(
            [
                Line(left, (-touch_x, touch_y)),
                Arc((0.0, 0.0), (radius, radius), 1.5 * pi - phi, 1.5 * pi + phi),
                Line((touch_x, touch_y), right),
            ]
        )
        self.free_edge = PlanarPath([Line(left, apex), Line(apex, right)])
        self.corners: NDArray[np.float64] = np.array([left, right])
        self.corners.flags.writeable = False
        self.suture_length = self.suture_line.length
        self.free_edge_length = self.free_edge.length
        self.intercommissural_length = p.free_edge_length
        self.area = radius * tangent + radius**2 * phi + half * apex[1]
