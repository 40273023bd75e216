"""The words for valid values, on hand-written JSON schemas and on entries of the scene."""

from __future__ import annotations

from typing import Any

import pytest

from avneo_fem.scene_fields import entry_schema, known_keys, valid_values


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number"}, "a finite number"),
        ({"type": "number", "minimum": 0.0}, "a finite number >= 0"),
        (
            {"type": "number", "exclusiveMinimum": 0.5, "exclusiveMaximum": 1.0},
            "a finite number > 0.5 and < 1",
        ),
        ({"type": "integer", "minimum": 1, "maximum": 9}, "an integer >= 1 and <= 9"),
        ({"type": "boolean"}, "true or false"),
        ({"type": "object"}, "a table"),
        ({"type": "string", "enum": ["A", "B"]}, '"A" or "B"'),
        (
            {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"type": "null"}]},
            "a finite number > 0, or left out",
        ),
        ({"prefixItems": [{"type": "integer"}] * 2}, "an array of 2, each an integer"),
    ],
)
def test_valid_values(schema: dict[str, Any], words: str) -> None:
    """Truth: what the JSON schema vocabulary means by these words."""
    assert valid_values(schema) == words


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (("root", "radius"), "a finite number > 0"),
        (("template", "free_edge_height"), "a finite number"),
        (("cusp", 2, "suture_line", "type"), '"A" or "B"'),
        (("commissures", "chord_ratio", 1), "a finite number > 0"),
        (("cusp", 0, "template"), "a table"),
        ((), "a table"),
    ],
)
def test_entries(path: tuple[str | int, ...], words: str) -> None:
    """Truth: the schema of these entries, common tables and cusps' own alike."""
    schema = entry_schema(path)
    assert schema is not None
    assert valid_values(schema) == words


@pytest.mark.parametrize(
    "path", [("rot",), ("root", "x"), ("cusp", 3), ("root", "radius", "x"), ("root", 0)]
)
def test_no_such_entry(path: tuple[str | int, ...]) -> None:
    """Truth: paths that lead nowhere have no schema and no keys."""
    assert entry_schema(path) is None
    assert known_keys(path) == []


def test_known_keys() -> None:
    """Truth: the keys of the tables, sorted."""
    assert known_keys(("cusp", 1)) == ["suture_line", "template"]
    assert known_keys(("mesh",)) == ["refinements", "size"]
    assert {"cusp", "template", "suture_line", "root", "name"} <= set(known_keys(()))
