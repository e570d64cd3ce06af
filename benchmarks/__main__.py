"""`make bench`: the simulator beside its peers in one run, round after round, into benchmarks/simulator.csv.

Every method is held to 1e-4 s of the tight ensemble. Rates are simulations a second on one core but where said;
ratios are taken within a round, so that a busy machine slows both sides.
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
from benchmarks.grid import AXES, points
from slipstick.bench import parameters
from slipstick.bench.conditions import paper_conditions
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

ROUNDS = 9
DOPRI_TOLERANCE, SCIPY_TOLERANCE = 1e-6, 3e-4
SCIPY_RUNS = [(point, condition) for point in (0, 1275, 2499) for condition in range(4, 216, 54)]
CONDITIONS, MODEL = paper_conditions(), Model()


def main() -> None:
    """Measure and write."""
    whole = points(50)
    tight = ensemble.shifting_times(MODEL, CONDITIONS, AXES, whole, ensemble.TIGHT)[0]
    share = np.arange(0, len(whole), 25)

    def ours() -> np.ndarray:
        return ensemble.shifting_times(MODEL, CONDITIONS, AXES, whole[share], threads=1)[0]

    def ours_all_cores() -> np.ndarray:
        return ensemble.shifting_times(MODEL, CONDITIONS, AXES, whole)[0]

    def scalar(rows: np.ndarray = share) -> np.ndarray:
        vectors = np.tile(MODEL.parameters, (len(rows), 1))
        for column, name in enumerate(AXES):
            vectors[:, parameters.index(name)] *= whole[rows, column]
        initial, speed = ensemble.initial_input_speed(vectors, CONDITIONS)
        return scalar_dopri.shifting_times(
            vectors, CONDITIONS.current_profile, CONDITIONS.profile_time, CONDITIONS.profile_current,
            CONDITIONS.motor_speed, CONDITIONS.load_inertia, CONDITIONS.brake_torque, initial[:, speed],
            DOPRI_TOLERANCE)

    def script() -> np.ndarray:
        times = []
        for point, condition in SCIPY_RUNS:
            factors = dict(zip(AXES, whole[point], strict=True))
            p = {name: value * factors.get(name, 1.0)
                 for name, value in zip(parameters.NAMES, MODEL.parameters, strict=True)}
            times.append(scipy_script.shifting_time(p, CONDITIONS, condition, SCIPY_TOLERANCE))
        return np.array(times)

    tight_of_script = np.array([tight[point, condition] for point, condition in SCIPY_RUNS])
    errors = {"ensemble": np.abs(ours_all_cores() - tight).max(),
              "scalar": np.abs(scalar(np.arange(len(whole))) - tight).max(),
              "script": np.abs(script() - tight_of_script).max()}
    full, bare = Child("full"), Child("bare")
    rates: dict[str, list[float]] = {name: [] for name in ("one", "all", "scalar", "script", "full", "bare")}
    for number in range(ROUNDS):
        rates["one"].append(rate(ours))
        rates["scalar"].append(rate(scalar))
        rates["script"].append(rate(script))
        rates["all"].append(rate(ours_all_cores))
        rates["full"].append(full.rate())
        rates["bare"].append(bare.rate())
        print(f"round {number + 1} of {ROUNDS}", file=sys.stderr)
    of = {name: np.array(values) for name, values in rates.items()}
    rows = [
        ("ensemble, one core [1/s]", of["one"], errors["ensemble"]),
        ("ensemble, all cores [1/s]", of["all"], errors["ensemble"]),
        ("scalar Dormand-Prince 5(4) in numba, one core [1/s]", of["scalar"], errors["scalar"]),
        ("first scipy script, one core [1/s]", of["script"], errors["script"]),
        ("ratio: ensemble to scalar Dormand-Prince, one core", of["one"] / of["scalar"], None),
        ("ratio: ensemble to scipy script, one core", of["one"] / of["script"], None),
        ("ratio: ensemble on all cores to scipy script", of["all"] / of["script"], None),
        ("ratio: time with the neutral catalogue to time without any effect", of["bare"] / of["full"], None),
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
    """Simulations a second."""
    begun = time.perf_counter()
    count = job().size
    return count / (time.perf_counter() - begun)


class Child:
    """The ensemble in a process of its own, with the `full` or the `bare` catalogue compiled in."""

    def __init__(self, catalogue: str) -> None:
        self.process = subprocess.Popen([sys.executable, "-m", "benchmarks.catalogue", catalogue], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.process.stdout
        self.process.stdout.readline()

    def rate(self) -> float:
        """Have it run once; simulations a second."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())


if __name__ == "__main__":
    main()
