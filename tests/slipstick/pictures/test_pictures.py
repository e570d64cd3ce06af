"""The pictures of a fit: all can be rendered, show every experiment, and state the finding and the output."""

import json
import math
import socket
import struct
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from slipstick.pictures import CAPTIONS, Spec, inputs, pictures, propagation, theme
from slipstick.pictures.engagement import panels
from slipstick.pictures.multiples import ticks, unknown
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.pictures.profiles import threshold
from slipstick.pictures.rendering import render
from slipstick.pictures.theme import SCHEMA
from slipstick.report.words import numbers

Made = Callable[..., dict[str, Any]]
Marks = Callable[[Spec, str], list[ElementTree.Element]]
Scales = Callable[[Spec], Iterator[Spec]]
SEVEN = ("current_delay", "current_bias", "current_gain", "pressure_bias", "temperature_gain", "initial_position",
         "friction_coefficient")
DATA = {"comparison": "symbol", "residuals": "symbol", "inputs": "line", "profiles": "line", "pairs": "line",
        "densities": "area", "calibration": "line", "engagement": "line", "convergence": "line"}
"""Name of a picture -> kind of the marks of its data."""


def draw(output: dict[str, Any]) -> dict[str, Spec]:
    # Through JSON, as in the service.
    return pictures(json.loads(json.dumps(output)))


@pytest.fixture(scope="module")
def drawn(made: Made) -> dict[str, Spec]:
    return draw(made(n=20))


def test_a_fit_has_all_pictures_and_each_can_be_rendered(drawn: dict[str, Spec], marks: Marks) -> None:
    assert list(drawn) == list(CAPTIONS)
    for name, spec in drawn.items():
        assert spec["title"]["text"]
        assert marks(spec, DATA[name])


def test_every_axis_that_is_shown_has_a_title(drawn: dict[str, Spec], scales: Scales) -> None:
    titles = {"".join(scale["title"]) for spec in drawn.values() for scale in scales(spec) if scale.get("title")}
    for unit in ("[s]", "[ms]", "[A]", "[bar]", "[mm]", "[rad/s]", "[N m]", "[multiple of nominal]"):
        assert any(title.endswith(unit) for title in titles), unit


@pytest.mark.parametrize("n", [216, 2])
def test_every_experiment_has_its_points(made: Made, n: int, marks: Marks) -> None:
    specs = draw(made(n=n))
    # Before and after, in the scatter plot and by experiment.
    assert len(marks(specs["comparison"], "symbol")) == 4 * n
    assert len(marks(specs["densities"], "symbol")) == n
    assert len([path for path in marks(specs["densities"], "area") if path.get("d")]) == n


def test_the_title_of_the_densities_counts_times_outside(made: Made) -> None:
    output = made(n=20)
    prediction = output["figure_data"]["prediction"]
    difference = np.array(prediction["measured"]) - prediction["mean"]
    outside = np.abs(difference) > 1.644854 * np.array(prediction["std"])
    title = draw(output)["densities"]["title"]["text"]
    assert title == (f"{outside.sum()} of 20 measured times lie outside their predicted central 90 % intervals; "
                     "the expected number is 2")


def test_engagements_that_never_lock_are_omitted_and_counted(made: Made, marks: Marks) -> None:
    output = made(n=20)
    for name, index in (("before", 3), ("mean", 5)):
        output["figure_data"]["prediction"][name][index] = None
    output["figure_data"]["prediction"]["density"][5] = output["figure_data"]["prediction"]["density_time"][5] = []
    output["figure_data"]["engagement"] |= {"lock": None, "touch": None, "measured": None}
    specs = draw(output)
    assert "Not drawn: 2 without a predicted" in " ".join(specs["comparison"]["title"]["subtitle"])
    assert len(marks(specs["comparison"], "symbol")) == 4 * 20 - 2 * 2
    assert "Not drawn: 1 that may never lock" in " ".join(specs["densities"]["title"]["subtitle"])
    assert len(marks(specs["densities"], "symbol")) == 19
    assert specs["engagement"]["title"]["text"].endswith("never in the fitted model")
    assert [row["phase"] for row in specs["engagement"]["datasets"]["phases"]] == ["fill"]
    assert marks(specs["engagement"], "line")


def test_an_engagement_without_a_measured_signal_shows_the_simulated_one_alone(made: Made, marks: Marks) -> None:
    whole, output = draw(made(n=20))["engagement"], made(n=20)
    del output["figure_data"]["engagement"]["measured"]["pressure"]
    partial = draw(output)["engagement"]
    assert len(marks(partial, "line")) == len(marks(whole, "line")) - 2  # the signal, and its difference
    assert not any("measured pressure" in row for row in partial["datasets"]["signals"])
    assert all("simulated pressure" in row for row in partial["datasets"]["signals"])


def test_differences_are_drawn_under_the_signals_that_are_measured(made: Made) -> None:
    output = made(n=20)
    spec = draw(output)["engagement"]
    fields = [[layer["encoding"]["y"]["field"] for layer in view["layer"] if "field" in layer["encoding"].get("y", {})]
              for view in spec["vconcat"]]
    titles = [["difference pressure"], ["difference input_speed", "difference output_speed"],
              ["difference output_torque"]]
    assert [field for field in fields if any("difference" in name for name in field)] == titles
    for difference in titles:
        place = fields.index(difference)
        assert f"measured {difference[0].split()[1]}" in fields[place - 1]
    for row in spec["datasets"]["signals"]:
        for name in ("pressure", "output_torque"):
            assert row[f"difference {name}"] == pytest.approx(row[f"measured {name}"] - row[f"simulated {name}"],
                                                              abs=2e-3 * abs(row[f"measured {name}"]) + 1e-3)
    svg = render(spec, "svg").decode()
    assert "simulated [bar]" in svg
    assert f'stroke="{theme.AXIS}"' in svg


@pytest.mark.parametrize("names", [["pressure"], ["output_speed"], ["output_torque", "input_speed"]])
def test_panels_are_those_of_the_signals_that_there_are(marks: Marks, names: list[str]) -> None:
    time = [0.01 * k for k in range(100)]
    series = {name: [float(k) for k in range(100)] for name in names}
    spec = theme.picture("one", "engagement", panels(time, {"nominal": series, "measured": series},
                                                     {"nominal": 0.5, "measured": 0.6}, 0.0, 3.2))
    assert len(spec["vconcat"]) == len(names)
    assert len(marks(spec, "line")) == 2 * len(names)
    assert ("input ÷ gear ratio" in json.dumps(spec, ensure_ascii=False)) == ("input_speed" in names)


def test_the_phases_of_an_engagement_follow_one_another(made: Made) -> None:
    datasets = draw(made(n=20))["engagement"]["datasets"]
    phases = [(row["phase"], row["from"]) for row in datasets["phases"]]
    assert phases == [("fill", 0.0), ("slip", 0.1), ("stick", datasets["locks"][1]["t"])]
    # The input speed is divided by the gear ratio.
    assert datasets["signals"][0]["simulated input_speed"] == 160 / 3.2


def test_seven_inputs_show_the_plane_of_the_surface(made: Made, marks: Marks) -> None:
    output = made(SEVEN)
    output["figure_data"]["surface"]["axes"] = ["initial_position", "pressure_bias"]
    specs = draw(output)
    assert specs["inputs"]["encoding"]["x"]["title"] == "initial position [multiple of nominal]"
    assert "All other unknowns keep their fitted values." in " ".join(specs["inputs"]["title"]["subtitle"])
    assert len(marks(specs["profiles"], "line")) == len(specs["profiles"]["concat"]) == 15


def test_one_input_shows_its_density(made: Made) -> None:
    specs = draw(made(("pressure_bias",)))
    rows = specs["inputs"]["layer"][0]["data"]["values"]
    values, density = (np.array([row[name] for row in rows]) for name in ("x", "density"))
    assert np.trapezoid(density, values) == pytest.approx(0.9995, abs=1e-3)
    assert len(specs["profiles"]["concat"]) == 3


@pytest.mark.parametrize("family", ["normal", "lognormal", "gamma", "uniform"])
def test_the_curves_enclose_the_stated_share_of_the_runs(made: Made, family: str) -> None:
    result = made(n=20)["result"] | {"families": [family, "normal"], "std": [0.3, 0.2],
                                 "correlation": [[1.0, 0.8], [0.8, 1.0]]}
    curve = np.array([[row["x"], row["y"]] for row in inputs.curves(result, [0, 1])[0]["data"]["values"]
                      if row["share"] == "90 %"])
    runs = inputs._inputs(result, [0, 1]).points(np.random.default_rng(1).normal(size=(4000, 2)))
    # A curve that encloses a point has a winding number of one about it.
    angles = np.arctan2(*np.moveaxis(curve[:, None] - runs, -1, 0))
    turns = np.sum((np.diff(angles, axis=0) + math.pi) % (2 * math.pi) - math.pi, axis=0) / (2 * math.pi)
    assert np.mean(np.abs(turns) > 0.5) == pytest.approx(0.9, abs=0.02)


def test_ridges_are_distinguished_from_peaks() -> None:
    edges = np.linspace(-1, 1, 202)
    first, second = ((edges[:-1] + edges[1:]) / 2)[:, None], ((edges[:-1] + edges[1:]) / 2)[None]
    assert inputs.surface_shape(edges, edges, 300 * (first + second) ** 2 + 3 * (first - second) ** 2) == "ridge"
    assert inputs.surface_shape(edges, edges, 20 * first**2 + 30 * second**2) == "peak"
    assert inputs.surface_shape(edges, edges, 20 * (first - 1) ** 2 + 30 * second**2) == "open"
    assert inputs.surface_shape(edges, edges, 1e6 * (first**2 + second**2)) == "peak"  # within one cell


def test_a_ridge_narrower_than_the_grid_spacing_is_continuous() -> None:
    grid = np.linspace(-1, 1, 21)
    slanted = 400 * (grid[:, None] - 0.37 * grid) ** 2 + 0.1 * grid**2
    x, _, drops = inputs.interpolated_drops(
        {"first": grid, "second": grid, "log10_likelihood": (-269 - slanted).tolist()})
    middle = (x[:-1] + x[1:]) / 2
    assert np.all(np.abs(middle[np.argmin(drops, axis=0)]) <= 0.38)
    assert np.all(np.min(drops, axis=0) < 0.2)


def test_the_title_states_whether_the_means_are_determined(made: Made) -> None:
    output = made(n=20)
    assert draw(output)["inputs"]["title"]["text"].startswith("A ridge")
    surface = output["figure_data"]["surface"]
    first, second = np.meshgrid(surface["first"], surface["second"], indexing="ij")
    surface["log10_likelihood"] = (-300.0 * ((first - 1) ** 2 + (second - 1) ** 2)).tolist()
    surface["log10_likelihood"][0][0] = None
    assert draw(output)["inputs"]["title"]["text"] == (
        "The recordings determine both pressure bias and initial position")


def test_an_open_interval_is_marked(made: Made) -> None:
    output = made(n=20)
    output["result"]["intervals"][2] |= {"upper": None, "unsettled": ["upper"]}
    spec = draw(output)["profiles"]
    texts = [[layer["mark"]["text"] for layer in panel["layer"] if layer["mark"].get("text")]
             for panel in spec["concat"]]
    assert texts == [["← open"], [], ["not found →"], [], []]
    assert spec["title"]["text"] == "The recordings limit 3 of 5 unknowns on both sides"


def test_the_axis_of_a_profile_ends_where_the_curve_leaves_the_panel(made: Made) -> None:
    output = made(n=20)
    # A parabola that drops by 1.25 decades, the depth of the panel, at 0.3 and 0.7 and extends far beyond.
    values = np.linspace(-2, 3, 11)
    interval = output["result"]["intervals"][1]
    interval["curve"] = [[value, 1.25 * ((value - 0.5) / 0.2) ** 2] for value in values]
    output["result"]["intervals"][-1] |= {"lower": 0.012, "upper": 0.02}
    panels = draw(output)["profiles"]["concat"]
    low, high = panels[1]["layer"][-1]["encoding"]["x"]["scale"]["domain"]
    assert (low, high) == pytest.approx((0.3, 0.7), abs=0.02)
    assert panels[-1]["layer"][0]["data"]["values"] == [{"low": 12.0, "high": 20.0}]  # in ms


def test_the_axes_contain_the_curves(made: Made) -> None:
    output = made(n=20)
    output["result"]["std"] = [0.05, 0.4]
    layers = draw(output)["inputs"]["layer"]
    low, high = draw(output)["inputs"]["encoding"]["y"]["scale"]["domain"]
    heights = [row["y"] for layer in layers for row in layer["data"]["values"] if row.get("share") == "90 %"]
    assert low < min(heights) < 0.8
    assert high > max(heights) > 1.2


def test_the_threshold_is_half_the_chi_square_quantile() -> None:
    assert threshold(0.9) == pytest.approx(2.70554 / 2 / 2.302585, rel=1e-5)  # chi-square in decades


def test_a_search_without_generations_has_no_convergence(made: Made) -> None:
    output = made(n=20)
    output["result"]["history"] = []
    assert "convergence" not in draw(output)
    output["result"] |= {"history": [None, -280.0], "method": "classic"}
    assert draw(output)["convergence"]["title"]["text"].startswith(
        "2 blocks of the grid improve the best candidate by 0.0 decades")


def test_the_same_fit_gives_the_same_pictures(made: Made, drawn: dict[str, Spec]) -> None:
    assert json.dumps(draw(made(n=20))) == json.dumps(drawn, allow_nan=False)
    picture = render(drawn["profiles"], "png")
    assert picture.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", picture[16:24])
    assert width > 2 * 700
    assert height > 2 * 250


def test_rendering_loads_no_external_data() -> None:
    with socket.create_server(("127.0.0.1", 0)) as outside:
        outside.settimeout(0.2)
        url = f"http://127.0.0.1:{outside.getsockname()[1]}/data.json"
        with pytest.raises(ValueError, match="External data url not allowed"):
            render({"$schema": SCHEMA, "data": {"url": url}, "mark": "bar"}, "svg")
        with pytest.raises(TimeoutError):
            outside.accept()


# The axes of unknowns: round values whose labels have room and differ.


PHYSICAL = [{"name": "pressure_bias", "unit": "bar", "nominal": 1.6, "std": 0.1}]
WIDEST = 56  # px of a label such as "0.0475 mm", by its drawing


@pytest.mark.parametrize("size", [105, 140, 204])
def test_labels_do_not_collide_with_each_other_or_those_of_the_next_panel(size: int) -> None:
    gap, rng = 40, np.random.default_rng(1)
    for width in 10 ** rng.uniform(-3, 3, 300):
        low = rng.uniform(-1, 3) * width
        values = ticks((low, low + width), size)
        places = [(value - low) / width * size for value in values]
        assert 2 <= len(values) <= 3
        assert min(np.diff(places)) > WIDEST
        assert places[0] - places[-1] + size + gap > WIDEST


def test_labels_have_the_digits_that_tell_them_apart() -> None:
    shown = unknown("mean of pressure_bias", PHYSICAL)
    values = ticks((0.9951, 1.0052), 105)
    assert values == [0.998, 1.004]
    assert shown.axis(values=values)["format"] == ".4~r"
    assert "'.4~r'" in shown.axis(values=values)["labelExpr"]
    assert shown.axis(values=[1.0, 1.1])["format"] == ".3~r"


# The output of another machine in pictures and pages: its name and unit, not shifting times in ms.


SPEED = {"name": "final_speed", "unit": "rpm"}


def test_times_are_shown_in_ms_and_others_in_their_unit() -> None:
    assert (SHIFTING_TIME.small, SHIFTING_TIME.factor, SHIFTING_TIME.per) == ("ms", 1e3, "ms")
    assert Output.of({"output": {"name": "run_up_time", "unit": "s"}}).small == "ms"
    assert Output.of({"output": None}) == Output.of({}) == SHIFTING_TIME
    other = Output.of({"output": {"name": "final_energy", "unit": "kg m^2"}})
    assert (other.words, other.small, other.factor, other.per) == ("final energy", "kg m²", 1.0, "0.001 kg m²")


def test_a_fit_of_another_machine_speaks_of_its_output(made: Callable[..., dict[str, Any]]) -> None:
    clutch, output = made(n=20), made(n=20)
    output["figure_data"] |= {"output": SPEED, "engagement": None, "conditions": {
        "voltage [V]": clutch["figure_data"]["conditions"]["motor_speed"]}}
    text = json.dumps(pictures(output), ensure_ascii=False)
    for said in ("measured final speed [rpm]", "predicted final speed [rpm]", "measured − predicted [rpm]",
                 "Densities are per 0.001 rpm", "the measured final speed is larger", "The measured values"):
        assert said in text, said
    for other in ("shifting time", "[ms]", " ms", "never lock", "measured times", '"engagements"'):
        assert other not in text, other
    differences = pictures(output)["comparison"]["datasets"]["experiments"][0]
    assert differences["difference after"] == pytest.approx(differences["measured"] - differences["after"], abs=1e-5)
    rows = {row[0]: row for row in numbers(output["result"], output["physical"], Output.of(output["figure_data"]))}
    assert float(rows["output noise [rpm]"][2]) == pytest.approx(output["result"]["output_std"], rel=1e-3)


def test_a_propagation_for_another_machine_speaks_of_its_output() -> None:
    one = {"condition": 0, "mean": 1500.0, "std": 20.0, "quantiles": [1450.0], "first_order": None, "total": None,
           "density": None, "density_time": None}
    answer = {"axes": [{"name": "voltage"}], "conditions": [one], "output": SPEED}
    spec = propagation.draw(answer, [0.05], {"load [N m]": [3.0]})
    assert spec["title"]["text"] == "Condition 0 has a final speed of 1500 rpm, with a standard deviation of 20.0 rpm"
    text = json.dumps(spec)
    assert "final speed [rpm]" in text
    assert "ms]" not in text
