"""Cusps of quasi-optimal size for the root of a scene (paper section 4.4), and the new valve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import contact_lengths, quasi_optimal_lengths
from avneo_fem.geometry.sizing import ROUNDING, closing_lengths
from avneo_fem.geometry.triple_contact import triple_contact_point
from avneo_fem.geometry.valve_geometry import ValveGeometry, commissure_plane
from avneo_fem.scene import Scene, Template

__all__ = ["Resizing", "resize", "resized_scene"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Resizing:
    """Present and quasi-optimal sizes of the cusps of a scene.

    Attributes
    ----------
    chord_lengths : (3,) array
        a_i [mm].
    present, quasi_optimal, closing : (3,) arrays
        L_f [mm]: the scene's; 2 a_i / sqrt(3) (Proposition 3.2), for which nu* <= 1; and the
        shortest in the same proportions, for which nu* = 1.
    present_radii, radii : (3,) arrays
        R_s [mm] of the scene, and in its proportion to the quasi-optimal L_f (section 4.4).
    present_nu : float or None
        nu* now; None when the present lengths are inconsistent.
    present_problem : str or None
        Why they are.
    rebuilt : ValveGeometry
        The valve with the quasi-optimal sizes, all else kept.
    """

    chord_lengths: Array
    present: Array
    quasi_optimal: Array
    closing: Array
    present_radii: Array
    radii: Array
    present_nu: float | None
    present_problem: str | None
    rebuilt: ValveGeometry

    @property
    def verified(self) -> bool:
        """Whether the rebuilt valve keeps Proposition 3.2 and the scene's limits."""
        return self.rebuilt.triple_contact.nu_star <= 1.0 + ROUNDING and self.rebuilt.competent


def resized_scene(scene: Scene, lengths: ArrayLike) -> Scene:
    """The scene with other free-edge lengths (3,) [mm]; R_s keeps its proportion to L_f.

    The policy on competence becomes "warn": the verdict is to be told.
    """
    cusps = []
    for cusp, length in zip(scene.cusp, np.asarray(lengths, dtype=float).tolist(), strict=True):
        old = cusp.template
        changes = {
            "free_edge_length": length,
            "belly_radius": old.belly_radius * length / old.free_edge_length,
        }
        template = Template(**{**old.model_dump(), **changes})
        cusps.append(cusp.model_copy(update={"template": template}))
    competence = scene.competence.model_copy(update={"policy": "warn"})
    return scene.model_copy(update={"cusp": tuple(cusps), "competence": competence})


def resize(scene: Scene) -> Resizing:
    """Quasi-optimal sizes for the commissures of a scene, whatever its templates are.

    Raises
    ------
    SceneError
        For chords that form no triangle, a gap that leaves no suture line, and quasi-optimal
        cusps that are no templates or do not fit their suture lines.
    """
    plane = commissure_plane(scene)
    templates = [cusp.template for cusp in scene.cusp]
    present = np.array([template.free_edge_length for template in templates])
    nu, problem = None, None
    try:
        nu = triple_contact_point(plane.points, contact_lengths(present)).nu_star
    except SceneError as error:
        problem = str(error)
    wanted = quasi_optimal_lengths(plane.chord_lengths)
    other = resized_scene(scene, wanted)
    try:
        rebuilt = ValveGeometry.from_scene(other)
    except SceneError as error:
        raise SceneError(
            error.key,
            error.value,
            f"is the quasi-optimal size, with belly_radius in proportion; {error.valid}; L_f is"
            " given by the chords, so change corner_height or belly_radius in the scene",
        ) from None
    return Resizing(
        chord_lengths=plane.chord_lengths,
        present=present,
        quasi_optimal=wanted,
        closing=closing_lengths(plane),
        present_radii=np.array([template.belly_radius for template in templates]),
        radii=np.array([cusp.template.belly_radius for cusp in other.cusp]),
        present_nu=nu,
        present_problem=problem,
        rebuilt=rebuilt,
    )
