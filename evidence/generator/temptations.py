"""Deviations of a bench that look like an effect, although they are within its tolerances or change no quantity."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .bench import SENSORS, Bench
from .world import World

SESSIONS = ((0.4, 42.0, 40.0), (1.0, 55.0, 35.0))  # end in the test sequence, first oil temperature and its rise in °C
WARMING = 0.25  # of the test sequence
READING = 0.5  # °C, std of the noise of the thermometer


def _with_loud_sensor(world: World, bench: Bench, random: np.random.Generator) -> World:
    sensor = SENSORS[random.integers(len(SENSORS))]
    return replace(world, noise={**world.noise, sensor: 0.03 * bench.ranges[sensor]},
                   memory={**world.memory, sensor: 0.9})


TEMPTATIONS: dict[str, Callable[[World, Bench, np.random.Generator], World]] = {
    "batches": lambda world, bench, random: replace(world, batches=True),
    "ambient": lambda world, bench, random: replace(world, ambient=0.02 * (1 if random.random() < 0.5 else -1)),
    "loud_sensor": _with_loud_sensor,
    "many_bad_runs": lambda world, bench, random: replace(world, bad_runs=0.1),
    "thermometer": lambda world, bench, random: replace(world, thermometer=True),
}
"""Name of a deviation, and how it changes a world."""


def second_batch(order: np.ndarray) -> np.ndarray:
    """Return which of the runs (n,) with the places `order` in the test sequence are of its second half."""
    return order >= len(order) / 2


def oil_temperature(order: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return the oil temperature of each run (n,) in °C: it rises in two sessions and scatters."""
    sequence = order / max(len(order) - 1, 1)
    temperature, start = np.zeros(len(order)), 0.0
    for end, first, rise in SESSIONS:
        warmed = first + rise * (1 - np.exp(-(sequence - start) / WARMING))
        temperature = np.where((sequence >= start) & (sequence <= end), warmed, temperature)
        start = end
    return temperature + 3.0 * random.standard_normal(len(order))
