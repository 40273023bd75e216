"""What the commands of the command line share: their options, and where people read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from avneo_fem.scene import FIDELITIES

__all__ = ["Fidelity", "Json", "Scene", "Set", "people"]

people = Console(stderr=True, soft_wrap=True, highlight=False)

Scene = Annotated[Path, typer.Argument(metavar="SCENE", help="scene file (TOML)")]
Fidelity = Annotated[str | None, typer.Option(help=f"one of {', '.join(FIDELITIES)}")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="an entry of the scene (repeatable), e.g. --set mesh.size=1.0",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print the report on stdout")]
