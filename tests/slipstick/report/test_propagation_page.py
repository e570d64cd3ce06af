"""The picture and the page of a propagation: every condition, quantiles, Sobol bars, warnings first."""

import re
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from slipstick.pictures.propagation import draw
from slipstick.pictures.rendering import render
from slipstick.report.propagation import propagation_page

CONDITIONS = {"current_profile": [0, 2], "motor_speed": [104.7, 199.0], "load_inertia": [6.0, 14.0],
              "brake_torque": [20.0, 80.0]}
REQUEST = {"inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08], "families": None}, "output_std": 0.003,
           "quantiles": [0.05, 0.95], "tolerance": 0.001}


def condition(index: int, **changes: Any) -> dict[str, Any]:
    time = np.linspace(0.5, 0.7, 41)
    density = np.exp(-((time - 0.6) / 0.02) ** 2 / 2) / 50
    return {"condition": index, "mean": 0.6, "std": 0.02, "error": 2e-4, "quantiles": [0.567, 0.633],
            "first_order": [0.7, 0.2], "total": [0.8, 0.3], "density_time": time.tolist(), "density": density.tolist(),
            **changes}


def answer(*conditions: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {"table": "mine", "table_digest": "a1b2", "axes": [{"name": "pressure_bias"}, {"name": "initial_position"}],
            "outside": "clip", "mass_outside": 1e-5, "order": 4, "nodes": 25, "reached": True,
            "conditions": list(conditions), **changes}


def texts(spec: dict[str, Any]) -> list[str]:
    return ["".join(element.itertext()) for element in ElementTree.fromstring(render(spec, "svg")).iter()
            if element.tag.endswith("}text")]


def test_every_condition_has_its_density_quantiles_and_bars() -> None:
    spec = draw(answer(condition(0), condition(215)), [0.05, 0.95], CONDITIONS)
    assert spec["title"]["text"] == ("Standard deviations of 20.0 to 20.0 ms in 2 conditions; the pressure bias causes "
                                     "most of the variance in all of them")
    assert [row["title"]["text"] for row in spec["vconcat"]] == [
        "0: profile 0, motor 105 rad/s, 6 kg m², brake 20 N m",
        "215: profile 2, motor 199 rad/s, 14 kg m², brake 80 N m"]
    density, bars = spec["vconcat"][0]["hconcat"]
    area, quantiles, std, _ = (layer["data"]["values"] for layer in density["layer"])
    assert area[20] == {"t": 600.0, "p": 0.02}
    assert [row["t"] for row in quantiles] == [567, 633]
    assert (std[0]["low"], std[0]["high"]) == (580, 620)
    assert {(row["input"], row["first"], row["total"]) for row in bars["data"]["values"]} == {
        ("pressure bias", 0.7, 0.8), ("initial position", 0.2, 0.3)}
    drawn = texts(spec)
    assert {"shifting time [ms]", "share of the variance", "pressure bias"} <= set(drawn)


def test_dependent_inputs_have_no_bars_and_no_noise_no_density() -> None:
    one = condition(0, first_order=None, total=None, density=None, density_time=None)
    spec = draw(answer(one), [0.05, 0.95], CONDITIONS)
    assert spec["title"]["text"] == "Condition 0 locks at 600.0 ms, with a standard deviation of 20.0 ms"
    assert "the inputs are dependent" in " ".join(spec["title"]["subtitle"])
    assert len(spec["vconcat"][0]["hconcat"]) == 1
    assert "area" not in str(spec)
    # The caption speaks of what is drawn.
    for word in ("density", "Right", "share of the variance"):
        assert word in draw(answer(condition(0)), [0.05, 0.95], CONDITIONS)["description"]
        assert word not in spec["description"]
    bare = draw(answer(condition(0, quantiles=[])), [], CONDITIONS)
    assert "quantiles" not in bare["description"]


@pytest.mark.parametrize(("count", "parts"), [(4, 1), (5, 2)])
def test_a_picture_of_many_conditions_is_in_parts_between_which_a_page_may_end(count: int, parts: int) -> None:
    columns = {name: [values[0]] * count for name, values in CONDITIONS.items()}
    page = propagation_page(answer(*map(condition, range(count))), REQUEST, columns)
    figure, = re.findall(r"<figure.*?</figure>", page, re.DOTALL)
    drawn = re.findall(r"<svg .*?</svg>", figure, re.DOTALL)
    assert len(drawn) == parts
    assert all("shifting time [ms]" in part for part in drawn)
    assert len(identifiers := re.findall(r'\bid="([^"]+)"', figure)) == len(set(identifiers))
    for place in range(count):
        assert f"{place}: profile 0" in drawn[place // 4]


def test_the_page_has_the_shell_of_reports(reading: Callable[[str], Any]) -> None:
    axes = [{"name": "pressure_bias", "nominal": 1.6, "unit": "bar"},
            {"name": "initial_position", "nominal": 5e-4, "unit": "m"}]
    given = answer(condition(0), condition(215), axes=axes)
    parsed = reading(propagation_page(given, REQUEST, CONDITIONS, "../"))
    links = [attributes["href"] for tag, attributes in parsed.elements if tag == "a"]
    assert links == ["../", "#distributions", "#numbers", "#inputs", "#provenance"]
    assert "Standard deviations of 20.0 to 20.0 ms in 2 conditions" in parsed.text[:parsed.text.index("Numbers")]
    row = re.sub(r"\s", "", "initial position normal 1 0.08 0.5 mm 0.04 mm")
    assert row in re.sub(r"\s", "", parsed.text)
    assert "../" not in [attributes.get("href") for _, attributes in
                         reading(propagation_page(given, REQUEST, CONDITIONS)).elements]


@pytest.mark.parametrize(("changes", "warning"), [
    ({"mass_outside": 0.2}, "20.0 % of the inputs lie outside the table. There, the value at its nearest edge is used"),
    ({"reached": False}, "The tolerance is not reached: the error exceeds 1 ms with 25 model runs")])
def test_warnings_come_before_the_result(reading: Callable[[str], Any], changes: dict[str, Any], warning: str) -> None:
    parsed = reading(propagation_page(answer(condition(0), **changes), REQUEST, CONDITIONS))
    body = parsed.text[parsed.text.index("Slipstick ·"):]
    assert body.index(warning) < body.index("Pressure bias and initial position propagated to 1 condition of “mine”")
    assert parsed.count("svg") == 1
    assert parsed.count("script") == 0
    assert reading(propagation_page(answer(condition(0)), REQUEST, CONDITIONS)).count("aside") == 0


def test_independent_inputs_are_not_called_dependent_where_no_condition_has_an_expansion() -> None:
    lost = dict.fromkeys(condition(0)) | {"condition": 7, "quantiles": [None], "first_order": [None, None],
                                          "total": [None, None]}
    spec = draw(answer(lost), [0.5], CONDITIONS)
    assert spec["title"]["text"] == "No condition has a distribution"
    assert "1 without an expansion" in " ".join(spec["title"]["subtitle"])
    assert "dependent" not in str(spec)


def test_a_condition_without_an_expansion_is_counted(reading: Callable[[str], Any]) -> None:
    lost = dict.fromkeys(condition(0)) | {"condition": 7, "quantiles": [None, None]}
    text = reading(propagation_page(answer(condition(0), lost), REQUEST, CONDITIONS)).text
    assert "1 of 2 conditions have no distribution" in text
    assert "Not drawn: 1 without an expansion" in text
    for phrase in ("0: profile 0, motor 105 rad/s", "600.0", "567.0", "80 %", "Output noise: 3 ms", "0.2 ms", "a1b2"):
        assert phrase in text
