"""The report of a fit as a page: what it says, and that nothing in the data can break out of it."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from slipstick.figure_data import figure_data
from slipstick.inference import table_problem
from slipstick.pictures import CAPTIONS
from slipstick.report import costs, page, words
from slipstick.storage.library import Library
from slipstick.uncertainty import fit

Made = Callable[..., dict[str, Any]]
Read = Callable[[str], Any]
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;"
FIT = {"id": "first-fit", "table": "nominal", "table_digest": "a1b2", "recordings": "measured",
       "recordings_digest": "c3d4", "simulate": False, "outside": "clip",
       "settings": {"seed": 7, "mean_bounds": [[0.5, 1.5]]},
       "submitted": "2026-11-01T10:00:00Z", "ended": "2026-11-01T10:00:12Z"}


def test_the_page_says_what_was_found(made: Made, reading: Read) -> None:
    shown = reading(page(FIT, made(), about="a bench"))
    for said in ("Pressure bias and initial position fitted to 216 engagements of “measured”",
                 "log10 likelihood −300.00 before, −269.00 after", "31.0 decades (factors of ten) more likely",
                 "open, to 1.01",
                 "0.99 to 1.01", "Limited above only: mean of pressure bias.", "Limited on both sides (90 %): mean of "
                 "initial position, std of pressure bias, std of initial position and output std.",
                 "Identified: 1.00 × mean of pressure bias + 1.00 × mean of initial position, to "
                 "±\u00a01\u00a0% of the range.",
                 "search 9 s", "a1b2", "c3d4", "seed 7", "a bench", "recordings are simulated"):
        assert said in shown.text, said
    assert shown.count("figure") == len(CAPTIONS)


def test_a_real_fit_has_all_that_the_made_up_one_has(shelf: Path, made: Made, reading: Read) -> None:
    library = Library(shelf)
    table, recordings = library.table("nominal"), library.recording("measured")
    problem = table_problem(table, recordings, "clip")
    settings = fit.FitSettings(population=4, generations=1, refine=False)
    state = fit.next_state(settings, problem, fit.initial_state(settings, problem))
    estimate = fit.with_next_interval(settings, problem, fit.refined_estimate(settings, problem, state))
    result = fit.summary(settings, problem, state, estimate)
    shown = figure_data(settings, problem, estimate["vector"], table.model, recordings)
    assert shape(made()["result"]) <= shape(result)
    assert shape(made()["figure_data"]) == shape(shown)
    said = reading(page(FIT, {"result": result, "figure_data": shown, "seconds": {}, "processor_seconds": {}}))
    assert said.count("figure") == len(CAPTIONS)


def shape(value: Any, place: str = "") -> set[str]:
    """The places of all values in nested mappings; of a list its first entry."""
    if isinstance(value, dict) and "weights" not in place:
        return {found for name, entry in value.items() for found in shape(entry, f"{place}/{name}")}
    return shape(value[0], f"{place}/0") if isinstance(value, list) and value else {place}


def test_nothing_in_the_data_becomes_markup(made: Made, reading: Read) -> None:
    output = made((HOSTILE, "initial_position"))
    output["result"]["remarks"] = [{"unknown": HOSTILE, "cause": HOSTILE, "remedy": HOSTILE}]
    fit = FIT | dict.fromkeys(("id", "table", "recordings", "recordings_digest"), HOSTILE)
    hostile, tame = reading(page(fit, output, about=HOSTILE)), reading(page(FIT, made(), about="a bench"))
    assert hostile.count("img") == 0
    assert hostile.count("script") == tame.count("script") == 5
    assert hostile.text.count("<script>alert(1)</script>") > 10


def test_the_page_refers_to_nothing_outside(made: Made, reading: Read) -> None:
    html = page(FIT, made())
    for _, attributes in reading(html).elements:
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


def test_a_fit_without_intervals_has_a_page(made: Made, reading: Read) -> None:
    output = made()
    output["result"] |= {"intervals": [], "combinations": []}
    said = reading(page(FIT, output))
    assert "Limited" not in said.text
    assert "interval" not in said.text.split("Pictures")[0]
    assert said.count("figure") == len(CAPTIONS) - 1


def test_a_combination_that_may_be_anything_has_no_number(made: Made) -> None:
    output = made()
    output["result"]["combinations"][0] |= {"std_error": 5628.9, "identified": False}
    assert words.combinations(output["result"])[0][1].endswith("not at all within the range.")


def test_a_combination_is_told_with_its_interval(made: Made) -> None:
    output = made()
    output["result"]["combinations"][0]["interval"] = {
        "estimate": 0.4, "lower": 0.381, "upper": 0.422, "unsettled": [], "level": 0.9}
    assert words.combinations(output["result"])[0][1].endswith("from −1.9 to +2.2\u00a0% of the range (90\u00a0%).")


def test_an_end_that_was_not_found_is_not_called_open(made: Made, reading: Read) -> None:
    output = made()
    output["result"]["intervals"][0]["unsettled"] = ["lower"]
    text = reading(page(FIT, output)).text
    assert "not found, to 1.01" in text
    assert "An end was not found: mean of pressure bias." in text


def test_no_more_of_a_combination_is_told_than_can_be_read(made: Made) -> None:
    output = made(tuple(f"input_{number}" for number in range(7)))
    output["result"]["combinations"][0]["weights"] = {f"mean of input_{number}": 0.4 - 0.01 * number
                                                      for number in range(7)}
    assert words.combinations(output["result"])[0][1].startswith(
        "0.40 × mean of input 0 + 0.39 × mean of input 1 + 0.38 × mean of input 2 …, to")


def test_one_remedy_is_said_once(made: Made) -> None:
    output = made()
    output["result"]["remarks"] = [{"unknown": name, "cause": f"{name} is low", "remedy": "Widen"} for name in "ab"]
    assert words.remarks(output["result"]) == [("a is low. b is low.", "Widen.")]


def test_correlations_are_among_the_numbers(made: Made) -> None:
    output = made()
    output["result"]["correlation"] = [[1.0, -0.6], [-0.6, 1.0]]
    output["result"]["intervals"].append({"unknown": "partial correlation of a and b given c", "estimate": 0.2,
                                          "lower": None, "upper": 0.5, "unsettled": [], "level": 0.9})
    rows = list(words.numbers(output["result"]))
    assert rows[-2] == ("correlation of pressure bias and initial position", "0", "−0.6", "")
    assert rows[-1] == ("partial correlation of a and b given c", "0", "0.2", "open, to 0.5")


def test_table_ii_holds_both_methods_beside_the_papers(made: Made) -> None:
    genetic, classic = made(), made()
    classic["result"] |= {"method": "classic", "searched": {"log10_likelihood": -269.2}, "log10_likelihood": -268.9,
                          "generations": 16}
    classic["processor_seconds"] = {"open": 1.0, "search": 7199.0, "refine": 60.0, "intervals": 500.0}
    expected = [
        ("277 h", "−269.00", "2 h", "−269.20"), ("", "", "2.02 h", "−268.90"),
        ("1.65 h", "−273.00", "9.1 s", "−269.50"), ("", "", "12.1 s", "−269.00"),
        ("168 ×", "4.00 decades", "600 ×", "0.10 decades")]
    assert [row[1:] for row in costs.rows(genetic, classic)] == expected
    assert [row[1:] for row in costs.rows(classic, genetic)] == expected
    slower = classic | {"result": genetic["result"] | {"method": "classic", "log10_likelihood": -269.001},
                        "processor_seconds": {"search": 1.21}}
    assert costs.rows(genetic, slower)[-1][3:] == ("0.1 ×", "0.00 decades")
    said = "4 values of each of the 2 unknowns, 16 candidates; one twice as fine costs 4 times as much."
    assert said in costs.notes(genetic, classic)[1]
    assert len(costs.notes(genetic, None)) == 2  # of the data, and that a row is empty
    nothing = ("", "")
    assert [row[3:] for row in costs.rows(genetic, None)] == [
        nothing, nothing, expected[2][2:], expected[3][2:], nothing]


@pytest.mark.parametrize("axes", [("pressure_bias",), tuple(f"input_{number}" for number in range(7))])
def test_any_number_of_inputs_has_a_page(made: Made, axes: tuple[str, ...]) -> None:
    html = page(FIT, made(axes))
    assert len(json.loads(re.findall(r'id="pictures">(.*?)</script>', html)[0])) == len(CAPTIONS)


def test_the_same_fit_gives_the_same_page(made: Made) -> None:
    assert page(FIT, made()) == page(FIT, json.loads(json.dumps(made())))
