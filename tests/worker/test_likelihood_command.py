"""`likelihood`: options, units, recordings as HDF5 and CSV and of other machines, files, and what it refuses."""

import argparse
import csv
from pathlib import Path

import numpy as np
import pytest

import slipstick
from slipstick.black_box import BlackBoxDescription, Cases, Measurements, Quantity
from slipstick.black_box.description import Input
from slipstick.errors import SlipstickError
from slipstick.interface.likelihood import likelihood
from slipstick.recordings import Recordings
from slipstick.table import Axis, Grid
from worker import likelihood as command


def run(*words: object) -> int:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


@pytest.fixture
def given(shelf: Path) -> list[object]:
    return [shelf / "nominal.h5", shelf / "measured.h5", "--bench", shelf / "heavy.toml", "--mean", "1,1", "--std",
            "0.05,0.08", "--output-std", "20 ms"]


def test_it_prints_and_writes_what_the_function_returns(given: list[object], tmp_path: Path,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*given, "--out", tmp_path / "result.json") == 0
    expected = likelihood(given[0], Recordings.open(given[1]), [1, 1], [0.05, 0.08], 0.02, name="measured")
    printed = capsys.readouterr().out
    assert printed == f"{expected!r}\n\nWrote {tmp_path / 'result.json'}\n"
    assert printed.startswith(f"log10 likelihood {expected.log10_likelihood:.2f}".replace("-", "−"))
    assert slipstick.open_result(tmp_path / "result.json").to_dict() == expected.to_dict()
    assert run(*given, "--out", tmp_path / "result.csv") == 0
    with (tmp_path / "result.csv").open() as file:
        densities = [float(row["log10_density"]) for row in csv.DictReader(file)]
    assert densities == expected.log10_density.tolist()


def test_recordings_may_be_a_csv_file_of_the_bench(given: list[object], tmp_path: Path,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "one.csv"
    path.write_text("current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
                    "0,104.72,6,20,0.36\n")
    assert run(given[0], path, *given[2:]) == 0
    assert "1 measurement of the shifting time in “one”" in capsys.readouterr().out


def test_measurements_of_another_machine_need_no_bench(shelf: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    machine = BlackBoxDescription("Spring", (Input("stiffness", "N/m", 100.0, 0.5, 1.5),), (Quantity("load", "N"),),
                                  Quantity("travel", "mm"), "")
    cases = Cases(machine.columns, np.array([[1.0], [2.0]]))
    axis = Axis("stiffness", np.array([0.5, 1.5]), 100.0, "N/m")
    Grid((axis,), np.array([[3.0, 6.0], [1.0, 2.0]]), np.zeros((2, 2), np.uint8), cases, machine, "tests").save(
        tmp_path / "spring.h5")
    measured = Measurements(cases, np.array([2.1, 3.9]), machine.output)
    (tmp_path / "mine.h5").write_bytes(measured.to_bytes())
    (tmp_path / "mine.csv").write_text("load [N],travel [m]\n1,0.0021\n2,0.0039\n")
    for name in ("mine.h5", "mine.csv"):
        assert run(tmp_path / "spring.h5", tmp_path / name, "--mean", 1, "--std", 0.1, "--output-std", "50 um") == 0
    first, second = capsys.readouterr().out.split("log10 likelihood ")[1:]
    assert first == second
    expected = likelihood(tmp_path / "spring.h5", measured, 1, 0.1, 0.05, name="mine")
    assert f"log10 likelihood {first}" == f"{expected!r}\n"
    words = ("--mean", 1, "--std", 0.1, "--output-std", "50 um", "--bench", "heavy")
    with pytest.raises(SlipstickError, match="--bench is a clutch, and what is simulated is another machine, Spring"):
        run(tmp_path / "spring.h5", tmp_path / "mine.csv", *words)
    with pytest.raises(SlipstickError, match=r"The file holds no measurements of the output of a machine\. Give a CSV"):
        run(tmp_path / "spring.h5", shelf / "measured.h5", "--mean", 1, "--std", 0.1, "--output-std", "50 um")


@pytest.mark.parametrize(("words", "message"), [
    (["--mean", "1"], "`mean` has 1 entries, but the table has 2 axes"), (["--output-std", "0"], "The output std is 0"),
    (["--output-std", "20 V"], "--output-std is '20 V'"), (["--out", "result.h5"], r"ends in \.json or \.csv"),
    (["--mean", "1.45,1", "--outside", "error"], "outside the range of the table"),
    (["--bench", "missing.toml"], "missing"),
    (["--machine", "mine.py"], "--machine declares another machine, and the table is of a clutch"),
])
def test_wrong_options_are_refused_and_nothing_is_written(given: list[object], tmp_path: Path, words: list[str],
                                                          message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SlipstickError, match=message):
        run(*given, "--out", "result.json", *words)
    assert not list(tmp_path.iterdir())
