"""Symmetry of a valve: three equal cusps a third of a turn apart."""

from __future__ import annotations

import numpy as np

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.scene_schema import Scene

__all__ = ["require_symmetry"]

#: chords that differ by less, relative to the longest, are equal
_EQUAL = 1e-9


def require_symmetry(scene: Scene, plane: CommissurePlane) -> None:
    """Refuse ``contact.method = "symmetry_planes"`` for a valve without that symmetry.

    The half-planes through the circumcentre and the commissures are symmetry planes, and so the
    surfaces on which equal cusps meet, only when all chords and all cusps are equal (the
    symmetric geometries of [13, 14] of the paper).

    Raises
    ------
    SceneError
        Names ``contact.method``, what differs, and the methods that would do.
    """
    if scene.contact.method != "symmetry_planes":
        return
    chords = plane.chord_lengths
    unequal = []
    if np.ptp(chords) > _EQUAL * chords.max():
        unequal.append(f"chords ({', '.join(f'{a:.6g}' for a in chords)}) mm")
    for name in ("template", "suture_line"):
        tables = [getattr(cusp, name) for cusp in scene.cusp]
        keys = [k for k in type(tables[0]).model_fields if len({getattr(t, k) for t in tables}) > 1]
        if keys:
            key = keys[0]
            values = ", ".join(str(getattr(table, key)) for table in tables)
            unequal.append(f"{name}.{key} ({values})")
    if unequal:
        raise SceneError(
            "contact.method",
            scene.contact.method,
            'must be "virtual_planes" or "bezier" for a valve that is not symmetric: its'
            f" {' and its '.join(unequal)} would have to be equal",
        )
