"""The pictures of a study, and the surfaces of the same fit on both of its tables: each says what the data say."""

import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import pytest

from slipstick.pictures import units
from slipstick.pictures.study import NAMES, Spec, study_pictures, surfaces
from slipstick.studies import StudyResult, StudySettings
from slipstick.studies.figures import Figures
from slipstick.studies.result import Candidate, FindingResult, Gap, Law, SimulationResult

Studied = Callable[[str], tuple[StudyResult, Figures]]
Marks = Callable[[Spec, str], list[ElementTree.Element]]
DATA = {"overlay": "line", "law": "symbol", "evidence": "symbol", "times": "symbol", "blocks": "symbol",
        "gap": "symbol", "signals": "line"}
"""Name of a picture -> kind of the marks of its data."""


def law_of(one: FindingResult, **changes: Any) -> FindingResult:
    assert isinstance(one.law, Law)
    return replace(one, law=replace(one.law, **changes))


def lag_of(one: FindingResult) -> FindingResult:
    lag = law_of(one, x=None, change=[0.012], lower=[0.011], upper=[0.013], unit="s", relative=False, formula=None,
                 up_to="nothing")
    return replace(lag, title="Lag of the pressure sensor", quantity="pressure sensor", depends_on="lag")


def with_findings(result: StudyResult, *findings: FindingResult) -> StudyResult:
    return replace(result, findings=list(findings))


@pytest.mark.parametrize(("name", "drawn"), [
    ("friction", ["overlay", "law", "evidence", "blocks", "gap", "signals"]),
    ("nothing", ["overlay", "blocks", "signals"]), ("times", ["times"]),
    pytest.param("torque", ["overlay", "signals"], marks=pytest.mark.slow),
    pytest.param("drag", ["overlay", "law", "evidence", "blocks", "gap", "signals"], marks=pytest.mark.slow)])
def test_every_picture_can_be_rendered(studied: Studied, marks: Marks, name: str, drawn: list[str]) -> None:
    specs = study_pictures(*studied(name))
    assert list(specs) == drawn
    assert set(specs) < set(NAMES)
    for key, spec in specs.items():
        assert spec["description"]
        assert marks(spec, DATA[key])
        json.dumps(spec, allow_nan=False)


def test_the_law_of_friction_falls_with_slip_beside_its_formula(studied: Studied, marks: Marks) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    assert one.law is not None
    spec = study_pictures(result, figures)["law"]
    assert re.fullmatch(r"The friction coefficient falls by [\d.]+ % as the slip of the plates grows from [\d.]+ to "
                        r"\d+ rad/s", spec["title"]["text"])
    assert "up to a constant" in " ".join(spec["title"]["subtitle"])
    assert len(marks(spec, "symbol")) == len(one.law.change)
    assert len(marks(spec, "line")) == 2  # the law and the formula
    rising = with_findings(result, law_of(one, change=one.law.change[::-1], linearised=True, formula=None))
    spec = study_pictures(rising, figures)["law"]
    assert "rises by" in spec["title"]["text"]
    assert "several times too narrow" in " ".join(spec["title"]["subtitle"])
    assert len(marks(spec, "line")) == 1
    assert "catalogue" not in json.dumps(spec)


def test_a_law_that_is_not_monotonic_varies(studied: Studied) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    assert one.law is not None
    bent = law_of(one, change=[abs(place - 7) * 0.01 for place in range(len(one.law.change))])
    # 7 % of its first value, which is 7 % above the mean; without a free constant, of the model's value.
    for up_to, size in (("constant", "6.54 %"), ("nothing", "7 % of the model's value")):
        drawn = study_pictures(with_findings(result, law_of(bent, up_to=up_to)), figures)["law"]
        assert f"varies by {size} with the slip" in drawn["title"]["text"]


def test_the_change_of_a_law_does_not_depend_on_its_constant(studied: Studied) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    assert one.law is not None
    moved = law_of(one, **{name: [1.1 * (1 + value) - 1 for value in getattr(one.law, name)]
                           for name in ("change", "lower", "upper")})
    first, second = (study_pictures(with_findings(result, each), figures)["law"]["title"]["text"]
                     for each in (one, moved))
    assert first == second


def test_captions_speak_of_what_is_drawn(studied: Studied) -> None:
    result, figures = studied("friction")
    one, gap = result.findings[0], result.gap
    assert gap is not None
    captions = {name: spec["description"] for name, spec in study_pictures(result, figures).items()}
    assert "Blue:" in captions["law"]
    assert "The control is" in captions["gap"]
    bare = replace(result, findings=[law_of(one, formula=None, up_to="nothing")], gap=replace(gap, control=None))
    fewer = {name: spec["description"] for name, spec in study_pictures(bare, figures).items()}
    assert "Blue:" not in fewer["law"]
    assert "up to a constant" not in fewer["law"]
    assert "The control is" not in fewer["gap"]
    assert "Dots:" not in study_pictures(with_findings(result, lag_of(one)), figures)["law"]["description"]


def test_the_first_picture_has_the_signal_in_which_the_finding_shows_best(studied: Studied) -> None:
    result, figures = studied("friction")
    spec = study_pictures(result, figures)["overlay"]
    signal = next(name for name in figures.engagements[0].measured if name.replace("_", " ") in spec["title"]["text"])
    worst = figures.engagements[0]
    curves = [layer["data"]["values"] for layer in spec["vconcat"][0]["layer"] if layer["mark"]["type"] == "line"]
    kept = len(curves[0])
    for curve, values in zip(curves, (worst.measured[signal], *(worst.models[who][signal] for who in worst.models)),
                             strict=True):
        assert [row["y"] for row in curve] == pytest.approx(values[:kept], rel=1e-3)
    errors = {who: math.sqrt(sum((a - b) ** 2 for a, b in zip(worst.measured[signal], worst.models[who][signal],
                                                              strict=True)) / len(worst.time)) for who in worst.models}
    for who in ("before", "after"):
        assert f"{errors[who]:.2g} " in spec["title"]["text"]
    assert errors["after"] < 0.8 * errors["before"]


def test_the_slope_of_a_law_known_up_to_a_line_is_not_stated(studied: Studied) -> None:
    result, figures = studied("friction")
    spec = study_pictures(with_findings(result, law_of(result.findings[0], up_to="line")), figures)["law"]
    assert spec["title"]["text"].endswith("with the slip of the plates, other than by a straight line")
    assert "up to a straight line" in " ".join(spec["title"]["subtitle"])


def test_wide_bands_do_not_hide_the_law(studied: Studied) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    assert one.law is not None
    off = -0.5 * max(one.law.change)
    wide = law_of(one, change=[off, *one.law.change[1:]], lower=[-50.0, *one.law.lower[1:]],
                  upper=[50.0, *one.law.upper[1:]])
    spec = study_pictures(with_findings(result, wide), figures)["law"]
    assert "falls by" in spec["title"]["text"]  # the first point is not known
    low, high = next(scale for scale in domains(spec) if len(scale) == 2)
    assert low < 100 * min(one.law.change)
    assert high < 40  # percent; the law rises to 17


def domains(view: Any) -> Iterator[list[float]]:
    if isinstance(view, dict):
        domain = view.get("scale", {}).get("domain") if isinstance(view.get("scale"), dict) else None
        if domain and not isinstance(domain[0], str):
            yield domain
        for part in view.values():
            yield from domains(part)
    elif isinstance(view, list):
        for part in view:
            yield from domains(part)


def test_every_finding_has_a_panel_and_a_number_an_interval(studied: Studied, marks: Marks) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    spec = study_pictures(with_findings(result, one, lag_of(one), replace(one, law=None)), figures)["law"]
    titles = [panel["title"]["text"] for panel in spec["vconcat"]]
    assert len(titles) == 2
    assert titles[1] == "Lag of the pressure sensor: 12 ms"
    assert marks(spec, "rule")
    alone = study_pictures(with_findings(result, lag_of(one)), figures)["law"]
    assert alone["title"]["text"] == "Lag of the pressure sensor: 12 ms"
    assert "law" not in study_pictures(with_findings(result, replace(one, law=None)), figures)


def test_the_gap_shows_every_engagement_and_each_closure(studied: Studied, marks: Marks) -> None:
    result, figures = studied("friction")
    gap = result.gap
    assert gap is not None
    assert gap.control is not None
    closures = {name: replace(one, closure=0.9, lower=0.8, upper=1.0) for name, one in gap.closures.items()}
    closures["pressure"] = replace(closures["pressure"], closure=None)
    closures["shifting_time"] = replace(closures["shifting_time"], rms_before=0.0285, rms_after=0.0072)
    others = {**closures, "shifting_time": replace(closures["shifting_time"], closure=-3.0, lower=-4.0, upper=-2.0)}
    result = replace(result, gap=replace(gap, closures=closures, control=replace(gap.control, closures=others)))
    spec = study_pictures(result, figures)["gap"]
    assert len(marks(spec, "symbol")) == 2 * result.experiments + 2 * (len(closures) - 1)
    assert "larger error than without it" in [text for mark in marks(spec, "text") for text in mark.itertext()]
    assert spec["title"]["text"] == "On held-out conditions, the shifting-time error falls from 28.5 to 7.20 ms"
    closures["shifting_time"] = replace(closures["shifting_time"], rms_after=0.03)
    assert "grows from 28.5 to 30.0 ms" in study_pictures(result, figures)["gap"]["title"]["text"]


def test_differences_are_measured_minus_predicted(studied: Studied) -> None:
    result, figures = studied("friction")
    late = replace(figures, measured=[value + 1.0 for value in figures.measured])
    sums = [sum(row["difference"] for layer in study_pictures(result, one)["gap"]["vconcat"][0]["layer"]
                for row in layer["data"]["values"] if "difference" in row) for one in (figures, late)]
    assert sums[1] - sums[0] == pytest.approx(2 * 1000 * result.experiments, rel=1e-3)
    high = [replace(one, measured={name: [value + 100 for value in values] for name, values in one.measured.items()})
            for one in figures.engagements]
    title = study_pictures(result, replace(figures, engagements=high))["signals"]["title"]["text"]
    assert title.startswith("In the 3 worst engagements, the pressure is off by 1e+02 bar")


def test_a_block_in_which_single_engagements_stand_out_is_not_explained(studied: Studied) -> None:
    result, figures = studied("nothing")
    assert "No block is left unexplained" in study_pictures(result, figures)["blocks"]["title"]["text"]
    odd = replace(result, blocks=[replace(block, outlying=[4] if block.name == "load" else [])
                                  for block in result.blocks])
    spec = study_pictures(odd, figures)["blocks"]
    assert f"1 of {len(result.blocks)} blocks is not explained" in spec["title"]["text"]
    assert [row["series"] == "not explained" for row in spec["data"]["values"]] == [
        block.name == "load" for block in result.blocks]


def test_the_evidence_that_is_drawn_is_the_one_that_is_told(studied: Studied) -> None:
    result, figures = studied("friction")
    rival = Candidate("pressure_dependent_friction", "friction coefficient", "pressure", 90.0, 1.2)
    one = replace(result.findings[0], errors=8.7, rivals=[rival])
    settings = StudySettings.from_dict({"naming": {"errors": 5.0, "apart": 3.0}})
    specs = study_pictures(with_findings(result, one), figures, None, settings)
    blocks = specs["blocks"]
    first, second = specs["evidence"]["data"]["values"]
    # 8.7 standard errors: a 90 % interval that is 1.645 of them wide to either side, and far from zero.
    assert (first["value"], first["least"]) == (8.7, 5.0)
    assert (first["low"], first["high"]) == pytest.approx((8.7 - 1.645, 8.7 + 1.645), abs=1e-3)
    assert first["low"] > 0
    assert (second["label"], second["value"], second["least"]) == ("lead over pressure-dependent friction", 1.2, 3.0)
    assert second["low"] < 0
    assert second["series"] == "below the threshold"
    assert [row["value"] for row in blocks["data"]["values"]] == pytest.approx(
        [block.chi_square for block in result.blocks], rel=1e-4)
    thresholds = [layer["encoding"]["x"]["datum"] for layer in blocks["layer"][:2]]
    assert thresholds == pytest.approx([1.0, math.exp(5.0 * 0.05)])


def test_the_evidence_shows_a_finding_against_another_explanation_or_nothing(studied: Studied) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    assert one.next_best is not None
    rows = study_pictures(result, figures)["evidence"]["data"]["values"]
    assert [row["value"] for row in rows] == pytest.approx([one.errors, one.next_best.behind], rel=1e-4)
    alone = with_findings(result, replace(one, rivals=[], next_best=None))
    assert "evidence" not in study_pictures(alone, figures)


def test_an_interval_of_a_size_that_contains_zero_is_explained(studied: Studied) -> None:
    result, figures = studied("friction")
    lag = lag_of(result.findings[0])
    wide = study_pictures(with_findings(result, law_of(lag, lower=[-0.002])), figures)["law"]["title"]["subtitle"]
    assert " ".join(wide).startswith("90 % interval of the size: −2.00 to 13.0 ms. It contains zero:")
    sure = study_pictures(with_findings(result, lag), figures)["law"]["title"]["subtitle"]
    assert " ".join(sure) == "90 % interval of the size: 11.0 to 13.0 ms."


def test_what_a_right_model_would_leave_is_drawn(studied: Studied) -> None:
    result, figures = studied("friction")
    assert result.gap is not None
    band = study_pictures(result, figures)["gap"]["vconcat"][0]["layer"][0]["data"]["values"][0]
    assert band["high"] == -band["low"] == pytest.approx(2e3 * result.gap.closures["shifting_time"].rms_expected)


def test_without_a_significant_gap_there_are_no_closures(studied: Studied) -> None:
    result, figures = studied("friction")
    assert result.gap is not None
    closures = {name: replace(one, closure=None) for name, one in result.gap.closures.items()}
    spec = study_pictures(replace(result, gap=replace(result.gap, closures=closures, control=None)), figures)["gap"]
    assert len(spec["vconcat"]) == 1


def test_the_finding_explains_the_worst_signals(studied: Studied, marks: Marks) -> None:
    result, figures = studied("friction")
    spec = study_pictures(result, figures)["signals"]
    # Each engagement: two measured speeds, and the differences of four signals to both models.
    assert len(marks(spec, "line")) == len(figures.engagements) * (2 + 4 * 2)
    left = {who: [abs(a - b) for one in figures.engagements
                  for a, b in zip(one.measured["output_torque"], one.models[who]["output_torque"], strict=True)]
            for who in ("before", "after")}
    # Noise is in both, and parameters of their own take up much of what the model without the finding lacks.
    assert sum(left["after"]) < 0.8 * sum(left["before"])
    assert "signals" not in study_pictures(result, replace(figures, engagements=[]))


def test_engagements_have_their_numbers_in_the_recordings(studied: Studied) -> None:
    result, figures = studied("friction")
    place = figures.engagements[0].condition
    for set_aside, number in (([], place), ([0, place + 2], place + 1)):
        spec = study_pictures(replace(result, set_aside=set_aside), figures)["signals"]
        assert f'"{number}: profile ' in json.dumps(spec)


@pytest.mark.parametrize(("unit", "value", "text"), [
    ("m", 7e-05, "0.07 mm"), ("s", 0.0123, "12.3 ms"), ("bar", 0.3, "0.3 bar"), ("A", 0.012, "12 mA"),
    ("N m s^2", 0.03, "0.03 N m s²"), ("Pa", 2.5e5, "0.25 MPa"), ("1", -0.2, "−0.2")])
def test_numbers_are_shown_in_readable_units(unit: str, value: float, text: str) -> None:
    shown, factor = units.scale(unit, value)
    assert units.with_unit(units.number(factor * value), shown) == text


# The likelihood surfaces of the same fit on two tables: common axes in units and common shades.


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
    assert spec["title"]["text"] == \
        "With the extended model, the same fit makes the recordings 120.0 decades more likely"
    assert "Output noise: 12 ms before, 3 ms after." in spec["title"]["subtitle"][0]
    assert len(marks(spec, "symbol")) == 4
    for fit, likelihood in zip(both_fits.values(), (-269.0, -389.0), strict=True):
        fit["result"]["log10_likelihood"] = likelihood
    assert "120.0 decades less likely" in draw(both_fits)["title"]["text"]
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
