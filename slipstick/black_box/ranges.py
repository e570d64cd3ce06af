"""What the signals of a machine reach in its own experiments, to which recordings are compared."""

import numpy as np

from slipstick.black_box.function import limit_time
from slipstick.engine.simulation import compile_kernels, simulate_runs
from slipstick.machine import Machine, SignalRange, list_experiments

_SECONDS = 5.0
"""Longest simulation: a worker tells of its machines before it takes jobs."""


def simulate_ranges(machine: Machine) -> tuple[SignalRange, ...]:
    """Simulate the experiments of a machine once, and return the range of each signal that is finite in all of them.

    There is none where it declares no experiments, or where these fail or take more than seconds.
    """
    compile_kernels()
    try:
        with limit_time(_SECONDS), np.errstate(all="ignore"):
            signals = simulate_runs(machine, list_experiments(machine)).signals
    except Exception:  # of any kind: the equations are those of a file, which need not say how the machine is run
        return ()
    return tuple(SignalRange(name, float(values.min()), float(values.max())) for name, values in signals.items()
                 if np.isfinite(values).all())
