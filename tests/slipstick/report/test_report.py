"""The report of a fit as a page: what it says, and that nothing in the data can break out of it."""

import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import pytest

from slipstick.pictures import CAPTIONS
from slipstick.report import costs, page, words

Made = Callable[..., dict[str, Any]]
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;"
FIT = {"id": "first-fit", "table": "nominal", "table_digest": "a1b2", "recordings": "measured",
       "recordings_digest": "c3d4", "simulate": False, "outside": "clip",
       "settings": {"seed": 7, "mean_bounds": [[0.5, 1.5]]},
       "submitted": "2026-11-01T10:00:00Z", "ended": "2026-11-01T10:00:12Z"}


class Reading(HTMLParser):
    """The elements of a page in their order, and its text outside of scripts."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.elements and self.elements[-1][0] not in ("script", "style"):
            self.text += data

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.elements)


def test_the_page_says_what_was_found(made: Made) -> None:
    reading = Reading(page(FIT, made(), about="a bench"))
    for said in ("Pressure bias and initial position fitted to 216 engagements of “measured”",
                 "log10 likelihood −300.00 before, −269.00 after", "31.0 decades more likely", "open, to 1.01",
                 "0.99 to 1.01", "Limited above only: mean of pressure bias.", "Limited on both sides (90 %): mean of "
                 "initial position, std of pressure bias, std of initial position and output std.",
                 "Identified: 1.00 × mean of pressure bias + 1.00 × mean of initial position, to "
                 "±\u00a01\u00a0% of the range.",
                 "a1b2", "c3d4", "seed 7", "a bench", "recordings are simulated"):
        assert said in reading.text, said
    assert reading.count("figure") == len(CAPTIONS)


def test_nothing_in_the_data_becomes_markup(made: Made) -> None:
    output = made((HOSTILE, "initial_position"))
    output["result"]["remarks"] = [{"unknown": HOSTILE, "cause": HOSTILE, "remedy": HOSTILE}]
    fit = FIT | dict.fromkeys(("id", "table", "recordings", "recordings_digest"), HOSTILE)
    hostile, tame = Reading(page(fit, output, about=HOSTILE)), Reading(page(FIT, made(), about="a bench"))
    assert hostile.count("img") == 0
    assert hostile.count("script") == tame.count("script") == 5
    assert hostile.text.count("<script>alert(1)</script>") > 10


def test_the_page_refers_to_nothing_outside(made: Made) -> None:
    html = page(FIT, made())
    for _, attributes in Reading(html).elements:
        assert not {"src", "href", "action"} & attributes.keys()
    assert "sourceMappingURL" not in html
    assert re.search(r"Content-Security-Policy\" content=\"default-src 'none'", html)
    for project in ("University of Washington", "Mike Bostock"):
        assert project in html  # their licences travel with their programs


def test_a_likelihood_of_minus_infinity_is_said(made: Made) -> None:
    output = made()
    output["result"]["before"]["log10_likelihood"] = None
    assert "the nominal model leaves at least one engagement without any" in page(FIT, output)
    output["result"]["log10_likelihood"] = None
    assert "The fitted inputs leave at least one engagement without any likelihood" in page(FIT, output)


def test_a_fit_without_intervals_has_a_page(made: Made) -> None:
    output = made()
    output["result"] |= {"intervals": [], "combinations": []}
    reading = Reading(page(FIT, output))
    assert "Limited" not in reading.text
    assert reading.count("figure") == len(CAPTIONS) - 1


def test_correlations_are_among_the_numbers(made: Made) -> None:
    output = made()
    output["result"]["correlation"] = [[1.0, -0.6], [-0.6, 1.0]]
    assert ("correlation of pressure bias and initial position", "0", "−0.6", "") in words.numbers(output["result"])


def test_table_ii_holds_both_methods_beside_the_papers(made: Made) -> None:
    genetic, classic = made(), made()
    classic["result"] |= {"method": "classic", "searched": {"log10_likelihood": -269.2}, "log10_likelihood": -268.9}
    classic["seconds"] = {"open": 1.0, "search": 7199.0, "refine": 60.0, "intervals": 500.0}
    expected = [
        ("277 h", "−269.00", "2 h", "−269.20"), ("", "", "2.02 h", "−268.90"),
        ("1.65 h", "−273.00", "9.1 s", "−269.50"), ("", "", "12.1 s", "−269.00"),
        ("168 ×", "4.00 decades", "600 ×", "0.10 decades")]
    assert [row[1:] for row in costs.rows(genetic, classic)] == expected
    assert [row[1:] for row in costs.rows(classic, genetic)] == expected
    nothing = ("", "")
    assert [row[3:] for row in costs.rows(genetic, None)] == [
        nothing, nothing, expected[2][2:], expected[3][2:], nothing]


@pytest.mark.parametrize("axes", [("pressure_bias",), tuple(f"input_{number}" for number in range(7))])
def test_any_number_of_inputs_has_a_page(made: Made, axes: tuple[str, ...]) -> None:
    html = page(FIT, made(axes))
    assert len(json.loads(re.findall(r'id="pictures">(.*?)</script>', html)[0])) == len(CAPTIONS)


def test_the_same_fit_gives_the_same_page(made: Made) -> None:
    assert page(FIT, made()) == page(FIT, json.loads(json.dumps(made())))
