"""`python -m worker import --machine`: files to runs and a page, and proposed mappings."""

from pathlib import Path

import numpy as np
import pytest

from slipstick.machine import open_machine, read_runs, require_runs
from tests.slipstick.acquisition.sled import STANDSTILLS, as_csv, recording
from worker.__main__ import main

MACHINE = """
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Sensor

drive = Block("drive", gives="speed", reads=("voltage", "load"), states=("speed",), parameters=(Parameter("gain"),))


@drive.rate
def change(x, u, q, p):
    return p.gain * u.voltage - p.load


MACHINE = Machine("sled", (drive,), (Sensor("speed", "m/s"),), (Command("voltage", "V"),), (Condition("load", "N"),))
"""
MAP = """
[signals]
speed = { channel = "v", unit = "mm/s" }
[commands]
voltage = { channel = "u", unit = "V" }
[further."the <way>"]
channel = "x"
unit = "mm"
[conditions]
load = { value = "3 N" }
[time]
channel = "t"
unit = "ms"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    columns = recording(6)
    columns["v"][2000:2010] = np.nan
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "long.csv").write_bytes(as_csv(columns))
    (tmp_path / "machine.py").write_text(MACHINE)
    (tmp_path / "channels.toml").write_text(MAP + STANDSTILLS.replace("for", 'begin_as = "cut at"\nfor'))
    return tmp_path


def run(folder: Path, *options: str) -> int:
    return main(["import", str(folder / "files"), "--machine", str(folder / "machine.py"), *options])


def test_a_long_recording_becomes_runs_and_a_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "--map", str(folder / "channels.toml"), "--out", str(folder / "out" / "runs.h5")) == 0
    runs = require_runs(open_machine(folder / "machine.py"), read_runs(folder / "out" / "runs.h5"))
    assert (len(runs), runs.machine) == (5, "sled")
    page, out = (folder / "out" / "runs.html").read_text(), capsys.readouterr().out
    for said in ("5 runs imported", "1 set aside", "long.csv, run 1", "has a gap", "6 runs were cut from 1 file",
                 "Runs of sled have"):
        assert said in page
        assert said in out
    for said in ("picture-runs", "voltage [V]", "speed [m/s]", "cut at [s]", "load [N]", "the &lt;way&gt;"):
        assert said in page


def test_the_sheet_of_conditions_may_lie_in_the_folder_of_the_recordings(
        folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "files" / "plan.csv").write_text("file;weight [N]\nsled.csv;4\nother.csv;5\n")
    (folder / "files" / "long.csv").rename(folder / "files" / "sled.csv")
    assert run(folder, "--guess") == 0
    assert "units of sled.csv" in capsys.readouterr().out
    text = (folder / "channels.toml").read_text()
    (folder / "channels.toml").write_text(text.replace(
        'load = { value = "3 N" }', 'load = { column = "weight" }\nplan = "files/plan.csv"'))
    assert run(folder, "--map", str(folder / "channels.toml"), "--out", str(folder / "runs.h5")) == 0
    assert read_runs(folder / "runs.h5").conditions["load"].tolist() == [4.0] * 5


def test_a_wrong_unit_of_a_signal_looks_wrong(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "machine.py").write_text(MACHINE.replace(
        'Parameter("gain")', 'Parameter("gain", value=1.0)').replace(
        '"V"),), (Condition("load", "N"),)', '"V", (((0, 3.5), (1, 3.5)),)),), (Condition("load", "N", levels=(3.0,)),)'
                                             ', duration=1.0, step=0.01'))
    (folder / "channels.toml").write_text((folder / "channels.toml").read_text().replace("mm/s", "m/s"))
    assert run(folder, "--map", str(folder / "channels.toml"), "--out", str(folder / "runs.h5")) == 0
    assert "m/s in the runs, and 0.5 m/s in the experiments that the machine declares. Check its unit" in \
        capsys.readouterr().out


def test_a_proposed_mapping_is_that_of_the_machine(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "--guess") == 0
    out, said = capsys.readouterr()
    assert '[commands."voltage"]' in out
    assert '# OPEN: "load" = { value = "1 N" }' in out
    assert "time: the name 't'" in said


def test_bench_and_machine_exclude_each_other_and_files_must_exist(
        folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(folder, "--guess", "--bench", "heavy")
    assert "not allowed with argument" in capsys.readouterr().err
    assert run(folder, "--map", str(folder / "other.toml"), "--out", str(folder / "runs.h5")) == 1
    assert "channels.toml" in capsys.readouterr().err
    assert run(folder, "--map", str(folder / "channels.toml"), "--out", str(folder / "runs.csv")) == 1
    assert "is not the name of a .h5 file" in capsys.readouterr().err
    assert not (folder / "runs.h5").exists()
