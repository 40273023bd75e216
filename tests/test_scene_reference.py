"""docs/scene.md is what the schema says, no more and no less."""

from __future__ import annotations

import re
from pathlib import Path

from avneo_fem.scene import Scene
from avneo_fem.scene_reference import scene_reference

COMMITTED = Path(__file__).parents[1] / "docs" / "scene.md"


def rows() -> dict[str, list[str]]:
    """Cells of each entry, by its dotted name, read back from the Markdown."""
    found, table = {}, ""
    for line in scene_reference().splitlines():
        if heading := re.match(r"## `\[(\w+)\]`", line):
            table = f"{heading[1]}."
        if line.startswith("| `"):
            key, *cells = line.strip("| ").split(" | ")
            found[table + key.strip("`")] = cells
    return found


def test_committed_reference_is_current() -> None:
    """Truth: ``python -m avneo_fem.scene_reference`` reproduces the committed file."""
    assert COMMITTED.read_text(encoding="utf-8") == scene_reference()


def test_every_entry_is_listed() -> None:
    """Truth: the keys of a dumped scene, with the tables common to all cusps, are the rows."""
    dumped = Scene().model_dump()
    dumped |= dumped.pop("cusp")[0]
    keys = set()
    for name, value in dumped.items():
        keys |= {f"{name}.{key}" for key in value} if isinstance(value, dict) else {name}
    assert set(rows()) == keys


def test_rows_tell_default_unit_range_and_meaning() -> None:
    """Truth: a sample of rows, against the schema as the paper and design.md word it."""
    found = rows()
    assert found["root.radius"] == ["`12.0`", "mm", "a finite number > 0", found["root.radius"][3]]
    assert found["root.radius"][3].startswith("R, ")
    assert found["material.young_modulus"][:2] == ["`1000.0`", "kPa"]
    assert found["commissures.chord_ratio"][0] == "`[1.0, 1.0, 1.0]`"
    assert found["suture_line.ellipse_end_degrees"][1:3] == [
        "degrees",
        "a finite number > 90 and < 180",
    ]
    assert "(H_i + H_j)/2" in found["commissures.gap"][3]
    assert found["contact.clearance"][0] == ""
    assert all(cells[2] and cells[3] for cells in found.values())
