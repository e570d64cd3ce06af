"""The commands simulate, calibrate and bench: recordings of a simulated bench, and what is printed."""

import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.naming import name
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.recordings.simulated import simulated_recordings
from slipstick.table import Table
from tests.benches import COMPACT, HEAVY, NOMINAL, TABLES
from tests.worker.test_your_bench import few_recordings
from worker.__main__ import main

STRIBECK = {"strength": 0.15, "decay_speed": 20.0}


def test_recordings_are_written_that_can_be_opened_and_are_the_same_again(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [tmp_path / "new" / f"{name}.h5" for name in ("one", "two", "three")]
    for file, seed in zip(files, ("1", "1", "2"), strict=True):
        assert main(["simulate", "--bench", str(TABLES / "compact.toml"), "--engagements", "100", "--seed", seed,
                     "--effect", "seal_friction", "--effect", "supply_droop=-0.5", "--out", str(file)]) == 0
    one, again, other = (Recordings.open(file) for file in files)
    assert one.digest == again.digest != other.digest
    assert len(one) == 100
    assert one.run_order is not None
    assert not np.array_equal(one.run_order, np.arange(100))
    np.testing.assert_array_equal(one.conditions.motor_speed[:10], one.conditions.motor_speed[90:])  # 90 conditions
    assert one.signals is not None
    assert one.signals.time[1] == pytest.approx(COMPACT.sample_time)
    assert f"python -m worker study {files[0]} --bench {TABLES / 'compact.toml'}" in capsys.readouterr().out


def test_scatter_noise_and_resolution_are_those_of_the_bench_and_of_the_options() -> None:
    conditions = HEAVY.conditions.take([100] * 200)
    exact = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0, noise=0)
    assert exact.signals is not None
    resolution = HEAVY.sensors["pressure"].resolution or 0.0
    assert np.ptp(exact.signals["pressure"], axis=0).max() <= resolution
    time = ensemble.shifting_times(NOMINAL, HEAVY.conditions.take([100]))[0][0, 0]
    assert exact.measured_time == pytest.approx(time, abs=1e-3)
    noisy = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0, noise=2)
    assert noisy.signals is not None
    for signal in SIGNAL_UNITS:
        std = (noisy.signals[signal] - exact.signals[signal]).std()
        assert std == pytest.approx(2 * (HEAVY.sensors[signal].noise or 0.0), rel=0.05)
    scattered = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0.02, noise=0)
    assert 10 * np.std(exact.measured_time) < np.std(scattered.measured_time) < 0.2 * time


def test_what_cannot_be_simulated_is_refused(tmp_path: Path) -> None:
    deaf = replace(HEAVY, sensors={**HEAVY.sensors, "pressure": replace(HEAVY.sensors["pressure"], noise=None)})
    with pytest.raises(InvalidValue, match="states no noise of pressure"):
        simulated_recordings(deaf, NOMINAL, HEAVY.conditions)
    with pytest.raises(InvalidValue, match="do not lock"):
        simulated_recordings(HEAVY, NOMINAL, HEAVY.conditions, scatter=3.0)


@pytest.mark.parametrize(("options", "message"), [
    (["--effect", "stribek_friction"], "Did you mean 'stribeck_friction'?"),
    (["--effect", "stribeck_friction=strong"], "Write stribeck_friction, or stribeck_friction=MULTIPLE"),
    (["--effect", "stribeck_friction=99"], "Take it between"),
    (["--engagements", "0"], "0 engagements are too few"),
    (["--scatter", "-1"], "Give numbers of 0 or more"),
    (["--out", "recordings.csv"], "Give --out a path that ends in .h5")])
def test_invalid_options_are_refused(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str) -> None:
    assert main(["simulate", "--out", str(tmp_path / "new.h5"), *options]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_recordings_of_others_are_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "recordings.h5"
    shutil.copy(TABLES / "measured.h5", file)
    assert main(["simulate", "--engagements", "2", "--out", str(file)]) == 1
    assert "has no simulated recordings" in capsys.readouterr().err
    assert file.read_bytes() == (TABLES / "measured.h5").read_bytes()
    file.unlink()
    for _ in range(2):
        assert main(["simulate", "--engagements", "2", "--out", str(file)]) == 0


@pytest.mark.slow
def test_a_study_names_the_simulated_effect() -> None:
    model = Model(HEAVY.physics).with_effect("stribeck_friction", STRIBECK)
    found = name(HEAVY, simulated_recordings(HEAVY, model, HEAVY.conditions.take(range(0, 216, 6))))
    assert [one.pair for one in found.findings] == [("friction coefficient", "slip")]
    assert not name(HEAVY, simulated_recordings(HEAVY, NOMINAL, HEAVY.conditions.take(range(0, 216, 6)))).findings


# The command `calibrate`: what it tells to do next can be done.


def test_the_printed_command_builds_a_table_of_the_calibrated_model(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recordings, model, table = tmp_path / "few.h5", tmp_path / "my model.json", tmp_path / "table.h5"
    few_recordings(recordings)
    assert main(["calibrate", "--bench", str(TABLES / "compact.toml"), "--recordings", str(recordings),
                 "--out", str(model)]) == 0
    said = "Build a table of the calibrated model: "
    printed, = (line.removeprefix(said) for line in capsys.readouterr().out.splitlines() if line.startswith(said))
    assert shlex.split(printed)[:4] == ["python", "-m", "worker", "build"]
    assert main([*shlex.split(printed)[3:-1], str(table), "--axis", "pressure_bias=0.9:1.1:2"]) == 0
    assert Table.open(table).model.physics == COMPACT.physics


# `python -m worker bench`: the template, and what the check prints.


def check(path: Path, text: str, *options: str) -> int:
    path.write_text(text)
    return main(["bench", "check", str(path), *options])


def test_a_template_is_a_bench_and_never_replaces_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "new" / "mine.toml"
    assert main(["bench", "new", str(path)]) == 0
    assert Bench.open(path).name == "my_bench"
    path.write_text("mine")
    assert main(["bench", "new", str(path)]) == 1
    assert path.read_text() == "mine"
    assert "already exists" in capsys.readouterr().err


def test_a_folder_that_cannot_be_written_is_an_error_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "new", "/dev/null/bench.toml"]) == 1
    assert capsys.readouterr().err.startswith("error: ")


def test_a_sound_bench_is_described(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "check", str(TABLES / "compact.toml")]) == 0
    out = capsys.readouterr().out
    assert f"{len(COMPACT.conditions)} conditions: 90 locked, 0 never locked, 0 failed" in out
    assert "earliest 488.8 ms (condition 36), median 697.9 ms (condition 80), latest 1137.5 ms (condition 71)" in out
    assert "Nothing implausible" in out


@pytest.mark.parametrize(("name", "start"), [("some.svg", b"<svg"), ("some.png", b"\x89PNG"), (None, b"<svg")])
def test_the_median_engagement_is_drawn(tmp_path: Path, name: str | None, start: bytes) -> None:
    options = ("--picture",) if name is None else ("--picture", str(tmp_path / name))
    assert check(tmp_path / "mine.toml", (TABLES / "compact.toml").read_text(), *options) == 0
    content = (tmp_path / (name or "mine.svg")).read_bytes()
    assert content.startswith(start)
    for word in (b"Condition 80", b"fill", b"slip", b"stick", b"shifting time") if start == b"<svg" else ():
        assert word in content


def test_a_picture_has_a_known_form(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (TABLES / "compact.toml").read_text()
    assert check(tmp_path / "mine.toml", text, "--picture", "mine.pdf") == 1
    assert "'mine.pdf' is neither .svg nor .png" in capsys.readouterr().err


def test_findings_are_listed_and_only_a_useless_bench_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (TABLES / "compact.toml").read_text()
    assert check(tmp_path / "mine.toml", text.replace("[5, 15, 30]", "[5, 15, 3000]")) == 0
    out = capsys.readouterr().out
    for word in ("0 failed", "Implausible: 1", "1. conditions.brake_torque: the brake is stronger than the clutch",
                 "   Why it matters: ", "   What to do: "):
        assert word in out
    assert check(tmp_path / "mine.toml", text.replace('"1.1 bar"', '"110 bar"')) == 1
    out = capsys.readouterr().out
    assert "No engagement locks" in out
    assert "the pressure never exceeds pressure_bias" in out
