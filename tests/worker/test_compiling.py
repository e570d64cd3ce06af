"""The simulator is compiled before a clock starts, beside a worker for jobs; and what is said of the progress."""

import argparse
import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.storage.library import Library
from worker import build, compiling, fit_steps
from worker.progress import Progress
from worker.simulators import Simulators

ROOT = Path(__file__).parents[2]


def test_a_compilation_is_said_and_loading_is_not(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
                                                  six_conditions) -> None:
    said: list[bool] = []
    monkeypatch.setattr(compiling, "_SILENT_SECONDS", 0.0)
    monkeypatch.setattr(compiling, "signals", lambda *_, **__: said.append(wait_for("Compiling", capsys)))
    compiling.compile_simulator(None, six_conditions)
    assert said == [True]
    monkeypatch.setattr(compiling, "_SILENT_SECONDS", 1e6)
    monkeypatch.setattr(compiling, "signals", lambda *_, **__: None)
    compiling.compile_simulator(None, six_conditions)
    assert capsys.readouterr().err == ""


def wait_for(text: str, capsys: pytest.CaptureFixture[str]) -> bool:
    while text not in capsys.readouterr().err:
        pass
    return True


def test_a_build_compiles_before_its_progress_starts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Started(Exception):
        pass

    def started(*_: object) -> None:
        raise Started

    order: list[str] = []
    monkeypatch.setattr(build, "compile_simulator", lambda *_: order.append("compiled"))
    monkeypatch.setattr(build, "Progress", started)
    with pytest.raises(Started):
        run(build, "--bench", str(ROOT / "tables" / "heavy.toml"), "--out", str(tmp_path / "table.h5"))
    assert order == ["compiled"]


def run(command: Any, *arguments: str) -> None:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    command.run(parser.parse_args(arguments))


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


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_log_has_few_lines_and_ends_with_the_rate():
    log = io.StringIO()
    progress = Progress(1000, "engagements", log)
    for done in range(200, 1001):
        progress(done, 200)
    first, last = log.getvalue().splitlines()
    assert first == "200 of 1,000 engagements, 200 from an earlier run"
    assert last.startswith("1,000 of 1,000 engagements, 200 from an earlier run, ")
    assert " per second, " in last


def test_a_terminal_shows_one_updated_line():
    terminal = Terminal()
    progress = Progress(10, "engagements", terminal)
    for done in (0, 5, 10):
        progress(done, 0)
    assert terminal.getvalue().count("\n") == 1
    assert terminal.getvalue().endswith("\n")
    assert "\r10 of 10" in terminal.getvalue()
