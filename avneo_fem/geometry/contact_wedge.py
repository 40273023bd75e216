"""Contact wedges of the three cusps: one signed distance per cusp and lambda (paper §3.3.2).

Cusp i must stay in the wedge between the contact curves that end in A_(i+1) and A_(i+2); for
lambda = 0 the wedge is straight with its apex at A_i, for lambda = 1 the three wedges share the
apex C and touch along the contact curves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.contact_curve import control_points, deflection_point, match_length
from avneo_fem.geometry.extruded_wedge import ContactWedge
from avneo_fem.geometry.planar_wedge import PlanarWedge

__all__ = ["ContactWedge", "ContactWedgeFamily"]

Array = NDArray[np.float64]

_THIRDS = np.arange(4.0)[:, None] / 3.0


@dataclass(frozen=True, eq=False)
class ContactWedgeFamily:
    """Contact curves (3.3) of a valve and the wedges (3.5) that lead to them.

    Parameters
    ----------
    commissures : CommissurePlane
        Points A_i, plane coordinates and the circumradius R.
    triple_contact_point : (3,) array
        C [mm], in the triangle of the commissures (a side of it included).
    contact_lengths : (3,) array
        c_i [mm], length of the contact curve from A_i to C.
    omega : float
        omega of (3.3a).

    Attributes
    ----------
    sigma : (3,) array
        sigma* of (3.3c), matched to c_i (design.md §1).

    Raises
    ------
    SceneError
        When the points do not lie as said, or no curve has the length c_i.
    """

    commissures: CommissurePlane
    triple_contact_point: Array
    contact_lengths: Array
    omega: float = 0.5
    sigma: Array = field(init=False)
    _ends: Array = field(init=False, repr=False)
    _polygons: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        keep = object.__setattr__
        for name in ("triple_contact_point", "contact_lengths"):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise SceneError(name, value.tolist(), "must be finite, of shape (3,)")
            value.flags.writeable = False
            keep(self, name, value)
        if not (np.isfinite(self.omega) and self.omega > 0.0):
            raise SceneError("contact.omega", self.omega, "must be greater than 0")
        if self.contact_lengths.min() <= 0.0:
            raise SceneError(
                "template.free_edge_length",
                self.contact_lengths.tolist(),
                "contact lengths c_i = (l_j + l_k - l_i) / 2 must be greater than 0: each free "
                "edge must be shorter than the other two together",
            )
        plane = self.commissures
        keep(self, "_ends", plane.project(plane.points))
        centre = plane.project(self.triple_contact_point)
        self._check_centre(centre)
        sigma, polygons = np.zeros(3), np.zeros((3, 4, 2))
        for i in range(3):
            end, neighbour = self._ends[i], self._ends[(i + 1) % 3]
            deflection = deflection_point(centre, end, neighbour, plane.circumradius)
            length = float(self.contact_lengths[i])
            sigma[i] = match_length(centre, end, deflection, length, self.omega)
            polygons[i] = control_points(centre, end, deflection, sigma[i], self.omega)
        for name, value in {"sigma": sigma, "_polygons": polygons}.items():
            value.flags.writeable = False
            keep(self, name, value)

    def _check_centre(self, centre: Array) -> None:
        weights = np.linalg.solve(np.vstack([self._ends.T, np.ones(3)]), np.r_[centre, 1.0])
        off = np.linalg.norm(self.commissures.embed(centre) - self.triple_contact_point)
        tolerance = 1e-9 * self.commissures.circumradius
        if weights.min() < -1e-9 or weights.max() > 1.0 - 1e-9 or off > tolerance:
            raise SceneError(
                "triple_contact_point",
                self.triple_contact_point.tolist(),
                "must lie in the triangle of the commissures, away from its corners",
            )

    def control_points(self, i: int) -> Array:
        """Y_i (4, 2) of (3.3a) in plane coordinates, from C to A_i."""
        return self._polygons[i]

    def wedge(self, cusp_index: int, lam: float) -> ContactWedge:
        """Contact wedge of a cusp for lambda in [0, 1] (3.5).

        Raises
        ------
        SceneError
            For a cusp other than 0, 1, 2, a lambda outside [0, 1], or when the two curves cross,
            which leaves no wedge (seen with very unequal contact lengths only).
        """
        if cusp_index not in (0, 1, 2):
            raise SceneError("cusp", cusp_index, "must be 0, 1 or 2")
        if not 0.0 <= lam <= 1.0:
            raise SceneError("lam", lam, "must lie between 0 and 1")
        ends = [(cusp_index + 1) % 3, (cusp_index + 2) % 3]
        apex = self._ends[cusp_index]
        straight = np.stack([apex + _THIRDS * (self._ends[i] - apex) for i in ends])
        section = PlanarWedge(lam * self._polygons[ends] + (1.0 - lam) * straight)
        if section.crosses_itself():
            raise SceneError(
                "template.free_edge_length",
                self.contact_lengths.tolist(),
                f"the contact curves of cusp {cusp_index} cross each other at lambda = {lam:g}; "
                "use cusps of less unequal free edges",
            )
        return ContactWedge(section, self.commissures, cusp_index, float(lam))
