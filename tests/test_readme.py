"""The numbers of the README are those of the notebook, which a test of the wheel computes again, and of the rates."""

import json
import re
from pathlib import Path

from evidence.tables import read_rates

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "README.md").read_text()
TEXT = " ".join(PAGE.replace(">", "").split())
CELLS = json.loads((ROOT / "docs" / "quickstart.ipynb").read_text())["cells"]
PRINTED = "".join("".join(shown["text"]) for cell in CELLS for shown in cell.get("outputs", ()) if "text" in shown)


def numbers(pattern: str) -> tuple[str, ...]:
    """What the groups of a pattern match in the output of the notebook."""
    match = re.search(pattern, PRINTED)
    assert match, pattern
    return match.groups()


def test_the_gap_is_that_of_the_study() -> None:
    before, after, wrong, expected = numbers(r"([\d.]+) ms without the effect, ([\d.]+) ms with it, "
                                             r"([\d.]+) ms with a wrong one, ([\d.]+) ms by noise")
    assert f"falls from {before} to {after} ms; sensor noise and scatter alone leave {expected} ms" in TEXT
    assert f"as a control, leaves {wrong} ms" in TEXT


def test_the_law_and_its_confidence_are_those_of_the_finding() -> None:
    law, = numbers(r"The (friction coefficient falls by [\d.]+ % as the slip of the plates grows from [\d.]+ to "
                   r"\d+ rad/s)")
    confidence, right, total = numbers(r"confidence ([\d.]+): (\d+) of (\d+) were right")
    assert law in TEXT
    assert f"a confidence of {confidence}: of {total} findings" in TEXT
    assert f"effects, {right} were right" in TEXT


def test_the_fits_are_those_of_both_models() -> None:
    for which, words in (("before", "likelihood is {}, and the position scatters by {} %"),
                         ("after", "with it, {} and {} %")):
        likelihood, scatter = numbers(rf"{which}: log10 likelihood ([-\d.]+), scatter (\d+) %")
        assert words.format(likelihood.replace("-", "−"), scatter) in TEXT


def test_the_rates_are_those_of_the_table() -> None:
    rates = {(rate.suite, rate.what): rate for rate in read_rates(ROOT / "evidence" / "rates.csv")
             if rate.stage == "reported"}
    wrong = rates["nothing_missing", "something said to be missing"]
    right = rates["one_known_effect", "visible: right first"]
    assert f"of {wrong.of} in which nothing was missing, it said of {wrong.hits} that something was" in TEXT
    assert f"of {right.of} with one visible effect of the catalogue, it named it first in {right.hits}" in TEXT


def test_it_is_short() -> None:
    assert len(PAGE.split("## Further reading")[0].split()) < 750
