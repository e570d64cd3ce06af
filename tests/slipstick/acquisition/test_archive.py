"""An archive is checked before anything in it is read; the child process in which that happens has limits."""

import json

import pytest

from slipstick.acquisition.archive import answer, import_archive
from slipstick.errors import BadRecording
from slipstick.recordings import Recordings
from slipstick.storage.isolated import isolated
from tests.benches import TABLES
from tests.slipstick.acquisition.conftest import LOCK, MAP, archive, csv, run

FILES = {"channels.toml": MAP.encode(), "runs/a.csv": csv(run())}
BENCH = TABLES / "compact.toml"


def asked(files: dict[str, bytes]) -> bytes:
    return json.dumps({"bench": str(BENCH)}).encode() + b"\n" + archive(files)


def test_an_archive_becomes_recordings_in_a_child_process() -> None:
    content, report = import_archive(archive(FILES), BENCH)
    assert Recordings.read(content, "h5").measured_time == pytest.approx([LOCK], abs=3e-3)
    assert (report.engagements, report.computed, report.set_aside, report.doubts) == (("a.csv",), True, (), ())
    assert any("decimal commas" in remark for remark in report.remarks)


@pytest.mark.parametrize(("files", "says"), [
    ({"runs/a.csv": b"t;p\n1;2\n"}, "no file 'channels.toml'"),
    ({**FILES, "channels.toml": (MAP + 'plan = "p.csv"').encode()}, "no file 'p.csv', the sheet of conditions"),
    ({**FILES, "other/a.csv": b""}, "two files 'a.csv'"),
    ({"channels.toml": MAP.encode()}, "No file was given")])
def test_a_wrong_archive_is_refused(files: dict[str, bytes], says: str) -> None:
    with pytest.raises(BadRecording, match=says):
        answer(asked(files))


def test_a_small_archive_of_a_huge_file_is_not_unpacked() -> None:
    bomb = asked({"a.csv": bytes(1 << 20)}).replace((1 << 20).to_bytes(4, "little"), (1 << 31).to_bytes(4, "little"))
    with pytest.raises(BadRecording, match="more than"):
        answer(bomb)


def test_a_child_that_dies_is_reported_as_a_failure() -> None:
    with pytest.raises(BadRecording, match="it failed"):
        isolated(b"x", "json:loads", BadRecording, 5, "it failed")
