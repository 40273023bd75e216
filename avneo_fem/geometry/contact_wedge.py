"""Contact wedges of the three cusps: one signed distance per cusp and lambda (paper §3.3.2).

Cusp i must stay in the wedge between the contact curves that end in A_(i+1) and A_(i+2); for
lambda = 0 the wedge is straight with its apex at A_i, for lambda = 1 the three wedges share the
apex C and touch along the contact curves.

The two methods that the paper compares itself with have half-planes for contact surfaces, which
are there at once: the virtual contact planes of [5] through C and the commissures, and the
symmetry planes of [13, 14] through the circumcentre and the commissures.
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
from avneo_fem.scene_method import ContactMethod

__all__ = ["ContactWedge", "ContactWedgeFamily"]

Array = NDArray[np.float64]

_THIRDS = np.arange(4.0)[:, None] / 3.0


def _segment(start: Array, end: Array) -> Array:
    """The straight segment as an evenly spaced control polygon (4, 2)."""
    return np.asarray(start + _THIRDS * (end - start))


@dataclass(frozen=True, eq=False)
class ContactWedgeFamily:
    """Contact curves of a valve and the wedges that lead to them.

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
    method : "bezier", "virtual_planes" or "symmetry_planes"
        The curves (3.3) with the path (3.5) to them; or segments from C; or segments from the
        circumcentre, which contains the symmetry planes of a symmetric valve only
        (:func:`avneo_fem.geometry.symmetry.require_symmetry`).

    Attributes
    ----------
    sigma : (3,) array or None
        sigma* of (3.3c), matched to c_i (design.md §1); None for planes, which have none.

    Raises
    ------
    SceneError
        When the points do not lie as said, or no curve has the length c_i.
    """

    commissures: CommissurePlane
    triple_contact_point: Array
    contact_lengths: Array
    omega: float = 0.5
    method: ContactMethod = "bezier"
    sigma: Array | None = field(init=False)
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
        if self.is_fixed:
            apex = centre if self.method == "virtual_planes" else np.zeros(2)
            sigma, polygons = None, np.stack([_segment(apex, end) for end in self._ends])
        else:
            sigma, polygons = self._curves(centre)
            sigma.flags.writeable = False
        polygons.flags.writeable = False
        keep(self, "sigma", sigma)
        keep(self, "_polygons", polygons)

    def _curves(self, centre: Array) -> tuple[Array, Array]:
        """sigma* (3,) and control polygons (3, 4, 2) of (3.3)."""
        sigma, polygons = np.zeros(3), np.zeros((3, 4, 2))
        for i in range(3):
            end, neighbour = self._ends[i], self._ends[(i + 1) % 3]
            deflection = deflection_point(centre, end, neighbour, self.commissures.circumradius)
            length = float(self.contact_lengths[i])
            sigma[i] = match_length(centre, end, deflection, length, self.omega)
            polygons[i] = control_points(centre, end, deflection, sigma[i], self.omega)
        return sigma, polygons

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

    @property
    def is_fixed(self) -> bool:
        """Whether the wedges do not depend on lambda: contact planes are there at once."""
        return self.method != "bezier"

    def levels(self, steps: int) -> tuple[float, ...]:
        """The lambdas to go through: 0, 1/steps, ..., 1; just 1 where the wedges are fixed."""
        return (1.0,) if self.is_fixed else tuple(k / steps for k in range(steps + 1))

    def control_points(self, i: int) -> Array:
        """Y_i (4, 2) of (3.3a) in plane coordinates, from the common apex to A_i."""
        return self._polygons[i]

    def wedge(self, cusp_index: int, lam: float) -> ContactWedge:
        """Contact wedge of a cusp for lambda in [0, 1] (3.5); the same for all if ``is_fixed``.

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
        if self.is_fixed:
            return ContactWedge(
                PlanarWedge(self._polygons[ends]), self.commissures, cusp_index, 1.0
            )
        straight = np.stack([_segment(self._ends[cusp_index], self._ends[i]) for i in ends])
        section = PlanarWedge(lam * self._polygons[ends] + (1.0 - lam) * straight)
        if section.crosses_itself():
            lengths = np.asarray(self.contact_lengths)
            raise SceneError(
                "template.free_edge_length",
                # l_i = c_j + c_k, to the digits that were given
                [float(f"{length:.12g}") for length in lengths.sum() - lengths],
                f"the contact curves of cusp {cusp_index} cross each other at lambda = {lam:g}; "
                'use cusps of less unequal free edges, or contact.method = "virtual_planes"',
            )
        return ContactWedge(section, self.commissures, cusp_index, float(lam))
