"""The table of robustness, evidence/robustness.csv, to which each module writes the rows of its own test."""

import csv
import platform
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from llvmlite import binding

PATH = Path(__file__).parents[1] / "robustness.csv"
HEADER = ("test", "what", "cases", "right", "unit", "measured", "made by")


@dataclass(frozen=True)
class Row:
    """How many of `cases` went `right`, counted in `unit` (None if nothing is counted), and further figures as text."""

    what: str
    cases: int | None
    right: int | None
    unit: str
    measured: str


def replace_rows(test: str, rows: Sequence[Row], command: str, path: Path = PATH) -> None:
    """Replace the rows of `test` in the table; those of other tests stay as they are."""
    others: list[list[str]] = []
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            others = [row for row in csv.reader(file) if row and row[0] not in (HEADER[0], test)]
    made_by = f"`{command}`: {describe_machine()}"
    own = [[test, *("" if entry is None else str(entry) for entry in astuple(row)), made_by] for row in rows]
    with path.open("w", newline="", encoding="utf-8") as file:
        # A stable sort: tests in alphabetical order, the rows of each in the order of the module.
        csv.writer(file, lineterminator="\n").writerows([HEADER, *sorted([*others, *own], key=lambda row: row[0])])
    for row in own:
        print(*row[1:-1], sep=" | ")


def describe_machine() -> str:
    """Processor and Python of this process."""
    return f"{platform.machine()} ({binding.get_host_cpu_name()}), Python {platform.python_version()}"
