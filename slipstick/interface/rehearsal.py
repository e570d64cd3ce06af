"""What users run is compiled before they wait for it: small studies and a fit of what is shipped.

`python -m slipstick.interface.rehearsal` names what the blocks of a study ask for, and ends; a first study runs it
beside itself, on another core, while it compiles the simulator.
"""

import subprocess
import sys
from types import TracebackType

import numpy as np
from numba.core.event import Event, Listener, install_listener

from slipstick.bench import Bench
from slipstick.building import compile_simulator
from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.engine.simulation import simulate_runs
from slipstick.interface.build import build
from slipstick.interface.fit import fit
from slipstick.machine import Machine, list_experiments
from slipstick.machine_studies import study_machine
from slipstick.naming import name
from slipstick.recordings import Recordings
from slipstick.studies import StudySettings, conclude, examine

_AXES = {"pressure_bias": (0.7, 1.3, 5), "initial_position": (0.7, 1.3, 5)}
_RUNS = 6


def rehearse_clutch() -> None:
    """Study and fit every other engagement of the shipped sample."""
    bench, recordings, settings = *_sample(), StudySettings()
    named = examine(settings, bench, recordings)
    # Findings would be further fits by the same code, but for sensors that lag.
    conclude(settings, bench, recordings, {**named, "findings": []})
    lagged_signal(np.zeros((1, 2)), np.arange(2.0), np.zeros(1))
    table = build(bench, _AXES, conditions=recordings, progress=False)
    fit(table, recordings, progress=False, generations=2)


def rehearse_machines() -> None:
    """Study simulated runs of two shipped machines."""
    for shipped in ("two_tanks", "dry_clutch"):  # without and with surfaces
        machine = Machine.open(shipped)
        experiments = list_experiments(machine)
        study_machine(machine, simulate_runs(machine, experiments.take(np.arange(_RUNS) % len(experiments)), seed=1))


def compile_study(bench: Bench, recordings: Recordings) -> None:
    """Compile what a study runs, unless it is compiled: the simulator here, the blocks in a process beside."""
    with _Beside() as beside, install_listener("numba:compile", beside):
        compile_simulator(Model(bench.physics), recordings.conditions)
        beside.wait()


class _Beside(Listener):
    """Starts a process that compiles the blocks, when the simulator is being compiled, and ends it with the block."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def on_start(self, event: Event) -> None:
        """Numba has not found in its cache what is called, so that it has not the blocks either."""
        if self._process is None and event.data["dispatcher"].stats.cache_path:
            self._process = subprocess.Popen([sys.executable, "-m", __name__], stdin=subprocess.DEVNULL,
                                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def on_end(self, event: Event) -> None:
        """The process goes on."""

    def wait(self) -> None:
        """Wait until the process has compiled the blocks."""
        if self._process is not None:
            self._process.wait()

    def __enter__(self) -> "_Beside":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def _sample() -> tuple[Bench, Recordings]:
    recordings = Recordings.open("sample")
    return Bench.open("heavy"), recordings.take(np.arange(0, len(recordings), 2))


if __name__ == "__main__":
    bench, recordings = _sample()
    name(bench, recordings, StudySettings().naming)
