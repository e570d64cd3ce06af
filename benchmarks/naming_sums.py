"""The table of docs/naming.md: rates of `benchmarks.naming`, added over several runs.

    python -m benchmarks.naming_sums

prints it. A test compares it with the page.
"""

import csv
from pathlib import Path

import numpy as np

from benchmarks.rates import bounds

COLUMNS = {"`glacial`, first run": ("glacial", "glacial_from_1", "glacial_from_2"),
           "`polar`, `austral` and `boreal`, again": ("polar_again", "austral_again", "boreal_again")}
"""Column -> the files naming_FILE.csv whose cases it has."""
ROWS = (("recordings without an effect: with a finding, or an unexplained block", "nulls called anything", "2 %"),
        ("listed effects from 1 naming limit: found", "listed, from 1 naming limits: found, alone or in a tie", "95 %"),
        ("the same from 5 limits", "listed, from 5 naming limits: found, alone or in a tie", "95 %"),
        ("from 1 limit: found with a name too many", "listed, from 1 naming limits: one name too many", "3 %"),
        ("from 1 limit: a wrong name of confidence 0.9", "listed, from 1 naming limits: a wrong name called clear",
         "1 %"),
        ("right findings of these that have confidence 0.9", "listed, from 1 naming limits: right names that are clear",
         "80 %"),
        ("listed effects below 1 limit: found", "listed, 0 to 1 naming limits: found, alone or in a tie", ""),
        ("unlisted effects that are visible: right block", "unlisted, visible: right block", "95 %"),
        ("the same: a name of the catalogue", "unlisted, visible: a name of the catalogue", "5 %"),
        ("unlisted effects from 1 limit: right pair", "unlisted, from 1 naming limit: right pair", "80 %"),
        ("right names, with the named effect left out of the catalogue: unlisted",
         "right names, left out of the catalogue: unlisted", "95 %"),
        ("two effects, both from 1 limit: both found", "two effects, both from 1 naming limit: both found",
         "70 to 90 %"),
        ("measured laws of right pairs off by at most 1.5 times their stated error (RMS)",
         "laws of right pairs: RMS off by at most 1.5 times the stated error", "all"),
        ("findings with a confidence of 0.9 or more: right", "findings with a confidence of 0.9 to 1: right", ""),
        ("findings with a confidence of 0.8 to 0.9: right", "findings with a confidence of 0.8 to 0.9: right", ""))
"""What a row says, the rate in the files, and the target."""
BAND = "laws of right pairs: share of the visited range in the 90 % band: mean"
EXPECTED = "findings: expected right, and right"
_HERE = Path(__file__).parent


def rates_of(file: str) -> dict[str, list[str]]:
    """The cells after the name of each rate of a file."""
    with (_HERE / f"naming_{file}.csv").open() as lines:
        return {name: cells for name, *cells in csv.reader(lines)}


def counted(files: tuple[str, ...], name: str) -> str:
    """The cell of a rate: how many of how many, and its 95 % bounds."""
    hits, n = (sum(int(rates_of(file)[name][place]) for file in files) for place in range(2))
    low, high = bounds(hits, n)
    return f"{hits} of {n} ({100 * low:.0f} to {100 * high:.0f} %)" if n else "no case"


def held(files: tuple[str, ...]) -> str:
    """The cell of the mean share of the visited range that bands contain."""
    cells = [rates_of(file)[BAND] for file in files]
    return f"{100 * np.average([float(one[2]) for one in cells], weights=[int(one[1]) for one in cells]):.0f} %"


def expected(files: tuple[str, ...]) -> str:
    """The cell of how many findings are right by their confidence, and are."""
    cells = [rates_of(file)[EXPECTED] for file in files]
    return f"{sum(float(one[0]) for one in cells):.0f} and {sum(int(one[1]) for one in cells)}"


def table() -> str:
    """The table as Markdown."""
    rows = [["", *COLUMNS, "target"], ["---"] * (len(COLUMNS) + 2),
            *([words, *(counted(files, name) for files in COLUMNS.values()), target] for words, name, target in ROWS),
            ["mean share of the visited range in the 90 % band of a measured law",
             *map(held, COLUMNS.values()), "85 to 95 %"],
            ["findings: right by their confidence, and right", *map(expected, COLUMNS.values()), "within 0.05"]]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    print(table())
