"""The parts of the documentation that follow from the tables: rates, the formula of the confidence, real recordings.

    python -m evidence.pages

writes them between the marks of the pages in `PARTS`; a test compares them.
"""

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from evidence.rates import Rate
from evidence.real.command import MACHINES
from evidence.real.page import render_findings, render_values
from evidence.suites import OTHER_MACHINES
from evidence.tables import read_rates
from slipstick.studies.confidence import coefficients

ROOT = Path(__file__).parents[1]
FEWEST = 10
"""Cases or findings of a rate in the table of the method: the bounds of fewer are too wide to tell anything."""
TABLE = Path(__file__).with_name("rates.csv")
SHORT = {
    ("nothing_missing", "something said to be missing"): "nothing is missing: the study says that something is",
    ("one_known_effect", "visible: right in the answer"): "one effect of the catalogue: it is in the answer",
    ("one_known_effect", "visible: right first"): "the same: it is named first",
    ("one_known_effect", "visible: a name too many"): "the same: with a name too many",
    ("one_known_effect", "visible: a wrong name that is sure"): "the same: a wrong name with a confidence of 0.9",
    ("one_unknown_effect", "visible: right block"): "an effect outside the catalogue: the right block is named",
    ("one_unknown_effect", "visible: a name of the catalogue"): "the same: a name of the catalogue",
    ("two_effects", "both visible: both in the answer"): "two effects: both are in the answer",
    ("all", "findings with a confidence of 0.9 or more: right"): "all suites, findings with a confidence of 0.9: right",
}
"""Rows of the page for users: a rate, and its words."""


def render_short_rates(rates: Sequence[Rate]) -> str:
    """Return the table of the page for users, of what is reported."""
    given = {(rate.suite, rate.what): rate for rate in rates if rate.stage == "reported"}
    rows = [f"| {words} | {_count(given[key])} |" for key, words in SHORT.items() if key in given]
    return "\n".join(["| recordings in which | cases (95 % bounds) |", "| --- | --- |", *rows])


def render_rates(rates: Sequence[Rate]) -> str:
    """Return the table of the rates of at least `FEWEST`, of all findings and of those that are reported."""
    keys = dict.fromkeys((rate.suite, rate.what) for rate in rates if rate.of >= FEWEST)
    given = {(rate.suite, rate.what, rate.stage): rate for rate in rates}
    rows = []
    for suite, what in keys:
        first, reported = (given.get((suite, what, stage)) for stage in ("all", "reported"))
        cells = [f"{rate.hits} of {rate.of}" if rate else "" for rate in (first, reported)]
        rows.append(f"| {suite.replace('_', ' ')} | {what} | {' | '.join(cells)} "
                    f"| {_bounds(reported or first)} |")
    return "\n".join(["| suite | counted | all findings | reported | 95 % bounds |", "| --- | --- | --- | --- | --- |",
                      *rows])


def render_confidence() -> str:
    """Return the logarithm of the odds that a finding is right."""
    constant, *others = coefficients()
    variables = ("s q", "s [alone]", "[further]", "ln q", "[rare]")
    terms = (f"{'-' if value < 0 else '+'} {abs(value):.2f} {words}"
             for value, words in zip(others, variables, strict=True))
    return f"    logit P = {constant:.2f} {' '.join(terms)}\n    s = min(max(lead, 0) / 5, 1)"


def _read(of_engine: bool) -> list[Rate]:
    return [rate for rate in read_rates(TABLE) if (rate.suite == OTHER_MACHINES) == of_engine]


def _count(rate: Rate) -> str:
    return f"{rate.hits} of {rate.of} ({_bounds(rate)})"


def _bounds(rate: Rate | None) -> str:
    assert rate is not None
    return "{:.0f} to {:.0f} %".format(*(100 * bound for bound in rate.bounds))


PARTS: dict[str, dict[str, Callable[[], str]]] = {
    "docs/study.md": {"rates": lambda: render_short_rates(read_rates(TABLE))},
    "docs/naming.md": {"rates": lambda: render_rates(_read(of_engine=False)), "confidence": render_confidence},
    "docs/engine.md": {"rates": lambda: render_rates(_read(of_engine=True))},
    "evidence/real.md": {f"{name} {words}": partial(render, name) for name in MACHINES
                         for words, render in (("findings", render_findings), ("values", render_values))},
}
"""Page, and the name of each mark with what is written there."""


def replace_part(text: str, mark: str, content: str) -> str:
    """Return the text of a page with other content between its marks; raises `ValueError` where it has none."""
    opened, closed = f"<!-- {mark} -->", f"<!-- /{mark} -->"
    if text.count(opened) != 1 or text.count(closed) != 1:
        raise ValueError(f"The page needs one '{opened}' and one '{closed}'")
    return re.sub(f"{opened}\n.*?{closed}", lambda _: f"{opened}\n\n{content}\n\n{closed}", text, flags=re.DOTALL)


def render_page(page: str) -> str:
    """Return the text of a page with its parts as the tables have them."""
    text = (ROOT / page).read_text()
    for mark, render in PARTS[page].items():
        text = replace_part(text, mark, render())
    return text


if __name__ == "__main__":
    for name in PARTS:
        (ROOT / name).write_text(render_page(name))
