import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.building import Plan, axes_of, build_grid
from slipstick.clutch.ensemble import DEFAULT, TIGHT, shifting_times
from slipstick.interface.build import PAPER_AXES
from tests.benches import HEAVY, NOMINAL, TABLES
from worker.__main__ import main
from worker.bench_option import bench_file
from worker.build import read_axes


def build_table(axes, conditions, out, part=slice(None)):
    spans = axes if axes is PAPER_AXES else read_axes(axes, "NAME=LOW:HIGH:COUNT")
    axes = axes_of(NOMINAL, spans)
    plan = Plan(NOMINAL, conditions, tuple(replace(axis, values=axis.values[part]) for axis in axes), DEFAULT)
    with ThreadPoolExecutor(2) as pool:
        return build_grid(plan, out, pool, lambda done, resumed: None)


def number(pattern, output):
    return float(re.search(pattern, output)[1].replace(",", ""))


@pytest.mark.slow
def test_the_default_grid_is_within_its_error_target(tmp_path, capsys):
    """In the middle of its axes, to which the shipped recordings belong."""
    table = build_table(PAPER_AXES, HEAVY.conditions, tmp_path / "a.h5", slice(14, 36))
    assert main(["verify", str(tmp_path / "a.h5"), "--points", "40"]) == 0
    output = capsys.readouterr().out
    assert number(r"error: ([\d.]+) ms RMS", output) <= 0.05
    assert abs(number(r"([+-][\d.]+) decades", output)) < 0.5
    for part in (table.digest, table.model.digest, table.conditions.digest, "104,544 locked", "1.6 bar", "0.0005 m"):
        assert part in output


def test_the_printed_error_is_that_of_the_table(six_conditions, tmp_path, capsys):
    axes = ("pressure_bias=0.6:1.4:4", "initial_position=0.8:1.2:3")
    table = build_table(axes, six_conditions, tmp_path / "a.h5")
    points = np.random.default_rng(7).uniform(table.lower, table.upper, (50, 2))
    names = [axis.name for axis in table.axes]
    difference = table.interpolate(points) - shifting_times(NOMINAL, six_conditions, names, points, TIGHT)[0]
    assert main(["verify", str(tmp_path / "a.h5"), "--points", "50", "--seed", "7"]) == 0
    output = capsys.readouterr().out
    rms = 1e3 * np.sqrt(np.mean(difference**2))
    assert rms > 0.2  # the grid is coarse enough for a meaningful comparison
    assert number(r"error: ([\d.]+) ms RMS", output) == pytest.approx(rms, abs=1e-4)
    assert number(r"([\d.]+) ms maximum", output) == pytest.approx(1e3 * np.abs(difference).max(), abs=1e-3)
    assert main(["verify", str(tmp_path / "a.h5"), "--machine", "mine.toml"]) == 1
    assert "--machine declares another machine, and the table is of a clutch" in capsys.readouterr().err
    assert "not computed for these recordings" in output  # the table has only six of their conditions


def test_engagements_that_never_lock_are_counted_separately(six_conditions, tmp_path, capsys):
    build_table(["pressure_bias=1:8:4"], six_conditions, tmp_path / "a.h5")
    assert main(["verify", str(tmp_path / "a.h5"), "--points", "50"]) == 0
    assert number(r"([\d,]+) engagements have no shifting time", capsys.readouterr().out) > 0


def test_a_damaged_or_missing_file_exits_with_status_1(six_conditions, tmp_path, capsys):
    path = tmp_path / "a.h5"
    table = build_table(["pressure_bias=0.8:1.2:3"], six_conditions, path)
    assert main(["verify", str(path), "--points", "0"]) == 0
    content = path.read_bytes()
    position = content.index(table.times[1, 1].tobytes())
    path.write_bytes(content[:position] + bytes([content[position] ^ 1]) + content[position + 1:])
    assert main(["verify", str(path)]) == 1
    assert main(["verify", str(tmp_path / "b.h5")]) == 1
    error = capsys.readouterr().err
    assert error.count("error: ") == 2
    assert "damaged" in error


def test_a_table_of_another_bench_is_refused(six_conditions, tmp_path, capsys):
    build_table(["pressure_bias=0.9:1.1:3"], six_conditions, tmp_path / "a.h5")
    verify = ["verify", str(tmp_path / "a.h5"), "--points", "0", "--bench"]
    assert main([*verify, str(TABLES / "heavy.toml")]) == 0
    assert main(["verify", str(tmp_path / "a.h5"), "--points", "-1"]) == 1
    assert "Give --points 0 or more" in capsys.readouterr().err
    assert main([*verify, str(TABLES / "compact.toml")]) == 1
    assert "another bench than 'compact'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["mine", "mine.toml"])
def test_the_name_of_a_bench_is_that_of_the_service(name, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SLIPSTICK_TABLES", str(tmp_path))
    shutil.copy(TABLES / "compact.toml", tmp_path / "mine.toml")
    assert main(["bench", "check", name]) == 0
    assert "Compact-clutch test bench" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    shutil.copy(TABLES / "heavy.toml", name)  # a file at the path itself goes before
    assert bench_file(name) == Path(name)
    assert bench_file(f"./{name}") == Path(name)
