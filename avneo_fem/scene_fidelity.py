"""The dial: bundles of defaults from a quick look to the yardstick of the others.

A bundle changes *defaults* only: what a scene states itself, in its file, in code or by ``--set``,
wins. ``mesh.size`` is a length of the scene, so a bundle multiplies it instead. Suturing knows
triangles of degree 1, whose strain is constant, so there is no degree and no quadrature to choose;
bending is the model, not its quality, and stays on in every bundle (``material.bending = false``
is one entry away). What the bundles cost and miss is measured in docs/tradeoff.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel

__all__ = ["FIDELITIES", "Fidelity", "with_bundle", "with_defaults"]


@dataclass(frozen=True)
class Fidelity:
    """One position of the dial.

    Attributes
    ----------
    size_factor : float
        What ``mesh.size`` is multiplied by.
    purpose : str
        What it is for.
    entries : mapping of table to mapping of key to value
        Defaults that differ from the schema's.
    """

    size_factor: float
    purpose: str
    entries: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


#: The bundles by name, from quick to exact; ``standard`` is the schema as it stands.
FIDELITIES: dict[str, Fidelity] = {
    "draft": Fidelity(
        2.0,
        "sizing at the screen: no crossing, and inside; no equilibrium is claimed",
        {"solver": {"quality": "approximate", "boundary_steps": 10}},
    ),
    "standard": Fidelity(1.0, "the paper's mesh, in equilibrium"),
    "fine": Fidelity(0.7, "about twice the triangles"),
    "reference": Fidelity(0.5, "what the others are measured against"),
}


def with_bundle(data: dict[str, Any]) -> dict[str, Any]:
    """What is given of a scene, and beneath it the entries of its ``fidelity``.

    Parameters
    ----------
    data : dict
        Keyword arguments of :class:`avneo_fem.scene.Scene`; tables are dictionaries, or objects
        whose entries count as given where they were set. Nothing is checked: values that are no
        tables, and a fidelity that does not exist, are left to the schema.
    """
    name = data.get("fidelity", "standard")
    bundle = FIDELITIES.get(name) if isinstance(name, str) else None
    return with_defaults(data, bundle.entries) if bundle else dict(data)


def with_defaults(
    data: dict[str, Any], defaults: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """What is given of a scene, and other defaults than the schema's beneath it.

    Parameters
    ----------
    data : dict
        As for :func:`with_bundle`.
    defaults : mapping of table to mapping of key to value
    """
    completed = dict(data)
    for table, entries in defaults.items():
        given = data.get(table, {})
        if isinstance(given, dict):
            completed[table] = {**entries, **given}
        elif isinstance(given, BaseModel):
            missing = {key: entries[key] for key in entries if key not in given.model_fields_set}
            completed[table] = given.model_copy(update=missing)
    return completed
