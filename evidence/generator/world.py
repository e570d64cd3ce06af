"""The deviations of a bench from its model other than effects: scatter, noise, curves, conditions, clocks, bad runs."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from .bench import SENSORS, Bench

INGREDIENTS = ("scatter", "noise", "converter", "conditions", "sag", "clocks", "bad_runs")
EXACT = ("gr",)  # parameters that cannot vary from run to run: the gears have numbers of teeth
LARGEST_SCATTER = {"x30": 0.10, "aa": 0.05}  # relative std; of all other parameters `OTHER_SCATTER`
OTHER_SCATTER = 0.03


@dataclass(frozen=True)
class World:
    """The size of each deviation; the defaults are absent deviations.

    `scatter`: relative std of parameters from run to run. `noise` and `memory`: std of the noise of each sensor in the
    unit of its signal, and correlation of the noise of successive samples. `time_noise`: std of the noise of the
    shifting time in s. `converter` and `conditions`: relative std of the error of the converter's curves, a smooth
    function of the speed ratio, and of the error of each level of the conditions. `sag`: relative loss of motor speed
    at the largest torque on the pump. `clocks`: delay of each sensor in sampling periods, at most 1. `bad_runs`:
    probability that a run is bad. `batches`: the errors of the levels and the noise are other ones in the second half
    of the test sequence. `ambient`: relative change of motor speed and brake torque over the test sequence.
    `thermometer`: the oil temperature is recorded.
    """

    scatter: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(SENSORS, 0.0))
    memory: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(SENSORS, 0.3))
    time_noise: float = 0.0
    converter: float = 0.0
    conditions: float = 0.0
    sag: float = 0.0
    clocks: Mapping[str, float] = field(default_factory=dict)
    bad_runs: float = 0.0
    batches: bool = False
    ambient: float = 0.0
    thermometer: bool = False


def plain_world(bench: Bench, noise: float = 0.01) -> World:
    """Return a world with sensor noise, relative to the ranges of the signals, and scatter of two parameters alone."""
    return World(scatter={"aa": 0.05, "x30": 0.08},
                 noise={name: noise * bench.ranges[name] for name in SENSORS}, time_noise=0.3 * noise)


def draw_world(key: Iterable[int], bench: Bench, ingredients: Iterable[str] = INGREDIENTS) -> World:
    """Draw a world with some of the `INGREDIENTS`; the draw of each does not depend on the presence of others."""
    world = World()
    for name in ingredients:
        random = np.random.default_rng([*key, INGREDIENTS.index(name)])
        world = replace(world, **_DRAWS[name](random, bench))
    return world


def _scatter(random: np.random.Generator, bench: Bench) -> dict:
    names = [name for name in bench.parameters if name not in EXACT]
    largest = [LARGEST_SCATTER.get(name, OTHER_SCATTER) for name in names]
    return {"scatter": dict(zip(names, (random.random(len(names)) * largest).tolist(), strict=True))}


def _noise(random: np.random.Generator, bench: Bench) -> dict:
    largest = np.where(random.random(len(SENSORS)) < 0.2, 0.03, 0.015)
    std = np.exp(random.uniform(np.log(0.003), np.log(largest))) * [bench.ranges[name] for name in SENSORS]
    if random.random() < 0.5:  # as stated, times a factor
        std = [bench.noise[name] for name in SENSORS] * np.exp(random.uniform(np.log(0.5), np.log(2), len(SENSORS)))
    memory = random.uniform(0, 0.9, len(SENSORS))
    return {"noise": dict(zip(SENSORS, std.tolist(), strict=True)),
            "memory": dict(zip(SENSORS, memory.tolist(), strict=True)),
            "time_noise": float(np.exp(random.uniform(np.log(1e-3), np.log(5e-3))))}


def _clocks(random: np.random.Generator, bench: Bench) -> dict:
    return {"clocks": dict(zip(SENSORS, random.random(len(SENSORS)).tolist(), strict=True))}


_DRAWS = {
    "scatter": _scatter, "noise": _noise, "clocks": _clocks,
    "converter": lambda random, bench: {"converter": 0.02}, "conditions": lambda random, bench: {"conditions": 0.02},
    "sag": lambda random, bench: {"sag": random.uniform(0.005, 0.02)},
    "bad_runs": lambda random, bench: {"bad_runs": 0.02},
}


def with_other_curves(bench: Bench, std: float, random: np.random.Generator) -> Bench:
    """Return the bench with a smooth relative error of both converter curves, of RMS `std` over the speed ratio."""
    waves = np.cos(np.pi * np.outer(np.arange(4), bench.speed_ratio))
    curves = {}
    for name in ("torque_ratio", "capacity"):
        error = (random.standard_normal(4) / [1, 1, 2, 4]) @ waves
        curves[name] = getattr(bench, name) * (1 + std * error / np.sqrt(np.mean(error**2)))
    return replace(bench, **curves)


def with_errors(levels: np.ndarray, std: float, random: np.random.Generator) -> np.ndarray:
    """Return conditions (n,) with one relative error for each of their levels, normal and clipped to 2 `std`."""
    distinct, index = np.unique(levels, return_inverse=True)
    return levels * (1 + std * np.clip(random.standard_normal(len(distinct)), -2, 2))[index]
