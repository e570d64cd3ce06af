"""The study beside the one before it, and beside a single regression, on the same sixty cases of hidden effects.

    python -m benchmarks.earlier_comparison

after `python -m benchmarks.studies sixty`, whose answers are in var/studies-sixty.jsonl. earlier_study.csv has those of
the study that screened the catalogue by score tests and whole simulations, and of a regression of the residuals on the
changes by all effects, of which the best one is the answer. It was written by the last version that had both. A third
of the cases is from the list on which the present method was developed. earlier_comparison.csv has the rates.
"""

import csv
import json
from pathlib import Path
from typing import NamedTuple

from benchmarks.naming import FOLDER
from benchmarks.naming_rates import CLEAR, rate, same
from benchmarks.results import write
from slipstick.naming.answer import names

Pair = tuple[str, ...]


class Said(NamedTuple):
    """What a method says of a case: that something is missing, the pairs that it names, and whether one is clear."""

    anything: bool
    pairs: list[Pair]
    clear: list[Pair]


def pairs(text: str) -> list[Pair]:
    """The pairs of a cell: a block alone, as the earlier study names it, is none."""
    found = [tuple(its.strip() for its in one.split("~")) for one in text.split("+") if one]
    return [same(one) for one in found if one[1]]


def earlier() -> dict[str, tuple[list[Pair], bool, dict[str, Said]]]:
    """Case -> hidden pairs, whether the catalogue has all of them, and what the study and the regression said."""
    with Path(__file__).with_name("earlier_study.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["kind"]]
    found = {}
    for row in rows:
        hidden = [(quantity, on) for quantity, on in (one.split(" ~ ") for one in row["hidden"].split("+") if one)]
        named = pairs(row["findings"])
        found[row["case"]] = ([same(one) for one in hidden], all(names(one) for one in hidden), {
            "earlier study": Said(row["kind"] != "none", named, named if row["clear"] == "True" else []),
            "regression": Said(bool(row["regression"]), pairs(row["regression"]), [])})
    return found


def present() -> dict[str, Said]:
    """Case -> what the study says."""
    found = {}
    for entry in map(json.loads, (FOLDER / "studies-sixty.jsonl").read_text().splitlines()):
        result = entry["result"]
        its = [(same((one["quantity"], one["depends_on"])), one["confidence"]) for one in result["findings"]]
        found[entry["case"]] = Said(result["kind"] != "none", [pair for pair, _ in its],
                                    [pair for pair, sure in its if sure >= CLEAR])
    return found


def main() -> None:
    """Compare, and write the table."""
    known, now = earlier(), present()
    rows = []
    for method in ("study", "earlier study", "regression"):
        said = [(hidden, listed, now[case] if method == "study" else others[method])
                for case, (hidden, listed, others) in known.items()]
        nulls = [its for hidden, _, its in said if not hidden]
        one = [(hidden[0], its) for hidden, listed, its in said if len(hidden) == 1 and listed]
        outside = [its for hidden, listed, its in said if len(hidden) == 1 and not listed]
        two = [(hidden, its) for hidden, _, its in said if len(hidden) == 2]
        rates = {
            "nulls called anything": [its.anything for its in nulls],
            "one listed effect, named and nothing else": [its.pairs == [pair] for pair, its in one],
            "one listed effect, a wrong name": [bool(set(its.pairs) - {pair}) for pair, its in one],
            "one listed effect, a wrong name called clear": [bool(set(its.clear) - {pair}) for pair, its in one],
            "an unlisted effect, something is missing": [its.anything for its in outside],
            "two effects, both named": [set(hidden) <= set(its.pairs) for hidden, its in two],
            "two effects, a wrong name": [bool(set(its.pairs) - set(hidden)) for hidden, its in two]}
        rows += [rate(f"{method}: {label}", values) for label, values in rates.items()]
    write("earlier_comparison", ("of", "cases", "of all", "share", "lower", "upper"), rows,
          "python -m benchmarks.earlier_comparison")


if __name__ == "__main__":
    main()
