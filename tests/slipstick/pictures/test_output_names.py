"""The output of another machine in pictures and pages: its name and unit, not shifting times in ms."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from slipstick.pictures import pictures, propagation
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.report.words import numbers

SPEED = {"name": "final_speed", "unit": "rpm"}


def test_times_are_shown_in_ms_and_others_in_their_unit() -> None:
    assert (SHIFTING_TIME.small, SHIFTING_TIME.factor, SHIFTING_TIME.per) == ("ms", 1e3, "ms")
    assert Output.of({"output": {"name": "run_up_time", "unit": "s"}}).small == "ms"
    assert Output.of({"output": None}) == Output.of({}) == SHIFTING_TIME
    other = Output.of({"output": {"name": "final_energy", "unit": "kg m^2"}})
    assert (other.words, other.small, other.factor, other.per) == ("final energy", "kg m²", 1.0, "0.001 kg m²")


def test_a_fit_of_another_machine_speaks_of_its_output(made: Callable[..., dict[str, Any]]) -> None:
    clutch, output = made(), made()
    output["figure_data"] |= {"output": SPEED, "engagement": None, "conditions": {
        "voltage [V]": clutch["figure_data"]["conditions"]["motor_speed"]}}
    text = json.dumps(pictures(output), ensure_ascii=False)
    for said in ("measured final speed [rpm]", "predicted final speed [rpm]", "measured − predicted [rpm]",
                 "Densities are per 0.001 rpm", "the measured final speed is larger", "The measured values"):
        assert said in text, said
    for other in ("shifting time", "[ms]", " ms", "never lock", "measured times"):
        assert other not in text, other
    differences = pictures(output)["comparison"]["datasets"]["experiments"][0]
    assert differences["difference after"] == pytest.approx(differences["measured"] - differences["after"], abs=1e-5)
    rows = {row[0]: row for row in numbers(output["result"], output["physical"], Output.of(output["figure_data"]))}
    assert float(rows["output std [rpm]"][2]) == pytest.approx(output["result"]["output_std"], rel=1e-3)


def test_a_propagation_for_another_machine_speaks_of_its_output() -> None:
    one = {"condition": 0, "mean": 1500.0, "std": 20.0, "quantiles": [1450.0], "first_order": None, "total": None,
           "density": None, "density_time": None}
    answer = {"axes": [{"name": "voltage"}], "conditions": [one], "output": SPEED}
    spec = propagation.draw(answer, [0.05], {"load [N m]": [3.0]})
    assert spec["title"]["text"] == "Condition 0 has a final speed of 1500 rpm, with a std of 20.0 rpm"
    text = json.dumps(spec)
    assert "final speed [rpm]" in text
    assert "ms]" not in text
