"""The tables of docs/naming.md and docs/naming_tests.md: rates of `benchmarks.naming`, added over several runs.

    python -m benchmarks.naming_sums

prints them. A test compares them with the pages.
"""

import csv
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.rates import bounds

FIRST_RUNS = {"solar": ("solar", "solar_from_1", "solar_from_2"),
              "lunar": ("lunar", "lunar_from_1", "lunar_from_2"),
              "glacial": ("glacial", "glacial_from_1", "glacial_from_2"),
              "alpine": ("alpine", "alpine_from_1", "alpine_from_2", "alpine_from_2_rest"),
              **{which: (which, f"{which}_from_1") for which in ("boreal", "austral", "polar", "overseas")},
              "distant": ("distant",)}
"""Column of docs/naming_tests.md -> the files naming_FILE.csv whose cases it has."""
COLUMNS = {"`solar`, first runs": FIRST_RUNS["solar"],
           "`glacial` and `lunar`, first runs": FIRST_RUNS["glacial"] + FIRST_RUNS["lunar"],
           "`polar`, `austral` and `boreal`, again": ("polar_again", "austral_again", "boreal_again")}
"""The same for docs/naming.md."""
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


@cache
def rates_of(file: str) -> dict[str, list[str]]:
    """The cells after the name of each rate of a file."""
    with (_HERE / f"naming_{file}.csv").open() as lines:
        return {name: cells for name, *cells in csv.reader(lines)}


def summed(files: Iterable[str], name: str) -> tuple[int, int]:
    """How many of how many a rate is in several files, of those that have it."""
    cells = [its[name] for file in files if name in (its := rates_of(file))]
    return sum(int(one[0]) for one in cells), sum(int(one[1]) for one in cells)


def counted(files: tuple[str, ...], name: str) -> str:
    """The cell of a rate: how many of how many, and its 95 % bounds."""
    if any(name not in rates_of(file) for file in files):  # a rate that was not computed at that time
        return ""
    hits, n = summed(files, name)
    low, high = bounds(hits, n)
    return f"{hits} of {n} ({100 * low:.0f} to {100 * high:.0f} %)" if n else "no case"


def held(files: tuple[str, ...]) -> str:
    """The cell of the mean share of the visited range that bands contain."""
    cells = [its[BAND] for file in files if BAND in (its := rates_of(file))]
    if len(cells) < len(files):
        return ""
    return f"{100 * np.average([float(one[2]) for one in cells], weights=[int(one[1]) for one in cells]):.0f} %"


def expected(files: tuple[str, ...]) -> str:
    """The cell of how many findings are right by their confidence, and are."""
    cells = [rates_of(file)[EXPECTED] for file in files]
    return f"{sum(float(one[0]) for one in cells):.0f} and {sum(int(one[1]) for one in cells)}"


def table(columns: Mapping[str, tuple[str, ...]], targets: bool) -> str:
    """A table of rates as Markdown, with the `targets` as the last column."""
    rows = [["", *columns, "target"], ["---"] * (len(columns) + 2),
            *([words, *(counted(files, name) for files in columns.values()), target] for words, name, target in ROWS),
            ["mean share of the visited range in the 90 % band of a measured law",
             *map(held, columns.values()), "85 to 95 %"],
            ["findings: right by their confidence, and right", *map(expected, columns.values()), "within 0.05"]]
    if not targets:
        rows = [row[:-1] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    print(table(COLUMNS, targets=True), table(FIRST_RUNS, targets=False), sep="\n\n")
