"""A real Dask scheduler and workers as processes: the same digests as on this machine, also if a worker is killed."""

import json
import math
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from job_processes import SETTINGS, Bench, ended, in_stage

from evidence.runner import answer_cases
from slipstick.black_box import BlackBox
from slipstick.black_box.simulation import FAILED
from slipstick.building import Plan, axes_of, build_grid
from slipstick.clutch.ensemble import DEFAULT, Simulator
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import InvalidValue
from slipstick.machine import Machine, list_experiments
from slipstick.table import Grid, Table
from tests.benches import HEAVY, NOMINAL
from worker import cluster
from worker.__main__ import main
from worker.build import read_axes
from worker.cluster import Cluster
from worker.executors import explained
from worker.simulators import Simulators

ROOT = Path(__file__).parents[2]
AXES = ("pressure_bias=0.8:1.2:12", "initial_position=0.9:1.1:10")
PROGRAM = "import sys; from dask.__main__ import main; sys.exit(main())"

FUNCTION = '''
import time

def output(a, b):
    if a < 0.55:
        time.sleep(60)
    return a * b
'''
MACHINE = '''
title = "A function in trouble"
simulator = { callable = "slow_function:output", timeout = "0.2 s" }
output = { name = "c", unit = "m" }
inputs.a = { nominal = 1, range = [0.5, 1.5], points = 5 }
conditions.b = [1, 2, 3]
'''


class Dask:
    """A scheduler and its workers, one task at a time each."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self.folder = folder
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", self.address.rpartition(":")[2],
                                    "--no-dashboard")
        while True:
            try:
                socket.create_connection(("127.0.0.1", int(self.address.rpartition(":")[2]))).close()
                break
            except ConnectionRefusedError:
                assert self.scheduler.poll() is None
                time.sleep(0.05)
        self.workers: list[subprocess.Popen[bytes]] = []

    def start(self, *arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, "-c", PROGRAM, *arguments], cwd=self.folder, env={
            **os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", **environment},
            stderr=subprocess.DEVNULL)

    def add_worker(self, *options: str, **environment: str) -> subprocess.Popen[bytes]:
        self.workers.append(self.start("worker", self.address, "--no-nanny", "--no-dashboard", "--nthreads", "1",
                                       "--host", "127.0.0.1", *options, **environment))
        return self.workers[-1]

    def stop(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dask]:
    dask = Dask(tmp_path_factory.mktemp("dask"))
    for _ in range(2):
        dask.add_worker()
    yield dask
    dask.stop()


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch) -> Plan:
    monkeypatch.setattr("slipstick.building.plan.CHUNK", 216)  # a point
    spans = read_axes(AXES, "NAME=LOW:HIGH:COUNT")
    assert spans is not None
    return Plan(NOMINAL, HEAVY.conditions, axes_of(NOMINAL, spans), DEFAULT)


def built(plan: Plan, out: Path, executor: Executor, report: Callable[[int, int], None] = lambda *_: None) -> Grid:
    with executor, explained():
        return build_grid(plan, out, executor, report)


def wait_for_workers(executor: Cluster, count: int) -> None:
    deadline = time.monotonic() + 60
    while executor.threads != count:
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.slow
def test_a_killed_worker_does_not_change_the_digest(dask: Dask, plan: Plan, tmp_path: Path) -> None:
    expected = built(plan, tmp_path / "here.h5", ThreadPoolExecutor(2))
    executor, done = Cluster(dask.address), []
    wait_for_workers(executor, 2)

    def report(finished: int, resumed: int) -> None:
        done.append(finished)
        if len(done) == 20:
            dask.workers[0].kill()

    table = built(plan, tmp_path / "there.h5", executor, report)
    assert dask.workers.pop(0).wait() == -9
    assert done[19] < done[-1] / 2
    assert table.digest == expected.digest == Table.open(tmp_path / "there.h5").digest


def test_fits_simulate_on_the_cluster(dask: Dask) -> None:
    points = np.random.default_rng(1).uniform(0.8, 1.2, (7, 2))
    axes = ("pressure_bias", "initial_position")
    there = Simulators(dask=dask.address).of_clutch(NOMINAL, axes)
    np.testing.assert_array_equal(there(points, HEAVY.conditions), Simulator(NOMINAL, axes)(points, HEAVY.conditions))


def test_no_scheduler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(cluster, "_SECONDS", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense", "carrier://127.0.0.1:9"):
        assert main(["build", "--dask", address, "--out", str(tmp_path / "a.h5")]) == 1
        assert f"There is no Dask scheduler at '{address}'" in capsys.readouterr().err


@pytest.mark.slow
def test_a_scheduler_without_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    empty = Dask(tmp_path)
    try:
        monkeypatch.setattr(cluster, "_SECONDS", 5.0)
        with pytest.raises(InvalidValue, match="has no workers"):
            Cluster(empty.address)
    finally:
        empty.stop()


@pytest.mark.slow
def test_a_worker_with_another_program_is_refused(dask: Dask, tmp_path: Path) -> None:
    for package in ("slipstick", "worker"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / "slipstick" / "errors.py").open("a") as changed:
        changed.write("# another version\n")
    executor = Cluster(dask.address)
    before = executor.threads
    other = dask.add_worker(PYTHONPATH=str(tmp_path))
    wait_for_workers(executor, before + 1)
    with pytest.raises(InvalidValue, match="another version of Slipstick"), executor:  # it joined after the start
        list(executor.map(math.sqrt, range(200)))
    with pytest.raises(InvalidValue, match="another version of Slipstick"):
        Cluster(dask.address)
    other.kill()
    dask.workers.remove(other)
    with Cluster(dask.address) as executor:
        wait_for_workers(executor, before)
        assert list(executor.map(math.sqrt, (4, 9))) == [2, 3]


@pytest.mark.slow
def test_a_killed_scheduler_ends_a_build_which_resumes(plan: Plan, tmp_path: Path) -> None:
    lost, finished = Dask(tmp_path), []
    lost.add_worker()

    def report(done: int, resumed: int) -> None:
        finished.append(done)
        if len(finished) == 5:
            lost.scheduler.kill()

    try:
        with pytest.raises(InvalidValue, match="The Dask scheduler has ended"):
            built(plan, tmp_path / "a.h5", Cluster(lost.address), report)
    finally:
        lost.stop()
    resumed: list[int] = []
    table = built(plan, tmp_path / "a.h5", ThreadPoolExecutor(2), lambda *both: resumed.append(both[1]))
    assert resumed[0] >= finished[4]
    assert table.digest == built(plan, tmp_path / "b.h5", ThreadPoolExecutor(2)).digest


@pytest.mark.slow
def test_commands_write_the_same_tables(dask: Dask, tmp_path: Path) -> None:
    axes = ("--axis", "pressure_bias=0.8:1.2", "--axis", "initial_position=0.8:1.2")
    training = ("--runs", "300", "--steps", "200")
    grid = ("--axis", "pressure_bias=0.8:1.2:30", "--axis", "initial_position=0.8:1.2:20")
    (tmp_path / "slow_function.py").write_text(FUNCTION)
    (tmp_path / "machine.toml").write_text(MACHINE)
    machine = ("--machine", str(tmp_path / "machine.toml"))
    for number, command in enumerate((("build", *grid), ("surrogate", *axes, *training), ("build", *machine))):
        here, there = tmp_path / f"here{number}.h5", tmp_path / f"there{number}.h5"
        assert main([*command, "--out", str(here)]) == 0
        assert main([*command, "--out", str(there), "--dask", dask.address]) == 0
        assert Table.open(here).digest == Table.open(there).digest
    assert Table.open(there).status[0, 0] == FAILED  # the call that takes too long was ended on the cluster as well
    file = BlackBox.open(tmp_path / "machine.toml")
    points = np.array([[0.7], [1.2]])
    on_cluster = Simulators({file.description.digest: file}, dask.address).of_machine(file.description, ["a"])
    here = Simulators({file.description.digest: file}).of_machine(file.description, ["a"])
    np.testing.assert_array_equal(on_cluster(points, file.cases), here(points, file.cases))
    (tmp_path / "slow_function.py").write_text(FUNCTION.replace("a * b", "a + b"))
    with pytest.raises(InvalidValue, match="source of the Python callable differs"):
        on_cluster(points, file.cases)


@pytest.mark.slow
def test_a_callable_needs_a_worker_that_may_start_processes(tmp_path: Path) -> None:
    for daemon in ("True", "False"):
        dask = Dask(tmp_path)
        worker = dask.start("worker", dask.address, "--no-dashboard", "--host", "127.0.0.1", "--nthreads", "1",
                            DASK_DISTRIBUTED__WORKER__DAEMON=daemon)
        try:
            with Cluster(dask.address, needs_main_thread=True) as executor:
                future = executor.submit(math.sqrt, 4)
                if daemon == "True":
                    with pytest.raises(InvalidValue, match="DASK_DISTRIBUTED__WORKER__DAEMON=False"):
                        future.result()
                else:
                    assert future.result() == 2
        finally:
            worker.terminate()
            worker.wait()
            dask.stop()


@pytest.mark.slow
def test_cases_of_the_evidence_are_answered_alike(dask: Dask, tmp_path: Path) -> None:
    case = ("nothing_missing", 411)
    here, = answer_cases("naming", [case], work=tmp_path / "here")
    there, = answer_cases("naming", [case], dask.address, tmp_path / "there")
    assert not here.answer.error
    assert replace(there.answer, seconds=0.0) == replace(here.answer, seconds=0.0)
    assert there.truth == here.truth


@pytest.mark.slow
def test_a_study_of_a_machine_computes_its_runs_on_the_cluster(
        dask: Dask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = Machine.open("two_tanks")
    experiments = list_experiments(machine)
    simulate_runs(machine, experiments.take(np.arange(24) % len(experiments)), seed=1).save(tmp_path / "runs.h5")
    monkeypatch.setattr("slipstick.engine.part_fit._TOGETHER", 8 * len(experiments.time))
    studied = list[dict[str, object]]()
    with Cluster(dask.address) as watching:
        for name, options in (("there", ("--dask", dask.address)), ("here", ())):
            before = transitions(watching)
            assert main(["study", str(tmp_path / "runs.h5"), "--machine", "two_tanks",
                         "--out", str(tmp_path / f"{name}.json"), *options]) == 0
            studied.append(json.loads((tmp_path / f"{name}.json").read_text())["result"])
            assert (transitions(watching) > before + 50) == (name == "there")
    assert studied[0] == studied[1]


def transitions(executor: Cluster) -> int:
    """How often tasks have changed their state, several times each."""
    return executor._client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.transition_counter)


@pytest.mark.slow
def test_a_fit_of_a_job_on_the_cluster_has_the_same_result(
        dask: Dask, shelf: Path, few_recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        launch: Callable[..., subprocess.Popen[bytes]]) -> None:
    monkeypatch.setenv("SLIPSTICK_DASK", dask.address)
    dask.add_worker()
    bench, results = Bench(shelf, few_recordings / "few.h5", tmp_path, launch), []
    body = {"simulate": True, "recordings": "few", "parameters": ["initial_position", "pressure_bias"],
            "settings": {**SETTINGS, "generations": 30, "patience": 30, "refine": False, "intervals": False}}
    with Cluster(dask.address) as watching:
        for name in ("there", "here"):
            before = transitions(watching)
            bench.post("/v1/fits", name, body)
            bench.follow(name, in_stage("search", 2))
            if name == "there":
                dask.workers.pop().kill()
            assert bench.follow(name, ended)["status"] == "done"
            results.append(bench.client.get(f"/v1/fits/{name}/result").json()["result"])
            computed = transitions(watching) > before + 50
            assert computed == (name == "there")
            bench.kill(bench.worker)
            monkeypatch.delenv("SLIPSTICK_DASK", raising=False)
            bench.work()
    assert results[0] == results[1]
    bench.kill(bench.worker, bench.service)
