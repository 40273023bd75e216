"""docs/scene.md, written from the schema of the scene.

Run ``python -m avneo_fem.scene_reference > docs/scene.md`` after a change of the schema.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

from avneo_fem.scene_fidelity import FIDELITIES
from avneo_fem.scene_fields import entry_schema, valid_values

__all__ = ["scene_reference"]

_FIRST = ("root", "commissures", "template", "suture_line")
_UNIT = re.compile(r" ?\[(mm|kPa|mN|degrees)\]")

_INTRODUCTION = """# The scene file

<!-- Written by `python -m avneo_fem.scene_reference > docs/scene.md`. Do not edit. -->

A scene is one TOML file. Every entry has a default; an empty file is the valve of the paper's
Experiment 1, and `demos/` holds the paper's three. Unknown keys, values of the wrong type and
values out of range are errors. Lengths are in mm, stresses in kPa, forces in mN, angles in
degrees. The paper's symbols stand in front of the descriptions.

`[template]` and `[suture_line]` hold for all three cusps. Where they differ, write exactly three
`[[cusp]]` tables, for cusp 0, 1 and 2; each overrides single entries:

```toml
[[cusp]]
template.free_edge_length = 58.5

[[cusp]]

[[cusp]]
suture_line.type = "B"
```

Every entry can be set from the command line, too: `--set KEY=VALUE` (repeatable) takes a dotted key
and a TOML value, e.g. `--set mesh.size=1.0 --set cusp.1.template.thickness=0.4`; a single word that
is no TOML value is text (`--set solver.quality=approximate`).

## Fidelity

`fidelity` chooses defaults, and multiplies `mesh.size`. Where the scene or `--set` gives an entry,
that is what holds. The defaults in the tables below are those of `standard`. What the bundles cost
and miss is in [tradeoff.md](tradeoff.md).

"""

_AFTER_FIDELITY = """
There is no degree and no quadrature to choose: suturing knows triangles of degree 1, whose strain
is constant. Bending is part of the model, not of its quality: it stays on in every bundle.
"""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _row(key: str, schema: dict[str, Any]) -> str:
    description = schema.get("description", "")
    unit = _UNIT.search(description)
    value = schema.get("default")
    default = "" if value is None else f"`{json.dumps(value)}`"
    cells = [
        f"`{key}`",
        default,
        unit.group(1) if unit else "",
        valid_values(schema),
        _UNIT.sub("", description),
    ]
    return f"| {' | '.join(map(_cell, cells))} |"


def _section(title: str, about: str, path: Sequence[str], keys: Sequence[str]) -> str:
    rows = [_row(key, entry_schema([*path, key]) or {}) for key in keys]
    head = "| key | default | unit | valid | meaning |\n|---|---|---|---|---|"
    return "\n".join([f"\n## {title}\n", f"{about}\n", head, *rows]) + "\n"


def _fidelities() -> str:
    rows = ["| fidelity | factor on `mesh.size` | defaults | for |", "|---|---|---|---|"]
    for name, bundle in FIDELITIES.items():
        entries = [
            f"`{table}.{key} = {json.dumps(value)}`"
            for table, inner in bundle.entries.items()
            for key, value in inner.items()
        ]
        told = ", ".join(entries) or "as below"
        rows.append(f"| {name} | {bundle.size_factor:g} | {told} | {bundle.purpose} |")
    return "\n".join(rows) + "\n"


def scene_reference() -> str:
    """Every table, key, default, unit, valid range and description of a scene file (Markdown)."""
    properties = (entry_schema([]) or {})["properties"]
    tables = [key for key in properties if "properties" in (entry_schema([key]) or {})]
    single = [key for key in properties if key not in (*tables, "cusp")]
    text = _INTRODUCTION + _fidelities() + _AFTER_FIDELITY
    text += _section("Whole run", "Entries above the first table.", [], single)
    order = sorted(tables, key=lambda table: table not in _FIRST)
    for table in order:
        schema = entry_schema([table]) or {}
        about = " ".join(schema["description"].split())
        text += _section(f"`[{table}]`", about, [table], list(schema["properties"]))
    return text


if __name__ == "__main__":
    print(scene_reference(), end="")
