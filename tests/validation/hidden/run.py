"""Noiseless recordings: the bench integrated and sampled."""

from dataclasses import dataclass

import numpy as np

from . import sensors
from .bench import STICK, Bench, Quantities
from .stepping import integrate

SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque")
TIME = np.arange(1001) * sensors.PERIOD


@dataclass(frozen=True)
class Run:
    """n engagements: `conditions` among the 216, place in the sequence from 0, `lock_time` in s, each (n,).

    `quantities` of the bench (n, k) by name, and what noiseless sensors read, at `TIME`; `phase` is (3, n, k).
    """

    bench: Bench
    conditions: np.ndarray
    order: np.ndarray
    lock_time: np.ndarray
    phase: np.ndarray
    quantities: Quantities
    readings: sensors.Signals


def observe(bench: Bench, conditions: np.ndarray, order: np.ndarray, relative: float = 1e-8) -> Run:
    """Run the engagements; those whose shafts do not meet within `TIME` are left out."""
    course = integrate(bench, *bench.start(), TIME[-1], relative)
    stuck = (course.phase[:, 1] == STICK) & (course.length > 0)
    lock_time = np.min(np.where(stuck, course.start, np.inf), axis=0)
    kept = np.flatnonzero(np.isfinite(lock_time))
    states, phase = (sampled[:, kept] for sampled in course.at(TIME))
    n, k = states.shape[1:]
    samples = bench.take(np.repeat(kept, k))
    flat = samples.quantities(np.tile(TIME, n), states.reshape(-1, n * k), phase.reshape(-1, n * k))
    del flat["rates"]
    quantities = {name: values.reshape(n, k) for name, values in flat.items()}
    readings = sensors.read({name: quantities[name] for name in SIGNALS}, quantities, bench.effects)
    ranks = np.argsort(np.argsort(order[kept]))
    return Run(bench.take(kept), conditions[kept], ranks, lock_time[kept], phase, quantities, readings)
