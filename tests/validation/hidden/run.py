"""Noiseless recordings: integration of the bench and sampling of its signals."""

from dataclasses import dataclass

import numpy as np

from . import sensors
from .bench import STICK, Bench, Quantities
from .nominal import HEAVY
from .stepping import Solution, integrate

SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque")
TIME = HEAVY.time


@dataclass(frozen=True)
class Run:
    """n engagements: index in the `conditions` of the setup, place in the test sequence, `lock_time` in s, (n,) each.

    `quantities` of the bench and noiseless sensor `readings` are (n, k) by name, at the times of its setup; `phase` is
    (3, n, k).
    """

    bench: Bench
    conditions: np.ndarray
    order: np.ndarray
    lock_time: np.ndarray
    phase: np.ndarray
    quantities: Quantities
    readings: sensors.Signals


def observe(bench: Bench, conditions: np.ndarray, order: np.ndarray, relative: float = 1e-8) -> Run:
    """Run the engagements; those that do not lock within the horizon are left out."""
    time = bench.setup.time
    solution = integrate(bench, *bench.start(), time[-1], relative)
    sticking = (solution.phase[:, 1] == STICK) & (solution.length > 0)
    lock_time = np.min(np.where(sticking, solution.start, np.inf), axis=0)
    locked = np.flatnonzero(np.isfinite(lock_time))
    bench, order = bench.take(locked), order[locked]
    phase, quantities = _quantities(bench, solution, locked, time)
    readings = {}
    for name in SIGNALS:
        late = bench.clocks.get(name, 0.0) * bench.setup.period
        # Before the command everything is as at the command.
        seen = _quantities(bench, solution, locked, np.maximum(time - late, 0.0))[1] if late else quantities
        readings |= sensors.read({name: seen[name]}, seen, bench)
    return Run(bench, conditions[locked], np.argsort(np.argsort(order)), lock_time[locked], phase, quantities, readings)


def _quantities(bench: Bench, solution: Solution, lanes: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, Quantities]:
    """Return phases (3, n, k) and quantities (n, k) of the engagements in `lanes` (n,) at `time` (k,)."""
    states, phase = (sampled[:, lanes] for sampled in solution.at(time))
    n, k = states.shape[1:]
    samples = bench.take(np.repeat(np.arange(n), k))
    flat = samples.quantities(np.tile(time, n), states.reshape(-1, n * k), phase.reshape(-1, n * k))
    del flat["rates"]
    return phase, {name: values.reshape(n, k) for name, values in flat.items()}
