"""`python -m worker bench`: the template, and what the check prints."""

from pathlib import Path

import pytest

from slipstick.bench import Bench
from tests.benches import COMPACT, TABLES
from worker.__main__ import main


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


def test_an_error_in_the_file_has_its_key_and_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (TABLES / "compact.toml").read_text()
    line = text[:text.index("gear_ratio = ")].count("\n") + 1
    assert check(tmp_path / "mine.toml", text.replace("gear_ratio = 1.8", "gear_ratio = -1.8")) == 1
    error = capsys.readouterr().err
    assert f"mine.toml, line {line}, parameters.gear_ratio: -1.8 1 is not positive" in error


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
