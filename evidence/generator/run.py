"""Noiseless recordings: integration of the engagements and sampling of their signals."""

from dataclasses import dataclass

import numpy as np

from . import sensors
from .bench import SENSORS
from .engagements import Engagements
from .states import STICK, Quantities
from .stepping import Solution, integrate


@dataclass(frozen=True)
class Run:
    """n engagements: index in the conditions of the bench, place in the test sequence, `lock_time` in s, (n,) each.

    `lock_time` is infinite where the plates do not lock within the recording. `quantities` and noiseless sensor
    `readings` are (n, k) by name, at the times of the bench; `phase` is (3, n, k).
    """

    engagements: Engagements
    conditions: np.ndarray
    order: np.ndarray
    lock_time: np.ndarray
    phase: np.ndarray
    quantities: Quantities
    readings: sensors.Signals


def observe(engagements: Engagements, conditions: np.ndarray, order: np.ndarray, relative: float = 1e-8,
            locked_only: bool = True) -> Run:
    """Run the engagements; with `locked_only`, those that do not lock within the recording are left out.

    Raises `RuntimeError` where the integrator does not get to the end.
    """
    time = engagements.bench.time
    solution = integrate(engagements, *engagements.start(), time[-1], relative)
    sticking = (solution.phase[:, 1] == STICK) & (solution.length > 0)
    lock_time = np.min(np.where(sticking, solution.start, np.inf), axis=0)
    lanes = np.flatnonzero(np.isfinite(lock_time)) if locked_only else np.arange(len(lock_time))
    engagements, order = engagements.take(lanes), order[lanes]
    phase, quantities = _quantities(engagements, solution, lanes, time)
    readings = {}
    for name in SENSORS:
        late = engagements.clocks.get(name, 0.0) * engagements.bench.period
        # Before the command everything is as at the command.
        seen = _quantities(engagements, solution, lanes, np.maximum(time - late, 0.0))[1] if late else quantities
        readings[name] = sensors.read(name, seen, engagements)
    return Run(engagements, conditions[lanes], np.argsort(np.argsort(order)), lock_time[lanes], phase, quantities,
               readings)


def _quantities(engagements: Engagements, solution: Solution, lanes: np.ndarray,
                time: np.ndarray) -> tuple[np.ndarray, Quantities]:
    """Return phases (3, n, k) and quantities (n, k) of the engagements in `lanes` (n,) at `time` (k,)."""
    states, phase = (sampled[:, lanes] for sampled in solution.at(time))
    n, k = states.shape[1:]
    samples = engagements.take(np.repeat(np.arange(n), k))
    flat = samples.quantities(np.tile(time, n), states.reshape(len(states), n * k), phase.reshape(len(phase), n * k))
    del flat["rates"]
    return phase, {name: values.reshape(n, k) for name, values in flat.items()}
