"""The regression suite: some twenty fixed cases, and what is expected of the present method on them.

It shows what a change of the method does within ten minutes, and says nothing of how often the method is right: the
cases have been looked at. `regression.csv` has a case in each row with the words of its verdict; a change of the method
that is meant to change an answer changes the row.
"""

import csv
from pathlib import Path

from evidence.rates import Entry
from evidence.runner import answer_cases, forget_entries

TABLE = Path(__file__).with_name("regression.csv")


def read() -> dict[tuple[str, int], str]:
    """Return the expected words of the verdict by suite and seed."""
    with TABLE.open() as file:
        return {(row["suite"], int(row["seed"])): row["expected"] for row in csv.DictReader(file)}


def summarise(entry: Entry) -> str:
    """Return what an answer is, as the study reports it, in words."""
    verdict = entry.verdict("reported")
    if not entry.truth.hidden:
        return "silent" if verdict.silent else "something said"
    of = f" of {len(entry.truth.hidden)}" if len(entry.truth.hidden) > 1 else ""
    words = (f"right first{of and f', {verdict.effects_named}{of}'}" if verdict.right_first
             else f"in the answer{of and f', {verdict.effects_named}{of}'}" if verdict.effects_named
             else "right block" if verdict.right_block else "silent" if verdict.silent else "missed")
    return words + (", a name too many" if verdict.too_many and verdict.effects_named else "")


def check(dask: str | None = None) -> int:
    """Answer the cases again, print each beside what is expected, and return 1 where any differs."""
    expected, differ = read(), 0
    work = TABLE.parents[1] / "var" / "evidence" / "regression"
    forget_entries("naming", work)
    for entry in answer_cases("naming", expected, dask, work):
        words, before = summarise(entry), expected[entry.suite, entry.seed]
        as_before = words == before
        differ += not as_before
        said = words if as_before else f"{words} instead of {before}"
        print(f"{'as expected' if as_before else 'DIFFERS'}: {entry.truth.case}: {said} [{entry.answer.seconds:.0f} s]",
              flush=True)
    print(f"{len(expected) - differ} of {len(expected)} as expected")
    return int(differ > 0)
