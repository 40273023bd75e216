"""One case of the map: a scene at an extreme, and how it must end."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["ExtremeCase", "flat", "scene_text"]

Entries = Mapping[str, Any]


@dataclass(frozen=True)
class ExtremeCase:
    """A scene and what is expected of it, stated before it is run.

    Attributes
    ----------
    name : str
        Also that of the scene.
    group : str
        The axis it lies on.
    label : str
        Short text for its cell of the map.
    about : str
        What is extreme, and what was scaled along with it.
    entries : mapping
        Scene entries by dotted key, ``{"template.thickness": 0.1}``; ``cusp`` may be a list of
        three such mappings. What is left out keeps its default.
    infeasible : str
        Why no verified valve can come out; empty: one can.
    diagnosis : str
        Regular expression that the program's reason must contain in an infeasible case.
    is_long : bool
        Run on demand only.
    patience : float
        Times the time limit.
    same_as, unit : str and float
        Name of the case whose valve, times ``unit``, must come out.
    cusp : int or None
        Suture this cusp only.
    """

    name: str
    group: str
    label: str
    about: str
    entries: Entries = field(default_factory=dict)
    infeasible: str = ""
    diagnosis: str = ""
    is_long: bool = False
    patience: float = 1.0
    same_as: str = ""
    unit: float = 1.0
    cusp: int | None = None

    @property
    def feasible(self) -> bool:
        """Whether a verified valve is expected."""
        return not self.infeasible


def flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A nested table by dotted keys; a list of tables stays a list, of flat tables."""
    result: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            result |= flat(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
            result[f"{prefix}{key}"] = [flat(item) for item in value]
        else:
            result[f"{prefix}{key}"] = value
    return result


def _lines(entries: Entries) -> list[str]:
    # a JSON scalar or array of scalars is TOML, too
    return [f"{key} = {json.dumps(value)}" for key, value in entries.items()]


def scene_text(case: ExtremeCase) -> str:
    """The case's scene as a TOML file that says what it is."""
    single = {key: value for key, value in case.entries.items() if key != "cusp"}
    lines = [f"# {case.about}", *_lines({**single, "name": case.name})]
    for cusp in case.entries.get("cusp", ()):
        lines += ["", "[[cusp]]", *_lines(cusp)]
    return "\n".join(lines) + "\n"
