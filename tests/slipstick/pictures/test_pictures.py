"""The pictures of a fit: all can be drawn, show every experiment, and say in words what is seen."""

import json
import math
import socket
import struct
import subprocess
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from slipstick.pictures import CAPTIONS, Spec, inputs, pictures
from slipstick.pictures.profiles import threshold
from slipstick.pictures.rendering import render
from slipstick.pictures.theme import SCHEMA

Made = Callable[..., dict[str, Any]]
Marks = Callable[[Spec, str], list[ElementTree.Element]]
Scales = Callable[[Spec], Iterator[Spec]]
SEVEN = ("current_delay", "current_bias", "current_gain", "pressure_bias", "temperature_gain", "initial_position",
         "friction_coefficient")
DATA = {"comparison": "symbol", "inputs": "line", "profiles": "line", "densities": "area", "engagement": "line",
        "convergence": "line"}
"""Name of a picture -> the marks that its data are drawn as."""


def draw(output: dict[str, Any]) -> dict[str, Spec]:
    # By way of JSON, as the service draws them.
    return pictures(*(json.loads(json.dumps(output[name])) for name in ("result", "figure_data")))


@pytest.fixture(scope="module")
def drawn(made: Made) -> dict[str, Spec]:
    return draw(made())


def test_a_fit_has_all_pictures_and_each_can_be_drawn(drawn: dict[str, Spec], marks: Marks) -> None:
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
    found = draw(made(n=n))
    # Before and after, in the plane of measured and simulated times and by experiment.
    assert len(marks(found["comparison"], "symbol")) == 4 * n
    assert len(marks(found["densities"], "symbol")) == n
    assert len([path for path in marks(found["densities"], "area") if path.get("d")]) == n


def test_the_density_counts_what_lies_outside(made: Made) -> None:
    output = made()
    shown = output["figure_data"]["prediction"]
    outside = np.abs(np.array(shown["measured"]) - shown["mean"]) > 1.644854 * np.array(shown["std"])
    title = draw(output)["densities"]["title"]["text"]
    assert title == (f"{outside.sum()} of 216 measured times lie outside the central 90 % predicted for them; "
                     "22 would be expected")


def test_what_never_locks_is_left_out_and_said(made: Made, marks: Marks) -> None:
    output = made()
    for name, lost in (("before", 3), ("mean", 5)):
        output["figure_data"]["prediction"][name][lost] = None
    output["figure_data"]["prediction"]["density"][5] = output["figure_data"]["prediction"]["density_time"][5] = []
    output["figure_data"]["engagement"] |= {"lock": None, "touch": None, "measured": None}
    found = draw(output)
    assert "2 without a simulated" in found["comparison"]["title"]["subtitle"][0]
    assert len(marks(found["comparison"], "symbol")) == 4 * 216 - 2 * 2
    assert "1 that may never lock left out" in " ".join(found["densities"]["title"]["subtitle"])
    assert len(marks(found["densities"], "symbol")) == 215
    assert found["engagement"]["title"]["text"].endswith("not at all in the fitted model")
    assert [row["phase"] for row in found["engagement"]["datasets"]["phases"]] == ["fill"]
    assert marks(found["engagement"], "line")


def test_the_phases_of_an_engagement_follow_one_another(made: Made) -> None:
    shown = draw(made())["engagement"]["datasets"]
    phases = [(row["phase"], row["from"]) for row in shown["phases"]]
    assert phases == [("fill", 0.0), ("slip", 0.1), ("stick", shown["locks"][1]["t"])]
    # Behind the gear the shafts meet.
    assert shown["signals"][0]["simulated input_speed"] == 160 / 3.2


def test_seven_inputs_show_the_plane_of_the_surface(made: Made, marks: Marks) -> None:
    output = made(SEVEN)
    output["figure_data"]["surface"]["axes"] = ["initial_position", "pressure_bias"]
    found = draw(output)
    assert found["inputs"]["encoding"]["x"]["title"] == "initial position [multiple of nominal]"
    assert "All other inputs are kept as fitted." in " ".join(found["inputs"]["title"]["subtitle"])
    assert len(marks(found["profiles"], "line")) == len(found["profiles"]["concat"]) == 15


def test_one_input_shows_its_density(made: Made) -> None:
    found = draw(made(("pressure_bias",)))
    rows = found["inputs"]["layer"][0]["data"]["values"]
    values, density = (np.array([row[name] for row in rows]) for name in ("x", "density"))
    assert np.trapezoid(density, values) == pytest.approx(0.9995, abs=1e-3)
    assert len(found["profiles"]["concat"]) == 3


@pytest.mark.parametrize("family", ["normal", "lognormal", "gamma", "uniform"])
def test_the_curves_hold_the_share_of_the_runs_they_claim(made: Made, family: str) -> None:
    result = made()["result"] | {"families": [family, "normal"], "std": [0.3, 0.2],
                                 "correlation": [[1.0, 0.8], [0.8, 1.0]]}
    curve = np.array([[row["x"], row["y"]] for row in inputs.curves(result, [0, 1])[0]["data"]["values"]
                      if row["mass"] == "90 %"])
    runs = inputs._inputs(result, [0, 1]).points(np.random.default_rng(1).normal(size=(4000, 2)))
    # A curve around a point turns once about it.
    angles = np.arctan2(*np.moveaxis(curve[:, None] - runs, -1, 0))
    turns = np.sum((np.diff(angles, axis=0) + math.pi) % (2 * math.pi) - math.pi, axis=0) / (2 * math.pi)
    assert np.mean(np.abs(turns) > 0.5) == pytest.approx(0.9, abs=0.02)


def test_a_ridge_is_told_from_a_peak() -> None:
    edges = np.linspace(-1, 1, 202)
    first, second = ((edges[:-1] + edges[1:]) / 2)[:, None], ((edges[:-1] + edges[1:]) / 2)[None]
    assert inputs.summit(edges, edges, 300 * (first + second) ** 2 + 3 * (first - second) ** 2) == "ridge"
    assert inputs.summit(edges, edges, 20 * first**2 + 30 * second**2) == "peak"
    assert inputs.summit(edges, edges, 20 * (first - 1) ** 2 + 30 * second**2) == "open"
    assert inputs.summit(edges, edges, 1e6 * (first**2 + second**2)) == "peak"  # within one cell


def test_a_ridge_narrower_than_its_grid_is_whole() -> None:
    grid = np.linspace(-1, 1, 21)
    slanted = 400 * (grid[:, None] - 0.37 * grid) ** 2 + 0.1 * grid**2
    x, _, drops = inputs.smooth({"first": grid, "second": grid, "log10_likelihood": (-269 - slanted).tolist()})
    middle = (x[:-1] + x[1:]) / 2
    assert np.all(np.abs(middle[np.argmin(drops, axis=0)]) <= 0.38)
    assert np.all(np.min(drops, axis=0) < 0.2)


def test_the_title_says_whether_the_means_are_fixed(made: Made) -> None:
    output = made()
    assert draw(output)["inputs"]["title"]["text"].startswith("A ridge")
    surface = output["figure_data"]["surface"]
    first, second = np.meshgrid(surface["first"], surface["second"], indexing="ij")
    surface["log10_likelihood"] = (-300.0 * ((first - 1) ** 2 + (second - 1) ** 2)).tolist()
    surface["log10_likelihood"][0][0] = None
    assert draw(output)["inputs"]["title"]["text"] == "The recordings fix both pressure bias and initial position"


def test_an_open_interval_is_marked(made: Made) -> None:
    output = made()
    output["result"]["intervals"][2] |= {"upper": None, "unsettled": ["upper"]}
    found = draw(output)["profiles"]
    texts = [[layer["mark"]["text"] for layer in panel["layer"] if layer["mark"].get("text")]
             for panel in found["concat"]]
    assert texts == [["← open"], [], ["not found →"], [], []]
    assert found["title"]["text"] == "2 of 5 unknowns stay open on one side or both"


def test_a_profile_is_drawn_where_it_is_in_the_picture(made: Made) -> None:
    output = made()
    # A parabola that falls by 1.25 decades, the depth of the picture, at 0.3 and 0.7 and goes far beyond.
    values = np.linspace(-2, 3, 11)
    interval = output["result"]["intervals"][1]
    interval["curve"] = [[value, 1.25 * ((value - 0.5) / 0.2) ** 2] for value in values]
    output["result"]["intervals"][-1] |= {"lower": 0.012, "upper": 0.02}
    panels = draw(output)["profiles"]["concat"]
    low, high = panels[1]["layer"][-1]["encoding"]["x"]["scale"]["domain"]
    assert (low, high) == pytest.approx((0.3, 0.7), abs=0.02)
    assert panels[-1]["layer"][0]["data"]["values"] == [{"low": 12.0, "high": 20.0}]  # in ms


def test_all_of_the_curves_is_in_the_picture(made: Made) -> None:
    output = made()
    output["result"]["std"] = [0.05, 0.4]
    layers = draw(output)["inputs"]["layer"]
    low, high = draw(output)["inputs"]["encoding"]["y"]["scale"]["domain"]
    heights = [row["y"] for layer in layers for row in layer["data"]["values"] if row.get("mass") == "90 %"]
    assert low < min(heights) < 0.8
    assert high > max(heights) > 1.2


def test_the_threshold_is_that_of_one_unknown() -> None:
    assert threshold(0.9) == pytest.approx(2.70554 / 2 / 2.302585, rel=1e-5)  # chi-square in decades


def test_a_search_without_generations_has_no_convergence(made: Made) -> None:
    output = made()
    output["result"]["history"] = []
    assert "convergence" not in draw(output)
    output["result"] |= {"history": [None, -280.0], "method": "classic"}
    assert draw(output)["convergence"]["title"]["text"].startswith("2 blocks of the grid gain 0.0 decades")


def test_the_same_fit_gives_the_same_pictures(made: Made, drawn: dict[str, Spec]) -> None:
    assert json.dumps(draw(made())) == json.dumps(drawn, allow_nan=False)
    picture = render(drawn["profiles"], "png")
    assert picture.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", picture[16:24])
    assert width > 2 * 700
    assert height > 2 * 250


def test_drawing_fetches_nothing() -> None:
    with socket.create_server(("127.0.0.1", 0)) as outside:
        outside.settimeout(0.2)
        url = f"http://127.0.0.1:{outside.getsockname()[1]}/data.json"
        with pytest.raises(subprocess.CalledProcessError):
            render({"$schema": SCHEMA, "data": {"url": url}, "mark": "bar"}, "svg")
        with pytest.raises(TimeoutError):
            outside.accept()
