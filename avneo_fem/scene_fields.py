"""What the schema of the scene says about an entry, in words: for errors and for docs/scene.md."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from avneo_fem.scene_schema import Scene
from avneo_fem.scene_tables import Cusp

__all__ = ["entry_schema", "known_keys", "valid_values"]

_BOUNDS = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}


@cache
def _file_schema() -> dict[str, Any]:
    """JSON schema of a scene file: :class:`Scene` and the tables common to all cusps."""
    schema = Scene.model_json_schema()
    schema["properties"] |= Cusp.model_json_schema()["properties"]
    return schema


def _resolved(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema with its reference to a table, if any, followed."""
    reference = schema.get("$ref")
    if reference is None:
        return schema
    return dict(_file_schema()["$defs"][reference.rsplit("/", 1)[1]])


def entry_schema(path: Sequence[str | int]) -> dict[str, Any] | None:
    """JSON schema of the entry at ``path`` of a scene file, None when there is no such entry.

    Parameters
    ----------
    path : sequence of str and int
        Keys and indices, e.g. ``("cusp", 1, "template", "thickness")``; () is the whole file.
    """
    schema = _file_schema()
    for part in path:
        if isinstance(part, int):
            items = schema.get("prefixItems", [])
            inner = items[part] if part < len(items) else None
        else:
            inner = schema.get("properties", {}).get(part)
        if inner is None:
            return None
        schema = _resolved(inner)
    return schema


def known_keys(path: Sequence[str | int]) -> list[str]:
    """Sorted keys of the table at ``path``."""
    return sorted((entry_schema(path) or {}).get("properties", {}))


def valid_values(schema: dict[str, Any]) -> str:
    """Valid values of an entry in words, e.g. ``a finite number > 0``."""
    if "anyOf" in schema:
        given = [option for option in schema["anyOf"] if option.get("type") != "null"]
        return " or ".join(valid_values(option) for option in given) + ", or left out"
    if "enum" in schema:
        return " or ".join(f'"{value}"' for value in schema["enum"])
    if "prefixItems" in schema:
        items = schema["prefixItems"]
        return f"an array of {len(items)}, each {valid_values(_resolved(items[0]))}"
    kind = schema["type"]
    if kind in ("number", "integer"):
        bounds = [f"{sign} {schema[key]:g}" for key, sign in _BOUNDS.items() if key in schema]
        noun = "a finite number" if kind == "number" else "an integer"
        return " ".join([noun, " and ".join(bounds)]).rstrip()
    if kind == "string":
        return "letters, digits and . _ -, the first a letter or a digit"
    return {"boolean": "true or false", "object": "a table"}[kind]
