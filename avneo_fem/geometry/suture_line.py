"""Aortic suture lines (ASL), types A and B (paper Fig. 7a, 7b; design.md section 1)."""

from __future__ import annotations

from math import cos, pi, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem import scene
from avneo_fem.errors import SceneError
from avneo_fem.geometry.curve import PlanarPath
from avneo_fem.geometry.segments import Arc, Bezier, Line, Segment

__all__ = ["AorticSutureLine"]

Array = NDArray[np.float64]


def _type_a(half: float, shape: scene.SutureLine) -> Segment:
    """Half ellipse with semi-axes w/2 and H_b below the straight parts."""
    return Arc((0.0, -shape.commissure_height), (half, shape.belly_depth), pi, 2.0 * pi)


def _type_b(half: float, shape: scene.SutureLine) -> tuple[Segment, Segment]:
    """Ellipse to D, then the quartic Bezier curve from D to M (paper Fig. 7b)."""
    top, depth = -shape.commissure_height, shape.belly_depth
    theta = radians(shape.ellipse_end_degrees)
    centre, axis = -(1.0 - shape.skew) * half, shape.skew * half
    s_d, z_d = centre - axis * cos(theta), top - depth * sin(theta)
    slope_s, slope_z = axis * sin(theta), -depth * cos(theta)
    # along the tangent at D to s = w/2, or to z = -H_c where that comes first
    reach = min((half - s_d) / slope_s, -tan(theta))
    s_t, z_t = s_d + reach * slope_s, z_d + reach * slope_z
    control = (
        (s_d, z_d),
        (s_d + (s_t - s_d) / 3.0, z_d + (z_t - z_d) / 3.0),
        (s_d + 2.0 * (s_t - s_d) / 3.0, top - depth),
        (half, z_d + 2.0 * (z_t - z_d) / 3.0),
        (half, top),
    )
    return Arc((centre, top), (axis, depth), pi, pi + theta), Bezier(control)


class AorticSutureLine:
    """ASL of one cusp, wrapped on the cylinder x^2 + y^2 = R^2.

    The unfolded line runs in (s, z) from (-w/2, 0) down, round and up to (w/2, 0); s goes to the
    angle ``start_angle`` + (s + w/2)/R, z stays, so the wrap keeps lengths. Seen from +z the line
    runs counter-clockwise.

    Parameters
    ----------
    radius : float
        R of the root [mm].
    start_angle : float
        Polar angle of P_0 [radians].
    width : float
        w, the part of the wall's circumference it spans [mm].
    shape : scene.SutureLine
        Type and dimensions.
    key : str
        Scene name of the table, for errors.

    Attributes
    ----------
    unfolded : PlanarPath
        The line in (s, z) [mm].
    length : float
        l_a [mm].
    breaks : (k + 1,) float64
        Arc lengths of the joints [mm].
    ends : (2, 3) float64
        P_0 and P_1 [mm].

    Raises
    ------
    SceneError
        Unless 0 < w < 2 pi R.
    """

    def __init__(
        self,
        radius: float,
        start_angle: float,
        width: float,
        shape: scene.SutureLine,
        key: str = "suture_line",
    ) -> None:
        if not 0.0 < width < 2.0 * pi * radius:
            raise SceneError(
                f"{key}.width",
                width,
                f"must lie between 0 and the circumference {2.0 * pi * radius:.6g} mm of the root;"
                f" commissures.gap smaller by more than {-width:.6g} mm would do"
                if width <= 0.0
                else f"must be below the circumference {2.0 * pi * radius:.6g} mm of the root",
            )
        self.radius, self.start_angle, self.width, self.shape = radius, start_angle, width, shape
        half, top = width / 2.0, -shape.commissure_height
        middle = (_type_a(half, shape),) if shape.type == "A" else _type_b(half, shape)
        self.unfolded = PlanarPath(
            [Line((-half, 0.0), (-half, top)), *middle, Line((half, top), (half, 0.0))]
        )
        self.length, self.breaks = self.unfolded.length, self.unfolded.breaks
        self.ends: Array = self.point([0.0, self.length])
        self.ends.flags.writeable = False

    def _angle(self, s: ArrayLike) -> tuple[Array, Array]:
        """Polar angle (n,) [radians] and height z (n,) [mm] at arc lengths s (n,) [mm]."""
        flat = self.unfolded.point(s)
        return self.start_angle + (flat[:, 0] + self.width / 2.0) / self.radius, flat[:, 1]

    def point(self, s: ArrayLike) -> Array:
        """r_asl, points (n, 3) [mm] at arc lengths s (n,) in [0, l_a] [mm]."""
        angle, z = self._angle(s)
        return np.column_stack([self.radius * np.cos(angle), self.radius * np.sin(angle), z])

    def tangent(self, s: ArrayLike) -> Array:
        """tau_asl, unit tangents (n, 3) (paper §3.1); at a joint that of the later segment."""
        angle, _ = self._angle(s)
        flat = self.unfolded.tangent(s)
        around, up = flat[:, 0], flat[:, 1]
        return np.column_stack([-around * np.sin(angle), around * np.cos(angle), up])

    def inward_normal(self, s: ArrayLike) -> Array:
        """n_Sr, unit normals (n, 3) of the wall, towards the axis (paper §3.1)."""
        angle, _ = self._angle(s)
        return np.column_stack([-np.cos(angle), -np.sin(angle), np.zeros_like(angle)])

    def conormal(self, s: ArrayLike) -> Array:
        """b_asl = tau_asl x n_Sr, unit vectors (n, 3) (paper §3.1).

        The clamp (3.1) asks the cusp to leave the wall along -b_asl; at the bottom b_asl = +e_z.
        """
        return np.cross(self.tangent(s), self.inward_normal(s))
