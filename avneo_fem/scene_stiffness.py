"""Stiffnesses that a scene does not state: those for Table 1's material, in proportion to E.

What a penalty must hold back is the sheet, so it is the ratio of the two that decides how far it
gives way, and how well conditioned the tangent is. A scene in other units of stress, or of a
sheet a hundred times stiffer, then behaves as it does for Table 1's 1000 kPa.
"""

from __future__ import annotations

from math import isfinite
from typing import Any

from pydantic import BaseModel

from avneo_fem.scene_fidelity import with_defaults
from avneo_fem.scene_method import Clamp, Contact, FreeEdge, Layers, Material, Wall

__all__ = ["with_stiffnesses"]

_TABLES: dict[str, type[BaseModel]] = {
    "free_edge": FreeEdge,
    "contact": Contact,
    "wall": Wall,
    "clamp": Clamp,
    "layers": Layers,
}
_KEYS = ("stiffness", "maximum_stiffness")
#: E of the paper's Table 1, for which the schema's defaults are [kPa]
_TABLE_1: float = Material().young_modulus


def with_stiffnesses(data: dict[str, Any]) -> dict[str, Any]:
    """What is given of a scene, and beneath it penalty stiffnesses in proportion to its E.

    Parameters
    ----------
    data : dict
        Keyword arguments of :class:`avneo_fem.scene.Scene`, as for
        :func:`avneo_fem.scene_fidelity.with_bundle`; an E that is no positive number is left to
        the schema to refuse.
    """
    material = data.get("material", {})
    if isinstance(material, BaseModel):
        material = material.model_dump()
    modulus = material.get("young_modulus", _TABLE_1) if isinstance(material, dict) else _TABLE_1
    if isinstance(modulus, bool) or not isinstance(modulus, int | float):
        return data
    if not isfinite(modulus) or modulus <= 0.0 or modulus == _TABLE_1:
        return data
    ratio = modulus / _TABLE_1
    return with_defaults(
        data,
        {
            name: {
                key: ratio * table.model_fields[key].default
                for key in _KEYS
                if key in table.model_fields
            }
            for name, table in _TABLES.items()
        },
    )
