"""What the sensors of runs read, and the signals with noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from .. import sensors
from . import motor, tanks
from .runs import PAST, Runs, prepare_inputs, respond
from .world import World

MACHINES: Mapping[str, ModuleType] = {"two tanks": tanks, "dc motor": motor}
"""Modules with the equations of the machines."""


@dataclass(frozen=True, eq=False)
class Reading:
    """Noiseless readings of the sensors, and all abscissas, of n runs, (n, k) by name at the times of the samples."""

    signals: sensors.Signals
    abscissas: dict[str, np.ndarray]


def simulate(runs: Runs, substeps: int | None = None, clocks: Mapping[str, float] | None = None) -> Reading:
    """Run without noise, with `substeps` integrator steps in a sampling period, by default the fine ones.

    `clocks` are the delays of sensors in sampling periods, rounded to integrator steps; before the start everything is
    as at the start. Raises `RuntimeError` where the integrator does not get to the end.
    """
    machine = MACHINES[runs.machine]
    substeps = machine.FINE if substeps is None else substeps
    inputs = prepare_inputs(runs, substeps)
    states = machine.integrate(runs, inputs)
    shape = states[next(iter(states))].shape
    every = {**states, "voltage": inputs.commanded.T, PAST: inputs.past.T,
             "time": np.broadcast_to(inputs.time, shape),
             **{name: np.broadcast_to(column[:, None], shape) for name, column in inputs.fixed.items()}}
    samples = np.arange(runs.count) * substeps
    signals = {}
    for name in machine.SIGNALS:
        late = np.maximum(samples - round((clocks or {}).get(name, 0.0) * substeps), 0)
        reading, change = states[name], runs.change
        if change is not None and change.quantity == f"{name} sensor" and change.lag is not None:
            reading = respond(runs, reading, inputs.step)
        seen = {key: rows[:, late] for key, rows in every.items()}
        signals[name] = reading[:, late] + runs.evaluate(f"{name} sensor", seen)
    return Reading(signals, {name: rows[:, samples] for name, rows in every.items()})


def measure(reading: Reading, world: World, random: np.random.Generator) -> sensors.Signals:
    """Return the signals (n, k) with noise, resolution and the spike of a world."""
    signals = sensors.add_noise(reading.signals, world.noise, world.memory, random)
    if world.spike is not None:
        start = world.spike.sample
        signals[world.spike.signal][world.spike.run, start:start + world.spike.length] += np.float32(world.spike.height)
    return signals
