"""Time the ensemble once for each line of standard input: `python -m benchmarks.catalogue full|bare|three`.

With `bare`, the ensemble is compiled without any effect. Each needs its own process, because the catalogue is compiled
into the ensemble. With `three`, effects on line pressure and friction, one with a memory, are active at a hundredth of
their typical coefficients, so that engagements take as long as without.
"""

import sys
import time

from slipstick.clutch import effects

if sys.argv[1] == "bare":
    effects.CATALOGUE = ()

from benchmarks.benches import AXES, HEAVY, make_grid
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

grid, conditions, model = make_grid(20), HEAVY.conditions, Model(HEAVY.physics)
for name in ("supply_droop", "stribeck_friction", "thermal_fade") if sys.argv[1] == "three" else ():
    coefficients = effects.find(name).coefficients
    model = model.with_effect(name, {c.name: c.typical if c.shape else 0.01 * c.typical for c in coefficients})
ensemble.shifting_times(model, conditions, AXES, grid[:2])
print("ready", flush=True)
for _ in sys.stdin:
    start = time.perf_counter()
    ensemble.shifting_times(model, conditions, AXES, grid, threads=1)
    print(len(grid) * len(conditions) / (time.perf_counter() - start), flush=True)
