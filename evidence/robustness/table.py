"""The table of robustness, evidence/robustness.csv, to which each module writes the rows of its own test."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from benchmarks.results import describe_machine
from evidence import tables

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
    made_by = f"`{command}`: {describe_machine()}"
    tables.replace_rows(path, HEADER, test, [
        [*("" if entry is None else str(entry) for entry in astuple(row)), made_by] for row in rows])
