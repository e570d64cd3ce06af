"""The simulator is compiled before a clock starts, beside a worker for jobs."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.building.compiling import MESSAGE
from slipstick.interface import build
from slipstick.storage.library import Library
from tests.benches import HEAVY
from worker import fit_steps
from worker.simulators import Simulators

ROOT = Path(__file__).parents[2]


CACHED = """
from numba import njit
from slipstick.building import say_compilation

@njit(cache=True)
def double(x):
    return 2 * x

@njit
def triple(x):
    return 3 * x

with say_compilation("compiles"):
    triple(1)
print("silent", flush=True)
with say_compilation("compiles"):
    double(1)
    double(1.5)
"""


def test_a_compilation_is_said_once_and_loading_from_the_cache_is_not(tmp_path: Path) -> None:
    (tmp_path / "cached.py").write_text(CACHED)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    said = [subprocess.run([sys.executable, "cached.py"], cwd=tmp_path, env=environment, check=True, text=True,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout for _ in range(2)]
    assert said == ["silent\ncompiles\n", "silent\n"]


@pytest.mark.slow
def test_the_first_use_of_the_simulator_says_at_once_that_it_compiles(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "worker.compiling", "tables/heavy.toml"]
    with subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True) as first:
        begin = time.monotonic()
        assert first.stderr is not None
        assert first.stderr.readline() == f"{MESSAGE}\n"
        until_said = time.monotonic() - begin
        assert first.wait() == 0
        assert until_said < (time.monotonic() - begin) / 2
    again = subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True, text=True)
    assert again.stderr == ""


def test_a_build_compiles_before_its_progress_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    monkeypatch.setattr(build, "compile_simulator", lambda *_: order.append("compiled"))
    build.build(HEAVY, {"pressure_bias": (0.9, 1.1, 2)}, progress=lambda text, share: order.append(text))
    assert order[:2] == ["compiled", "0 of 432 engagements"]


def test_a_fit_by_simulation_simulates_once_before_its_search(shelf: Path) -> None:
    """The stage `start` is reported before the first run, during which the simulator may be compiled."""
    seen: list[Any] = []

    class Counting(Simulators):
        def of_clutch(self, model: Any, axes: tuple[str, ...]) -> Any:
            def simulate(points: np.ndarray, conditions: Any, /) -> np.ndarray:
                seen.append(len(points))
                return np.full((len(points), len(conditions)), 0.5)

            return simulate

    library = Library(shelf)
    bench, table, recordings = library.bench("heavy"), library.table("nominal"), library.recording("measured")
    order = {"table": "nominal", "table_digest": table.digest, "recordings": "measured",
             "recordings_digest": recordings.digest, "bench": "heavy", "bench_digest": bench.digest,
             "sensing_digest": bench.sensing_digest, "outside": "clip", "settings": {}, "simulate": True,
             "parameters": ["pressure_bias", "initial_position"]}
    fit_steps.start(library, lambda progress: seen.append(progress["stage"]), Counting(), order)
    assert seen == ["start", 1]
    seen.clear()
    fit_steps.start(library, lambda progress: seen.append(progress["stage"]), Counting(), {**order, "simulate": False})
    assert seen == []


@pytest.mark.slow
def test_the_image_has_what_jobs_run() -> None:
    _, after = (ROOT / "Dockerfile").read_text().split("NUMBA_CACHE_DIR")
    command = next(line for line in after.splitlines() if "worker.rehearsal" in line).removeprefix("RUN python").split()
    subprocess.run([sys.executable, *command], cwd=ROOT, check=True)


_MISSES = """
import sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from slipstick.bench import Bench
from slipstick.recordings import Recordings
from slipstick.studies import StudySettings, conclude, examine
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Machine, list_experiments
from slipstick.machine_studies import study_machine
machine = Machine.open("dc_motor")
study_machine(machine, simulate_runs(machine, list_experiments(machine), seed=2))
bench, settings = Bench.open("tables/heavy.toml"), StudySettings()
recordings = Recordings.open("tables/measured.h5").take(np.arange(0, 216, 9))
conclude(settings, bench, recordings, examine(settings, bench, recordings))
kernels = {id(its): its for module in list(sys.modules.values()) if module.__name__.startswith("slipstick")
           for its in vars(module).values() if isinstance(its, Dispatcher)}
print(sum(sum(its.stats.cache_hits.values()) for its in kernels.values()),
      *(its.__qualname__ for its in kernels.values() if its.stats.cache_path and sum(its.stats.cache_misses.values())))
"""


@pytest.mark.slow
def test_a_study_compiles_nothing_afterwards(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-m", "worker.rehearsal"], cwd=ROOT, env=environment, check=True)
    found = subprocess.run([sys.executable, "-c", _MISSES], cwd=ROOT, env=environment, check=True, capture_output=True,
                           text=True)
    hits, *missed = found.stdout.split()
    assert int(hits) > 10
    assert missed == []
