"""Reading scenes: from TOML or nested dictionaries to a checked :class:`Scene`.

Every violation becomes a :class:`SceneError` of one line that names the key as it was written,
its value and what would be valid.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from avneo_fem.errors import SceneError
from avneo_fem.scene_fields import entry_schema, known_keys, valid_values
from avneo_fem.scene_overrides import overridden, parse_overrides
from avneo_fem.scene_schema import Scene
from avneo_fem.scene_tables import Cusp

__all__ = ["load_scene", "parse_scene"]

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def _scene_error(error: ValidationError) -> SceneError:
    """First schema violation as one line naming key, value and what would be valid."""
    first = error.errors()[0]
    location, value = first["loc"], first["input"]
    if first["type"] == "missing":  # too short an array: the entry at fault is the array
        location = location[:-1]
    # keys that TOML would want quoted are shown quoted, and so stay on one line
    key = ".".join(str(p) if _BARE.fullmatch(str(p)) else repr(p) for p in location)
    schema = entry_schema(location)
    if schema is None:
        known = known_keys(location[:-1])
        near = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(known)}"
        return SceneError(key, value, f"unknown key; {hint}")
    about = schema.get("description", "") if "properties" not in schema else ""
    valid = f"must be {valid_values(schema)}" + (f" ({about})" if about else "")
    return SceneError(key, list(value) if isinstance(value, tuple) else value, valid)


def _merge(base: dict[str, Any], override: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in override.items():
        old = merged.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            value = _merge(old, value)
        merged[key] = value
    return merged


def _tuples(value: Any) -> Any:
    """TOML arrays as tuples: the schema is strict and its sequences are immutable."""
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def parse_scene(data: dict[str, Any]) -> Scene:
    """Validate a scene given as nested dictionaries (what a TOML file parses to).

    Raises
    ------
    SceneError
        For the first violation, with key, value and what would be valid.
    """
    if not isinstance(data, dict):
        raise SceneError("scene", data, "must be a table")
    data = dict(data)
    common: dict[str, Any] = {key: data.pop(key) for key in Cusp.model_fields if key in data}
    for key, table in common.items():
        if not isinstance(table, dict):
            raise SceneError(key, table, f"must be a table [{key}]")
    cusps = data.pop("cusp", [{}, {}, {}])
    if not isinstance(cusps, list | tuple) or len(cusps) != 3:
        raise SceneError("cusp", cusps, "must be exactly three [[cusp]] tables, cusp 0, 1, 2")
    for index, cusp in enumerate(cusps):
        if not isinstance(cusp, dict):
            raise SceneError(f"cusp.{index}", cusp, "must be a [[cusp]] table")
    data["cusp"] = [_merge(common, cusp) for cusp in cusps]
    try:
        # the common tables are validated on their own first: errors then name the key as written
        Cusp.model_validate(common)
        return Scene.model_validate(_tuples(data))
    except ValidationError as error:
        raise _scene_error(error) from None


def load_scene(
    path: str | Path, fidelity: str | None = None, overrides: Sequence[str] = ()
) -> Scene:
    """Read and validate a scene file.

    Parameters
    ----------
    path : str or Path
    fidelity : str or None
        Instead of the file's.
    overrides : sequence of str
        ``KEY=VALUE`` each, instead of the file's and of the bundle's; the last one wins.

    Raises
    ------
    SceneError
        When the file is missing, is not TOML or violates the schema, or an override does.
    """
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError("scene file", str(path), f"cannot be read ({error.strerror})") from None
    except ValueError as error:  # broken TOML, broken UTF-8, integers too long for Python
        raise SceneError("scene file", str(path), f"is not valid TOML: {error}") from None
    data.setdefault("name", path.stem.replace("_", "-"))
    if fidelity is not None:
        data["fidelity"] = fidelity
    return parse_scene(overridden(data, parse_overrides(overrides)))
