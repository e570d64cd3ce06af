"""The pictures of a study: all can be drawn, show every experiment, effect and signal, and say what is seen."""

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
"""Name of a picture -> the marks that its data are drawn as."""
ALONE = [name for name in CAPTIONS if name != "surfaces"]
"""Those that need no fits beside the study."""


@pytest.fixture
def output(studied: Studied) -> dict[str, Any]:
    return studied("friction")[2]


def draw(output: dict[str, Any]) -> dict[str, Spec]:
    return study_pictures(output["result"], output["figure_data"])


def texts(marks: list[ElementTree.Element]) -> list[str]:
    return [word for mark in marks for word in mark.itertext()]


def test_a_study_has_all_pictures_and_each_can_be_drawn(output: dict[str, Any], marks: Marks) -> None:
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


def test_what_makes_no_sense_without_an_effect_is_left_out(studied: Studied) -> None:
    assert list(draw(studied("nothing")[2])) == ["law", "where", "screening", "signals"]
    titles = [spec["title"]["text"] for spec in draw(studied("nothing")[2]).values()]
    assert titles[0] == "Torque over pressure hardly depends on slip on the bench"
    assert titles[1].startswith("Nothing that asks for an effect")
    assert titles[2] == "The residuals ask for no effect beyond chance, or enough to matter"


def test_shifting_times_alone_have_no_pictures_of_signals(studied: Studied) -> None:
    found = draw(studied("times")[2])
    assert not {"law", "where", "residual", "signals"} & found.keys()
    assert "screening" in found


def test_the_law_rises_by_what_the_bench_does(output: dict[str, Any], marks: Marks) -> None:
    found = draw(output)["law"]
    assert "torque over pressure grows by" in found["title"]["text"]
    assert len(marks(found, "line")) == 3  # measured, before, after
    assert len(marks(found, "symbol")) == len(output["figure_data"]["law"]["cloud"]["slip"])
    output["figure_data"]["law"]["bins"]["median"].reverse()
    assert "torque over pressure falls by" in draw(output)["law"]["title"]["text"]


def test_each_cell_of_the_matrix_is_written(output: dict[str, Any], marks: Marks) -> None:
    where = output["figure_data"]["where"]
    where["before"]["chi_square"]["output_torque"]["slip"] = 123.4
    where["before"]["chi_square"]["pressure"]["slip"] = 0.96
    found = draw(output)["where"]
    cells = sum(value is not None for who in ("before", "after") for row in where[who]["chi_square"].values()
                for value in row.values())
    assert len(marks(found, "rect")) == cells
    assert {"123", "1.0"} <= set(texts(marks(found, "text")))
    assert found["title"]["text"] == "Model and bench disagree most in the block “pressure, speeds → torque”"


def test_every_effect_that_was_tried_is_in_the_screening(output: dict[str, Any], marks: Marks) -> None:
    first, *_, last = output["result"]["rounds"]
    first["p_value"], last["p_value"] = 0.001, 0.37
    found = draw(output)["screening"]
    assert len(marks(found, "symbol")) == len(first["screening"]) + len(last["screening"])
    assert found["title"]["text"].endswith("ask most for: Slip-speed-dependent friction")
    assert "0.1 % of cases or less" in " ".join(found["title"]["subtitle"])
    assert "in 37 % of cases" in " ".join(found["title"]["subtitle"])


def test_the_title_of_the_ranking_is_what_was_named_not_what_came_first_alone(output: dict[str, Any]) -> None:
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking.insert(0, {**ranking[0], "effect": "thermal_fade", "title": "Thermal fade"})
    title = draw(output)["ranking"]["title"]["text"]
    assert title == "Slip-speed-dependent friction explains most with what comes after it"


def test_the_ranking_marks_what_was_added_and_what_is_tied(output: dict[str, Any], marks: Marks) -> None:
    ranking = output["result"]["rounds"][0]["ranking"]
    ranking[1:] = [{**ranking[0], "effect": name, "title": name, "held_out_gain": gain, "error": gain / sure,
                    "sure": sure, "behind": behind, "tied": behind < 2, "bootstrap_share": 0.25, "bic": -12345.6}
                   for name, gain, sure, behind in (("twin", 90.0, 9.0, 0.5), ("far", -2.302585, -2.0, 30.0))]
    output["result"]["rounds"][1:] = [{**output["result"]["rounds"][-1], "ranking": []}]
    assert draw(output)["ranking"]["title"]["text"] == "Slip-speed-dependent friction predicts best"
    output["result"]["answer"]["tied"][0].append("twin")
    found = draw(output)["ranking"]
    rows = {row["title"]: row for row in found["vconcat"][0]["data"]["values"]}
    assert [row["place"] for row in rows.values()] == ["added", "tied with the best", "behind"]
    assert found["title"]["text"] == "Slip-speed-dependent friction predicts best, but 1 more cannot be told from it"
    # In decades, with two standard errors on either side.
    assert (rows["far"]["low"], rows["far"]["gain"], rows["far"]["high"]) == pytest.approx((-2, -1, 0), abs=1e-6)
    assert {"25 %", "30.0 s.e.", "−12\u202f346"} <= set(texts(marks(found, "text")))


def test_the_best_of_a_round_that_added_nothing_is_not_called_added(output: dict[str, Any]) -> None:
    first = output["result"]["rounds"][0]["ranking"]
    output["result"]["rounds"] = [{**one, "ranking": first} for one in output["result"]["rounds"][:2]]
    panels = draw(output)["ranking"]["vconcat"]
    assert [panel["data"]["values"][0]["place"] for panel in panels] == ["added", "best, but not added"]
    assert panels[1]["title"]["text"] == "With slip-speed-dependent friction added"


def test_the_residual_bends_less_with_the_effect(output: dict[str, Any]) -> None:
    one = output["figure_data"]["residual"][0]
    one["models"] = {"before": {"at": [1, 2, 3], "low": [-1, 1, 3], "median": [0, 2, 4], "high": [1, 3, 5]},
                     "after": {"at": [1, 2, 3], "low": [-1, -1, -1], "median": [0, 0.5, 0.1], "high": [1, 1, 1]}}
    found = draw(output)["residual"]
    assert found["title"]["text"] == "Over plate slip, what is left bends by 4 noise levels, with the effect by 0.5"
    assert "while the plates slip" in found["title"]["subtitle"][0]


def test_the_worst_signals_are_overlaid(output: dict[str, Any], marks: Marks) -> None:
    found = draw(output)["signals"]
    # Three experiments of pressure, two speeds and torque: measured, before and after.
    assert len(marks(found, "line")) == 3 * 4 * 3
    assert found["title"]["text"].startswith("In the worst experiments the output torque is off by")
    for one in output["figure_data"]["signals"]:
        for who in ("before", "after"):
            one[who]["pressure"] = [value + 1.0 for value in one["measured"]["pressure"]]
    assert "the pressure is off by 1 bar, with the effect by 1;" in draw(output)["signals"]["title"]["text"]


def test_the_gap_shows_every_experiment_and_each_closure(output: dict[str, Any], marks: Marks) -> None:
    gap = output["result"]["gap"]
    for closures in (gap["closures"], gap["control"]["closures"]):
        for one in closures.values():
            one |= {"closure": 0.9, "lower": 0.8, "upper": 1.0}
    gap["closures"]["pressure"]["closure"] = None
    gap["control"]["closures"]["shifting_time"] |= {"closure": -3.0, "lower": -4.0, "upper": -2.0}
    gap["closures"]["shifting_time"] |= {"rms_before": 0.0285, "rms_after": 0.0072}
    found = draw(output)["gap"]
    n = output["result"]["experiments"]
    assert len(marks(found, "symbol")) == 2 * n + 4 + 5
    assert "a larger error than without it" in texts(marks(found, "text"))
    assert found["title"]["text"] == "On conditions never seen, the shifting-time error falls from 28.5 to 7.2 ms"
    gap["closures"]["shifting_time"]["rms_after"] = 0.03
    assert "grows from 28.5 to 30 ms" in draw(output)["gap"]["title"]["text"]


def test_where_no_gap_was_clear_there_are_no_closures(output: dict[str, Any]) -> None:
    gap = output["result"]["gap"]
    gap["control"] = None
    for one in gap["closures"].values():
        one["closure"] = None
    assert len(draw(output)["gap"]["vconcat"]) == 1


def test_the_density_is_the_normal_one() -> None:
    # Per ms: a thousandth of that per s.
    for score, std in ((0.0, 0.01), (-2.5, 0.004)):
        expected = norm.logpdf(score * std, scale=std) / math.log(10) - 3
        assert likelihood.density(score, std) == pytest.approx(expected)


def test_the_likelihood_says_how_many_decades_are_gained(output: dict[str, Any], marks: Marks) -> None:
    prediction, n = output["figure_data"]["prediction"], output["result"]["experiments"]
    for who, std in (("before", 0.1), ("after", 0.01)):
        prediction[who] = {"mean": prediction["measured"], "std": [std] * n}
    found = draw(output)["likelihood"]
    assert found["title"]["text"] == f"The held-out shifting times become {n} decades more likely"
    assert len(marks(found, "symbol")) == n


def test_an_unlisted_term_has_its_pictures(output: dict[str, Any]) -> None:
    name = "open_friction_coefficient"
    output["figure_data"]["effects"][name] = {"title": "Unlisted term in the friction coefficient", "block": "torque"}
    output["result"]["answer"] |= {"kind": "unlisted", "effects": [name]}
    output["result"]["rounds"][-1]["added"] = [name]
    found = draw(output)
    assert list(found) == ALONE
    assert "with unlisted term in the friction coefficient" in json.dumps(found["law"])


def test_several_effects_are_told_apart_from_one(output: dict[str, Any]) -> None:
    output["result"]["answer"]["effects"] = ["stribeck_friction", "quadratic_load_drag"]
    assert "with 2 effects added" in json.dumps(draw(output)["law"])


def test_the_same_study_gives_the_same_pictures(studied: Studied) -> None:
    assert json.dumps(draw(studied("friction")[2])) == json.dumps(draw(studied("friction")[2]))


def test_too_few_values_for_a_curve_leave_it_out(output: dict[str, Any]) -> None:
    empty: dict[str, list[float]] = {"at": [], "low": [], "median": [], "high": []}
    output["figure_data"]["law"]["bins"] = empty
    output["figure_data"]["residual"][0]["models"]["before"] = empty
    assert not {"law", "residual"} & draw(output).keys()


def test_conditions_of_many_values_are_not_written_side_by_side(
        output: dict[str, Any], marks: Marks, scales: Scales) -> None:
    output["figure_data"]["conditions"]["motor_speed"] = [100.0 + place for place in range(24)]
    for who in ("before", "after"):
        groups = output["figure_data"]["where"][who]["by_condition"]
        groups["motor_speed"] = [{"value": 100.0 + place, "chi_square": 1.0} for place in range(24)]
    found = draw(output)
    titles = {scale["title"] for scale in scales(found["where"]) if scale.get("title")}
    assert titles == {"chi-square", "current profile", "run order"}
    assert "100 rad/s" not in texts(marks(found["gap"], "text"))
    for who in ("before", "after"):
        output["figure_data"]["where"][who]["by_condition"] = {
            name: [] for name in output["figure_data"]["where"][who]["by_condition"]}
    assert marks(draw(output)["where"], "rect")
