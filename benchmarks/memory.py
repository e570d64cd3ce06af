"""Peak memory of a build against the number of cells of its table: `python -m benchmarks.memory`.

It writes memory.csv (some minutes, 3 GB of memory, 2 GB of disk). A build of the worker with one thread runs in a
process of its own for each size, with a cheap function in place of the simulator, so that what is measured is the
build: its chunks, the table, its file, and the verification of the file. Both axes have equally many points.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.benches import AXES, HEAVY
from benchmarks.results import write
from slipstick.building import Plan, build_grid
from slipstick.building.plan import Simulate
from slipstick.clutch.ensemble import DEFAULT
from slipstick.clutch.model import Model
from slipstick.table import Axis

HEADER = ("cells", "time [s]", "peak memory [MB]", "memory of the process before [MB]", "difference in bytes per cell")
SIZES = (100, 316, 1000)
"""Points of each axis; with 100 conditions, the last is a table of 1e8 cells."""
_CONDITIONS = 100


@dataclass(frozen=True, eq=False)
class CheapPlan(Plan):
    """A plan whose simulation is a sum."""

    @property
    def simulate(self) -> Simulate:
        """The times 0.1 (x + y) of all conditions, locked."""
        count = len(self.conditions)
        return lambda points: (np.repeat(0.1 * points.sum(axis=1, keepdims=True), count, axis=1),
                               np.zeros((len(points), count), np.uint8))


def build_one(size: int) -> None:
    """Build a table in this process; print the time in s, and the peak and the earlier memory in MB."""
    axes = tuple(Axis(name, np.linspace(0.5, 1.5, size), 1.0, "1") for name in AXES)
    plan = CheapPlan(Model(HEAVY.physics), HEAVY.conditions.take(range(_CONDITIONS)), axes, DEFAULT)
    before, begin = _peak(), time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="slipstick-memory-") as folder:
        build_grid(plan, Path(folder) / "table.h5", ThreadPoolExecutor(1), lambda done, resumed: None)
    print(time.perf_counter() - begin, _peak(), before)


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def main() -> None:
    """Measure each size, and write the table."""
    rows = []
    for size in SIZES:
        printed = subprocess.run([sys.executable, "-m", "benchmarks.memory", str(size)], check=True, text=True,
                                 stdout=subprocess.PIPE, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).stdout
        seconds, peak, before = map(float, printed.split())
        cells = size**2 * _CONDITIONS
        rows.append((cells, seconds, peak, before, 1e6 * (peak - before) / cells))
    write("memory", HEADER, rows, "python -m benchmarks.memory")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        build_one(int(sys.argv[1]))
    else:
        main()
