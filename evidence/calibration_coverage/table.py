"""The table of coverage, evidence/calibration_coverage.csv, in which each part replaces its own rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from evidence import tables
from evidence.rates import bounds

PATH = Path(__file__).parents[1] / "calibration_coverage.csv"
HEADER = ("kind", "of", "sets", "intervals", "hits", "share", "lower", "upper", "note")


@dataclass(frozen=True)
class Row:
    """How many of the `intervals` of something in so many `sets` contain the true value."""

    of: str
    sets: int
    intervals: int
    hits: int
    note: str

    def cells(self) -> list[str]:
        """Return the cells behind the kind; without intervals there is no share, and no bounds."""
        shares = (self.hits / self.intervals, *bounds(self.hits, self.intervals)) if self.intervals else ()
        return [self.of, *map(str, (self.sets, self.intervals, self.hits)),
                *([f"{share:.3f}" for share in shares] or [""] * 3), self.note]


def replace_rows(kind: str, rows: Sequence[Row], made_by: str, path: Path = PATH) -> None:
    """Replace the rows of a kind, the last of which is what they were `made_by`; those of others stay as they are."""
    tables.replace_rows(path, HEADER, kind, [*(row.cells() for row in rows), ["made by", *[""] * 6, made_by]])
