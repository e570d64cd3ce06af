"""`propagate`: options, units, files, and what it refuses; the numbers are those of `slipstick.propagate`."""

import argparse
import csv
import json
from pathlib import Path

import pytest

import slipstick
from slipstick.errors import SlipstickError
from worker import propagate as command


def run(*words: object) -> int:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


@pytest.fixture
def given(shelf: Path) -> list[object]:
    return [shelf / "nominal.h5", "--mean", "1,1.1", "--std", "0.05,0.08"]


def test_it_prints_and_writes_what_the_function_returns(given: list[object], tmp_path: Path,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    files = [tmp_path / name for name in ("result.json", "page.html", "picture.svg")]
    assert run(*given, "--family", "gamma,normal", "--output-std", "5 ms", "--condition", 215, 0, "--tolerance", "2 ms",
               "--out", files[0], "--report", files[1], "--picture", files[2]) == 0
    expected = slipstick.propagate(given[0], [1, 1.1], [0.05, 0.08], families=["gamma", "normal"], output_std=0.005,
                                   conditions=[215, 0], tolerance=0.002)
    printed = capsys.readouterr().out
    assert printed == f"{expected.text}\n\nWrote {files[2]}, {files[1]}, {files[0]}\n"
    for value in (*expected.mean, *expected.quantiles.ravel()):
        assert f" {1e3 * value:.1f} " in printed
    for value in expected.std:
        assert f" {1e3 * value:#.3g} " in printed  # as the sentence above the table has it
    assert slipstick.open_result(files[0]).to_dict() == expected.to_dict()
    assert files[1].read_text().startswith("<!doctype html>")
    assert files[2].read_text().startswith("<svg")


def test_csv_has_a_row_for_each_condition(given: list[object], tmp_path: Path) -> None:
    assert run(*given, "--out", tmp_path / "result.csv") == 0
    expected = slipstick.propagate(given[0], [1, 1.1], [0.05, 0.08])
    with (tmp_path / "result.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["mean [s]"]) for row in rows] == expected.mean.tolist()
    assert [float(row["total of initial_position"]) for row in rows] == expected.total[:, 1].tolist()
    assert {row["reason"] for row in rows} == {""}


def test_a_plain_number_is_in_the_unit_of_the_output(given: list[object], tmp_path: Path) -> None:
    requests = []
    for number, text in enumerate(("0.005", "5 ms", "0.005 s")):
        path = tmp_path / f"{number}.json"
        run(*given, "--condition", 0, "--output-std", text, "--out", path)
        requests.append(json.loads(path.read_text())["request"])
    assert requests[0]["output_std"] == 0.005
    assert requests[0] == requests[1] == requests[2]


@pytest.mark.parametrize(("words", "message"), [
    (["--mean", "1,x"], "--mean is '1,x', which is no list of numbers. Give a number for each axis"),
    (["--std", "0.1"], r"The std has shape \(1,\)"), (["--output-std", "5 V"], "--output-std is '5 V': "),
    (["--output-std", "5ms"], "'5ms' is not a number, a space and its unit. Give a number in s"),
    (["--tolerance", "-1 ms"], "The tolerance is -0.001"), (["--family", "cake,gamma"], "no family 'cake'"),
    (["--condition", "216"], "no condition 216"), (["--out", "result.h5"], r"ends in \.json or \.csv"),
    (["--report", "page.pdf"], r"ends in \.html"), (["--picture", "picture.pdf"], r"End it in \.svg"),
    (["--mean", "1.45,1", "--outside", "error"], "pressure_bias = .*, outside the range of the table"),
])
def test_wrong_options_are_refused_and_nothing_is_written(given: list[object], tmp_path: Path, words: list[str],
                                                          message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SlipstickError, match=message):
        run(*given, "--out", "result.json", *words)
    assert not list(tmp_path.iterdir())
