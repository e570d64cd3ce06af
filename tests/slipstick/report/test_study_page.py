"""The HTML report of a study: answer, support, gap, caveats and limitations."""

import json
import re
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import pytest

from slipstick.pictures.study import CAPTIONS
from slipstick.report.study import limits, words
from slipstick.report.study.page import study_page
from slipstick.study.settings import StudySettings

Studied = Callable[[str], tuple[Any, Any, dict[str, Any]]]
Read = Callable[[str], Any]
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;"
STUDY = {"id": "first-study", "recordings": "few", "recordings_digest": "c3d4", "settings": asdict(StudySettings()),
         "submitted": "2026-11-01T10:00:00Z", "ended": "2026-11-01T10:00:12Z"}


@pytest.fixture
def output(studied: Studied) -> dict[str, Any]:
    return studied("friction")[2]


def joined(items: list[tuple[str, str]]) -> str:
    return " ".join(f"{lead} {text}" for lead, text in items)


def test_the_page_reports_the_missing_effect_and_its_support(output: dict[str, Any], reading: Read) -> None:
    result = output["result"]
    result["gap"]["closures"]["shifting_time"] |= {
        "rms_before": 0.0286, "rms_after": 0.0074, "rms_expected": 0.0071, "closure": 0.99, "lower": 0.97,
        "upper": 1.01}
    result["rounds"][0]["ranking"][0] |= {"sure": 78.6, "bootstrap_share": 1.0}
    text = reading(study_page(STUDY, output)).text
    for phrase in ("Missing: Slip-speed-dependent friction", "by 79 standard errors over 24 experiments",
                   "the best candidate in 100 % of bootstrap samples", "goes from 28.6 to 7.4 ms", "would leave 7.1 ms",
                   "The effect closes 99 % (97 to 101) of the gap", "decay speed [rad/s]", "90 % interval",
                   "the friction coefficient is alpha (1 + strength exp(", "Support: significant in the screening",
                   "In the block “pressure, speeds → torque”", "noise of the output torque [multiple of sensor noise]",
                   "run-to-run std of pressure bias", "The named effect is the best supported of the catalogue",
                   "c3d4", "fit 2 s", result["settings_digest"]):
        assert phrase in text, phrase
    assert reading(study_page(STUDY, output)).count("figure") == len(CAPTIONS) - 1  # one needs fits


@pytest.mark.parametrize(("name", "lead"), [
    ("nothing", "In 24 experiments, no effect of the catalogue is both significant and large enough to matter"),
    ("drag", "With quadratic load drag added, the model predicts held-out conditions better than the best fit"),
    ("times", "Nothing is missing that these recordings could show")])
def test_every_kind_of_answer_has_a_page(studied: Studied, reading: Read, name: str, lead: str) -> None:
    parsed = reading(study_page(STUDY, studied(name)[2]))
    assert lead in parsed.text
    assert ("With shifting times only, a name stands for a class" in parsed.text) == (name == "times")
    assert ("Findings" in parsed.text) == bool(studied(name)[2]["result"]["answer"]["effects"])


def test_an_answer_without_an_effect_has_its_reason(output: dict[str, Any]) -> None:
    output["result"]["answer"] |= {"kind": "none", "effects": []}
    assert "no effect of the catalogue significantly improves the prediction" in words.lead(
        output["result"], output["figure_data"])
    output["result"]["answer"]["kind"] = "not converged"
    assert "did not converge" in words.lead(output["result"], output["figure_data"])


def test_an_open_term_is_not_reported_as_an_identified_effect(output: dict[str, Any], reading: Read) -> None:
    term = "open_friction_coefficient"
    output["figure_data"]["effects"][term] = {**output["figure_data"]["effects"]["stribeck_friction"],
                                           "title": "Unlisted term in the friction coefficient"}
    output["result"]["answer"] |= {"kind": "unlisted", "effects": [term], "tied": [[term]], "coefficients": [
        {"effect": term, "coefficient": "signal", "unit": "1", "value": 4.0, "lower": 4.0, "upper": 4.0,
         "at_bound": False}]}
    output["result"]["answer"]["forms"] = [
        {"quantity": "friction coefficient", "form": "(plate slip / 50 rad/s)", "share": 0.62},
        {"quantity": "friction coefficient", "form": "(plate slip / 50 rad/s)^2", "share": 0.38}]
    text = reading(study_page(STUDY, output)).text
    assert "(plate slip / 50 rad/s) in the friction coefficient (62 %) and (plate slip / 50 rad/s)^2" in text
    assert "The term describes the missing effect but does not identify it." in text
    assert "selected from discrete values" in text
    assert "Slip-speed-dependent friction, the best effect of the catalogue, improves" in text


def test_a_tie_lists_all_tied_effects(output: dict[str, Any]) -> None:
    output["result"]["answer"]["tied"] = [["stribeck_friction", "quadratic_load_drag"]]
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking[1:] = [{**ranking[0], "effect": "quadratic_load_drag", "title": "Quadratic load drag", "behind": 1.2}]
    assert "slip-speed-dependent friction and quadratic load drag. Any of them may be the missing effect." in joined(
        limits.caveats(output["result"], output["figure_data"]))
    assert "do not distinguish it from Quadratic load drag." in joined(
        words.rounds(output["result"], output["figure_data"]))


def test_a_rival_that_later_effects_distinguish_is_no_tie(output: dict[str, Any]) -> None:
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking[1:] = [{**ranking[0], "effect": "thermal_fade", "title": "Thermal fade", "behind": 1.2, "tied": True}]
    text = joined(words.rounds(output["result"], output["figure_data"]))
    assert "trails the best by 1.2 standard errors; the other added effects distinguish the two." in text
    assert "do not distinguish it" not in text


def test_a_tie_comes_with_further_experiments(output: dict[str, Any], reading: Read) -> None:
    assert "Experiments that would distinguish the tied effects" not in reading(study_page(STUDY, output)).text
    experiment = {"current_profile": 3, "motor_speed": 238.76, "load_inertia": 4.8000001, "brake_torque": 16.0,
                  "recorded": False, "apart": 0.2136, "signal": "output_torque", "repetitions": 12}
    tie = {"effects": ["stribeck_friction", "quadratic_load_drag"], "experiments": [experiment]}
    output["result"]["further"] = [tie]
    text = reading(study_page(STUDY, output)).text
    assert "To distinguish slip-speed-dependent friction and quadratic load drag, run:" in text
    assert re.search(r"3\s*238.8\s*4.8\s*16\s*no\s*0.21\s*output torque\s*12", text)
    experiment["repetitions"] = None
    assert "No experiment near the recorded conditions would distinguish" in reading(study_page(STUDY, output)).text
    tie["experiments"] = []
    assert "There is no condition near the recorded ones under which" in reading(study_page(STUDY, output)).text


def test_an_unexplained_misfit_comes_first(output: dict[str, Any], reading: Read) -> None:
    last = output["result"]["rounds"][-1]
    last["noise"] = [1.0, 1.2, 1.0, 3.0, 1.0]
    text = reading(study_page(STUDY, output)).text
    assert "the reduced chi-square is 9 in the output torque; 1 corresponds to noise" in text
    assert text.index("Part of the misfit is unexplained") < text.index("Findings")
    last["noise"] = [1.0] * 5
    assert "Part of the misfit is unexplained" not in reading(study_page(STUDY, output)).text


def test_a_control_that_closes_as_much_casts_doubt(output: dict[str, Any]) -> None:
    gap = output["result"]["gap"]
    gap["closures"]["shifting_time"]["closure"] = 0.9
    for closure, doubt in ((0.6, True), (0.1, False), (-4.0, False)):
        gap["control"]["closures"]["shifting_time"]["closure"] = closure
        assert ("closes 60 % of the gap in the shifting time" in joined(
            limits.caveats(output["result"], output["figure_data"]))) == doubt
    assert next(row[-1] for row in words.gap(output["result"]) if row[0] == "shifting time [ms]") == \
        "none, the error grows"


def test_a_run_order_that_follows_a_condition_is_reported(output: dict[str, Any]) -> None:
    conditions = output["figure_data"]["conditions"]
    assert "No condition follows the run order" in joined(limits.limits(output["figure_data"]))
    order = sorted(range(24), key=lambda index: conditions["motor_speed"][index])
    conditions["run_order"] = [order.index(index) for index in range(24)]
    assert "the run order follows motor speed (correlation 0.97)" in joined(limits.limits(output["figure_data"]))
    conditions["run_order"] = None
    assert "have no run order" in joined(limits.limits(output["figure_data"]))


def test_the_reason_for_the_end_is_reported(output: dict[str, Any]) -> None:
    last = output["result"]["rounds"][-1]
    for change, phrase in (({"p_value": 0.4, "ranking": []},
                            "no further effect is both significant and large enough to matter (p\u00a0=\u00a00.4)"),
                           ({"p_value": None, "ranking": []}, "no further effect was tested."),
                           ({"p_value": 0.001, "ranking": output["result"]["rounds"][0]["ranking"]},
                            "Slip-speed-dependent friction would be next")):
        last |= change
        assert phrase in joined(words.rounds(output["result"], output["figure_data"]))


def test_nothing_in_the_data_becomes_markup(output: dict[str, Any], reading: Read) -> None:
    tame = reading(study_page(STUDY, output))
    output["result"]["answer"]["sentence"] = HOSTILE
    output["result"]["answer"]["coefficients"][0] |= {"coefficient": HOSTILE, "unit": HOSTILE}
    output["figure_data"]["effects"]["stribeck_friction"] = dict.fromkeys(
        ("title", "block", "quantity", "law", "signature", "source"), HOSTILE)
    hostile = reading(study_page(STUDY | dict.fromkeys(("id", "recordings", "recordings_digest"), HOSTILE), output))
    assert hostile.count("img") == 0
    assert hostile.count("script") == tame.count("script") == 5
    assert hostile.text.count("<script>alert(1)</script>") > 8


def test_the_page_refers_to_no_external_resource_and_is_small(output: dict[str, Any], reading: Read) -> None:
    html = study_page(STUDY, output)
    for _, attributes in reading(html).elements:
        assert not {"src", "href", "action"} & attributes.keys()
    assert re.search(r"Content-Security-Policy\" content=\"default-src 'none'", html)
    assert len(html) < 1_500_000


def test_the_same_study_gives_the_same_page(output: dict[str, Any]) -> None:
    assert study_page(STUDY, output) == study_page(json.loads(json.dumps(STUDY)), json.loads(json.dumps(output)))
