"""`make bench`: the simulator compared with other codes in alternating rounds; writes benchmarks/simulator.csv.

The tolerance of each method is chosen for an error of about 1e-4 s against the tight ensemble. Rates are simulations
per second, on one core unless stated otherwise. Ratios are computed within a round, so that the load of the machine
affects both sides.
"""

import csv
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks import scalar_dopri, scipy_script
from benchmarks.benches import HEAVY
from benchmarks.grid import AXES, points
from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

ROUNDS = 9
DOPRI_TOLERANCE, SCIPY_TOLERANCE = 1e-6, 3e-4
SCIPY_RUNS = [(point, condition) for point in (0, 1275, 2499) for condition in range(4, 216, 54)]
CONDITIONS, MODEL = HEAVY.conditions, Model(HEAVY.physics)


def main() -> None:
    """Run the benchmark and write the table."""
    grid = points(50)
    tight = ensemble.shifting_times(MODEL, CONDITIONS, AXES, grid, ensemble.TIGHT)[0]
    subset = np.arange(0, len(grid), 25)

    def one_core() -> np.ndarray:
        return ensemble.shifting_times(MODEL, CONDITIONS, AXES, grid[subset], threads=1)[0]

    def all_cores() -> np.ndarray:
        return ensemble.shifting_times(MODEL, CONDITIONS, AXES, grid)[0]

    def scalar(rows: np.ndarray = subset) -> np.ndarray:
        vectors = np.tile(MODEL.parameters, (len(rows), 1))
        for column, name in enumerate(AXES):
            vectors[:, parameters.index(name)] *= grid[rows, column]
        initial, speed = ensemble.initial_input_speed(HEAVY.physics.converter, vectors, CONDITIONS)
        return scalar_dopri.shifting_times(
            vectors, CONDITIONS.current_profile, CONDITIONS.profile_time, CONDITIONS.profile_current,
            CONDITIONS.motor_speed, CONDITIONS.load_inertia, CONDITIONS.brake_torque, initial[:, speed],
            DOPRI_TOLERANCE)

    def script() -> np.ndarray:
        times = []
        for point, condition in SCIPY_RUNS:
            factors = dict(zip(AXES, grid[point], strict=True))
            p = {name: value * factors.get(name, 1.0)
                 for name, value in zip(parameters.NAMES, MODEL.parameters, strict=True)}
            times.append(scipy_script.shifting_time(p, CONDITIONS, condition, SCIPY_TOLERANCE))
        return np.array(times)

    tight_of_script = np.array([tight[point, condition] for point, condition in SCIPY_RUNS])
    errors = {"ensemble": np.abs(all_cores() - tight).max(),
              "scalar": np.abs(scalar(np.arange(len(grid))) - tight).max(),
              "script": np.abs(script() - tight_of_script).max()}
    full, bare = CatalogueProcess("full"), CatalogueProcess("bare")
    measured: dict[str, list[float]] = {name: [] for name in ("one", "all", "scalar", "script", "full", "bare")}
    for number in range(ROUNDS):
        measured["one"].append(rate(one_core))
        measured["scalar"].append(rate(scalar))
        measured["script"].append(rate(script))
        measured["all"].append(rate(all_cores))
        measured["full"].append(full.rate())
        measured["bare"].append(bare.rate())
        print(f"round {number + 1} of {ROUNDS}", file=sys.stderr)
    rates = {name: np.array(values) for name, values in measured.items()}
    rows = [
        ("ensemble, one core [1/s]", rates["one"], errors["ensemble"]),
        ("ensemble, all cores [1/s]", rates["all"], errors["ensemble"]),
        ("scalar Dormand-Prince 5(4) in numba, one core [1/s]", rates["scalar"], errors["scalar"]),
        ("first scipy script, one core [1/s]", rates["script"], errors["script"]),
        ("ratio: ensemble to scalar Dormand-Prince, one core", rates["one"] / rates["scalar"], None),
        ("ratio: ensemble to scipy script, one core", rates["one"] / rates["script"], None),
        ("ratio: ensemble on all cores to scipy script", rates["all"] / rates["script"], None),
        ("ratio: time with the neutral catalogue to time without any effect", rates["bare"] / rates["full"], None),
    ]
    with Path("benchmarks/simulator.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["what", "median", "least", "most", "largest error [s]"])
        for what, values, error in rows:
            table.writerow([what, *(f"{f(values):.4g}" for f in (np.median, np.min, np.max)),
                            "" if error is None else f"{error:.2g}"])
        table.writerow([f"made by `make bench`: {ROUNDS} rounds, {platform.processor() or platform.machine()}, "
                        f"Python {platform.python_version()}", "", "", "", ""])
    print(Path("benchmarks/simulator.csv").read_text())


def rate(job: Callable[[], np.ndarray]) -> float:
    """Simulations per second of one call."""
    start = time.perf_counter()
    count = job().size
    return count / (time.perf_counter() - start)


class CatalogueProcess:
    """The ensemble in a separate process, compiled with the `full` or the `bare` catalogue."""

    def __init__(self, catalogue: str) -> None:
        self.process = subprocess.Popen([sys.executable, "-m", "benchmarks.catalogue", catalogue], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.process.stdout
        self.process.stdout.readline()

    def rate(self) -> float:
        """Simulations per second of one run of the ensemble."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())


if __name__ == "__main__":
    main()
