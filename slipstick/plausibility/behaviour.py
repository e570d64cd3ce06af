"""What the engagements of a bench do at its nominal parameters."""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.plausibility.physics import SteadyStates
from slipstick.recordings.signals import SIGNAL_UNITS

_SAMPLES = 1000  # of the longest profile: finer than a picture shows
_BATCH = 256  # conditions whose signals are kept at a time

SIGNALS = (*SIGNAL_UNITS, "piston_position")


@dataclass(frozen=True, eq=False)
class Behaviour:
    """n simulated engagements, each until its current profile ends; signals in the units of recordings.

    `shifting_time` (n,) in s is NaN unless the `status` (n,) is locked. `furthest_position` (n,) in m is that of the
    piston and `position_at_lock` (n,) that at the shifting time, NaN without. `largest_torque` (n,) in N m is at the
    output shaft and `final_slip` (n,) in rad/s between the plates. `lowest` and `highest` (n, 4) bound the measured
    signals in the order of `SIGNAL_UNITS`.
    """

    shifting_time: np.ndarray
    status: np.ndarray
    furthest_position: np.ndarray
    position_at_lock: np.ndarray
    largest_torque: np.ndarray
    final_slip: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def locked(self) -> np.ndarray:
        """Which engagements lock, (n,)."""
        return np.asarray(self.status == ensemble.LOCKED)

    def nearest_to(self, quantile: float) -> int:
        """The condition at that quantile of the shifting times, of those that lock."""
        order = np.argsort(np.where(self.locked, self.shifting_time, np.inf), kind="stable")
        return int(order[round(quantile * (int(self.locked.sum()) - 1))])


def behaviour(bench: Bench) -> Behaviour:
    """Simulate all conditions of the bench at the nominal parameters."""
    rows = range(0, len(bench.conditions), _BATCH)
    parts = [_part(bench, bench.conditions.take(np.arange(row, min(row + _BATCH, len(bench.conditions)))))
             for row in rows]
    return Behaviour(*(np.concatenate([getattr(part, name) for part in parts]) for name in Behaviour.__annotations__))


def sample_times(conditions: Conditions) -> np.ndarray:
    """Times in s at which engagements are shown, (k,), to the end of the longest profile."""
    return np.linspace(0, conditions.profile_time[conditions.current_profile, -1].max(), _SAMPLES)


def _part(bench: Bench, conditions: Conditions) -> Behaviour:
    time = sample_times(conditions)
    response = ensemble.signals(Model(bench.physics), conditions, time)
    inside = time <= conditions.profile_time[conditions.current_profile, -1][:, None]
    signals = {name: np.where(inside, getattr(response, name)[0], np.nan) for name in SIGNALS}
    lock, position = response.shifting_time[0], signals["piston_position"]
    slip = signals["input_speed"] - SteadyStates(bench)["gear_ratio"] * signals["output_speed"]
    measured = np.stack([signals[name] for name in SIGNAL_UNITS], axis=1)
    last = inside.sum(axis=1) - 1
    return Behaviour(
        lock, response.status[0], np.fmax.reduce(position, axis=1),
        np.array([np.interp(at, time, row) for at, row in zip(lock, position, strict=True)]),
        np.fmax.reduce(signals["output_torque"], axis=1), slip[np.arange(len(conditions)), last],
        np.fmin.reduce(measured, axis=2), np.fmax.reduce(measured, axis=2))
