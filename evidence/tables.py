"""The tables of a run: one row for each answer, and the rates of all of them."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from .answer import NamedPair, Pair
from .rates import Comparison, Entry, Rate

RATES = ("method", "suite", "what", "stage", "hits", "of", "share", "lower", "upper")
ANSWERS = ("method", "case", "runs", "bad runs", "hidden", "form", "trend", "share of runs", "strength", "findings",
           "not reported", "unexplained", "explanations", "right first", "found", "too many", "wrong and sure",
           "set aside", "seconds", "error")


def write_rates(path: Path, method: str, rates: Sequence[Rate]) -> None:
    """Write the rates of a method, named with its version."""
    write_table(path, RATES, [(method, each.suite, each.what, each.stage, each.hits, each.of,
                          *(f"{value:.3f}" for value in (each.hits / each.of, *each.bounds))) for each in rates])


def write_answers(path: Path, method: str, entries: Iterable[Entry]) -> None:
    """Write the answers of a method beside what was hidden, in the order of the cases."""
    ordered = sorted(entries, key=lambda entry: (entry.suite, entry.seed))
    write_table(path, ANSWERS, [(method, *_row(entry)) for entry in ordered])


def read_rates(path: Path) -> list[Rate]:
    """Return the rates of a table."""
    with path.open() as file:
        return [Rate(row["suite"], row["what"], row["stage"], int(row["hits"]), int(row["of"]))
                for row in csv.DictReader(file)]


def print_rates(rates: Sequence[Rate]) -> str:
    """Return the rates as lines of text."""
    return "\n".join(f"{each.suite:20} {each.stage:9} {each.hits:4} of {each.of:4}  "
                     f"{100 * each.bounds[0]:3.0f} to {100 * each.bounds[1]:3.0f} %  {each.what}" for each in rates)


def print_comparison(comparisons: Sequence[Comparison]) -> str:
    """Return two methods on the same cases as lines of text."""
    return "\n".join(f"{each.what:28} {each.cases:4} cases: {each.before:4} before, {each.after:4} after, "
                     f"{each.gained} gained, {each.lost} lost: {'stands' if each.stands else 'worse'}"
                     for each in comparisons)


def _row(entry: Entry) -> tuple[object, ...]:
    truth, answer, verdict = entry.truth, entry.answer.reported, entry.verdict("all")
    hidden = truth.hidden
    return (truth.case, truth.runs, len(truth.bad_runs), " + ".join(_words(each.pair) for each in hidden),
            " + ".join(each.form for each in hidden), " + ".join(each.trend for each in hidden),
            " + ".join(f"{each.share:g}" for each in hidden), " + ".join(f"{each.strength:.2g}" for each in hidden),
            _findings(answer.findings), _findings([each for each in entry.answer.findings if not each.reported]),
            " + ".join(answer.unexplained), " + ".join(map(_words, answer.explanations)), int(verdict.right_first),
            verdict.effects_named, verdict.too_many, int(verdict.wrong_and_sure), len(answer.set_aside), answer.seconds,
            answer.error)


def _findings(findings: Iterable[NamedPair]) -> str:
    return " + ".join(f"{_words(each.pair)} ({each.confidence:.2f}"
                      f"{f', {len(each.rivals)} rivals' if each.rivals else ''})" for each in findings)


def _words(pair: Pair) -> str:
    return " over ".join(pair)


def replace_rows(path: Path, header: Sequence[str], key: str, rows: Sequence[Sequence[str]]) -> None:
    """Replace the rows of a table that begin with `key` by others, and print these; the table is sorted by its keys."""
    others: list[list[str]] = []
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            others = [row for row in csv.reader(file) if row and row[0] not in (header[0], key)]
    own = [[key, *row] for row in rows]
    write_table(path, header, sorted([*others, *own], key=lambda row: row[0]))  # stable: rows of a key keep their order
    for row in own:
        print(*row, sep=" | ")


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
