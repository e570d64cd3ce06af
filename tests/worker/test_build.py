import fcntl
import json
import multiprocessing
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.clutch.ensemble import DEFAULT, NEVER_LOCKED, TIGHT, shifting_times
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from slipstick.table import Table
from tests.benches import COMPACT, HEAVY, NOMINAL
from worker import building
from worker.__main__ import main
from worker.bench_option import read_model
from worker.build import read_axis
from worker.plan import Plan

ROOT = Path(__file__).parents[2]
AXES = ("pressure_bias=0.8:1.2:6", "initial_position=0.9:1.1:3", "friction_coefficient=0.7:1.3:4")


def make_plan(conditions, axes=AXES, model=None, accuracy=DEFAULT):
    model = model or NOMINAL
    return Plan(model, conditions, tuple(read_axis(text, model) for text in axes), accuracy)


def build_table(plan, out, executor=None):
    with executor or ThreadPoolExecutor(2) as pool:
        return building.build(plan, out, pool, lambda done, resumed: None)


CHUNK = 54  # divides the engagements of `AXES` and six conditions: chunks may finish in any order


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr("worker.plan.CHUNK", CHUNK)


def test_the_table_equals_the_simulator_at_every_grid_point(six_conditions, tmp_path):
    plan = make_plan(six_conditions)
    table = build_table(plan, tmp_path / "a.h5")
    assert len(plan.chunks) == 8
    a, b, c = (axis.values for axis in plan.axes)
    points = np.array([[x, y, z] for x in a for y in b for z in c])
    times, status = shifting_times(NOMINAL, six_conditions, [axis.name for axis in plan.axes], points)
    assert np.array_equal(table.times.reshape(-1, 6), times, equal_nan=True)
    assert np.array_equal(table.status.reshape(-1, 6), status)
    assert np.array_equal(table(points, six_conditions), times, equal_nan=True)
    assert Table.open(tmp_path / "a.h5").digest == table.digest
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_the_table_does_not_depend_on_the_executor(six_conditions, tmp_path):
    plan = make_plan(six_conditions)
    spawned = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
    executors = (ThreadPoolExecutor(1), None, spawned)
    digests = {build_table(plan, tmp_path / "a.h5", executor).digest for executor in executors}
    assert len(digests) == 1


def test_engagements_that_never_lock_are_nan_with_a_status(six_conditions, tmp_path):
    table = build_table(make_plan(six_conditions, ["pressure_bias=1:8:4"]), tmp_path / "a.h5")
    assert np.count_nonzero(table.status == NEVER_LOCKED) > 0
    assert np.array_equal(np.isnan(table.times), table.status != 0)


def interrupted_chunks(plan, out, after):
    """Interrupt a build when `after` chunks are on disk; return their files."""
    def stop(done, resumed):
        if len(list(out.parent.glob(".*.parts/*.npz"))) >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), ThreadPoolExecutor(1) as pool:
        building.build(plan, out, pool, stop)
    return sorted(out.parent.glob(".*.parts/*.npz"))


def test_damaged_and_empty_chunks_are_simulated_again(six_conditions, tmp_path):
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    chunks = interrupted_chunks(plan, out, after=4)
    content = bytearray(chunks[0].read_bytes())
    content[len(content) // 4] ^= 1
    chunks[0].write_bytes(content)
    chunks[1].write_bytes(b"")
    reports = []
    with ThreadPoolExecutor(1) as pool:
        table = building.build(plan, out, pool, lambda *report: reports.append(report))
    assert reports[0] == (2 * CHUNK, 2 * CHUNK)
    assert reports[-1] == (table.times.size, 2 * CHUNK)
    assert table.digest == build_table(plan, tmp_path / "b.h5").digest


def test_chunks_of_a_different_build_are_not_reused(six_conditions, tmp_path):
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    others = [make_plan(six_conditions.take([0, 1, 2, 3, 4, 0])), make_plan(six_conditions, accuracy=TIGHT),
              make_plan(six_conditions, ("pressure_bias=0.8:1.201:6", *AXES[1:])),
              make_plan(six_conditions, model=NOMINAL.with_parameters({"gear_ratio": 3.1}))]
    assert len({plan.digest, *(other.digest for other in others)}) == 5
    interrupted_chunks(plan, out, after=4)
    reports = []
    with ThreadPoolExecutor(1) as pool:
        building.build(others[0], out, pool, lambda *report: reports.append(report))
    assert reports[0] == (0, 0)


def test_concurrent_builds_of_the_same_table_are_refused(six_conditions, tmp_path):
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    folder = interrupted_chunks(plan, out, after=2)[0].parent
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(InvalidValue, match="Another process is building this table"):
            build_table(plan, out)
    build_table(plan, out)


@pytest.mark.slow
def test_a_repeatedly_killed_build_gives_the_same_table(tmp_path, monkeypatch):
    out, axes = tmp_path / "a.h5", ("pressure_bias=0.5:1.5:30", "initial_position=0.5:1.5:30")
    command = [sys.executable, "-m", "worker", "build", "--threads", "1", "--out", out, "--axis", axes[0],
               "--axis", axes[1]]
    for chunks in (2, 5):
        with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL) as worker:
            while worker.poll() is None and len(list(tmp_path.glob(".*.parts/*.npz"))) < chunks:
                time.sleep(0.002)
            worker.send_signal(signal.SIGKILL)
        assert not out.exists()
    completed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert "from an earlier run" in completed.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
    monkeypatch.undo()
    assert Table.open(out).digest == build_table(make_plan(HEAVY.conditions, axes), tmp_path / "b.h5").digest


def test_the_command_reads_a_model_and_conditions(tmp_path, capsys):
    model = NOMINAL.with_parameters({"gear_ratio": 3.0}).with_effect("quadratic_load_drag", {})
    (tmp_path / "calibrated.json").write_text(json.dumps({"model": model.spec(), "chi_square": 1.0}))
    (tmp_path / "bench.csv").write_text(
        "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m]\n2,140,10,50\n5,110,6,20\n")
    assert main(["build", "--axis", "gear_ratio=0.9:1.1:3", "--model", str(tmp_path / "calibrated.json"),
                 "--conditions", str(tmp_path / "bench.csv"), "--out", str(tmp_path / "a.h5")]) == 0
    table = Table.open(tmp_path / "a.h5")
    assert table.model == model
    assert (table.axes[0].nominal, table.times.shape) == (3.0, (3, 2))
    assert table.conditions.motor_speed.tolist() == [140, 110]
    assert table.digest in capsys.readouterr().out


def test_a_table_of_another_bench(tmp_path, capsys):
    axis, out = ["--axis", "pressure_bias=0.9:1.1:3"], ["--out", str(tmp_path / "a.h5")]
    compact = ["--bench", str(ROOT / "tables" / "compact.toml")]
    assert main(["build", *compact, *axis, *out]) == 0
    table = Table.open(tmp_path / "a.h5")
    assert table.model == Model(COMPACT.physics)
    assert table.conditions.digest == COMPACT.conditions.digest
    expected, _ = shifting_times(Model(COMPACT.physics), COMPACT.conditions)
    np.testing.assert_array_equal(table.times[1], expected[0])
    (tmp_path / "heavy.json").write_text(json.dumps(NOMINAL.spec()))
    capsys.readouterr()
    assert main(["build", *compact, "--model", str(tmp_path / "heavy.json"), *axis, *out]) == 1
    assert "made for another bench than 'compact'" in capsys.readouterr().err


@pytest.mark.parametrize(("arguments", "message"), [
    (["--bench", "tables/heavi.toml"], "Did you mean 'heavy.toml'"), (["--bench", "README.md"], "is not TOML"),
    (["--axis", "presure_bias=0.5:1.5:5"], "Did you mean 'pressure_bias'"),
    (["--axis", "pressure_bias=0.5:1.5"], "Write NAME=LOW:HIGH:COUNT"),
    (["--axis", "pressure_bias=1.5:0.5:5"], "do not increase"), (["--axis", "pressure_bias=0.5:1.5:1"], "has 1 value"),
    (["--axis", "pressure_bias=0.5:1.5:-3"], "is not a valid axis"), (["--threads", "0"], "0 threads"),
    (["--model", "missing.json"], "Cannot read a model"),
    (["--conditions", "missing.csv"], "recordings file 'missing.csv'"),
])
def test_invalid_options_are_refused_with_a_remedy(arguments, message, tmp_path, capsys):
    assert main(["build", "--out", str(tmp_path / "a.h5"), *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_invalid_model_files_are_refused(tmp_path):
    path = tmp_path / "model.json"
    for content in ("[]", "{", "{}", '{"model": 3}', json.dumps({**NOMINAL.spec(), "bench": {}}),
                    json.dumps({**NOMINAL.spec(), "bench": {**NOMINAL.spec()["bench"], "digest": "0" * 64}})):
        path.write_text(content)
        with pytest.raises(InvalidValue):
            read_model(path)
    path.write_text(json.dumps({**NOMINAL.spec(), "effects": {"gravity": {"g": 9.81}}}))
    with pytest.raises(UnknownName):
        read_model(path)


def test_builds_that_cannot_succeed_are_refused_before_the_simulation(tmp_path: Path) -> None:
    recordings = tmp_path / "measured.h5"
    recordings.write_bytes((Path(__file__).parents[2] / "tables" / "measured.h5").read_bytes())
    content = recordings.read_bytes()
    axis = ("--axis", "pressure_bias=0.9:1.1:2")
    for arguments in ((*axis, *axis), ("--axis", "pressure_bias=0.5:1.5:100000", "--axis", "ramp_share=0.5:1:100000"),
                      (*axis, "--out", str(recordings))):
        out = () if "--out" in arguments else ("--out", str(tmp_path / "new.h5"))
        assert main(["build", *arguments, *out]) == 1
    assert recordings.read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["measured.h5"]


def test_a_table_of_a_model_with_a_measured_law_has_another_digest(tmp_path, capsys):
    law = MeasuredLaw("load torque", "output speed", (0.0, 20.0, 60.0), (0.0, 2.0, 30.0), relative=False)
    tables = []
    for name, model in (("with", NOMINAL.with_law(law)), ("without", NOMINAL)):
        (tmp_path / f"{name}.json").write_text(json.dumps(model.spec()))
        arguments = ["--model", str(tmp_path / f"{name}.json"), "--out", str(tmp_path / f"{name}.h5")]
        assert main(["build", *arguments, "--axis", "pressure_bias=0.9:1.1:2", "--threads", "1"]) == 0
        tables.append(Table.open(tmp_path / f"{name}.h5"))
        expected = shifting_times(model, HEAVY.conditions, ["pressure_bias"], np.array([[0.9], [1.1]]))[0]
        np.testing.assert_array_equal(tables[-1].times, expected)
    assert tables[0].model == NOMINAL.with_law(law)
    assert tables[0].digest != tables[1].digest
    assert not np.array_equal(tables[0].times, tables[1].times)
    capsys.readouterr()
    assert main(["verify", str(tmp_path / "with.h5"), "--points", "0"]) == 0
    assert "measured law: load torque over output speed" in capsys.readouterr().out


def test_a_build_gives_the_executor_a_few_chunks_ahead_of_those_it_has_stored(monkeypatch):
    """Otherwise the results of a simulation that is faster than the disk would pile up in memory."""
    monkeypatch.setattr(building, "_AHEAD", 3)
    plan = SimpleNamespace(simulate=lambda points: (points, points), points=lambda chunk: chunk.start)
    submitted, most = [], 0
    with ThreadPoolExecutor(2) as executor:
        submit = executor.submit
        monkeypatch.setattr(executor, "submit", lambda *given: submitted.append(given) or submit(*given))
        seen = []
        for chunk, *result in building._simulate(plan, [slice(k, k + 1) for k in range(20)], executor):
            most = max(most, len(submitted) - len(seen))
            seen.append(chunk.start)
            assert result == [chunk.start, chunk.start]
    assert sorted(seen) == list(range(20))
    assert most == 3
