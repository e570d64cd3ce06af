"""Draws a machine and its runs: parameters, commanded voltages, conditions, temperatures and run order."""

from collections.abc import Mapping

import numpy as np

from ..world import with_errors
from . import motor, tanks
from .runs import Name, Runs
from .world import World

RUNS = (24, 54)  # least and most runs of a case
OFF = 0.1  # largest share by which the mean of a parameter is off its nominal number
LITTLE_OFF = {"area 1": 0.03, "area 2": 0.03, "inductance": 0.03, "rotor inertia": 0.03}
EXACT = ("inductance",)  # does not scatter
TEMPERATURES = {"two tanks": (8.0, 32.0), "dc motor": (20.0, 90.0)}
"""Least and greatest temperature in degC."""
_SPREAD = 0.22  # largest logarithm of a nominal number over a typical one
_CORNERS = 24  # most corners of a command


def draw_values(machine: str, random: np.random.Generator) -> dict[str, float]:
    """Draw the nominal numbers of a machine; tanks spill below 9 V, and do not run empty at 2 V."""
    typical: Mapping[str, float] = tanks.PARAMETERS if machine == "two tanks" else motor.PARAMETERS
    while True:
        spread = np.exp(random.uniform(-_SPREAD, _SPREAD, len(typical)))
        values = dict(zip(typical, (spread * [*typical.values()]).tolist(), strict=True))
        if machine == "dc motor":
            values |= {"viscous coefficient": float(np.exp(random.uniform(*np.log([3e-5, 1e-4])))),
                       "dry torque": float(random.uniform(0.01, 0.02))}
            return values
        first, second = (values["pump gain"] / values[outlet] for outlet in ("outlet 1", "outlet 2"))
        if 81 * first**2 > 0.75 and 4 * min(first, second) ** 2 > 0.03 and 100 * second**2 < 1.6:
            return values


def draw_nominal(machine: Name, values: dict[str, float],
                 random: np.random.Generator) -> tuple[Runs, dict[str, float]]:
    """Return nominal runs, and the nominal numbers, where the inductance suits the sampling period."""
    n = int(random.integers(RUNS[0], RUNS[1] + 1))
    if machine == "two tanks":
        count = int(random.integers(300, 601))
        period = round(random.uniform(300.0, 600.0) / count, 2)
        conditions = {f"start level {tank}": np.round(random.uniform(0.1, 0.4, n), 3) for tank in (1, 2)}
        tick, draw = period / tanks.FINE, _draw_pump
    else:
        period = round(random.uniform(1.2e-3, 2.4e-3), 5)
        count = int(np.clip(random.uniform(1.0, 2.5) / period, 450, 1000))
        values = {**values, "inductance": min(values["resistance value"] * period * random.uniform(1.6, 3.0), 5e-3)}
        levels = np.arange(random.integers(3, 5)) * round(random.uniform(0.01, 0.03), 3)
        conditions = {"load torque": random.permutation(np.resize(levels, n))}
        tick, draw = period / motor.FINE, _draw_drive
    duration, largest = (count - 1) * period, round(random.uniform(9.0, 15.0), 1)
    corners = [draw(duration, largest, random) for _ in range(n)]
    time = np.array([np.maximum.accumulate(np.round(corner[0] / tick) * tick) for corner in corners])
    time += tick * np.cumsum(np.diff(time, axis=1, prepend=-1.0) <= 0, axis=1)  # corners are apart
    temperature = np.round(random.uniform(*TEMPERATURES[machine], n), 1)
    columns = {name: np.full(n, value) for name, value in values.items()}
    return Runs(machine, columns, conditions, temperature, random.permutation(n), period, count, time,
                np.array([corner[1] for corner in corners]), amplitude=np.zeros(n)), values


def _draw_pump(duration: float, largest: float, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (m,): 5 to 10 levels of 2 to 10 V, joined by ramps, most of which are short."""
    count = int(random.integers(5, 11))
    levels = random.permutation(np.linspace(2.0, 10.0, count) + random.uniform(-0.5, 0.5, count)).clip(2.0, 10.0)
    return _join(levels, 0.01, duration, random)


def _draw_drive(duration: float, largest: float, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (m,): rest, then 5 to 9 levels up to the `largest` voltage of either sign, some of them 0."""
    count = int(random.integers(5, 10))
    sign = random.choice([-1.0, 1.0]) * (-1.0) ** np.cumsum(random.random(count) < 0.6)
    levels = sign * largest * random.uniform(0.15, 1.0, count)
    levels[random.integers(1, count - 1)] = 0.0
    levels[random.random(count) < 0.1] = 0.0
    return _join(np.concatenate([[0.0], levels]), 0.004, duration, random)


def _join(levels: np.ndarray, short: float, duration: float,
          random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (m,) of levels (l,), each held for a while, with ramps that are `short` parts of the duration."""
    lengths = random.uniform(0.5, 1.5, len(levels))
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) / lengths.sum() * duration
    long = random.random(len(levels)) < 0.3
    ramps = np.where(long, random.uniform(0.2, 0.9, len(levels)) * lengths / lengths.sum(),
                     short * random.uniform(0.5, 1.5, len(levels))) * duration
    time = np.concatenate([[0.0], np.stack([starts[1:], (starts + ramps)[1:]], axis=1).ravel(), [duration]])
    value = np.concatenate([levels[:1], np.stack([levels[:-1], levels[1:]], axis=1).ravel(), levels[-1:]])
    rest = np.arange(1, _CORNERS - len(time) + 1) * short * duration
    return np.concatenate([time, duration + rest]), np.pad(value, (0, len(rest)), mode="edge")


def vary(nominal: Runs, world: World, random: np.random.Generator) -> tuple[Runs, dict[str, np.ndarray]]:
    """Return the actual runs without an effect, and the stated conditions (n,) by name."""
    n = len(nominal.order)
    values = {}
    for name, value in nominal.values.items():
        off = LITTLE_OFF.get(name, OFF)
        values[name] = value * (1.0 + random.uniform(-off, off)) * (
            1.0 + world.scatter.get(name, 0.0) * np.clip(random.standard_normal(n), -3, 3))
    stated = dict(nominal.conditions)
    actual = {name: with_errors(levels, world.conditions, random) for name, levels in stated.items()}
    channel = nominal.channel
    if world.warms_up:
        low, high = TEMPERATURES[nominal.machine]
        warmed = low + (high - low) * (0.1 + 0.8 * -np.expm1(-3.0 * nominal.sequence))
        channel = np.round(warmed + 0.03 * (high - low) * random.standard_normal(n), 1)
    return Runs(nominal.machine, values, actual, channel, nominal.order, nominal.period, nominal.count,
                nominal.corner_time, nominal.corner_value, amplitude=np.zeros(n)), stated
