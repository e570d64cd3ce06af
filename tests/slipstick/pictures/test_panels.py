"""Panels: no sample outside what may be drawn, extremes that survive thinning, marks, and maps with the nominal point.
"""

import numpy as np
import pytest

from slipstick.pictures import units
from slipstick.pictures.conditions import described
from slipstick.pictures.panels import (
    WIDTH,
    Signal,
    Span,
    draw_curves,
    draw_map,
    draw_numbers,
    draw_signal,
    draw_thumbnail,
    titled,
)
from slipstick.pictures.rendering import inline
from slipstick.pictures.theme import Spec

TIME = np.linspace(0, 2, 2001)


def rows(spec: Spec, mark: str) -> list[dict[str, float | None]]:
    """The rows of all layers with a mark of this type."""
    return [row for layer in spec["layer"] if layer["mark"]["type"] == mark for row in layer["data"]["values"]]


def test_the_extremes_of_a_long_signal_are_drawn() -> None:
    values = np.sin(TIME)
    values[[777, 1234]] = 5, -7
    drawn = [row["y"] for row in rows(draw_signal(TIME, Signal("speed", "rad/s", values)), "line")]
    assert len(drawn) < 1000
    assert (max(drawn), min(drawn)) == (5, -7)


def test_samples_below_the_lowest_value_are_not_drawn() -> None:
    values = np.where((TIME > 0.01) & (TIME < 0.02), -2.4, 3 * TIME)
    spec = draw_signal(TIME, Signal("pressure", "bar", values, lowest=-1.0))
    drawn = [row["y"] for row in rows(spec, "line")]
    assert None in drawn
    assert min(value for value in drawn if value is not None) == 0
    assert spec["layer"][-1]["encoding"]["y"]["scale"]["domain"][0] > -1


def test_levels_within_the_range_and_flaws_are_marked() -> None:
    signal = Signal("speed", "rad/s", 100 + 5 * TIME, {"motor speed": 105.0, "other": 900.0},
                    [Span("spike", 0.5, 0.5), Span("gap", 1.0, 1.2)], {"shifting time": 0.8})
    spec = draw_signal(TIME, signal)
    assert [row["label"] for row in rows(spec, "text")] == ["motor speed"]
    assert [(row["t"], row["end"]) for row in rows(spec, "rect")] == [(0.5, 0.5), (1.0, 1.2)]
    assert [row.get("t", row.get("y")) for row in rows(spec, "rule")] == [0.5, 1.0, 0.8, 105.0]


@pytest.mark.parametrize("spec", [
    draw_signal(TIME, Signal("speed", "rad/s", np.full(2001, 7.0))),
    draw_signal(TIME, Signal("speed", "rad/s", np.full(2001, np.nan))),
    draw_numbers("shifting time", "s", np.array([0.3, np.nan, 0.5]), 2, "engagement"),
    draw_curves("current", "A", ("time", "s"), {f"profile {place}": (TIME[::100], TIME[::100]) for place in range(9)}),
    draw_map("shifting time", "s", ("pressure bias", "bar", np.linspace(1, 2, 5)), ("initial position", "mm",
             np.linspace(1, 3, 4)), np.arange(20.0).reshape(4, 5), (1.5, 2.0))])
def test_a_panel_fits_a_narrow_screen(spec: Spec) -> None:
    svg = inline({"panel": spec}, {"panel": "Caption."})["panel"]
    assert f'width="{WIDTH}"' in svg
    assert "Caption." in svg


def test_a_map_has_its_values_and_the_nominal_point_and_leaves_nothing_undefined() -> None:
    values = np.array([[0.1, 0.2], [np.nan, 0.4]])
    spec = draw_map("run_up_time", "s", ("gain", "bar/A", np.array([1.0, 2.0])),
                    ("load", "N m^2", np.array([5.0, 7.0])), values, (1.5, 6.0))
    cells = {((row["x"] + row["x2"]) / 2, (row["y"] + row["y2"]) / 2): row["value"] for row in rows(spec, "rect")}
    assert cells == {(1.0, 5.0): 0.1, (2.0, 5.0): 0.2, (2.0, 7.0): 0.4}
    assert [(row["x"], row["y"]) for row in rows(spec, "point")] == [(1.5, 6.0)]
    assert spec["layer"][0]["encoding"]["y"]["title"] == "load [N m²]"


def test_a_thumbnail_says_what_it_shows_without_letters() -> None:
    spec = draw_thumbnail([0.0, 1.0, 2.0], [0.1, 0.0, -0.1], [0.0, -0.1, -0.2], [0.2, 0.1, 0.0], "Law: <drag>")
    svg = inline({"law": spec}, {"law": "Caption."})["law"]
    assert "Law: &lt;drag&gt;</title>" in svg
    assert "<text" not in svg
    assert svg.startswith("<svg ")
    assert 'xmlns="http://www.w3.org/2000/svg"' in svg


@pytest.mark.parametrize(("unit", "shown"), [
    ("kg m^2", "kg m²"), ("rad/s^2", "rad/s²"), ("1/(kg m^2)", "1/(kg m²)"), ("m^-2 s^10", "m⁻² s¹⁰"),
    ("rad/s/(N m)^0.5", "rad/s/(N m)^0.5"), ("N m", "N m")])
def test_exponents_are_raised(unit: str, shown: str) -> None:
    assert units.raised(unit) == shown
    assert titled("load_inertia", unit) == f"load inertia [{shown}]"
    assert described({f"load_inertia [{unit}]": [6.0, 0.002]}, 1) == f"load inertia 0.002 {shown}"
