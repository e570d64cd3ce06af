"""`python -m worker import`: files to recordings and a page, and proposed mappings."""

from pathlib import Path

import pytest

from slipstick.recordings import Recordings
from tests.benches import TABLES
from tests.slipstick.acquisition.conftest import LOCK, MAP, csv, run
from worker.__main__ import main

BENCH = ["--bench", str(TABLES / "compact.toml")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "files").mkdir()
    for number in range(3):
        (tmp_path / "files" / f"run{number}.csv").write_bytes(csv(run(seed=number, lock=LOCK + number / 100)))
    (tmp_path / "files" / "notes.docx").write_text("not a recording")
    (tmp_path / "channels.toml").write_text(MAP)
    return tmp_path


def imported(folder: Path, *options: str, files: str = "files", out: str = "out/mine.h5") -> int:
    return main(["import", str(folder / files), "--map", str(folder / "channels.toml"), "--out", str(folder / out),
                 *BENCH, *options])


def test_a_folder_becomes_recordings_and_a_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert imported(folder) == 0
    out, progress = capsys.readouterr()
    assert "3 engagements imported, 0 set aside" in out
    assert "output_torque <- -M_out [unit not stated]" in out
    assert "3 of 3 files" in progress
    recordings = Recordings.open(folder / "out" / "mine.h5")
    assert recordings.measured_time == pytest.approx([LOCK, LOCK + 0.01, LOCK + 0.02], abs=3e-3)
    page = (folder / "out" / "mine.html").read_text()
    for said in ("3 engagements imported", "run1.csv", "M_out", "picture-engagement", "picture-all", "pressure [bar]",
                 "decimal commas"):
        assert said in page
    assert 'class="warnings"' not in page


def test_files_are_written_before_anything_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever reads what the command says may stop after a line, which ends it."""
    def say(text: str, file: object = None) -> None:
        if file is None:
            raise BrokenPipeError

    monkeypatch.setattr("worker.import_.print", say, raising=False)
    assert imported(folder) == 1
    assert len(Recordings.open(folder / "out" / "mine.h5").measured_time) == 3


def test_what_is_set_aside_and_looks_wrong_is_on_the_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "files" / "run3.csv").write_bytes(csv(run(lock=2.0)))
    (folder / "channels.toml").write_text(MAP.replace(", sign = -1", ""))
    assert imported(folder) == 0
    page, out = (folder / "out" / "mine.html").read_text(), capsys.readouterr().out
    for said in ("3 engagements imported, 1 set aside", "run3.csv", "no lock-up", "output torque is negative"):
        assert said in page
        assert said in out


def test_the_page_shows_the_signals_that_there_are_and_what_stays_open(
        folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = MAP.splitlines()
    (folder / "channels.toml").write_text("\n".join(line for line in lines if not line.startswith("pressure")))
    assert imported(folder) == 0
    page, out = (folder / "out" / "mine.html").read_text(), capsys.readouterr().out
    for said in ("pressure not mapped", "A study tests the blocks load, input and lock"):
        assert said in page
        assert said in out
    assert "picture-engagement" in page
    assert "output torque [N m]" in page
    assert "pressure [bar]" not in page


def test_a_proposed_mapping_is_written_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "channels.toml").unlink()
    guess = ["import", str(folder / "files"), "--guess", "--map", str(folder / "channels.toml"), *BENCH]
    assert main(guess) == 0
    assert "pressure: the name 'p_oil', and the file states no unit" in capsys.readouterr().out
    before = (folder / "channels.toml").read_text()
    assert main(guess) == 1
    assert "already exists" in capsys.readouterr().err
    assert (folder / "channels.toml").read_text() == before
    assert main(guess[:3] + BENCH) == 0
    assert "[signals.pressure]" in capsys.readouterr().out


@pytest.mark.parametrize(("change", "says"), [
    ({"files": "nothing"}, "There is no file"), ({"files": "files/notes.docx"}, "no rows of two or more numbers"),
    ({"out": "out/mine.csv"}, "is not the name of a .h5 file")])
def test_wrong_files_are_named(folder: Path, capsys: pytest.CaptureFixture[str], change: dict[str, str],
                               says: str) -> None:
    assert imported(folder, **change) == 1  # type: ignore[arg-type]
    assert says in capsys.readouterr().err
    assert not (folder / "out").exists()


def test_files_of_one_name_and_empty_folders_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "empty").mkdir()
    assert imported(folder, files="empty") == 1
    assert "has no file of a known kind" in capsys.readouterr().err
    assert main(["import", str(folder / "files"), str(folder / "files" / "run0.csv"), "--map",
                 str(folder / "channels.toml"), "--out", str(folder / "mine.h5"), *BENCH]) == 1
    assert "Two files are called 'run0.csv'" in capsys.readouterr().err
    assert main(["import", str(folder / "files"), *BENCH]) == 1
    assert "--map or --out is missing" in capsys.readouterr().err
    (folder / "channels.toml").write_text(MAP + 'plan = "plan.csv"\n')
    assert imported(folder) == 1
    assert "the sheet of conditions" in capsys.readouterr().err
