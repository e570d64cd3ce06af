"""What shows whether a fit is right: residuals by group, the probability integral transform, the pairs of unknowns."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipstick.pictures import pictures
from slipstick.pictures.calibration import transformed
from slipstick.pictures.rendering import render
from slipstick.report.doubts import doubts

Made = Callable[..., dict[str, Any]]


def draw(output: dict[str, Any]) -> dict[str, Any]:
    return pictures(json.loads(json.dumps(output)))


def measured(output: dict[str, Any], change: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
    """The output with other measured times: `change` gives their differences to the mean in predicted stds."""
    prediction = output["figure_data"]["prediction"]
    normal = np.random.default_rng(3).normal(size=len(prediction["mean"]))
    prediction["measured"] = (np.array(prediction["mean"]) + 0.01 * change(normal)).tolist()
    return output


@pytest.mark.parametrize(("change", "says"), [
    (lambda normal: normal, "are spread as predicted"),
    (lambda normal: 0.4 * normal, "scatter less than predicted"),
    (lambda normal: 2.0 * normal, "scatter more than predicted"),
    (lambda normal: normal + 0.7, "are later than predicted"),
    (lambda normal: normal - 0.7, "are earlier than predicted")])
def test_the_transform_tells_how_times_differ_from_their_prediction(
        made: Made, change: Callable[[np.ndarray], np.ndarray], says: str) -> None:
    output = measured(made(), change)
    assert draw(output)["calibration"]["title"]["text"] == f"The measured times {says}"
    doubted = any(says in text for _, text in doubts(output["figure_data"]))
    assert doubted == (says != "are spread as predicted")


def test_the_transform_is_the_predicted_probability_below_the_measured_time(made: Made) -> None:
    prediction = measured(made(n=3), lambda _: np.array([-1.0, 0.0, 1.0]))["figure_data"]["prediction"]
    np.testing.assert_allclose(transformed(prediction), [0.1587, 0.5, 0.8413], atol=2e-3)
    prediction["mean"][1] = None
    assert len(transformed(prediction)) == 2


def groups(output: dict[str, Any]) -> list[dict[str, Any]]:
    return [row for panel in draw(output)["residuals"]["concat"] for row in panel["layer"][2]["data"]["values"]]


def test_residuals_are_grouped_by_profile_and_speed(made: Made) -> None:
    right = measured(made(), lambda normal: normal)
    rows = groups(right)
    assert len(rows) == 24
    assert [row["engagements"] for row in rows] == [9] * 24
    assert doubts(right["figure_data"]) == []
    speeds = np.array(right["figure_data"]["conditions"]["motor_speed"])
    wrong = measured(made(), lambda normal: normal + 2.0 * (speeds == speeds.min()))
    off = [row for row in groups(wrong) if row["low"] > 0 and row["speed"] == round(speeds.min())]
    assert len(off) == 6
    assert off[0]["y"] == pytest.approx(20, abs=8)  # measured minus predicted in ms: positive where the bench is later
    spec = draw(wrong)["residuals"]
    assert "of 24 groups of profile and motor speed; 2.4 are expected" in spec["title"]["text"]
    assert f"{speeds.min():.0f} rad/s" in spec["title"]["subtitle"][0]
    assert doubts(wrong["figure_data"])[0][0] == "The model lacks something:"


def test_every_pair_of_unknowns_has_the_search_and_both_traces(made: Made) -> None:
    spec = draw(made())["pairs"]
    panels = [panel for row in spec["vconcat"] for panel in row["hconcat"]]
    assert len(panels) == 10
    path = panels[0]["layer"][0]["data"]["values"]
    assert [row["x"] for row in path] == [1.3, 1.05, 1.0]
    assert [row["size"] for row in path] == sorted(row["size"] for row in path)
    labels = [layer["encoding"]["color"]["datum"] for layer in panels[0]["layer"][:-1]]
    assert labels == ["search", "search", "vertical unknown moved", "horizontal unknown moved"]
    assert panels[0]["layer"][-1]["data"]["values"] == [{"x": 1.0, "y": 1.0}]


def test_many_unknowns_show_those_that_are_hardest_to_separate(made: Made) -> None:
    output = made(tuple(f"input_{number}" for number in range(7)), 20)
    names = output["figure_data"]["search"]["unknowns"]
    weights = {name: 0.01 * place for place, name in enumerate(names)}
    output["result"]["combinations"][0]["weights"] = weights
    spec = draw(output)["pairs"]
    assert len(spec["vconcat"]) == 4
    assert "10 others are left out" in " ".join(spec["title"]["subtitle"])
    titles = [row["hconcat"][0]["encoding"]["y"]["title"][0] for row in spec["vconcat"]]
    assert titles[-1] == "output noise"


def test_a_fit_without_its_search_or_intervals_has_no_traces(made: Made) -> None:
    output = made()
    output["figure_data"]["search"]["traces"] = []
    assert "there are no traces" in " ".join(draw(output)["pairs"]["title"]["subtitle"])
    del output["figure_data"]["search"]
    assert "pairs" not in draw(output)


def test_axes_have_multiples_and_units(made: Made) -> None:
    specs = draw(made())
    first, *_, noise = (panel["layer"][0]["encoding"]["x"]["axis"] for panel in specs["profiles"]["concat"])
    assert first["labelExpr"] == "[datum.label, format(datum.value * 1.6, '.3~r') + \" bar\"]"
    assert "labelExpr" in specs["inputs"]["encoding"]["y"]["axis"]
    assert "labelExpr" not in noise  # ms, no multiple


def test_computed_points_of_a_profile_are_shown(made: Made) -> None:
    output = made()
    panel = draw(output)["profiles"]["concat"][1]
    points = [layer for layer in panel["layer"] if layer["mark"].get("type") == "point"]
    assert len(points[0]["data"]["values"]) == len(output["result"]["intervals"][1]["curve"])
    assert "Dots: computed points" in " ".join(draw(output)["profiles"]["title"]["subtitle"])


@pytest.mark.parametrize(("pressure", "noted"), [(-1.25, True), (-0.9, False)])
def test_a_pressure_below_vacuum_is_not_drawn_and_has_its_note(made: Made, pressure: float, noted: bool) -> None:
    output = made()
    output["figure_data"]["engagement"]["simulated"]["pressure"][5] = pressure
    spec = draw(output)["engagement"]
    lines = [layer["mark"] for layer in spec["vconcat"][1]["layer"] if layer["encoding"].get("y") == {"datum": -1.0}]
    assert [mark["type"] for mark in lines] == (["text"] if noted else [])
    assert ("below vacuum, down to −1.25 bar, not drawn" in render(spec, "svg").decode()) == noted
    drawn = [row["simulated pressure"] for row in spec["datasets"]["signals"]]
    assert min(value for value in drawn if value is not None) >= -1.0
    assert drawn.count(None) == noted
    assert "Conditions: profile 0, motor 105 rad/s" in " ".join(spec["title"]["subtitle"])


def test_pictures_of_shifting_times_are_measured_minus_predicted(made: Made) -> None:
    late = measured(made(), lambda normal: np.full_like(normal, 2.0))
    specs = draw(late)
    text = json.dumps(specs, ensure_ascii=False)
    assert "simulated [ms]" not in text
    assert "predicted − measured" not in text
    differences = [row["difference after"] for row in specs["comparison"]["datasets"]["experiments"]]
    dots = [row["y"] for panel in specs["densities"]["vconcat"] for row in panel["layer"][-1]["data"]["values"]]
    assert min(*differences, *dots, *(row["y"] for row in groups(late))) == pytest.approx(20, abs=0.1)
