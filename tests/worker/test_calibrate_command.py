"""The command `calibrate`: what it tells to do next can be done."""

import shlex
from pathlib import Path

import pytest

from slipstick.table import Table
from tests.benches import COMPACT, TABLES
from tests.worker.test_your_bench import few_recordings
from worker.__main__ import main


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
