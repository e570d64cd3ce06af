"""The pictures of a study: all can be rendered, and show every experiment, effect and signal."""

import json
import math
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import pytest
from scipy.stats import norm

from slipstick.pictures.study import CAPTIONS, Spec, likelihood, study_pictures

Studied = Callable[[str], tuple[Any, Any, dict[str, Any]]]
Marks = Callable[[Spec, str], list[ElementTree.Element]]
Scales = Callable[[Spec], Iterator[Spec]]
DATA = {"law": "line", "where": "rect", "screening": "symbol", "ranking": "symbol", "residual": "line",
        "signals": "line", "gap": "symbol", "likelihood": "symbol"}
"""Name of a picture -> kind of the marks of its data."""
ALONE = [name for name in CAPTIONS if name != "surfaces"]
"""Pictures that require no fits on the tables of the study."""


@pytest.fixture
def output(studied: Studied) -> dict[str, Any]:
    return studied("friction")[2]


def draw(output: dict[str, Any]) -> dict[str, Spec]:
    return study_pictures(output["result"], output["figure_data"])


def texts(marks: list[ElementTree.Element]) -> list[str]:
    return [word for mark in marks for word in mark.itertext()]


def test_a_study_has_all_pictures_and_each_can_be_rendered(output: dict[str, Any], marks: Marks) -> None:
    drawn = draw(output)
    assert list(drawn) == ALONE
    for name, spec in drawn.items():
        assert spec["title"]["text"]
        assert marks(spec, DATA[name])
        json.dumps(spec, allow_nan=False)


def test_every_quantity_is_shown_with_its_unit(output: dict[str, Any], scales: Scales) -> None:
    titles = {scale["title"] for spec in draw(output).values() for scale in scales(spec) if scale.get("title")}
    for unit in ("[rad/s]", "[10⁻⁴ N m/Pa]", "[noise levels]", "[bar]", "[N m]", "[s]", "[ms]", "[%]"):
        assert any(title.endswith(unit) for title in titles), unit


def test_pictures_of_an_effect_are_omitted_without_one(studied: Studied) -> None:
    assert list(draw(studied("nothing")[2])) == ["law", "where", "screening", "signals"]
    titles = [spec["title"]["text"] for spec in draw(studied("nothing")[2]).values()]
    assert titles[0] == "On the test bench, torque over pressure hardly depends on slip"
    assert titles[1].startswith("No block indicates a missing effect")
    assert titles[2] == "No effect of the catalogue is both significant and large enough to matter"


def test_shifting_times_alone_have_no_pictures_of_signals(studied: Studied) -> None:
    spec = draw(studied("times")[2])
    assert not {"law", "where", "residual", "signals"} & spec.keys()
    assert "screening" in spec


def test_the_title_of_the_law_states_the_trend_of_the_bench(output: dict[str, Any], marks: Marks) -> None:
    spec = draw(output)["law"]
    assert "torque over pressure grows by" in spec["title"]["text"]
    assert len(marks(spec, "line")) == 3  # measured, before, after
    assert len(marks(spec, "symbol")) == len(output["figure_data"]["law"]["cloud"]["slip"])
    output["figure_data"]["law"]["bins"]["median"].reverse()
    assert "torque over pressure falls by" in draw(output)["law"]["title"]["text"]


def test_each_cell_of_the_matrix_has_its_number(output: dict[str, Any], marks: Marks) -> None:
    where = output["figure_data"]["where"]
    where["before"]["chi_square"]["output_torque"]["slip"] = 123.4
    where["before"]["chi_square"]["pressure"]["slip"] = 0.96
    spec = draw(output)["where"]
    cells = sum(value is not None for model in ("before", "after") for row in where[model]["chi_square"].values()
                for value in row.values())
    assert len(marks(spec, "rect")) == cells
    assert {"123", "1.0"} <= set(texts(marks(spec, "text")))
    assert spec["title"]["text"] == "Model and test bench disagree most in the block “pressure, speeds → torque”"


def test_every_tested_effect_is_in_the_screening(output: dict[str, Any], marks: Marks) -> None:
    first, *_, last = output["result"]["rounds"]
    first["p_value"], last["p_value"] = 0.001, 0.37
    spec = draw(output)["screening"]
    assert len(marks(spec, "symbol")) == len(first["screening"]) + len(last["screening"])
    assert spec["title"]["text"].endswith("likelihood improvement: Slip-speed-dependent friction")
    assert "at most 0.1 % at first" in " ".join(spec["title"]["subtitle"])
    assert "37 % in the last round" in " ".join(spec["title"]["subtitle"])


def test_the_title_of_the_ranking_names_the_added_effect_not_the_first_in_the_ranking(output: dict[str, Any]) -> None:
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking.insert(0, {**ranking[0], "effect": "thermal_fade", "title": "Thermal fade"})
    title = draw(output)["ranking"]["title"]["text"]
    assert title == "Slip-speed-dependent friction explains most together with the effects added later"


def test_the_ranking_marks_added_and_tied_effects(output: dict[str, Any], marks: Marks) -> None:
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking[1:] = [{**ranking[0], "effect": name, "title": name, "held_out_gain": nats, "error": nats / sure,
                    "sure": sure, "behind": behind, "tied": behind < 2, "bootstrap_share": 0.25, "bic": -12345.6}
                   for name, nats, sure, behind in (("twin", 90.0, 9.0, 0.5), ("far", -2.302585, -2.0, 30.0))]
    output["result"]["rounds"][1:] = [{**output["result"]["rounds"][-1], "ranking": []}]
    assert draw(output)["ranking"]["title"]["text"] == "Slip-speed-dependent friction predicts best"
    output["result"]["answer"]["tied"][0].append("twin")
    spec = draw(output)["ranking"]
    rows = {row["title"]: row for row in spec["vconcat"][0]["data"]["values"]}
    assert [row["status"] for row in rows.values()] == ["added", "tied with the best", "behind"]
    assert spec["title"]["text"] == (
        "Slip-speed-dependent friction predicts best, but 1 more cannot be distinguished from it")
    # In decades, with two standard errors on either side.
    assert [rows["far"][name] for name in ("low", "improvement", "high")] == pytest.approx([-2, -1, 0], abs=1e-6)
    assert {"25 %", "30.0 s.e.", "−12\u202f346"} <= set(texts(marks(spec, "text")))


def test_the_best_of_a_round_that_added_nothing_is_not_called_added(output: dict[str, Any]) -> None:
    first = output["result"]["rounds"][0]["ranking"]
    output["result"]["rounds"] = [{**entry, "ranking": first} for entry in output["result"]["rounds"][:2]]
    panels = draw(output)["ranking"]["vconcat"]
    assert [panel["data"]["values"][0]["status"] for panel in panels] == ["added", "best, but not added"]
    assert panels[1]["title"]["text"] == "With slip-speed-dependent friction added"


def test_the_residual_varies_less_with_the_effect(output: dict[str, Any]) -> None:
    output["figure_data"]["residual"][0]["models"] = {
        "before": {"at": [1, 2, 3], "low": [-1, 1, 3], "median": [0, 2, 4], "high": [1, 3, 5]},
        "after": {"at": [1, 2, 3], "low": [-1, -1, -1], "median": [0, 0.5, 0.1], "high": [1, 1, 1]}}
    spec = draw(output)["residual"]
    assert spec["title"]["text"] == (
        "Over plate slip, the median residual varies by 4 noise levels, and by 0.5 with the effect")
    assert "while the plates slip" in spec["title"]["subtitle"][0]


def test_the_worst_signals_are_overlaid(output: dict[str, Any], marks: Marks) -> None:
    spec = draw(output)["signals"]
    # Three experiments of pressure, two speeds and torque: measured, before and after.
    assert len(marks(spec, "line")) == 3 * 4 * 3
    assert spec["title"]["text"].startswith("RMS error of the output torque in the worst experiments: ")
    for experiment in output["figure_data"]["signals"]:
        for model in ("before", "after"):
            experiment[model]["pressure"] = [value + 1.0 for value in experiment["measured"]["pressure"]]
    assert "pressure in the worst experiments: 1 bar, 1 bar with the effect" in draw(output)["signals"]["title"]["text"]


def test_the_gap_shows_every_experiment_and_each_closure(output: dict[str, Any], marks: Marks) -> None:
    gap = output["result"]["gap"]
    for closures in (gap["closures"], gap["control"]["closures"]):
        for closure in closures.values():
            closure |= {"closure": 0.9, "lower": 0.8, "upper": 1.0}
    gap["closures"]["pressure"]["closure"] = None
    gap["control"]["closures"]["shifting_time"] |= {"closure": -3.0, "lower": -4.0, "upper": -2.0}
    gap["closures"]["shifting_time"] |= {"rms_before": 0.0285, "rms_after": 0.0072}
    spec = draw(output)["gap"]
    n = output["result"]["experiments"]
    assert len(marks(spec, "symbol")) == 2 * n + 4 + 5
    assert "larger error than without the effect" in texts(marks(spec, "text"))
    assert spec["title"]["text"] == "On held-out conditions, the shifting-time error falls from 28.5 to 7.2 ms"
    gap["closures"]["shifting_time"]["rms_after"] = 0.03
    assert "grows from 28.5 to 30 ms" in draw(output)["gap"]["title"]["text"]


def test_without_a_significant_gap_there_are_no_closures(output: dict[str, Any]) -> None:
    gap = output["result"]["gap"]
    gap["control"] = None
    for closure in gap["closures"].values():
        closure["closure"] = None
    assert len(draw(output)["gap"]["vconcat"]) == 1


def test_the_density_is_the_normal_one() -> None:
    # The density per ms is a thousandth of that per s.
    for score, std in ((0.0, 0.01), (-2.5, 0.004)):
        expected = norm.logpdf(score * std, scale=std) / math.log(10) - 3
        assert likelihood.density(score, std) == pytest.approx(expected)


def test_the_title_of_the_likelihood_states_the_improvement(output: dict[str, Any], marks: Marks) -> None:
    prediction, n = output["figure_data"]["prediction"], output["result"]["experiments"]
    for model, std in (("before", 0.1), ("after", 0.01)):
        prediction[model] = {"mean": prediction["measured"], "std": [std] * n}
    spec = draw(output)["likelihood"]
    assert spec["title"]["text"] == f"The held-out shifting times become {n} decades more likely"
    assert len(marks(spec, "symbol")) == n


def test_an_open_term_has_its_pictures(output: dict[str, Any]) -> None:
    name = "open_friction_coefficient"
    output["figure_data"]["effects"][name] = {"title": "Unlisted term in the friction coefficient", "block": "torque"}
    output["result"]["answer"] |= {"kind": "unlisted", "effects": [name]}
    output["result"]["rounds"][-1]["added"] = [name]
    spec = draw(output)
    assert list(spec) == ALONE
    assert "with unlisted term in the friction coefficient" in json.dumps(spec["law"])


def test_several_effects_are_counted_in_the_legend(output: dict[str, Any]) -> None:
    output["result"]["answer"]["effects"] = ["stribeck_friction", "quadratic_load_drag"]
    assert "with 2 effects added" in json.dumps(draw(output)["law"])


def test_the_same_study_gives_the_same_pictures(studied: Studied) -> None:
    assert json.dumps(draw(studied("friction")[2])) == json.dumps(draw(studied("friction")[2]))


def test_pictures_with_too_few_bins_are_omitted(output: dict[str, Any]) -> None:
    empty: dict[str, list[float]] = {"at": [], "low": [], "median": [], "high": []}
    output["figure_data"]["law"]["bins"] = empty
    output["figure_data"]["residual"][0]["models"]["before"] = empty
    assert not {"law", "residual"} & draw(output).keys()


def test_conditions_with_many_values_are_not_labelled(
        output: dict[str, Any], marks: Marks, scales: Scales) -> None:
    output["figure_data"]["conditions"]["motor_speed"] = [100.0 + index for index in range(24)]
    for model in ("before", "after"):
        groups = output["figure_data"]["where"][model]["by_condition"]
        groups["motor_speed"] = [{"value": 100.0 + index, "chi_square": 1.0} for index in range(24)]
    spec = draw(output)
    titles = {scale["title"] for scale in scales(spec["where"]) if scale.get("title")}
    assert titles == {"chi-square", "current profile", "run order"}
    assert "100 rad/s" not in texts(marks(spec["gap"], "text"))
    for model in ("before", "after"):
        where = output["figure_data"]["where"][model]
        where["by_condition"] = {name: [] for name in where["by_condition"]}
    assert marks(draw(output)["where"], "rect")
