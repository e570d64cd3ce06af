"""Time the ensemble once for each line of standard input: `python -m benchmarks.catalogue full|bare`.

With `bare`, the ensemble is compiled without any effect. Each needs its own process, because the catalogue is compiled
into the ensemble.
"""

import sys
import time

from slipstick.clutch import effects

if sys.argv[1] == "bare":
    effects.CATALOGUE = ()

from benchmarks.benches import HEAVY
from benchmarks.grid import AXES, points
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

grid, conditions = points(20), HEAVY.conditions
ensemble.shifting_times(Model(HEAVY.physics), conditions, AXES, grid[:2])
print("ready", flush=True)
for _ in sys.stdin:
    start = time.perf_counter()
    ensemble.shifting_times(Model(HEAVY.physics), conditions, AXES, grid, threads=1)
    print(len(grid) * len(conditions) / (time.perf_counter() - start), flush=True)
