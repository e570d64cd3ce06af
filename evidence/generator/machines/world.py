"""Deviations of the runs of a machine that are no effect: noise, clocks, scatter, and temptations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

NOISE = {"two tanks": (0.003, 0.015), "dc motor": (0.001, 0.008)}  # std over the range of a signal
LOUD, LOUD_MEMORY = 0.03, 0.9
SCATTER = (0.01, 0.03)  # relative std of parameters from run to run
MUCH_SCATTER = 2.5  # times the usual


@dataclass(frozen=True)
class Spike:
    """A disturbance of a `height`, in the unit of the signal, that lasts for `length` samples from `sample` on."""

    run: int
    signal: str
    sample: int
    length: int
    height: float


@dataclass(frozen=True)
class World:
    """The size of each deviation.

    `noise` and `memory`: std of the noise of each sensor in the unit of its signal, and correlation of successive
    samples. `clocks`: delay of each sensor in sampling periods, at most 1. `scatter`: relative std of parameters from
    run to run. `conditions`: relative std of the error of each stated level of the conditions. `warms_up`: the
    temperature follows the run order.
    """

    noise: Mapping[str, float]
    memory: Mapping[str, float]
    clocks: Mapping[str, float]
    scatter: Mapping[str, float]
    conditions: float = 0.0
    warms_up: bool = False
    spike: Spike | None = None


def draw_world(machine: str, ranges: Mapping[str, float], parameters: tuple[str, ...],
               random: np.random.Generator) -> World:
    """Draw a world without temptations; `ranges` of the signals are in their units, `parameters` scatter."""
    noise = {name: float(size * np.exp(random.uniform(*np.log(NOISE[machine]))))
             for name, size in ranges.items()}
    memory, clocks = ({name: float(random.uniform(0, most)) for name in ranges} for most in (0.9, 1.0))
    return World(noise, memory, clocks, {name: float(random.uniform(*SCATTER)) for name in parameters})


def _with_late_clocks(world: World, *_: object) -> World:
    return replace(world, clocks=dict.fromkeys(world.clocks, 1.0))


def _with_loud_sensor(world: World, ranges: Mapping[str, float], shape: tuple[int, int],
                      random: np.random.Generator) -> World:
    name = sorted(ranges)[random.integers(len(ranges))]
    return replace(world, noise={**world.noise, name: LOUD * ranges[name]},
                   memory={**world.memory, name: LOUD_MEMORY})


def _with_spike(world: World, ranges: Mapping[str, float], shape: tuple[int, int],
                random: np.random.Generator) -> World:
    name, length = sorted(ranges)[random.integers(len(ranges))], int(random.integers(1, 6))
    run, sample = int(random.integers(shape[0])), int(random.integers(shape[1] - length))
    height = float(random.choice([-1, 1]) * random.uniform(0.3, 1.0) * ranges[name])
    return replace(world, spike=Spike(run, name, sample, length, height))


def _with_much_scatter(world: World, *_: object) -> World:
    return replace(world, scatter={name: MUCH_SCATTER * std for name, std in world.scatter.items()})


Tempt = Callable[[World, Mapping[str, float], tuple[int, int], np.random.Generator], World]
TEMPTATIONS: Mapping[str, Tempt] = {
    "late clocks": _with_late_clocks, "loud sensor": _with_loud_sensor, "spike": _with_spike,
    "conditions off": lambda world, *_: replace(world, conditions=0.02), "much scatter": _with_much_scatter,
    "temperature follows run order": lambda world, *_: replace(world, warms_up=True),
}
"""Name of a deviation that looks like an effect, and how it changes a world of runs and samples of a shape (n, k)."""
