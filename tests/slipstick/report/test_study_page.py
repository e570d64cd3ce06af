"""The HTML report of a study: answer, warnings, findings with their evidence, blocks, gap, limitations, and fits."""

import base64
import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from slipstick.confirmation.simulated import RANDOM
from slipstick.law_files import FORMATS, write_law
from slipstick.pictures.study import study_pictures, surfaces
from slipstick.report.study.fits import numbers, same_fit
from slipstick.report.study.limits import limits
from slipstick.report.study.page import study_page
from slipstick.report.study.simulation import lead, values_of
from slipstick.report.study.warnings import warnings
from slipstick.studies import StudyResult, StudySettings
from slipstick.studies.export import law_table
from slipstick.studies.figures import Figures
from slipstick.studies.result import (
    BeyondParameter,
    Candidate,
    Closure,
    Coefficient,
    CountedFindings,
    FindingResult,
    FurtherExperiment,
    Gap,
    Remainder,
    SimulationResult,
)
from slipstick.studies.words import sentence

Studied = Callable[[str], tuple[StudyResult, Figures]]
Read = Callable[[str], Any]
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;"
STUDY = {"id": "first-study", "recordings": "few", "recordings_digest": "c3d4", "settings": asdict(StudySettings()),
         "submitted": "2026-11-01T10:00:00Z", "ended": "2026-11-01T10:00:12Z"}
EXPERIMENT = FurtherExperiment("pressure_dependent_friction", 3, 238.76, 4.8000001, 16.0, False, 0.2136,
                               "output_torque", 12)


def page(result: StudyResult, figures: Figures, study: dict[str, Any] = STUDY) -> str:
    output = {"result": asdict(result), "figure_data": asdict(figures), "seconds": {"name": 2.0, "confirm": 9.0},
              "processor_seconds": {"name": 1.5, "confirm": 8.0}}
    return study_page(study, json.loads(json.dumps(output, allow_nan=False)))


def changed(result: StudyResult, **changes: Any) -> StudyResult:
    """The result with a changed first finding."""
    return replace(result, findings=[replace(result.findings[0], **changes)])


def said(result: StudyResult) -> str:
    return " ".join(f"{lead} {text}" for lead, text in warnings(result))


def test_the_page_reports_what_is_missing_and_its_evidence(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    one = result.findings[0]
    parsed = reading(page(result, figures))
    for phrase in ("Missing: slip-speed-dependent friction", "Finding: slip-speed-dependent friction",
                   f"rises by {one.nats:.0f} nats (",
                   "factors of ten) in the block “pressure, slip → torque in full contact”",
                   "alpha (1 + strength exp(", "Bo and Pavelescu", "decay speed", "90 % interval",
                   "supports the finding", "it changes the shifting time by", "Blocks of the model",
                   "gap closed (90 %)", "brake torque", "A name is a pair and a shape", "confirm 9 s", "c3d4",
                   result.settings_digest):
        assert phrase in parsed.text, phrase
    order = [attributes.get("id") for tag, attributes in parsed.elements if tag == "figure"]
    assert order == [f"picture-{name}" for name in ("overlay", "law", "evidence", "blocks", "gap", "signals")]


def box_of(text: str) -> str:
    return text[text.index("What to do"):text.index("All differences are measured")]


def files_of(parsed: Any) -> dict[str, bytes]:
    """File name -> content of what a page offers to download."""
    return {str(attributes["download"]): base64.b64decode(str(attributes["href"]).partition(";base64,")[2])
            for tag, attributes in parsed.elements if tag == "a" and "download" in attributes}


@pytest.mark.usefixtures("undrawn")
def test_the_page_begins_with_what_to_do(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    one, after = result.findings[0], result.after
    assert after is not None
    assert one.counted is not None
    text = reading(page(result, figures, {**STUDY, "bench": "heavy"})).text
    body = text[text.index("Slipstick · study of few"):]
    assert body.index("first-study") > body.index("Provenance")  # an identifier says nothing to a reader
    # The answer, how sure it is, what to do, and what was studied, before any section.
    order = [body.index(words) for words in (
        "Missing: slip-speed-dependent friction", f"Confidence {one.confidence:.2f}: of {one.counted.of} findings",
        "What to do", "Bench heavy · recordings few · 24 engagements · 1 November 2026", "Measured and simulated")]
    assert order == sorted(order)
    box = box_of(body)
    for each in one.confirmation.coefficients:
        assert f"{each.value:#.4g}" in box
        assert f"{each.lower:#.4g} to {each.upper:#.4g}" in box
    mean, error = after.parameters["friction_coefficient"], after.errors["friction_coefficient"]
    alpha = 1e5 * after.model["parameters"]["friction_coefficient"]
    nominal = alpha / (1 + mean)
    ends = [alpha + sign * 1.6449 * error * nominal for sign in (-1, 1)]
    assert f"{alpha:.4g} N m/bar" in box
    assert f"{ends[0]:.5g} to {ends[1]:.5g} N m/bar" in box
    assert f"{nominal:#.4g} N m/bar" in box
    speeds = figures.conditions["motor_speed"] or []
    assert f"motor speed {min(speeds):.4g} to {max(speeds):.4g} rad/s" in box
    assert "Next experiment:" in box


@pytest.mark.usefixtures("undrawn")
def test_laws_and_model_are_in_the_page_as_files(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    assert result.after is not None
    files = files_of(reading(page(result, figures)))
    law = law_table(result.findings[0])
    assert files == {**{f"{law.name}{suffix}": write_law(law, suffix) for suffix in FORMATS},
                     "extended_model.json": f"{json.dumps(result.after.model, indent=1)}\n".encode()}
    assert len(FORMATS) == 4


@pytest.mark.usefixtures("undrawn")
def test_the_same_quantity_has_the_same_number_everywhere(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    text, specs = reading(page(result, figures)).text, study_pictures(result, figures)
    headline = specs["law"]["title"]["text"]
    box = box_of(text)
    assert f"Measured: {headline}." in box
    assert f"Measured law: {headline}." in text
    # The formula follows the law: their changes, by one function, differ by little.
    fall = float(re.findall(r"falls by ([\d.]+) %", headline)[0])
    by_formula = float(re.findall(r"The equation gives ([\d.]+) % there", box)[0])
    assert by_formula == pytest.approx(fall, rel=0.15)
    before, after = re.findall(r"falls from ([\d.]+) to ([\d.]+) ms", specs["gap"]["title"]["text"])[0]
    assert f"goes from {before} to {after} ms" in box
    assert re.search(rf"shifting time \[ms\]\s*{before}\s*{after}", text)
    assert text.count(f"friction coefficient = {text.split('friction coefficient = ')[1][:30]}") == 2


def test_what_is_closed_by_chance_beyond_the_gap_is_all_of_it(studied: Studied) -> None:
    result, _ = studied("friction")
    assert result.gap is not None
    time = replace(result.gap.closures["shifting_time"], rms_before=24e-3, rms_after=7.0e-3, rms_expected=7.42e-3,
                   closure=1.01, lower=0.97, upper=1.06)
    gap = replace(result.gap, closures={**result.gap.closures, "shifting_time": time})
    said = lead(replace(result, gap=gap), StudySettings())
    assert "goes from 24.0 to 7.00 ms" in said
    assert "alone leave 7.42 ± 1.1 ms. That closes 100 % (97 to 106) of the gap." in said


@pytest.mark.usefixtures("undrawn")
def test_parameters_at_a_bound_and_undetermined_ones_are_marked(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    assert result.after is not None
    for fit in (result.before, result.after):
        assert fit is not None
        assert set(fit.errors) == set(fit.parameters)
        assert set(fit.at_bound) == {name for name, (prior, _) in RANDOM.items()
                                     if abs(fit.parameters[name]) > 0.99 * 3 * prior}
    marked = replace(result, after=replace(result.after, at_bound=["ramp_share"], undetermined=["piston_return"]))
    text = re.sub(r"\s+", " ", reading(page(marked, figures)).text)
    change, other = (re.sub("-", "−", f"{100 * result.after.parameters[name]:+.2f} %")
                     for name in ("ramp_share", "piston_return"))
    assert f"{change} (at a bound)" in text
    assert f"{other} (not determined)" in text
    values = {value.name: value for value in values_of(marked.after, 0.9)} if marked.after else {}
    assert (values["ramp share"].interval, values["ramp share"].remark) == ("", "at a bound")
    assert (values["piston return"].interval, values["piston return"].remark) == ("", "not determined")
    assert values["current delay"].interval


@pytest.mark.usefixtures("undrawn")
def test_a_service_is_linked_and_sections_are_listed(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    served = {**STUDY, "links": {"self": "/v1/studies/first-study"}}
    linked = reading(page(result, figures, served)).elements
    # The page has the address /v1/studies/first-study/report.
    assert next(attributes["href"] for tag, attributes in linked if tag == "a") == "../../../"
    alone = reading(page(result, figures))
    assert "../../../" not in [attributes.get("href") for _, attributes in alone.elements]
    sections = [f"#{attributes['id']}" for tag, attributes in alone.elements if tag == "section"]
    listed = [attributes["href"] for tag, attributes in alone.elements if tag == "a" and "download" not in attributes]
    assert listed == [place for place in sections if place != "#what-to-do"]


@pytest.mark.usefixtures("undrawn")
def test_the_box_decides_where_nothing_or_something_unknown_is_missing(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    parsed = reading(page(result, figures))
    assert "Keep the model: add nothing to it." in box_of(parsed.text)
    assert list(files_of(parsed)) == ["refitted_model.json"]
    block = result.blocks[0]
    left = replace(result, kind="unlisted", blocks=[replace(block, unexplained=True, outlying=[5]), *result.blocks[1:]])
    box = box_of(reading(page(left, figures)).text)
    assert f"Do not rely on its predictions of “{block.signals}”." in box
    assert "Look first at the signals of 1 engagement: 5." in box
    assert "Keep the model" not in box
    assert "something is missing that no effect and no law explains" in box
    torque = reading(page(*studied("torque")))
    box = box_of(torque.text)
    assert "record pressure, input speed and output speed as well" in box
    assert "something is missing whose law is not measured." in box
    assert "What may be missing: slip-speed-dependent friction" in box
    assert "Where it holds" not in box
    assert files_of(torque) == {}


@pytest.mark.usefixtures("undrawn")
def test_words_are_explained_where_they_are_used(studied: Studied, reading: Read) -> None:
    friction, nothing = (reading(page(*studied(name))).text for name in ("friction", "nothing"))
    assert "Nats: natural logarithm" in friction
    assert "Control: a wrong effect" in friction
    assert "Control:" not in nothing


@pytest.mark.usefixtures("undrawn")
def test_a_null_answer_is_a_good_answer(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    text = reading(page(result, figures)).text
    assert result.kind == "none"
    assert "Nothing is missing that these recordings could show" in text
    assert "In all 6 blocks of the model, 24 engagements leave no more than noise" in text
    assert "The model of the bench describes these recordings" in text
    for phrase in ("Finding", "Gap closed", "with the findings", "same fit"):
        assert phrase not in text
    assert warnings(result) == []


@pytest.mark.usefixtures("undrawn")
def test_a_value_that_is_not_what_the_bench_states_is_to_be_corrected(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    stated = sentence([], (), beyond=[BeyondParameter("input_inertia", 0.349, 0.01)])
    assert stated == ("Nothing is missing that these recordings could show. The inertia of the input shaft is 34.9 % "
                      "larger than the bench states")
    off = replace(result, beyond=[BeyondParameter("input_inertia", 0.349, 0.01)], sentence=stated)
    text = reading(page(off, figures)).text
    assert stated in text
    inertia = next(value for value in values_of(off.after, 0.9) if value.name == "input inertia")
    assert f"Correct the bench: input inertia {inertia.text}" in text
    assert f"instead of {inertia.nominal}" in text
    assert "The model of the bench, once corrected, describes these recordings" in text


@pytest.mark.usefixtures("undrawn")
def test_warnings_come_before_the_findings(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    worse = replace(result, set_aside=[3, 17], blocks=[
        replace(block, unexplained=block.name == "valve", chi_square=1.75) for block in result.blocks])
    text = reading(page(worse, replace(figures, aside={}))).text  # as of an earlier version
    assert "Set aside: engagements 3 and 17, numbered from 0." in text
    assert "Unexplained: “current → pressure”. Reduced chi-square is 1.75" in text
    assert "something that no law explains" in text
    assert text.index("Set aside") < text.index("Finding: slip-speed-dependent friction")
    body = text[text.index("Slipstick ·"):]
    assert "Mind the warnings: Set aside: engagements 3 and 17, Unexplained" in body  # a single comma
    assert body.index("Mind the warnings: Set aside") < body.index("Unexplained: “current")


@pytest.mark.usefixtures("undrawn")
def test_engagements_that_stand_out_in_a_block_are_named(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    load = next(block.signals for block in result.blocks if block.name == "load")
    worse = replace(result, blocks=[replace(block, outlying=[7, 2] if block.name == "load" else [])
                                    for block in result.blocks])
    assert f"Far worse than the others: engagements 7 and 2 in “{load}”, numbered from 0, and yet" in reading(
        page(worse, figures)).text
    assert "Far worse" not in reading(page(result, figures)).text
    nothing, figures = studied("nothing")
    odd = replace(nothing, kind="unlisted", blocks=[replace(block, outlying=[7]) for block in nothing.blocks])
    assert "leave no more than noise" not in reading(page(odd, figures)).text


@pytest.mark.usefixtures("undrawn")
def test_engagements_that_are_set_aside_are_described(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    aside = {name: [199.0 if name == "motor_speed" else 2.0] for name in figures.conditions}
    html = page(replace(result, set_aside=[3]), replace(figures, aside=aside))
    assert "Set aside: engagement 3 (profile 2, motor 199 rad/s, 2 kg m², brake 2 N m)," in reading(html).text


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("closure", "said"), [(0.97, True), (None, False), (-0.2, False)])
def test_what_the_scatter_hides_in_the_shifting_time_is_said_of_all_signals(studied: Studied, reading: Read,
                                                                            closure: float | None, said: bool) -> None:
    result, figures = studied("friction")
    assert result.gap is not None
    one = result.gap.closures["within_engagements"]
    closures = {**result.gap.closures, "shifting_time": replace(result.gap.closures["shifting_time"], closure=None),
                "within_engagements": replace(one, closure=closure, lower=0.9, upper=1.0, rms_before=1.17,
                                              rms_after=0.85)}
    text = reading(page(replace(result, gap=replace(result.gap, closures=closures)), figures)).text
    assert ("the error of all signals goes from 1.17 to 0.850 standard deviations of the noise, which closes "
            "97 % (90 to 100) of that gap" in text) == said
    del closures["within_engagements"]  # as of an earlier version
    assert "Beside the scatter" not in reading(page(replace(result, gap=replace(
        result.gap, closures=closures, control=None)), figures)).text


def test_tables_and_pictures_of_the_gap_agree(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    assert result.gap is not None
    time = replace(result.gap.closures["shifting_time"], closure=-0.3, lower=-0.45, upper=-0.05)
    worse = replace(result, gap=replace(result.gap, closures={**result.gap.closures, "shifting_time": time}))
    assert "−30 % (−45 to −5): the error grows" in reading(page(worse, figures)).text
    drawn = [row for view in study_pictures(worse, figures)["gap"]["vconcat"][1:] for row in view["data"]["values"]]
    row = next(row for row in drawn if row["channel"] == "shifting time" and not row["series"].startswith("control"))
    assert (row["lower"], row["closure"], row["upper"]) == (-45, -30, -5)


@pytest.mark.usefixtures("undrawn")
def test_a_finding_without_an_effect_on_shifting_times_has_no_smaller_gap_in_them(studied: Studied,
                                                                                reading: Read) -> None:
    result, figures = studied("friction")
    assert result.findings[0].worth is not None
    assert "The gap is smaller" in reading(page(result, figures)).text
    unchanged = replace(result.findings[0].worth, shifting_time=0.0, largest=0.0)
    text = reading(page(changed(result, worth=unchanged), figures)).text
    assert "it does not change the shifting time, with all other parameters as they are. In the signals" in text
    assert "The gap is smaller" not in text


@pytest.mark.usefixtures("undrawn")
def test_what_the_simulation_does_not_confirm_is_a_warning(studied: Studied) -> None:
    result, figures = studied("friction")
    confirmation = result.findings[0].confirmation
    assert "Not confirmed" not in said(result)
    unconfirmed = changed(result, confirmation=replace(confirmation, agrees=False, coefficients=[]), worth=None)
    assert "Not confirmed: the simulation of the whole bench does not support slip-speed-dependent friction" in said(
        unconfirmed)
    html = page(replace(unconfirmed, gap=None), figures)
    assert "does not support the finding, so that its coefficients" in html
    assert "supports none of the findings of the blocks" in html
    nothing = replace(confirmation, simulated="no", coefficients=[], agrees=None)
    alone = changed(result, confirmation=nothing, worth=None)
    assert "is that of its blocks" in said(alone)
    bound = [replace(one, at_bound=True) for one in confirmation.coefficients]
    assert "At a bound: strength and decay speed of slip-speed-dependent friction" in said(
        changed(result, confirmation=replace(confirmation, coefficients=bound)))
    noisy = replace(result, after=replace(result.after, chi_square={**result.after.chi_square, "pressure": 4.0}))
    assert "reduced chi-square is 4 in the pressure" in said(noisy)
    assert "Not converged" not in said(noisy)
    restless = replace(result, after=replace(result.after, converged=False))
    assert "Not converged: the fit of the simulation" in said(restless)


@pytest.mark.parametrize(("channel", "words"), [("shifting_time", "in the shifting time"),
                                                ("within_engagements", "within engagements")])
@pytest.mark.parametrize(("share", "doubt"), [(0.6, True), (0.1, False), (-4.0, False)])
def test_a_control_that_closes_as_much_casts_doubt(studied: Studied, share: float, doubt: bool, channel: str,
                                                   words: str) -> None:
    result, _ = studied("friction")
    gap = result.gap
    assert gap is not None
    assert gap.control is not None

    def closed(closure: float) -> dict[str, Closure]:
        return {name: replace(one, closure=closure if name == channel else None) for name, one in gap.closures.items()}

    gap = replace(gap, closures=closed(0.9), control=replace(gap.control, closures=closed(share)))
    assert (f"closes 60 % of the gap {words}, the findings 90 %" in said(replace(result, gap=gap))) == doubt


def test_a_larger_error_is_said_unless_it_is_less_than_the_scatter_leaves(studied: Studied) -> None:
    result, _ = studied("friction")
    assert result.gap is not None
    for after, worse in ((30.0, False), (41.0, True)):
        time = replace(result.gap.closures["shifting_time"], rms_before=20.0, rms_after=after, rms_expected=40.0)
        gap = replace(result.gap, closures={**result.gap.closures, "shifting_time": time}, control=None)
        assert ("predicted worse" in said(replace(result, gap=gap))) == worse


@pytest.mark.usefixtures("undrawn")
def test_a_tie_names_its_rivals_and_the_experiments_that_break_it(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    rival = Candidate("pressure_dependent_friction", "friction coefficient", "pressure", 90.0, 1.25)
    tie = changed(result, kind="tie", rivals=[rival], experiments=[EXPERIMENT])
    text = reading(page(tie, figures)).text
    assert "pressure-dependent friction (90 nats, behind by 1.2 standard errors)" in text
    assert "do not tell slip-speed-dependent friction from pressure-dependent friction." in text
    assert "Do not add yet: slip-speed-dependent friction: friction coefficient = " in text
    assert "Record first what tells it apart from pressure-dependent friction." in text
    assert ("Next experiment: profile 3, motor 239 rad/s, 4.8 kg m², brake 16 N m: 12 runs tell slip-speed-dependent "
            "friction from pressure-dependent friction, mostly by the output torque.") in text
    same = changed(tie, rivals=[])
    assert "Same quantity and dependence: pressure-dependent friction would" in reading(page(same, figures)).text
    assert "from another effect of the same quantity" in said(changed(same, experiments=[]))
    assert "To tell slip-speed-dependent friction from pressure-dependent friction, run:" in text
    assert re.sub(r"\s", "", "3 238.8 4.8 16 no 0.21 output torque 12") in re.sub(r"\s", "", text)
    hopeless = replace(tie.findings[0], experiments=[replace(EXPERIMENT, repetitions=None)])
    text = reading(page(replace(tie, findings=[hopeless]), figures)).text
    assert "No experiment near the recorded conditions would tell" in text
    assert "more than 1000" in text


@pytest.mark.usefixtures("undrawn")
def test_a_finding_that_few_engagements_show_says_why_it_is_named(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    why = "Few engagements show it: it is named because it explains nearly all that is missing there."
    assert why in reading(page(changed(result, errors=2.9), figures)).text
    assert why not in reading(page(changed(result, errors=4.1), figures)).text


@pytest.mark.usefixtures("undrawn")
def test_confidence_has_its_counts(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    counted = CountedFindings(0.9, 1.0, 41, 45)
    text = reading(page(changed(result, confidence=0.934, counted=counted), figures)).text
    assert "Confidence: 0.93. 41 of 45 findings with a confidence of 0.9 to 1 were right" in text
    assert "is an average over these benches: yours may differ" in text


@pytest.mark.usefixtures("undrawn")
def test_coefficients_have_readable_units_and_no_interval_at_a_bound(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    confirmation = replace(result.findings[0].confirmation, coefficients=[
        Coefficient("wear", "m", 7.1e-5, 6.9e-5, 7.3e-5, False), Coefficient("lag", "s", 0.02, 0.0, 0.1, True)])
    text = reading(page(changed(result, confirmation=confirmation), figures)).text
    for phrase in ("0.07100 mm", "0.06900 to 0.07300 mm", "20.00 ms", "none: at a bound of the search"):
        assert phrase in text
    assert "Equation:" not in text  # these are no coefficients of the effect


@pytest.mark.usefixtures("undrawn")
def test_the_equation_has_the_coefficients_and_the_refitted_parameter(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    assert result.after is not None
    strength, decay = (f"{each.value:.4g}" for each in result.findings[0].confirmation.coefficients)
    alpha = f"{1e5 * result.after.model['parameters']['friction_coefficient']:.4g}"
    assert (f"Equation: friction coefficient = alpha (1 + {strength} exp(-|plate slip| / ({decay} rad/s))), where "
            f"alpha = {alpha} N m/bar in the extended model.") in reading(page(result, figures)).text


def unlisted(one: FindingResult) -> FindingResult:
    assert one.law is not None
    factor = replace(one.confirmation.coefficients[0], name="factor", value=1.01, lower=0.98, upper=1.04)
    return replace(one, kind="unlisted", effect=None, title="Friction coefficient that depends on the slip",
                   confidence=None, counted=None, law=replace(one.law, formula=None),
                   confirmation=replace(one.confirmation, simulated="measured law", coefficients=[factor]))


@pytest.mark.usefixtures("undrawn")
def test_an_unlisted_finding_has_its_law_and_its_factor(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    result = replace(result, kind="unlisted", findings=[unlisted(result.findings[0])])
    text = reading(page(result, figures)).text
    assert "no effect of this quantity and dependence whose law has this shape" in text
    assert "with the measured law, supports the finding" in text
    assert "multiple of the measured law" in text
    assert "Confidence:" not in text
    assert "Formula:" not in text


@pytest.mark.usefixtures("undrawn")
def test_what_a_finding_may_leave_is_a_warning_and_no_finding(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    left = Remainder("viscosity_drift", "Drifting <film>", "film torque", "run order", ["clutch"], 38.0, 0.21,
                     CountedFindings(0.0, 0.4, 9, 44))
    text = reading(page(replace(result, remainders=[left]), figures)).text
    assert "Left over: drifting <film>? Beside the findings it would explain 38 nats in" in text
    assert "Only 9 of 44 such findings were right on simulated benches" in text
    assert "left over: drifting <film>?" in text
    assert "Finding: drifting" not in text
    assert "Left over" not in reading(page(result, figures)).text


@pytest.mark.usefixtures("undrawn")
def test_the_next_best_explanation_is_named(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    second = Candidate(None, "load torque", "time", 48.0, 6.5)
    text = reading(page(changed(result, rivals=[], next_best=second), figures)).text
    assert ("no other pair of quantity and dependence is close. The next best is load torque over time (48 nats, "
            "behind by 6.5 standard errors)") in text


@pytest.mark.usefixtures("undrawn")
def test_something_without_a_law_is_not_nothing(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    left = replace(result, kind="unlisted", blocks=[replace(one, unexplained=True) for one in result.blocks[:1]])
    text = reading(page(left, figures)).text
    assert "The block is known, but not the law" in text
    assert "describes these recordings" not in text


def test_a_run_order_that_follows_a_condition_is_reported(studied: Studied) -> None:
    conditions = dict(studied("nothing")[1].conditions)
    assert limits(conditions)[0][0] == "No condition follows the run order:"
    speeds = conditions["motor_speed"] or []
    order = sorted(range(24), key=lambda index: speeds[index])
    conditions["run_order"] = [float(order.index(index)) for index in range(24)]
    assert "the run order follows motor speed (correlation 0.97)" in limits(conditions)[0][1]
    assert limits({**conditions, "run_order": None})[0][0] == "The recordings have no run order:"


def test_a_run_order_that_follows_a_condition_by_chance_is_not_reported() -> None:
    random = np.random.default_rng(1)
    speeds = np.repeat([100.0, 200.0, 300.0], 8).tolist()
    orders = [random.permutation(24).astype(float).tolist() for _ in range(100)]
    told = [limits({"run_order": order, "motor_speed": speeds})[0][0] for order in orders]
    assert sum(np.corrcoef(order, speeds)[0, 1] > 0.3 for order in orders) > 3
    assert told.count("The runs are not in random order:") <= 3


def test_nothing_in_the_data_becomes_markup(studied: Studied, reading: Read) -> None:
    result, figures = studied("friction")
    html = page(result, figures)
    assert html == page(result, figures)
    assert len(html) < 1_500_000
    assert re.search(r"Content-Security-Policy\" content=\"default-src 'none'", html)
    tame = reading(html)
    assert not any({"src", "action"} & attributes.keys() for _, attributes in tame.elements)
    assert all(address.startswith(("#", "data:")) for _, attributes in tame.elements
               if (address := attributes.get("href")) is not None)
    one = result.findings[0]
    coefficients = [replace(entry, name=HOSTILE, unit=HOSTILE) for entry in one.confirmation.coefficients]
    hostile = replace(
        changed(result, title=HOSTILE, quantity=HOSTILE, depends_on=HOSTILE,
                confirmation=replace(one.confirmation, coefficients=coefficients),
                rivals=[Candidate(None, HOSTILE, HOSTILE, 1.0, 1.0)],
                experiments=[replace(EXPERIMENT, rival=HOSTILE, signal=HOSTILE)]),
        sentence=HOSTILE, blocks=[replace(block, signals=HOSTILE, findings=[HOSTILE]) for block in result.blocks])
    parsed = reading(page(hostile, figures))
    assert parsed.count("img") == 0
    assert parsed.count("script") == tame.count("script") == 0
    assert parsed.text.count("<script>alert(1)</script>") > 15


@pytest.mark.usefixtures("undrawn")
def test_settings_are_listed_where_they_differ_from_the_default(studied: Studied, reading: Read) -> None:
    result, figures = studied("nothing")
    assert re.search(r"settings\s*default", reading(page(result, figures)).text)
    chosen = StudySettings.from_dict({"level": 0.95, "naming": {"nats": 20.0}})
    text = reading(page(result, figures, {**STUDY, "settings": asdict(chosen)})).text
    assert 'level 0.95, naming {"nats": 20.0}' in text
    assert "gains the 20 nats and 4 standard errors" in text


def test_where_no_block_was_tested_the_page_has_what_the_simulation_says(studied: Studied) -> None:
    torque = re.sub(r"<[^>]+>", " ", page(*studied("torque")))
    for part in ("What would explain it", "Slip-speed-dependent friction", "No block has signals at both of its ends",
                 "not tested: pressure not measured", "The answer is that of the simulation of the whole bench alone"):
        assert part in torque
    assert "Shifting times over the conditions" not in torque
    times = re.sub(r"<[^>]+>", " ", page(*studied("times")))
    for part in ("Shifting times over the conditions", "current profile", "Each engagement is one number",
                 "The parameters of the bench explain these recordings. No block was tested"):
        assert part in times
    assert "What decided" not in times


# The section on the same fit on both tables of a study: numbers in units, or who compares them.


BEFORE, AFTER = (SimulationResult({}, {}, {}, 0.0, True, {
    "parameters": {"pressure_bias": bar, "initial_position": 5e-4},
    "units": {"pressure_bias": "bar", "initial_position": "m"}}) for bar in (3.2, 1.6))
RESULT = StudyResult("effect", "", [], [], [], BEFORE, AFTER, Gap({}, [], [], None), 24, {}, "", "")


def test_the_numbers_of_both_fits_are_in_units(both_fits: dict[str, dict[str, Any]]) -> None:
    assert list(numbers(RESULT, both_fits)) == [
        ("log10 likelihood", "−389.00", "−269.00"),
        ("mean of pressure bias [bar]", "3.2", "1.6"),
        ("scatter of pressure bias [bar]", "0.16, 5 % of the mean", "0.08, 5 % of the mean"),
        ("mean of initial position [mm]", "0.5", "0.5"),
        ("scatter of initial position [mm]", "0.025, 5 % of the mean", "0.025, 5 % of the mean"),
        ("output noise [ms]", "12", "3")]
    both_fits["before"]["result"]["log10_likelihood"] = None
    assert next(numbers(RESULT, both_fits)) == ("log10 likelihood", "−∞", "−269.00")


@pytest.mark.parametrize("picture", ["<figure></figure>", ""])
def test_the_section_states_the_provenance_of_its_numbers(
        both_fits: dict[str, dict[str, Any]], reading: Callable[[str], Any], picture: str) -> None:
    parsed = reading(same_fit(RESULT, both_fits, picture))
    for phrase in ("The same fit on the tables of both models", "fit fit-before, table table-before, SHA-256 a1b2",
                   "fit fit-after, table table-after, SHA-256 c3d4"):
        assert phrase in parsed.text
    assert parsed.count("figure") == bool(picture)


def test_a_value_at_a_bound_of_the_search_is_marked(both_fits: dict[str, dict[str, Any]]) -> None:
    both_fits["after"]["result"]["remarks"] = [{"unknown": "output std", "at_bound": True}]
    *_, noise = numbers(RESULT, both_fits)
    assert noise == ("output noise [ms]", "12", "3 (at a bound of the search)")


def test_the_decades_of_both_fits_are_those_of_the_picture(both_fits: dict[str, dict[str, Any]]) -> None:
    assert "are 120.0 decades (factors of ten) more likely" in same_fit(RESULT, both_fits, "")
    drawn = surfaces.draw(RESULT, both_fits)
    assert drawn is not None
    assert "recordings 120.0 decades more likely" in drawn["title"]["text"]


def test_without_fits_or_an_added_effect_there_is_no_section(both_fits: dict[str, dict[str, Any]]) -> None:
    assert same_fit(RESULT, None, "") == ""
    assert same_fit(replace(RESULT, gap=None), both_fits, "") == ""
