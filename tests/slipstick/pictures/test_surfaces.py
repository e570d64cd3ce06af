"""The likelihood surfaces of the same fit on two tables: common axes in units and common shades."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import pytest

from slipstick.pictures.study import Spec, surfaces
from slipstick.study.result import Gap, SimulationResult, StudyResult

Fits = dict[str, dict[str, Any]]
BEFORE, AFTER = (SimulationResult({}, {}, {}, 0.0, True, {
    "parameters": {"pressure_bias": bar, "initial_position": 5e-4},
    "units": {"pressure_bias": "bar", "initial_position": "m"}}) for bar in (3.2, 1.6))
STUDY = StudyResult("effect", "", [], [], [], BEFORE, AFTER, Gap({}, [], [], None), 24, {}, "", "")


def draw(fits: Fits) -> Any:
    return surfaces.draw(STUDY, fits)


def test_both_planes_share_axes_in_units(both_fits: Fits) -> None:
    before, after = draw(both_fits)["hconcat"]
    assert before["encoding"] == after["encoding"]
    x, y = (before["encoding"][channel] for channel in "xy")
    assert (x["title"], y["title"]) == ("pressure bias [bar]", "initial position [mm]")
    # The surfaces cover 0.8 to 1.2 times nominal: 3.2 bar before, 1.6 bar after, 0.5 mm in both.
    assert x["scale"]["domain"] == pytest.approx([1.28, 3.84], rel=0.1)
    assert y["scale"]["domain"] == pytest.approx([0.4, 0.6], rel=0.02)
    frames = [[panel["layer"][1]["data"]["values"][0][name] for name in ("x", "x2")] for panel in (before, after)]
    assert frames == [pytest.approx([2.56, 3.84]), pytest.approx([1.28, 1.92])]
    means = [panel["layer"][-1]["data"]["values"][0]["x"] for panel in (before, after)]
    assert means == [3.2, 1.6]


def test_the_shades_of_the_worse_fit_include_its_deficit(
        both_fits: Fits, marks: Callable[[Spec, str], list[ElementTree.Element]]) -> None:
    spec = draw(both_fits)
    before, after = ({row["band"] for row in panel["layer"][0]["data"]["values"]} for panel in spec["hconcat"])
    assert before == {"100 to 300", "300+"}
    assert after >= {"0 to 1", "100 to 300"}
    assert spec["title"]["text"] == "With the extended model, the same fit makes the recordings 120 decades more likely"
    assert "Output noise: 12 ms before, 3 ms after." in spec["title"]["subtitle"][0]
    assert len(marks(spec, "symbol")) == 4
    for fit, likelihood in zip(both_fits.values(), (-269.0, -389.0), strict=True):
        fit["result"]["log10_likelihood"] = likelihood
    assert "120 decades less likely" in draw(both_fits)["title"]["text"]
    json.dumps(spec, allow_nan=False)


@pytest.mark.parametrize("change", [
    lambda fit, made: fit.update(made(("pressure_bias",))),
    lambda fit, made: fit["figure_data"]["surface"].update(axes=["pressure_bias", "friction_coefficient"]),
    lambda fit, made: fit["result"].update(log10_likelihood=None)])
def test_fits_that_cannot_be_compared_have_no_picture(
        both_fits: Fits, made: Callable[..., dict[str, Any]], change: Callable[..., None]) -> None:
    change(both_fits["after"], made)
    assert draw(both_fits) is None


def test_without_anything_added_there_is_no_second_model(both_fits: Fits) -> None:
    assert surfaces.draw(replace(STUDY, gap=None), both_fits) is None
