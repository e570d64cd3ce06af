"""How a study grows with the number of runs: processor time for each run, and the largest memory.

    python -m evidence.growth

Runs of 1,000 samples of the shipped two tanks are studied, in which the second outlet loses a tenth of its flow at
high levels. Each number of runs has a process of its own. The result is `growth.csv`.
"""

import argparse
import multiprocessing
import resource
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, astuple, dataclass, replace
from pathlib import Path

import numpy as np

from evidence.kept import read_count
from evidence.tables import write_table
from slipstick.engine.measured_law import Law
from slipstick.engine.simulation import simulate_runs
from slipstick.engine.study import study
from slipstick.machine import Machine, Runs, list_experiments

TABLE = Path(__file__).with_suffix(".csv")
COUNTS = 54, 200, 700, 2000
_STEP = 0.2
_LEVELS = np.linspace(0.0, 1.0, 11)
_LOST = Law(("outflow 2", "level 2"), "curve", "", "m", _LEVELS, -0.1 * np.tanh(4 * _LEVELS),
            np.zeros((len(_LEVELS), len(_LEVELS))), 0, relative=True)


@dataclass(frozen=True)
class Growth:
    """A study of `runs` of so many samples: processor time in s and for each run in ms, and what it finds.

    `most_mb` is the largest memory of the process, and `before_mb` that with the runs alone.
    """

    runs: int
    samples: int
    processor_seconds: float
    ms_a_run: float
    before_mb: int
    most_mb: int
    findings: str


def draw_runs(machine: Machine, count: int) -> Runs:
    """Return runs of the experiments of a machine, each as often as it takes, with what is hidden in them."""
    experiments = list_experiments(replace(machine, step=_STEP))
    return simulate_runs(machine, experiments.take(np.arange(count) % len(experiments)), laws=(_LOST,), seed=1)


def measure_growth(count: int) -> Growth:
    """Study so many runs; the memory is that of this process, which should not have done anything else."""
    machine = Machine.open("two_tanks")
    runs, before, begin = draw_runs(machine, count), _find_most_mb(), time.process_time()
    findings = study(machine, runs).findings
    seconds = time.process_time() - begin
    return Growth(count, len(runs.time), round(seconds, 1), round(1e3 * seconds / count, 1), before, _find_most_mb(),
                  " + ".join(" over ".join(finding.pair) for finding in findings))


def _find_most_mb() -> int:
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(prog="python -m evidence.growth", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("counts", nargs="*", type=read_count, default=COUNTS, metavar="RUNS",
                        help=f"numbers of runs (default: {' '.join(map(str, COUNTS))})")
    parser.add_argument("--out", type=Path, default=TABLE, help=f"table that is written (default: {TABLE.name})")
    chosen = parser.parse_args(arguments)
    rows = list[Growth]()
    for count in chosen.counts:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
            rows.append(process.submit(measure_growth, count).result())
        print(rows[-1], flush=True)
    write_table(chosen.out, [*asdict(rows[0])], map(astuple, rows))


if __name__ == "__main__":
    main()
