"""Deviations of a bench that look like an effect, although they are within its tolerances or change no quantity."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from .world import SENSORS, World

SESSIONS = ((0.4, 42.0, 40.0), (1.0, 55.0, 35.0))  # end in the test sequence, first oil temperature and its rise in °C
WARMING = 0.25  # of the test sequence
READING = 0.5  # °C, std of the noise of the thermometer


def tempted(world: World, seed: int, names: Iterable[str]) -> World:
    """Return the world with the `TEMPTATIONS` of some names."""
    for name in names:
        world = TEMPTATIONS[name](world, np.random.default_rng([seed, 6]))
    return world


def _loud(world: World, random: np.random.Generator) -> World:
    sensor = SENSORS[random.integers(len(SENSORS))]
    return replace(world, noise={**(world.noise or {}), sensor: 0.03}, memory={**(world.memory or {}), sensor: 0.9})


TEMPTATIONS: dict[str, Callable[[World, np.random.Generator], World]] = {
    "batches": lambda world, random: replace(world, batches=True),
    "ambient": lambda world, random: replace(world, ambient=0.02 * (1 if random.random() < 0.5 else -1)),
    "loud_sensor": _loud,
    "many_bad_runs": lambda world, random: replace(world, bad_runs=0.1),
    "thermometer": lambda world, random: replace(world, thermometer=True),
}


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
