"""`slipstick.build` and `slipstick.surrogate`: what they take, what they refuse, interruptions, memory and files."""

import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.black_box import BlackBox
from slipstick.building import plan
from slipstick.clutch.ensemble import TIGHT, shifting_times
from slipstick.errors import InvalidValue, SlipstickError, UnknownName
from slipstick.interface.build import build
from slipstick.interface.surrogate import surrogate
from slipstick.recordings import Recordings
from slipstick.table import Grid, Table
from tests.benches import COMPACT, HEAVY, NOMINAL

ROOT = Path(__file__).parents[3]
AXES = {"pressure_bias": (0.9, 1.1, 3), "initial_position": (0.8, 1.2, 2)}
FORM = r"Give \(low, high, count\)"
FEW = HEAVY.conditions.take([0, 100, 215])
FUNCTION = """
def output(a, b):
    return None if a * b > 5 else a + b
"""
MACHINE = """
title = "A sum"
simulator = { callable = "NAME:output" }
output = { name = "c", unit = "m" }
inputs.a = { nominal = 2, range = [0.5, 1.5], points = 3 }
conditions.b = [1, 2]
"""


@pytest.fixture
def machine(tmp_path: Path) -> BlackBox:
    name = f"sum_{tmp_path.name.replace('-', '_')}"  # each test has its own module
    (tmp_path / f"{name}.py").write_text(FUNCTION)
    (tmp_path / "machine.toml").write_text(MACHINE.replace("NAME", name))
    return BlackBox.open(tmp_path / "machine.toml")


def parts(folder: Path, pattern: str) -> list[Path]:
    return list(folder.glob(f".table.h5.*.parts/{pattern}"))


def quiet_build(*given: Any, **named: Any) -> Grid:
    return build(*given, **{"progress": False, **named})


def test_a_table_has_the_simulated_times_in_memory_and_in_a_file(tmp_path: Path) -> None:
    table = quiet_build(HEAVY, AXES, conditions=FEW)
    points = np.array([[a, b] for a in (0.9, 1.0, 1.1) for b in (0.8, 1.2)])
    expected, status = shifting_times(NOMINAL, FEW, list(AXES), points)
    np.testing.assert_array_equal(table.times, expected.reshape(3, 2, 3))
    np.testing.assert_array_equal(table.status, status.reshape(3, 2, 3))
    assert [(axis.name, axis.unit, axis.nominal) for axis in table.axes] == [
        ("pressure_bias", "bar", 1.6), ("initial_position", "m", 5e-4)]
    out = tmp_path / "new" / "table.h5"
    written = quiet_build(HEAVY, AXES, conditions=FEW, out=str(out))
    assert Table.open(str(out)).digest == written.digest == table.digest
    assert [path.name for path in out.parent.iterdir()] == ["table.h5"]
    assert table.save(tmp_path / "other" / "saved.h5") == tmp_path / "other" / "saved.h5"
    assert Table.open(tmp_path / "other" / "saved.h5").digest == table.digest
    tight = quiet_build(HEAVY, AXES, conditions=FEW, accuracy="tight").times
    np.testing.assert_array_equal(tight, shifting_times(NOMINAL, FEW, list(AXES), points, TIGHT)[0].reshape(3, 2, 3))


def test_a_model_is_a_value_a_result_or_a_file(tmp_path: Path) -> None:
    model = NOMINAL.with_parameters({"gear_ratio": 3.0})
    (tmp_path / "calibrated.json").write_text(json.dumps({"model": model.spec()}))
    (tmp_path / "extended.json").write_text(json.dumps(model.spec()))
    given = (model, SimpleNamespace(model=model), tmp_path / "calibrated.json", str(tmp_path / "extended.json"))
    tables = [quiet_build(HEAVY, AXES, model=form, conditions=FEW) for form in given]
    assert {table.digest for table in tables} == {tables[0].digest}
    assert tables[0].model == model
    for wrong, message in ((3, "The int .* is not a model"), (COMPACT, "The Bench is not a model"),
                           (tmp_path / "missing.json", "Cannot read a model")):
        with pytest.raises(InvalidValue, match=message):
            quiet_build(HEAVY, AXES, model=wrong)
    with pytest.raises(InvalidValue, match="another bench than 'compact'"):
        quiet_build(COMPACT, AXES, model=model)


def test_conditions_are_those_of_recordings() -> None:
    recordings = Recordings(FEW, np.ones(3))
    assert quiet_build(HEAVY, AXES, conditions=recordings).conditions is FEW
    with pytest.raises(InvalidValue, match="A list is not conditions"):
        quiet_build(HEAVY, AXES, conditions=[1])
    drifting = NOMINAL.with_effect("viscosity_drift", {"drift": 0.1})
    assert drifting.uses_run_order
    with pytest.raises(InvalidValue, match="recordings with a run order"):
        quiet_build(HEAVY, AXES, model=drifting, conditions=recordings)


@pytest.mark.parametrize(("axes", "message"), [
    ({"presure_bias": (0.9, 1.1, 3)}, "Did you mean 'pressure_bias'"),
    ({"pressure_bias": (0.9, 1.1)}, FORM),
    ({"pressure_bias": (0.9, 1.1, 3, 4)}, FORM),
    ({"pressure_bias": "0.9:1.1:3"}, FORM), ({"pressure_bias": 3}, FORM),
    ({"pressure_bias": (0.9, 1.1, 2.5)}, FORM),
    ({"pressure_bias": (0.9, 1.1, 1)}, "Give 2 to"), ({"pressure_bias": (0.9, 1.1, 1e12)}, "Give 2 to"),
    ({"pressure_bias": (0.9, 1.1, float("nan"))}, FORM),
    ({"pressure_bias": (1.1, 0.9, 3)}, "does not increase"), ({"pressure_bias": (1.0, 1.0, 3)}, "does not increase"),
    ({"pressure_bias": (0.9, float("inf"), 3)}, "not finite"),
    ({"pressure_bias": (float("nan"), 1.1, 3)}, "not finite"),
    ({"pressure_bias": (0.5, 1.5, 100_000), "ramp_share": (0.5, 1, 100_000)}, "fewer points per axis"),
    ({"gear_ratio": (-1, 1, 3)}, "gear_ratio begins at -1 times 3.2"), ({"ramp_share": (0, 1, 3)}, "a positive value"),
    ({}, "has no axes"),
])
def test_axes_that_are_none_are_refused(axes: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(SlipstickError, match=message):
        quiet_build(HEAVY, axes, out=tmp_path / "table.h5")
    assert not list(tmp_path.iterdir())


def test_a_table_over_multiples_of_zero_is_refused() -> None:
    model = NOMINAL.with_parameters({"input_coulomb": 0.0})
    with pytest.raises(InvalidValue, match="input_coulomb has multiples of 0 N m, which are all 0"):
        quiet_build(HEAVY, {"input_coulomb": (0.5, 1.5, 3)}, model=model)
    quiet_build(HEAVY, {"input_coulomb": (-1, 1, 3)}, conditions=FEW)  # a parameter that may have either sign


def test_other_arguments_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidValue, match="0 threads are too few"):
        quiet_build(HEAVY, AXES, threads=0)
    with pytest.raises(UnknownName, match="Known: default, tight"):
        quiet_build(HEAVY, AXES, accuracy="best")
    (tmp_path / "notes.h5").write_text("mine")
    with pytest.raises(InvalidValue, match="exists and is not a table"):
        quiet_build(HEAVY, AXES, out=tmp_path / "notes.h5")
    assert (tmp_path / "notes.h5").read_text() == "mine"
    with pytest.raises(InvalidValue, match=r"table\.txt' is not the name of a \.h5 file"):
        quiet_build(HEAVY, AXES, out=tmp_path / "table.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["notes.h5"]  # refused before anything is simulated


def test_an_interrupted_build_is_resumed_by_the_same_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "CHUNK", 3)  # a point
    monkeypatch.setattr("slipstick.interface.progress._UPDATE_INTERVAL", 0.0)
    out, said = tmp_path / "table.h5", io.StringIO()

    def stop(text: str, share: float | None) -> None:
        if share and share > 0.3:
            raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as executor:
        with redirect_stderr(said), pytest.raises(KeyboardInterrupt):
            build(HEAVY, AXES, conditions=FEW, out=out, executor=executor, progress=stop)
        assert executor.submit(int, "3").result() == 3  # it was not shut down
    assert "Run the same command or call again to resume" in said.getvalue()
    assert not out.exists()
    assert sorted(path.suffix for path in parts(tmp_path, "*")) == ["", ".npz", ".npz"]  # and the lock
    texts: list[str] = []
    table = build(HEAVY, AXES, conditions=FEW, out=out, progress=lambda text, share: texts.append(text))
    assert texts[0] == "6 of 18 engagements, 6 from an earlier run"
    assert table.digest == quiet_build(HEAVY, AXES, conditions=FEW).digest
    assert [path.name for path in tmp_path.iterdir()] == ["table.h5"]


PROGRAM = """
import sys
from slipstick.bench import Bench
from slipstick.interface.build import build
build(Bench.open(sys.argv[1]), {"pressure_bias": (0.5, 1.5, 400), "initial_position": (0.5, 1.5, 300)}, threads=1,
      out="table.h5")
"""


def test_ctrl_c_leaves_whole_chunks_only(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", PROGRAM, str(ROOT / "tables" / "heavy.toml")], cwd=tmp_path, text=True,
                          stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}) as process:
        while process.poll() is None and len(parts(tmp_path, "[!.]*.npz")) < 2:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        watch = threading.Timer(30, process.kill)  # should it not end
        watch.start()
        _, error = process.communicate()
        watch.cancel()
    assert "Stopped. Run the same command or call again to resume.\n" in error
    assert error.rstrip().endswith("KeyboardInterrupt")
    names = [path.name for path in parts(tmp_path, "*")]
    assert len(names) >= 3
    assert all(name == "lock" or name.endswith(".npz") for name in names)
    for path in parts(tmp_path, "*.npz"):
        with np.load(path) as chunk:
            assert chunk["times"].shape == chunk["status"].shape


def test_a_black_box_has_all_inputs_as_axes_and_no_model(machine: BlackBox, tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    with ThreadPoolExecutor(1) as executor:
        table = quiet_build(machine, executor=executor)
        narrower = quiet_build(machine, {"a": (0.6, 0.8, 2)}, executor=executor, out=tmp_path / "table.h5")
    np.testing.assert_array_equal(table.times, [[2, 3], [3, 4], [4, np.nan]])
    assert table.axes[0].values.tolist() == [0.5, 1.0, 1.5]
    assert "1 of 6 runs have no output: 1 returned none, 0 failed" in capsys.readouterr().err
    assert Table.open(tmp_path / "table.h5").digest == narrower.digest
    for given in ({"model": NOMINAL}, {"conditions": FEW}, {"accuracy": "tight"}):
        with pytest.raises(InvalidValue, match=f"A black box takes no {next(iter(given))}"):
            quiet_build(machine, **given)
    with pytest.raises(InvalidValue, match="exceeds the range of the input") as beyond:
        quiet_build(machine, {"a": (0.1, 1.0, 3)})
    assert "`scatter`" in beyond.value.remedy  # a declared machine has no range to widen


def test_a_surrogate_is_trained_in_memory_and_written(machine: BlackBox, tmp_path: Path) -> None:
    few = {"runs": 100, "steps": 20, "progress": False}
    box = {"pressure_bias": (0.9, 1.1)}
    trained = surrogate(HEAVY, box, conditions=FEW, **few)
    assert surrogate(HEAVY, box, conditions=FEW, out=tmp_path / "s.h5", threads=1, **few).digest == trained.digest
    assert Table.open(tmp_path / "s.h5").digest == trained.digest
    with ThreadPoolExecutor(1) as executor:
        of_machine = surrogate(machine, {"a": (0.5, 1.0)}, executor=executor, **few)
        with pytest.raises(InvalidValue, match="of 240 runs in the box have no output"):
            surrogate(machine, executor=executor, **few)
    assert of_machine.output.unit == "m"
    for axes, message in ((None, "has no axes"), ({"pressure_bias": (0.9, 1.1, 3)}, r"Give \(low, high\) in")):
        with pytest.raises(InvalidValue, match=message):
            surrogate(HEAVY, axes, **few)
