"""Tables are built in chunks: they equal the simulator, on any executor and however a build was interrupted."""

import fcntl
import multiprocessing
import signal
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.bench import Conditions
from slipstick.building import Plan, axes_of, build_grid, chunks
from slipstick.clutch.ensemble import DEFAULT, NEVER_LOCKED, TIGHT, Accuracy, shifting_times
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.table import Grid, Table
from tests.benches import HEAVY, NOMINAL

AXES = {"pressure_bias": (0.8, 1.2, 6), "initial_position": (0.9, 1.1, 3), "friction_coefficient": (0.7, 1.3, 4)}
CHUNK = 54  # divides the engagements of `AXES` and six conditions: chunks may finish in any order


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.building.plan.CHUNK", CHUNK)


@pytest.fixture(scope="module")
def six_conditions() -> Conditions:
    """Six of the paper's conditions, one for each current profile."""
    return HEAVY.conditions.take([0, 41, 82, 123, 164, 205])


def make_plan(conditions: Conditions, axes: Any = AXES, model: Model = NOMINAL, accuracy: Accuracy = DEFAULT) -> Plan:
    return Plan(model, conditions, axes_of(model, axes), accuracy)


def build_table(plan: Plan, out: Path, executor: Executor | None = None) -> Grid:
    with executor or ThreadPoolExecutor(2) as pool:
        return build_grid(plan, out, pool, lambda done, resumed: None)


def test_the_table_equals_the_simulator_at_every_grid_point(six_conditions: Conditions, tmp_path: Path) -> None:
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


def test_the_table_does_not_depend_on_the_executor(six_conditions: Conditions, tmp_path: Path) -> None:
    plan = make_plan(six_conditions)
    spawned = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
    executors = (ThreadPoolExecutor(1), None, spawned)
    digests = {build_table(plan, tmp_path / "a.h5", executor).digest for executor in executors}
    assert len(digests) == 1


def test_engagements_that_never_lock_are_nan_with_a_status(six_conditions: Conditions, tmp_path: Path) -> None:
    table = build_table(make_plan(six_conditions, {"pressure_bias": (1, 8, 4)}), tmp_path / "a.h5")
    assert np.count_nonzero(table.status == NEVER_LOCKED) > 0
    assert np.array_equal(np.isnan(table.times), table.status != 0)


def interrupted_chunks(plan: Plan, out: Path, after: int) -> list[Path]:
    """Interrupt a build when `after` chunks are on disk; return their files."""
    def stop(done: int, resumed: int) -> None:
        if len(list(out.parent.glob(".*.parts/*.npz"))) >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), ThreadPoolExecutor(1) as pool:
        build_grid(plan, out, pool, stop)
    return sorted(out.parent.glob(".*.parts/*.npz"))


def test_ctrl_c_is_heard_between_two_chunks(six_conditions: Conditions, tmp_path: Path) -> None:
    """Amid the functions of futures it would leave their locks held, and the executor waiting for ever."""
    reports: list[int] = []

    def press(done: int, resumed: int) -> None:
        if done:
            signal.raise_signal(signal.SIGINT)
            reports.append(done)

    with pytest.raises(KeyboardInterrupt), ThreadPoolExecutor(1) as pool:
        build_grid(make_plan(six_conditions), tmp_path / "a.h5", pool, press)
    assert reports == [CHUNK]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert len(list(tmp_path.glob(".*.parts/*.npz"))) == 1


def test_damaged_and_empty_chunks_are_simulated_again(six_conditions: Conditions, tmp_path: Path) -> None:
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    chunks = interrupted_chunks(plan, out, after=4)
    content = bytearray(chunks[0].read_bytes())
    content[len(content) // 4] ^= 1
    chunks[0].write_bytes(content)
    chunks[1].write_bytes(b"")
    reports: list[tuple[int, ...]] = []
    with ThreadPoolExecutor(1) as pool:
        table = build_grid(plan, out, pool, lambda *report: reports.append(report))
    assert reports[0] == (2 * CHUNK, 2 * CHUNK)
    assert reports[-1] == (table.times.size, 2 * CHUNK)
    assert table.digest == build_table(plan, tmp_path / "b.h5").digest


def test_chunks_of_a_different_build_are_not_reused(six_conditions: Conditions, tmp_path: Path) -> None:
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    others = [make_plan(six_conditions.take([0, 1, 2, 3, 4, 0])), make_plan(six_conditions, accuracy=TIGHT),
              make_plan(six_conditions, {**AXES, "pressure_bias": (0.8, 1.201, 6)}),
              make_plan(six_conditions, model=NOMINAL.with_parameters({"gear_ratio": 3.1}))]
    assert len({plan.digest, *(other.digest for other in others)}) == 5
    interrupted_chunks(plan, out, after=4)
    reports: list[tuple[int, ...]] = []
    with ThreadPoolExecutor(1) as pool:
        build_grid(others[0], out, pool, lambda *report: reports.append(report))
    assert reports[0] == (0, 0)


def test_concurrent_builds_of_the_same_table_are_refused(six_conditions: Conditions, tmp_path: Path) -> None:
    plan, out = make_plan(six_conditions), tmp_path / "a.h5"
    folder = interrupted_chunks(plan, out, after=2)[0].parent
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(InvalidValue, match="Another process is building this table"):
            build_table(plan, out)
    build_table(plan, out)


def test_a_build_gives_the_executor_a_few_chunks_ahead_of_those_it_has_stored(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the results of a simulation that is faster than the disk would pile up in memory."""
    monkeypatch.setattr(chunks, "_AHEAD", 3)
    submitted, most = [], 0
    with ThreadPoolExecutor(2) as executor:
        submit = executor.submit
        monkeypatch.setattr(executor, "submit", lambda *given: submitted.append(given) or submit(*given))
        seen = []
        parts = [slice(k, k + 1) for k in range(20)]
        for chunk, *result in chunks.simulate_chunks(lambda point: (point, point), lambda part: part.start, parts,
                                                     executor):
            most = max(most, len(submitted) - len(seen))
            seen.append(chunk.start)
            assert result == [chunk.start, chunk.start]
    assert sorted(seen) == list(range(20))
    assert most == 3
