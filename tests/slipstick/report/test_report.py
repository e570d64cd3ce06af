"""The HTML report of a fit: its texts, and that no data can become markup."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from slipstick.inference.figures import figure_data
from slipstick.inference.problems import table_problem
from slipstick.pictures import CAPTIONS
from slipstick.recordings import Recordings
from slipstick.recordings.shipped import SIMULATED
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


@pytest.mark.usefixtures("undrawn")
def test_the_page_reports_the_results(made: Made, reading: Read) -> None:
    parsed = reading(page(FIT, made(), description="a bench"))
    for text in ("Pressure bias and initial position fitted to 216 engagements of “measured”",
                 "log10 likelihood −300.00 before the fit, −269.00 after", "31.0 decades (factors of ten) more likely",
                 "up to 1.01 (open below)", "up to 1.616 bar (open below)",
                 "0.99 to 1.01", "1.584 to 1.616 bar", "Limited above only: mean of pressure bias.",
                 "Limited on both sides (90 %): mean of "
                 "initial position, scatter of pressure bias, scatter of initial position and output noise.",
                 "Identified: 1.00 × mean of pressure bias + 1.00 × mean of initial position, standard error "
                 "1\u00a0% of the range.",
                 "search 9 s", "a1b2", "c3d4", "a bench",
                 "mean searched from 0.5 to 1.5 multiples of nominal; random numbers from seed 7"):
        assert text in parsed.text, text
    assert parsed.count("figure") == len(CAPTIONS)


@pytest.mark.usefixtures("undrawn")
def test_shipped_recordings_are_known_by_their_numbers_and_not_by_their_name(made: Made, reading: Read) -> None:
    assert {Recordings.open(name).digest for name in ("measured", "measured-compact", "sample")} == SIMULATED
    renamed = {**FIT, "recordings": "mine", "recordings_digest": Recordings.open("sample").digest}
    text = reading(page(renamed, made())).text
    assert "recordings mine (shipped, simulated)" in text
    assert "These recordings are shipped and simulated" in text
    text = reading(page(FIT, made())).text  # called as a shipped one
    assert "recordings measured" in text
    assert "simulated:" not in text
    assert "(shipped" not in text


@pytest.mark.usefixtures("undrawn")
def test_a_fit_of_another_machine_is_to_measurements(made: Made, reading: Read) -> None:
    output = made(n=20)
    output["figure_data"] |= {"output": {"name": "final_speed", "unit": "rpm"}, "engagement": None, "conditions": {
        "voltage [V]": output["figure_data"]["conditions"]["motor_speed"]}}
    output["result"]["log10_likelihood"] = None
    text = reading(page(FIT, output)).text
    assert "fitted to 20 measurements of “measured”" in text
    assert "recordings measured · 20 measurements · 1 November 2026" in text
    assert "at least one of the measurements has zero likelihood" in text
    assert "engagement" not in text


@pytest.mark.slow
def test_a_real_fit_has_all_entries_of_the_synthetic_one(shelf: Path, made: Made, reading: Read) -> None:
    library = Library(shelf)
    table, recordings = library.table("nominal"), library.recording("measured")
    problem = table_problem(table, recordings, "clip")
    settings = fit.FitSettings(population=4, generations=1, refine=False)
    state = fit.next_state(settings, problem, fit.initial_state(settings, problem))
    estimate = fit.with_next_interval(settings, problem, fit.refined_estimate(settings, problem, state))
    result = fit.summary(settings, problem, state, estimate)
    computed = figure_data(settings, problem, state, estimate, table.model, recordings)
    assert shape(made()["result"]) <= shape(result)
    assert shape(made()["figure_data"]) == shape(computed)
    parsed = reading(page(FIT, {**made(), "result": result, "figure_data": computed}))
    assert parsed.count("figure") == len(CAPTIONS)


def shape(value: Any, path: str = "") -> set[str]:
    """The paths of all values in nested mappings; of a list, those of its first entry."""
    if isinstance(value, dict) and "weights" not in path:
        return {inner for name, entry in value.items() for inner in shape(entry, f"{path}/{name}")}
    return shape(value[0], f"{path}/0") if isinstance(value, list) and value else {path}


def test_nothing_in_the_data_becomes_markup(made: Made, reading: Read) -> None:
    output = made((HOSTILE, "initial_position"), 20)
    output["result"]["remarks"] = [{"unknown": HOSTILE, "cause": HOSTILE, "remedy": HOSTILE}]
    fit = FIT | dict.fromkeys(("id", "table", "recordings", "recordings_digest"), HOSTILE)
    html = page(FIT, made(n=20), description="a bench")
    hostile, tame = reading(page(fit, output, description=HOSTILE)), reading(html)
    assert hostile.count("img") == 0
    assert hostile.count("script") == tame.count("script") == 0
    assert hostile.text.count("<script>alert(1)</script>") > 10
    assert not any({"src", "action"} & attributes.keys() for _, attributes in tame.elements)
    assert all((attributes.get("href") or "#").startswith("#") for _, attributes in tame.elements)
    assert re.search(r"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"", html)


@pytest.mark.usefixtures("undrawn")
def test_the_model_before_a_fit_is_nominal_only_within_the_bounds(made: Made) -> None:
    output = made()
    assert "than with the nominal model, whose output noise" in page(FIT, output)
    output["result"]["before"]["mean"][0] = 1.2
    assert "than with the model whose inputs are as near to nominal as their bounds allow, whose output noise" in page(
        FIT, output)


@pytest.mark.usefixtures("undrawn")
def test_a_zero_likelihood_is_reported(made: Made) -> None:
    output = made()
    output["result"]["before"]["log10_likelihood"] = None
    assert "With the nominal model, at least one of the engagements has zero likelihood" in page(FIT, output)
    output["result"]["log10_likelihood"] = None
    assert "With the fitted inputs, at least one of the engagements has zero likelihood" in page(FIT, output)


@pytest.mark.usefixtures("undrawn")
def test_a_fit_without_intervals_has_a_page(made: Made, reading: Read) -> None:
    output = made()
    output["result"] |= {"intervals": [], "combinations": []}
    parsed = reading(page(FIT, output))
    assert "Limited" not in parsed.text
    assert "% interval" not in parsed.text.split("Pictures")[0]
    assert parsed.count("figure") == len(CAPTIONS) - 1  # no profiles


def test_a_combination_wider_than_its_range_has_no_number(made: Made) -> None:
    output = made()
    output["result"]["combinations"][0] |= {"std_error": 5628.9, "identified": False}
    assert words.combinations(output["result"])[0][1].endswith("standard error larger than the range.")


def test_a_combination_has_its_interval_relative_to_the_estimate(made: Made) -> None:
    output = made()
    interval = {"estimate": 0.4, "lower": 0.381, "upper": 0.422, "unsettled": [], "level": 0.9}
    output["result"]["combinations"][0]["interval"] = interval
    lead = "90\u00a0% interval as a share of the range:"
    assert words.combinations(output["result"])[0][1].endswith(f"{lead} −1.9\u00a0% to +2.2\u00a0%.")
    interval |= {"lower": None, "unsettled": ["lower"]}
    assert words.combinations(output["result"])[0][1].endswith(f"{lead} up to +2.2\u00a0% (end not found below).")


@pytest.mark.usefixtures("undrawn")
def test_an_end_that_was_not_found_is_not_called_open(made: Made, reading: Read) -> None:
    output = made()
    output["result"]["intervals"][0]["unsettled"] = ["lower"]
    text = reading(page(FIT, output)).text
    assert "up to 1.01 (end not found below)" in text
    assert "End of the interval not found: mean of pressure bias." in text


def test_a_combination_lists_its_largest_weights_only(made: Made) -> None:
    output = made(tuple(f"input_{number}" for number in range(7)))
    output["result"]["combinations"][0]["weights"] = {f"mean of input_{number}": 0.4 - 0.01 * number
                                                      for number in range(7)}
    assert words.combinations(output["result"])[0][1].startswith(
        "0.40 × mean of input 0 + 0.39 × mean of input 1 + 0.38 × mean of input 2 …, standard error")


def test_remarks_with_the_same_remedy_are_merged(made: Made) -> None:
    output = made()
    output["result"]["remarks"] = [{"unknown": name, "cause": f"{name} is low", "remedy": "Widen"} for name in "ab"]
    assert words.warnings(output["result"]) == [("a is low. b is low.", "Widen.")]


@pytest.mark.usefixtures("undrawn")
def test_values_at_a_bound_are_in_the_headline_and_warnings_before_it(made: Made, reading: Read) -> None:
    output = made()
    output["result"]["remarks"] = [
        {"unknown": "std of pressure_bias", "cause": "The std of pressure_bias is at its lower bound, 0.002",
         "remedy": "Interpret this as no scatter", "at_bound": True},
        {"unknown": "pressure_bias", "cause": "2 % of the runs have pressure_bias outside", "remedy": "Build a table"}]
    text = reading(page(FIT, output)).text.split("</title>")[-1]
    headline = "fitted to 216 engagements of “measured”, with scatter of pressure bias at its bound"
    assert headline in text
    body = text[text.index("Slipstick ·"):]
    assert body.index("The scatter of pressure bias is at its lower bound") < body.index(headline)
    assert body.index(headline) < body.index("log10 likelihood −300.00")
    assert "at its bound" not in reading(page(FIT, made())).text


@pytest.mark.usefixtures("undrawn")
def test_misfits_are_warnings_before_the_result(made: Made, reading: Read) -> None:
    assert reading(page(FIT, made())).count("aside") == 0
    output = made()
    prediction = output["figure_data"]["prediction"]
    prediction["measured"] = [mean + 0.02 for mean in prediction["mean"]]
    text = reading(page(FIT, output)).text
    body = text[text.index("Slipstick ·"):]
    assert body.index("The model lacks something: in 24 of 24 groups") < body.index("Pressure bias and initial")
    assert "the measured times are later than predicted" in body
    assert "All differences are measured minus predicted" in body


@pytest.mark.usefixtures("undrawn")
def test_lengths_and_currents_have_engineering_units(made: Made) -> None:
    output = made()
    output["physical"] = [{"name": "pressure_bias", "unit": "bar", "nominal": 1.6, "mean": 1.6, "std": 0.4},
                          {"name": "initial_position", "unit": "m", "nominal": 5e-4, "mean": 5e-4, "std": 7.457e-5}]
    rows = list(words.numbers(output["result"], output["physical"]))
    assert rows[1][3] == "0.5 mm"
    assert rows[3][3] == "0.07457 mm"
    assert rows[3][5] == "0.495 to 0.505 mm"
    assert "e-05" not in page(FIT, output)
    assert "e−05" not in page(FIT, output)


def test_the_numbers_include_correlations(made: Made) -> None:
    output = made()
    output["result"]["correlation"] = [[1.0, -0.6], [-0.6, 1.0]]
    output["result"]["intervals"].append({"unknown": "partial correlation of a and b given c", "estimate": 0.2,
                                          "lower": None, "upper": 0.5, "unsettled": [], "level": 0.9})
    rows = list(words.numbers(output["result"], output["physical"]))
    assert rows[0] == ("mean of pressure bias (normal)", "1", "1", "1.6 bar", "up to 1.01 (open below)",
                       "up to 1.616 bar (open below)")
    assert rows[3][3] == "80 mbar"
    assert rows[4][3] == "10 ms"
    assert rows[-2] == ("correlation of pressure bias and initial position", "0", "−0.6", "", "", "")
    assert rows[-1] == ("partial correlation of a and b given c", "0", "0.2", "", "up to 0.5 (open below)", "")


@pytest.mark.usefixtures("undrawn")
def test_table_ii_is_in_the_report_of_a_fit_of_the_inputs_of_the_paper_alone(made: Made, reading: Read) -> None:
    assert "Table II" in reading(page(FIT, made())).text
    other = made(("pressure_bias",))
    assert "Table II" not in reading(page(FIT, other)).text
    assert "Table II" in reading(page(FIT, other, other_method=made(("pressure_bias",)))).text


def test_the_settings_are_said_in_words() -> None:
    settings = {"families": ["normal", "gamma"], "std_bounds": [[0.002, 0.3], [0.01, 0.1]], "method": "classic",
                "grid": 6, "output_std_bounds": [0.001, 0.05], "refine": False, "intervals": True, "level": 0.9,
                "correlated": True}
    assert words.settings_of(settings, ["pressure_bias", "initial_position"]) == (
        "distributions of the inputs: normal (pressure bias) and gamma (initial position); scatter searched from "
        "0.002 to 0.3 (pressure bias) and 0.01 to 0.1 (initial position) multiples of nominal; output noise searched "
        "from 0.001 to 0.05 s; inputs may be correlated; classic search on a grid of 6 values for each unknown; no "
        "refinement; profile-likelihood intervals of 90 %")


@pytest.mark.usefixtures("undrawn")
def test_a_scatter_does_not_read_as_an_uncertainty(made: Made, reading: Read) -> None:
    said = words.fitted([{"name": "initial_position", "unit": "m", "mean": 7.02e-4, "std": 7.22e-5}])
    assert said == "initial position 0.702 mm with a scatter of 0.0722 mm"
    text = reading(page(FIT, made())).text
    assert "scatter of initial position" in text
    assert "std of" not in text


def test_table_ii_compares_both_methods_with_the_paper(made: Made) -> None:
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
    text = "4 values of each of the 2 unknowns, 16 candidates in total. A grid twice as fine costs 4 times as much."
    assert text in costs.notes(genetic, classic)[1]
    assert len(costs.notes(genetic, None)) == 2  # on the data, and on the missing method
    empty = ("", "")
    assert [row[3:] for row in costs.rows(genetic, None)] == [
        empty, empty, expected[2][2:], expected[3][2:], empty]
