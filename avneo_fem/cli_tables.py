"""What the command line prints for people: tables of the geometry and of sizes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from avneo_fem.geometry.competence import range_text

__all__ = ["show_geometry", "show_sizes"]


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
    advice = geometry["free_edge_advice"]
    if advice["for_unit_nu"] is not None:
        _add_row(table, "all L_f times nu* [mm]", advice["for_unit_nu"], 3)
        table.add_row(escape("closing L_f, all [mm]"), *_ranges(advice["together"]))
    table.add_row(escape("closing L_f, alone [mm]"), *_ranges(advice["alone"]))
    return table


def _ranges(pairs: Sequence[Any]) -> list[str]:
    return [range_text(pair, 4, "-") for pair in pairs]


def show_geometry(console: Console, geometry: dict[str, Any]) -> None:
    """Print the geometry of a valve (that of the report) and the verdict on it."""
    console.print(_geometry_table(geometry))
    point = ", ".join(f"{x:.4f}" for x in geometry["triple_contact_point"])
    case, nu = geometry["triple_point_case"], geometry["nu_star"]
    console.print(f"triple contact point ({point}) mm, {case}; nu* = {nu:.4f}")
    verdict = "[green]competent[/]" if geometry["competent"] else "[yellow]not competent[/]"
    console.print(f"{verdict}: {escape(geometry['competence_reason'])}")


def show_sizes(console: Console, sizes: dict[str, Any]) -> None:
    """Print present and quasi-optimal sizes (those of the report) and the verdict on them."""
    present, wanted = sizes["present"], sizes["quasi_optimal"]
    table = _cusp_table("sizes")
    for label, values, digits in (
        ("chord a_i [mm]", sizes["chord_lengths"], 3),
        ("free edge L_f now [mm]", present["free_edge_length"], 3),
        ("quasi-optimal L_f = 2 a_i / sqrt(3) [mm]", wanted["free_edge_length"], 3),
    ):
        _add_row(table, label, values, digits)
    table.add_row(escape("change [mm]"), *(f"{change:+.3f}" for change in wanted["change"]))
    for label, values, digits in (
        ("shortest in proportion, nu* = 1 [mm]", sizes["free_edge_length_for_nu_1"], 3),
        ("belly radius R_s now [mm]", present["belly_radius"], 3),
        ("R_s in proportion to L_f [mm]", wanted["belly_radius"], 3),
        ("stitching ratio J_sl with these", wanted["stitching_ratio"], 4),
    ):
        _add_row(table, label, values, digits)
    console.print(table)
    if present["problem"] is None:
        console.print(f"now: nu* = {present['nu_star']:.4f}")
    else:
        console.print(f"now: no valve, {escape(present['problem'])}")
    console.print(f"rebuilt with the quasi-optimal sizes: nu* = {wanted['nu_star']:.4f}")
    verdict = "[green]verified[/]" if sizes["verified"] else "[red]not verified[/]"
    console.print(f"{verdict}: {escape(wanted['competence_reason'])}")
