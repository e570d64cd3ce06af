"""The section on the same fit on both tables of a study: numbers in units, or instructions to add it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from slipstick.report.study.fits import numbers, same_fit
from slipstick.study.result import Gap, SimulationResult, StudyResult

BEFORE, AFTER = (SimulationResult({}, {}, {}, 0.0, True, {
    "parameters": {"pressure_bias": bar, "initial_position": 5e-4},
    "units": {"pressure_bias": "bar", "initial_position": "m"}}) for bar in (3.2, 1.6))
RESULT = StudyResult("effect", "", [], [], [], BEFORE, AFTER, Gap({}, [], [], None), 24, {}, "", "")
STUDY: dict[str, Any] = {"id": "mine", "links": {"self": "/v1/studies/mine"}}


def test_the_numbers_of_both_fits_are_in_units(both_fits: dict[str, dict[str, Any]]) -> None:
    assert list(numbers(RESULT, both_fits)) == [
        ("log10 likelihood", "−389.00", "−269.00"),
        ("mean of pressure bias [bar]", "3.2", "1.6"), ("mean of initial position [mm]", "0.5", "0.5"),
        ("std of pressure bias [bar]", "0.16", "0.08"), ("std of initial position [mm]", "0.025", "0.025"),
        ("output noise [ms]", "12", "3")]
    both_fits["before"]["result"]["log10_likelihood"] = None
    assert next(numbers(RESULT, both_fits)) == ("log10 likelihood", "−∞", "−269.00")


@pytest.mark.parametrize("picture", ["<figure></figure>", ""])
def test_the_section_states_the_provenance_of_its_numbers(
        both_fits: dict[str, dict[str, Any]], reading: Callable[[str], Any], picture: str) -> None:
    parsed = reading(same_fit(STUDY, RESULT, both_fits, picture))
    for phrase in ("The same fit on the tables of both models", "fit fit-before, table table-before, SHA-256 a1b2",
                   "fit fit-after, table table-after, SHA-256 c3d4"):
        assert phrase in parsed.text
    assert parsed.count("figure") == bool(picture)


def test_without_fits_the_section_has_instructions(reading: Callable[[str], Any]) -> None:
    text = reading(same_fit(STUDY, RESULT, None, "")).text
    for phrase in ("GET /v1/studies/mine/model?which=before", "worker build --bench BENCH --model", "POST /v1/fits",
                   "/v1/studies/mine/report?before=FIT&after=FIT"):
        assert phrase in text
    assert "/v1/studies/ID/report" in same_fit({"id": "mine"}, RESULT, None, "")


def test_without_an_added_effect_there_is_no_section() -> None:
    assert same_fit(STUDY, replace(RESULT, gap=None), None, "") == ""
