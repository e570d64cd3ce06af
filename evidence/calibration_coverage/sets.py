"""Simulated recordings of a bench, each uncertain parameter of which scatters from run to run."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slipstick.bench import Bench, Conditions, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.engine.noise import Noise, draw_noise
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS

TABLES = Path(__file__).parents[2] / "tables"
BENCHES = {name: Bench.open(TABLES / f"{name}.toml") for name in ("heavy", "compact")}
"""The shipped benches."""
SCATTER, LARGEST_SHIFT, CORRELATION = (0.005, 0.05), 0.05, (0.0, 0.5)
"""Bounds of the scatter (log-uniform), of the true means about 1 (uniform), and of the noise's autocorrelation."""
EVERY = {"heavy": 3, "compact": 2}
"""Step between the conditions that are run; the first one differs from set to set."""
_AFTER = 0.3
"""Time in s recorded after the current has come to rest."""


@dataclass(frozen=True, eq=False)
class SetTruth:
    """True `mean` and `scatter` (d,) of multipliers, `correlation` of the noise, and multipliers `points` (n, d)."""

    mean: np.ndarray
    scatter: np.ndarray
    correlation: float
    points: np.ndarray


def draw_set(bench: Bench, seed: int) -> tuple[Recordings, SetTruth]:
    """Return recordings of a bench, with the noise and resolution of its sensors, and the truth behind them."""
    random, d = np.random.default_rng([seed, len(bench.name)]), len(bench.uncertain)
    mean = 1 + random.uniform(-LARGEST_SHIFT, LARGEST_SHIFT, d)
    scatter = np.exp(random.uniform(*np.log(SCATTER), d))
    correlation = float(random.uniform(*CORRELATION))
    every = EVERY[bench.name]
    conditions = bench.conditions.take(np.arange(seed % every, len(bench.conditions), every))
    return record_runs(bench, conditions, mean, scatter, correlation, random)


def record_runs(bench: Bench, conditions: Conditions, mean: np.ndarray, scatter: np.ndarray, correlation: float,
                random: np.random.Generator) -> tuple[Recordings, SetTruth]:
    """Return recordings of those of the conditions that lock, with multipliers of this mean and scatter (d,)."""
    n, columns = len(conditions), [parameters.index(name) for name in bench.uncertain]
    points = mean + scatter * random.normal(size=(n, len(mean)))
    vectors = np.tile(bench.physics.nominal, (n, 1))
    vectors[:, columns] *= points
    time = np.arange(0.0, bench.profiles[0][:, -2].max() + _AFTER, bench.sample_time)
    response = ensemble.simulate(bench.physics.curves, vectors, np.tile(Model(bench.physics).coefficients(), (n, 1)),
                                 conditions, time, ensemble.TIGHT, paired=True)
    locked = np.flatnonzero((response.status == ensemble.LOCKED) & (response.shifting_time < time[-1]))
    signals = []
    for name in SIGNAL_UNITS:
        sensor = bench.sensors[name]
        noisy = getattr(response, name) + draw_noise(Noise(sensor.noise or 0.0, correlation), (n, len(time)), random)
        rounded = np.round(noisy / sensor.resolution) * sensor.resolution if sensor.resolution else noisy
        signals.append(rounded[locked])
    times = response.shifting_time + random.normal(0, bench.sensors["shifting_time"].noise, n)
    return (Recordings(conditions.take(locked), times[locked], Signals(time, *signals)),
            SetTruth(mean, scatter, correlation, points[locked]))
