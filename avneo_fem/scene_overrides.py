"""Entries of a scene that come from the command line: ``--set KEY=VALUE``."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from avneo_fem.errors import SceneError

__all__ = ["overridden", "parse_overrides"]

_KEY = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_VALID = "must be KEY=VALUE with a dotted key and a TOML value, e.g. mesh.size=0.5"


def parse_overrides(texts: Sequence[str]) -> list[tuple[tuple[str, ...], Any]]:
    """(path, value) of every ``KEY=VALUE``.

    The value is TOML: ``0.5``, ``true``, ``[8, 9, 6]``, ``"B"``. A single word that is no TOML
    value is text, since shells take quotes away.

    Raises
    ------
    SceneError
        For a text that is no ``KEY=VALUE``, or whose value is neither TOML nor a word.
    """
    found = []
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not _KEY.fullmatch(key):
            raise SceneError("--set", text, _VALID)
        found.append((tuple(key.split(".")), _value(text, value)))
    return found


def _value(text: str, value: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {value}")
    except ValueError:  # broken TOML, integers too long for Python
        if _WORD.fullmatch(value):
            return value
        raise SceneError("--set", text, _VALID) from None
    if set(parsed) != {"value"}:  # a line break in it begins another key
        raise SceneError("--set", text, _VALID)
    return parsed["value"]


def overridden(data: dict[str, Any], overrides: Sequence[tuple[tuple[str, ...], Any]]) -> Any:
    """The nested dictionaries of a scene with entries replaced; ``data`` itself is left alone.

    A number as part of a path is an index (``cusp.1.template.thickness``); a scene without
    ``[[cusp]]`` tables has three empty ones. Where a path leads to no table or index, one is put
    there: whether such an entry exists is for the schema to say.
    """
    result: Any = data
    for path, value in overrides:
        result = _replaced(result, path, value, path[0] == "cusp")
    return result


def _replaced(data: Any, path: Sequence[str], value: Any, cusp: bool = False) -> Any:
    if not path:
        return value
    first, *rest = path
    if isinstance(data, list | tuple) and first.isdecimal() and int(first) < len(data):
        index = int(first)
        return [*data[:index], _replaced(data[index], rest, value), *data[index + 1 :]]
    table = dict(data) if isinstance(data, dict) else {}
    inner = table.get(first, [{}, {}, {}] if cusp and rest else {})
    return {**table, first: _replaced(inner, rest, value)}
