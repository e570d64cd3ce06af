"""Studies, fits and calibrations as results: they say what they are, are saved and opened, drawn and tabulated."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick
from slipstick.bench.parameters import NAMES
from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.calibrate import CalibrationResult
from slipstick.interface.fit import Fit
from slipstick.interface.result import Result
from slipstick.interface.study import Study
from slipstick.recordings import Recordings
from slipstick.time_budget import TimeBudgetEnded
from tests.benches import COMPACT, HEAVY


@pytest.fixture(scope="module")
def few(few_recordings: Path) -> Recordings:
    return Recordings.open(few_recordings / "few.h5")


@pytest.fixture(scope="module")
def study(study_of_few: Study) -> Study:
    return study_of_few


@pytest.fixture(scope="module")
def fit(shelf: Path) -> Fit:
    table, measured = slipstick.Table.open(shelf / "nominal.h5"), Recordings.open(shelf / "measured.h5")
    return slipstick.fit(table, measured, ["initial_position"], progress=False, generations=3, name="measured")


@pytest.fixture(scope="module")
def calibration(few: Recordings) -> CalibrationResult:
    return slipstick.calibrate(HEAVY, few.take(np.arange(14)), progress=False)


def opened(result: Result, folder: Path) -> Result:
    return slipstick.open_result(result.save(folder / "new" / "result.json"))


def test_a_study_names_the_effect_and_draws_its_law(study: Study, tmp_path: Path) -> None:
    assert study.answer == "Missing: slip-speed-dependent friction"
    (finding,) = study.findings
    assert finding.effect == "stribeck_friction"
    assert (finding.quantity, finding.depends_on) == ("friction coefficient", "slip")
    strength, decay = finding.coefficients
    assert (strength.name, strength.unit, decay.unit) == ("strength", "1", "rad/s")
    law = finding.law
    assert law is not None
    assert law.x is not None
    assert (law.x_unit, law.unit, len(law.x)) == ("rad/s", "1", len(law.change))
    assert all(low <= value <= high for low, value, high in zip(law.band[0], law.change, law.band[1], strict=True))
    assert list(law.to_frame()) == ["slip [rad/s]", "change [1]", "lower [1]", "upper [1]", "formula [1]"]
    assert study.to_frame()["unit"].tolist() == ["1", "rad/s"]
    assert "friction" in law.plot().title
    assert list(study.extended.effects) == ["stribeck_friction"]
    assert finding.equation is not None
    assert finding.equation.startswith("friction coefficient = alpha (1 + 0.")
    assert [path.suffix for path in study.save_laws(tmp_path)] == [".csv", ".mat", ".mo", ".h"]
    with pytest.raises(InvalidValue, match=r"End the name in one of: \.csv, \.mat, \.mo, \.h"):
        law.save(tmp_path / "law.txt")
    assert study.report(tmp_path / "study.html").read_text().startswith("<!doctype html>")
    assert study.summary()[1].startswith("Held-out RMS error of the shifting time: ")


def test_results_are_opened_as_they_were_saved(study: Study, fit: Fit, calibration: CalibrationResult,
                                               tmp_path: Path) -> None:
    for result in (study, fit, calibration):
        again = opened(result, tmp_path)
        assert type(again) is type(result)
        assert json.dumps(again.to_dict()) == json.dumps(result.to_dict())
        assert again.plot().spec == result.plot().spec
        assert repr(again) == repr(result)


def test_results_of_the_service_are_opened_without_pictures(study: Study, fit: Fit, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    for result in (study, fit):
        content = result.to_dict()
        for name in ("figure_data", "settings", "submitted", "ended", "outside", "simulate"):
            content.pop(name, None)
        file.write_text(json.dumps(content))
        again = slipstick.open_result(file)
        assert type(again) is type(result)
        assert again.summary() == result.summary()


def test_a_notebook_shows_the_answer_and_the_main_picture(study: Study, fit: Fit,
                                                          calibration: CalibrationResult) -> None:
    for result in (study, fit, calibration):
        html = result._repr_html_()
        assert html.startswith("<p>")
        assert "<svg" in html
        bundle = result.plot()._repr_mimebundle_()
        assert set(bundle) == {"application/vnd.vegalite.v5+json", "image/svg+xml", "text/plain"}


@pytest.mark.parametrize(("suffix", "begin"), [(".svg", b"<svg"), (".png", b"\x89PNG"), (".html", b"<!doctype html>"),
                                                (".json", b"{")])
def test_a_picture_is_saved_by_its_suffix(calibration: CalibrationResult, tmp_path: Path, suffix: str,
                                          begin: bytes) -> None:
    assert calibration.plot().save(tmp_path / f"picture{suffix}").read_bytes().startswith(begin)


def test_a_fit_has_estimates_with_units_and_finds_the_scatter(fit: Fit) -> None:
    assert fit.inputs == ("initial_position",)
    assert [(entry.name, entry.unit) for entry in fit.unknowns[:3]] == [
        ("mean of initial_position", "1"), ("std of initial_position", "1"), ("output std", "s")]
    assert fit.mean.shape == fit.std.shape == (1,)
    assert fit.log10_likelihood is not None
    before = fit.output["result"]["before"]["log10_likelihood"]
    assert fit.log10_likelihood > before
    assert fit.physical[0]["unit"] == "m"
    assert fit.to_frame()["unit"].tolist()[:3] == ["1", "1", "s"]


def test_a_fit_of_a_bench_simulates(few: Recordings) -> None:
    direct = slipstick.fit(HEAVY, few, ["initial_position"], progress=False, generations=1, population=4,
                           intervals=False, refine=False)
    assert direct.request["simulate"]
    with pytest.raises(InvalidValue, match="A simulator has no uncertain inputs by default"):
        slipstick.fit(HEAVY, few, progress=False)
    with pytest.raises(InvalidValue, match="gear ratio of the bench"):
        slipstick.fit(COMPACT, few, ["initial_position"], progress=False)


def test_the_calibration_has_the_parameters_in_their_units(calibration: CalibrationResult) -> None:
    units = {entry.name: entry.unit for entry in calibration.parameters}
    assert units["initial_position"] == "m"
    values = dict(zip(NAMES, calibration.model.parameters, strict=True))
    for entry in calibration.parameters:
        assert entry.lower <= entry.value <= entry.upper
        assert values[entry.name] == entry.value
    assert calibration.text.startswith("Bench 'heavy'")


def test_a_budget_ends_a_study_with_what_it_has_and_is_a_time(few: Recordings) -> None:
    with pytest.raises(TimeBudgetEnded):
        slipstick.study(HEAVY, few, budget="1 us", progress=False)
    steps = list[str]()

    def slow(text: str, _: float | None) -> None:
        steps.append(text)
        if len(steps) == 4:
            raise KeyboardInterrupt  # as Ctrl-C does

    with pytest.raises(KeyboardInterrupt):
        slipstick.study(HEAVY, few, progress=slow)
    assert steps[0].startswith("step 1 of ")
    for budget in ("2 m", "soon", -1.0):
        with pytest.raises(InvalidValue, match="The time budget is"):
            slipstick.study(HEAVY, few, budget=budget, progress=False)


def test_what_is_no_result_is_refused(tmp_path: Path, study: Study) -> None:
    with pytest.raises(UnknownName, match=r"no\.json"):
        slipstick.open_result(tmp_path / "no.json")
    for content in ("{", "[]", '{"kind": "study"}', '{"kind": "cake"}', "{}"):
        file = tmp_path / "other.json"
        file.write_text(content)
        with pytest.raises(InvalidValue, match=r"other\.json|incomplete|not of a result"):
            slipstick.open_result(file)
    with pytest.raises(UnknownName, match="picture"):
        study.plot("cake")
    with pytest.raises(InvalidValue, match=r"End it in|ends in"):
        study.save(tmp_path / "study.h5")
    with pytest.raises(InvalidValue, match=r"End it in"):
        study.plot().save(tmp_path / "law.pdf")


def test_without_a_library_of_data_frames_the_remedy_is_said(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InvalidValue, match="Neither pandas nor polars"):
        study.to_frame()


def test_unknown_settings_are_refused(few: Recordings, shelf: Path) -> None:
    wrong: dict[str, Any] = {"levl": 0.9}
    with pytest.raises(UnknownName, match="levl"):
        slipstick.study(HEAVY, few, progress=False, **wrong)
    with pytest.raises(UnknownName, match="levl"):
        slipstick.fit(slipstick.Table.open(shelf / "nominal.h5"), few, progress=False, **wrong)
    assert np.isfinite(few.measured_time).all()
