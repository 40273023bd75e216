"""Runs the textbook benchmarks of the shell and writes their table and plots.

    python demos/verification            # all levels, some minutes
    python demos/verification --quick    # the levels that the tests run
    python demos/verification cantilever plates -o out/verification

Every benchmark states its problem, its reference and its target values at the head of its own
file in this folder. The exit status is 0 only when every value is within its tolerance.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from importlib import import_module
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from record import Row

BENCHMARKS = (
    "cantilever",
    "roll_up",
    "locking",
    "plates",
    "manufactured",
    "membranes",
    "hencky",
    "pressure_work",
    "half_plane",
    "pressed_sheet",
)


def write_table(rows: list[Row], folder: Path) -> None:
    """``table.csv`` with all digits, ``table.md`` to be read."""
    head = ["benchmark", "case", "quantity", "value", "target", "error", "allowed", "source"]
    with (folder / "table.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*head, "passed"])
        for row in rows:
            line = [row.benchmark, row.case, row.quantity, repr(row.value), repr(row.target)]
            writer.writerow([*line, repr(row.error), row.tolerance, row.source, row.passed])
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        unit = "" if row.absolute else " %"
        scale = 1.0 if row.absolute else 100.0
        mark = "" if row.passed else " **missed**"
        lines.append(
            f"| {row.benchmark} | {row.case} | {row.quantity} | {row.value:.6g} | {row.target:.6g}"
            f" | {scale * row.error:.2g}{unit}{mark} | {scale * row.tolerance:.2g}{unit}"
            f" | {row.source} |"
        )
    (folder / "table.md").write_text("\n".join(lines) + "\n")


def draw(names: list[str], folder: Path) -> None:
    """One plot a benchmark, ``<name>.png``."""
    for name in names:
        figure, axes = plt.subplots(figsize=(6, 4.5), layout="constrained")
        import_module(name).draw(axes)
        figure.savefig(folder / f"{name}.png", dpi=120)
        plt.close(figure)


def main(arguments: list[str] | None = None) -> int:
    """Run, write, and say what missed its target."""
    parser = argparse.ArgumentParser(prog="demos/verification", description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    parser.add_argument("--quick", action="store_true", help="the levels that the tests run")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/verification"))
    given = parser.parse_args(arguments)
    unknown = sorted(set(given.names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"unknown benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    names = given.names or list(BENCHMARKS)
    given.output.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    for name in names:
        clock = time.perf_counter()
        found = import_module(name).rows(full=not given.quick)
        rows += found
        missed = [row for row in found if not row.passed]
        seconds = time.perf_counter() - clock
        print(f"{name:15} {len(found):3} values, {len(missed)} missed, {seconds:6.1f} s")
        for row in missed:
            print(
                f"   {row.case}, {row.quantity}: {row.value:.6g}, target {row.target:.6g},"
                f" error {row.error:.2g}, allowed {row.tolerance:.2g}"
            )
    write_table(rows, given.output)
    draw(names, given.output)
    print(f"table and plots: {given.output}")
    return 0 if all(row.passed for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
