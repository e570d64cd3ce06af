"""The command `study`: its results as text, JSON, a report, laws and a model, and the input that it refuses."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from slipstick.clutch.effects import CATALOGUE
from slipstick.clutch.model import Model
from slipstick.interface import study
from slipstick.recordings import Recordings
from slipstick.studies import StudyResult, StudySettings
from slipstick.studies.figures import Figures
from slipstick.studies.record import from_dict
from slipstick.studies.result import BlockResult, SimulationResult
from slipstick.table import Table
from tests.benches import HEAVY, NOMINAL
from worker.__main__ import main
from worker.study_text import study_text


@pytest.mark.slow
def test_a_study_names_what_is_missing_and_writes_a_model_to_build(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings, model, table = few_recordings / "few.h5", tmp_path / "new" / "model.json", tmp_path / "extended.h5"
    (tmp_path / "settings.json").write_text('{"level": 0.95}')
    status = main(["study", str(recordings), "--settings", str(tmp_path / "settings.json"),
                   "--out", str(tmp_path / "result.json"), "--report", str(tmp_path / "report.html"),
                   "--extended", str(model), "--laws", str(tmp_path / "laws")])
    assert status == 0
    printed = capsys.readouterr()
    stored = json.loads((tmp_path / "result.json").read_text())
    result = from_dict(StudyResult, stored["result"])
    assert result.effects == ["stribeck_friction"]
    assert printed.out.startswith(result.sentence)
    for part in ("decay speed", "95 % interval", "standard errors over engagements", "Blocks of the model",
                 "by the control", "Limitations", f"--model {model}"):
        assert part in " ".join(printed.out.split())
    assert "Fitting the simulation of the whole bench without and with the findings" in printed.err
    for name in ("seconds", "processor_seconds"):
        assert list(stored[name]) == ["name", "confirm"]
    assert (tmp_path / "report.html").read_text().startswith("<!doctype html>")

    law = result.findings[0].law
    assert law is not None
    assert sorted(path.name for path in (tmp_path / "laws").iterdir()) == [
        f"1_friction_coefficient_over_slip{suffix}" for suffix in (".csv", ".h", ".mat", ".mo")]
    rows = np.loadtxt(tmp_path / "laws" / "1_friction_coefficient_over_slip.csv", delimiter=",", skiprows=1)
    assert rows[:, 1].tolist() == law.change
    mat = loadmat(tmp_path / "laws" / "1_friction_coefficient_over_slip.mat")
    assert mat["friction_coefficient_relative_change"].ravel().tolist() == law.change

    build = ["build", "--model", str(model), "--conditions", str(recordings), "--out", str(table)]
    assert main([*build, "--axis", "pressure_bias=0.9:1.1:3"]) == 0
    assert Table.open(table).model == Model.from_spec(result.after.model)
    assert list(Table.open(table).model.effects) == ["stribeck_friction"]


def test_the_text_has_warnings_before_what_was_achieved() -> None:
    fit = SimulationResult({"pressure_bias": -0.02}, {"pressure_bias": 0.05}, {"pressure": 1.0}, 0.0, True,
                           {"parameters": {}})
    block = BlockResult("valve", "current → pressure", 1.8, [], True)
    result = StudyResult("unlisted", "Something is missing", [], [block], [3], fit, fit, None, 24, {}, "", "")
    lines = study_text(result, Figures({"run_order": None}, [], {}, []), StudySettings()).splitlines()
    assert lines[0] == "Warnings"
    assert lines[1].startswith("- Set aside: engagement 3, numbered from 0.")
    assert 1 < lines.index("Something is missing.") < lines.index("Blocks of the model")
    assert "current → pressure                1.80  something that no law explains" in lines
    assert "pressure bias           −2.00 %   5.00 %" in lines


def test_shifting_times_alone_are_studied(
        few_recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings = Recordings.open(few_recordings / "few.h5")
    conditions = recordings.conditions
    columns = np.column_stack([conditions.current_profile, conditions.motor_speed, conditions.load_inertia,
                               conditions.brake_torque, recordings.measured_time])
    header = "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]"
    np.savetxt(tmp_path / "few.csv", columns, ["%d", "%.9g", "%g", "%g", "%.9g"], ",", header=header, comments="")
    assert main(["study", str(tmp_path / "few.csv"), "--out", str(tmp_path / "few.json"),
                 "--report", str(tmp_path / "few.html")]) == 0
    result = from_dict(StudyResult, json.loads((tmp_path / "few.json").read_text())["result"])
    assert [one.condition for one in result.times] == ["motor_speed", "current_profile"]
    printed = capsys.readouterr().out
    assert "No block was tested" in printed
    assert "Shifting times over the conditions" in printed
    assert "Shifting times over the conditions" in (tmp_path / "few.html").read_text()


def test_a_study_ends_with_its_time_budget_at_the_next_step(
        few_recordings: Path, watched_study_of_few: tuple[Any, list[dict[str, Any]]], tmp_path: Path,
        capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    few, clock = few_recordings / "few.h5", SimpleNamespace(now=0.0)
    monkeypatch.setattr(study, "time", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(study, "examine", lambda *arguments: watched_study_of_few[1][-1])

    def conclude(*arguments: Any) -> Any:
        clock.now = 61.0
        return whole(*arguments)

    whole = study.conclude
    monkeypatch.setattr(study, "conclude", conclude)
    assert main(["study", str(few), "--time-budget", "60", "--out", str(tmp_path / "few.json"),
                 "--report", str(tmp_path / "few.html"), "--extended", str(tmp_path / "model.json")]) == 1
    printed = capsys.readouterr()
    assert printed.out.startswith("Warnings\n- Partial result: the time budget of 60 s ended before the job.")
    assert "ended before there was an extended model, which was not written" in printed.err
    result = from_dict(StudyResult, json.loads((tmp_path / "few.json").read_text())["result"])
    assert result.partial
    assert result.effects == ["stribeck_friction"]
    assert "Partial result:" in (tmp_path / "few.html").read_text()
    assert not (tmp_path / "model.json").exists()


def test_a_study_without_time_says_so(few_recordings: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(few_recordings / "few.h5"), "--time-budget", "0"]) == 1
    assert "The time budget of 0 s ended before a block of the model was examined" in capsys.readouterr().err


@pytest.mark.parametrize(("content", "message"), [
    ('{"levels": 0.9}', "Did you mean 'level'?"), ('{"level": "high"}', "Cannot read study settings"),
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


def test_laws_are_written_into_a_folder_only(few_recordings: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings = few_recordings / "few.h5"
    assert main(["study", str(recordings), "--laws", str(recordings)]) == 1
    assert "Give --laws the name of a folder" in capsys.readouterr().err


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
