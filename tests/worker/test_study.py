"""The command `study`: its results as text, JSON, a report and a model, and the input that it refuses."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from slipstick.clutch.effects import CATALOGUE
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.study.comparison import compare
from slipstick.study.settings import StudySettings
from slipstick.table import Table
from tests.benches import HEAVY, NOMINAL
from worker.__main__ import main
from worker.study import study_output
from worker.study_text import study_text

SETTINGS = {"catalogue": ["stribeck_friction", "centrifugal_pressure"], "shortlist": 2, "significance": 0.99,
            "smallest": 0.0, "most_effects": 1}


@pytest.fixture
def settings(tmp_path: Path) -> Path:
    (tmp_path / "settings.json").write_text(json.dumps(SETTINGS))
    return tmp_path / "settings.json"


def test_a_study_identifies_the_missing_effect_and_writes_a_model_to_build(
        few_recordings: Path, settings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings, model, table = few_recordings / "few.h5", tmp_path / "new" / "model.json", tmp_path / "extended.h5"
    status = main(["study", str(recordings), "--settings", str(settings), "--out", str(tmp_path / "result.json"),
                   "--report", str(tmp_path / "report.html"), "--extended", str(model)])
    assert status == 0
    printed = capsys.readouterr()
    result = json.loads((tmp_path / "result.json").read_text())
    answer = result["result"]["answer"]
    assert answer["effects"] == ["stribeck_friction"]
    assert printed.out.startswith(answer["sentence"])
    for part in ("friction: strength", "90 % interval", "p ≤", "Centrifugal pressure head",
                 "Where model and recordings", "closed by control", "Limitations", f"--model {model}"):
        assert part in " ".join(printed.out.split())
    assert "candidate 2 of" in printed.err
    assert list(result["seconds"]) == ["fit", "screen", "candidates", "choose", "conclude"]
    assert (tmp_path / "report.html").read_text().startswith("<!doctype html>")

    build = ["build", "--model", str(model), "--conditions", str(recordings), "--out", str(table)]
    assert main([*build, "--axis", "pressure_bias=0.9:1.1:3"]) == 0
    assert Table.open(table).model == Model.from_spec(result["result"]["models"]["after"])
    assert list(Table.open(table).model.effects) == ["stribeck_friction"]


def test_a_study_of_shifting_times_only_states_it(
        few_recordings: Path, settings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings = Recordings.open(few_recordings / "few.h5")
    conditions = recordings.conditions
    columns = np.column_stack([conditions.current_profile, conditions.motor_speed, conditions.load_inertia,
                               conditions.brake_torque, recordings.measured_time])
    header = "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]"
    np.savetxt(tmp_path / "few.csv", columns, ["%d", "%.9g", "%g", "%g", "%.9g"], ",", header=header, comments="")
    assert main(["study", str(tmp_path / "few.csv"), "--settings", str(settings), "--out", str(tmp_path / "few.json"),
                 "--report", str(tmp_path / "few.html")]) == 0
    printed = capsys.readouterr().out
    assert "NaN" not in (tmp_path / "few.json").read_text()
    assert "shifting times only" in (tmp_path / "few.html").read_text()
    assert "With shifting times only" in printed
    assert "Where model" not in printed


def test_an_unexplained_residual_is_not_reported_as_nothing_missing(few_recordings: Path) -> None:
    times = replace(Recordings.open(few_recordings / "few.h5"), signals=None)
    sentences = {}
    for significance in (0.99, 0.001):
        settings = {**SETTINGS, "catalogue": ["falling_load_friction"], "significance": significance}
        answer = study_output(StudySettings.from_dict(settings), compare(HEAVY, times, 0.003))["result"]["answer"]
        assert answer["kind"] == "none"
        sentences[significance] = answer["sentence"]
    assert sentences[0.99].startswith("Something asks for an effect, and none that is known predicts")
    assert sentences[0.001] == "Nothing is missing that these recordings could show"


def test_a_tie_suggests_experiments(few_recordings: Path) -> None:
    times = replace(Recordings.open(few_recordings / "few.h5"), signals=None)
    output = study_output(StudySettings.from_dict(SETTINGS), compare(HEAVY, times, 0.003))
    assert output["result"]["further"] == []
    tie = {"effects": ["stribeck_friction", "centrifugal_pressure"], "experiments": [
        {"current_profile": 3, "motor_speed": 238.76, "load_inertia": 4.8, "brake_torque": 16.0, "recorded": False,
         "apart": 0.2136, "signal": "shifting_time", "repetitions": None},
        {"current_profile": 0, "motor_speed": 104.72, "load_inertia": 6.0, "brake_torque": 20.0, "recorded": True,
         "apart": 0.1, "signal": "shifting_time", "repetitions": 12}]}
    output["result"]["further"] = [tie]
    text = study_text(output["result"], output["figure_data"], 0.9)
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "To distinguish slip-speed-dependent friction and centrifugal pressure head, run:" in text
    assert "3 238.8 4.8 16 no 0.21 shifting time more than 1000" in lines
    assert "0 104.7 6 20 yes 0.1 shifting time 12" in lines


@pytest.mark.parametrize(("content", "message"), [
    ('{"shortlist": 0}', "Give at least 1"),
    ('{"catalogue": ["stribek_friction"]}', "Did you mean 'stribeck_friction'?"),
    ('{"short_list": 3}', "Did you mean 'shortlist'?"),
    ('{"scatter": ["current_gain"], "parameters": ["pressure_bias"]}', "Known: pressure_bias"),
    ('{"level": "high"}', "Cannot read study settings"),
    ("[1]", "Cannot read study settings"),
    ("{", "Cannot read study settings")])
def test_invalid_settings_are_refused(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, message: str) -> None:
    (tmp_path / "settings.json").write_text(content)
    assert main(["study", str(few_recordings / "few.h5"), "--settings", str(tmp_path / "settings.json")]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("options", [("--out", "measured.h5"), ("--report", "report.json"), ("--extended", "model")])
def test_results_do_not_replace_other_files(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, str]) -> None:
    option, name = options
    assert main(["study", str(few_recordings / "few.h5"), option, str(tmp_path / name)]) == 1
    assert "Give a path that ends in" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_signal_without_noise_is_refused(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(few_recordings / "few.h5", tmp_path / "constant.h5")
    with h5py.File(tmp_path / "constant.h5", "r+") as file:
        file["signals/pressure"][...] = 1.0
    assert main(["study", str(tmp_path / "constant.h5")]) == 1
    assert "pressure shows no noise" in capsys.readouterr().err


def test_a_drifting_model_is_built_only_for_conditions_with_a_run_order(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effect = next(effect for effect in CATALOGUE if effect.uses_run_order).on(HEAVY.scales)
    coefficients = {coefficient.name: coefficient.typical for coefficient in effect.coefficients}
    (tmp_path / "model.json").write_text(json.dumps(NOMINAL.with_effect(effect.name, coefficients).spec()))
    build = ["build", "--model", str(tmp_path / "model.json"), "--axis", "pressure_bias=0.9:1.1:2",
             "--out", str(tmp_path / "table.h5")]
    assert main(build) == 1
    assert "recordings with a run order" in capsys.readouterr().err
    assert main([*build, "--conditions", str(few_recordings / "few.h5")]) == 0
    assert Table.open(tmp_path / "table.h5").model.uses_run_order
