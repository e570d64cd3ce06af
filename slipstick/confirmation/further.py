"""Further experiments that would tell two fitted models apart that the recordings do not.

The difference r of two predictions counts as far as the scatter of the parameters cannot hide it: with the whitened
derivatives G with respect to the scattering parameters and their variances D,

    d^2 = r' (1 + G D G')^-1 r

is the expected rise of twice the log-likelihood of the right model above the other one in one run, with variance 4 d^2:
100 / d^2 runs tell them apart by five standard errors.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.traces import Traces
from slipstick.recordings import Recordings, Signals

_BEYOND = (0.8, 1.2)
"""Times the lowest and the highest recorded level: as far as a fit may be trusted unseen."""
_LEVELS, _KINDS = 3, 5
"""Levels of each condition that are tried, and experiments that are proposed."""
_ERRORS = 5.0
"""Standard errors by which repetitions shall tell two models apart."""
_MOST = 1000
"""Runs that nobody would make."""
_FACTORS = ("motor_speed", "load_inertia", "brake_torque")


@dataclass(frozen=True)
class FurtherExperiment:
    """A proposed experiment in which two tied effects predict different results."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    rival: str
    """The effect that it tells apart from the finding."""
    current_profile: int
    """Index of the current profile in the recordings."""
    motor_speed: float
    """Motor speed in rad/s."""
    load_inertia: float
    """Load inertia in kg m^2."""
    brake_torque: float
    """Brake torque in N m."""
    recorded: bool
    """Whether the recordings contain this condition."""
    apart: float
    """Distance of both predictions in standard deviations, beyond what the scatter of the parameters can hide."""
    signal: str
    """Signal, or `shifting_time`, that contributes most."""
    repetitions: int | None
    """Expected number of runs until five standard errors; null for more than 1000."""


def further(right: SimulationFit, other: SimulationFit, rival: str) -> list[FurtherExperiment]:
    """The experiments that tell two fits apart best, each of another profile or motor speed, the best first.

    `rival` is the name of the other fit.
    """
    given = right.block.scene.recordings.conditions
    conditions, recorded = _list_candidates(given)
    here, there = (_move_elsewhere(fit, conditions) for fit in (right, other))
    points = [np.tile(fit.fitted.mean, (len(conditions), 1)) for fit in (right, other)]
    by_right, by_other = here.base(points[0]), there.base(points[1])
    locks = np.all(np.abs(by_right - by_other) < 1e5, axis=1)
    own, _ = there.columns(points[1], (), by_other)
    left = by_right - by_other
    weighted = own * np.sqrt(other.fitted.variance)[:, None]
    inner = np.eye(own.shape[1]) + weighted @ weighted.transpose(0, 2, 1)
    through = np.linalg.solve(inner, weighted @ left[:, :, None])
    left = left - (weighted.transpose(0, 2, 1) @ through)[..., 0]
    square = np.where(locks, (left * (by_right - by_other)).sum(axis=1), 0.0)
    experiments, kinds = list[FurtherExperiment](), set[tuple[int, float]]()
    for place in np.argsort(-square, kind="stable"):
        kind = int(conditions.current_profile[place]), float(conditions.motor_speed[place])
        if kind in kinds or len(experiments) == _KINDS or square[place] <= 0:
            continue
        kinds.add(kind)
        shares = {name: float((left[place, columns] ** 2).sum()) for name, columns in here.traces.columns.items()}
        runs = int(np.ceil(4 * _ERRORS**2 / square[place]))
        experiments.append(FurtherExperiment(
            rival, *kind, float(conditions.load_inertia[place]), float(conditions.brake_torque[place]),
            bool(recorded[place]), float(np.sqrt(square[place])), max(shares, key=shares.__getitem__),
            runs if runs <= _MOST else None))
    return experiments


def _list_candidates(given: Conditions) -> tuple[Conditions, np.ndarray]:
    """Conditions of all profiles at a few levels, up to a fifth beyond the recorded ones, and which are recorded."""
    levels = [np.unique(np.quantile(getattr(given, name), np.linspace(0, 1, _LEVELS), method="nearest"))
              for name in _FACTORS]
    wide = [np.unique([values[0] * _BEYOND[0], *values, values[-1] * _BEYOND[1]]) for values in levels]
    rows = list(product(range(len(given.profile_time)), *wide))
    first = [int(np.argmax(given.current_profile == row[0])) for row in rows]
    columns = dict(zip(_FACTORS, np.array([row[1:] for row in rows]).T, strict=True))
    candidates = replace(given.take(first), current_profile=np.array([row[0] for row in rows]), **columns)
    known = {tuple(condition) for condition in zip(given.current_profile.tolist(), *(
        getattr(given, name).tolist() for name in _FACTORS), strict=True)}
    return candidates, np.array([(row[0], *map(float, row[1:])) in known for row in rows])


def _move_elsewhere(fit: SimulationFit, conditions: Conditions) -> SimulatedBench:
    """The simulation of a fit under other conditions."""
    block, scene = fit.block, fit.block.scene
    nothing = np.zeros((len(conditions), len(scene.time)))
    empty = Signals(scene.time, **dict.fromkeys(block.traces.signals, nothing))
    recordings = Recordings(conditions, np.full(len(conditions), scene.time[-1]), empty)
    unmeasured = replace(scene, recordings=recordings, smooth={}, order=None)
    blank = np.zeros((len(conditions), block.measured.shape[1]))
    traces = Traces(unmeasured, blank, np.ones(blank.shape, bool), block.traces.noise, block.traces.clocks,
                    block.traces.converter, conditions)
    return SimulatedBench(traces, block.terms).at(fit.fitted.shared)
