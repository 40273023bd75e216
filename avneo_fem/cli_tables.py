"""What the command line prints for people: tables of the geometry and of sizes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

__all__ = ["show_geometry"]


def _cusp_table(title: str) -> Table:
    """Empty table with a column for labels and one for each cusp."""
    table = Table(title=title, title_justify="left")
    for head in ("", "cusp 0", "cusp 1", "cusp 2"):
        table.add_column(head, justify="left" if not head else "right")
    return table


def _add_row(table: Table, label: str, values: Sequence[float], digits: int) -> None:
    table.add_row(escape(label), *(f"{value:.{digits}f}" for value in values))


def _geometry_table(geometry: dict[str, Any]) -> Table:
    table = _cusp_table("geometry")
    for label, key, digits in (
        ("chord a_i [mm]", "chord_lengths", 3),
        ("length l_i [mm]", "commissure_lengths", 3),
        ("contact c_i [mm]", "contact_lengths", 3),
        ("aortic suture line l_a [mm]", "asl_length", 3),
        ("cusp suture line l_c [mm]", "csl_length", 3),
        ("stitching ratio J_sl", "stitching_ratio", 4),
        ("sigma*", "sigma", 4),
    ):
        if geometry[key] is not None:  # contact planes have no sigma
            _add_row(table, label, geometry[key], digits)
    return table


def show_geometry(console: Console, geometry: dict[str, Any]) -> None:
    """Print the geometry of a valve (that of the report) and the verdict on it."""
    console.print(_geometry_table(geometry))
    point = ", ".join(f"{x:.4f}" for x in geometry["triple_contact_point"])
    case, nu = geometry["triple_point_case"], geometry["nu_star"]
    console.print(f"triple contact point ({point}) mm, {case}; nu* = {nu:.4f}")
    verdict = "[green]competent[/]" if geometry["competent"] else "[yellow]not competent[/]"
    console.print(f"{verdict}: {escape(geometry['competence_reason'])}")
