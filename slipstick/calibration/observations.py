"""What a calibration compares: every sample of every measured signal, and the shifting time of each engagement.

At lock-up the torque jumps. The samples between the simulated and the measured lock-up then differ by the whole jump,
however near the two are, and a linearisation does not describe that. They are left out of the torque, and the shifting
time tells when lock-up is.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals

ACCURACY = ensemble.Accuracy(5e-4, 5e-3)
_LOCK_UP = 4.0
"""Standard deviations of the measured shifting time around it within which the torque is left out: the true lock-up is
outside in 6 of 100,000 engagements."""
_MARGIN = 2
"""Samples left out beside a lock-up: the jump is between two samples, and differences move it by less than one."""


@dataclass(frozen=True, eq=False)
class Observations:
    """n `recordings` of a `bench` with k samples, with the effect coefficients and laws of the model compared.

    `free` names the d parameters whose multipliers of the nominal values form a point. `base` (20,) has the others.
    """

    recordings: Recordings
    signals: Signals
    bench: Bench
    free: tuple[str, ...]
    base: np.ndarray
    coefficients: np.ndarray
    laws: tuple[MeasuredLaw, ...] = ()

    @property
    def channels(self) -> tuple[str, ...]:
        """The c measured signals, and the shifting time last."""
        return (*self.signals.names, "shifting_time")

    @property
    def start(self) -> np.ndarray:
        """The point (d,) of the base values."""
        columns = [parameters.index(name) for name in self.free]
        return np.asarray(self.base[columns] / np.array(self.bench.physics.nominal)[columns])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest multipliers, (d,) each."""
        priors = [self.bench.prior(name) for name in self.free]
        return np.array([prior.lower for prior in priors]), np.array([prior.upper for prior in priors])

    def vectors(self, points: np.ndarray) -> np.ndarray:
        """Parameter vectors (..., 20) of points (..., d)."""
        columns = [parameters.index(name) for name in self.free]
        vectors = np.tile(self.base, (*points.shape[:-1], 1))
        vectors[..., columns] = points * np.array(self.bench.physics.nominal)[columns]
        return vectors

    def simulate(self, points: np.ndarray, places: np.ndarray) -> ensemble.Response:
        """Simulate the engagements `places` (m,) at points (s, m, d); the response has s x m rows."""
        s, m = points.shape[:2]
        conditions = self.recordings.conditions.take(np.tile(places, s))
        response = ensemble.simulate(self.bench.physics.curves, self.vectors(points).reshape(s * m, -1),
                                     np.tile(self.coefficients, (s * m, 1)), conditions, self.signals.time, ACCURACY,
                                     paired=True, laws=self.laws)
        if np.any(response.status == ensemble.FAILED):
            raise InvalidValue("A simulation failed within the bounds of the calibration",
                               "Narrow the bounds of the parameters in the bench file, or start from another model")
        return response

    def residuals(self, response: ensemble.Response, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Measured - simulated: the c signals (c, s, m, k) and shifting times (s, m), from a response of s x m rows."""
        shape = (-1, len(places), len(self.signals.time))
        signals = np.array([self.signals[name][places] - getattr(response, name).reshape(shape)
                            for name in self.signals.names])
        times = self.recordings.measured_time[places] - self.lock_up(response, places)
        return signals, times

    def lock_up(self, response: ensemble.Response, places: np.ndarray) -> np.ndarray:
        """Simulated shifting times (s, m); an engagement that never locks has the end of its current profile."""
        conditions = self.recordings.conditions
        end = conditions.profile_time[conditions.current_profile, -1][places]
        locked = (response.status == ensemble.LOCKED).reshape(-1, len(places))
        return np.where(locked, response.shifting_time.reshape(-1, len(places)), end)

    def counted(self, lock_up: np.ndarray, places: np.ndarray, noise: float) -> np.ndarray:
        """Which samples (c, m, k) count for s simulations with `lock_up` (s, m), measured with a `noise` in s."""
        time, measured, margin = self.signals.time, self.recordings.measured_time[places], self._margin(noise)
        both = np.concatenate([lock_up, measured[None]])
        first, last = both.min(axis=0) - margin, both.max(axis=0) + margin
        counted = np.ones((len(self.signals.names), len(places), len(time)), bool)
        if "output_torque" in self.signals.names:
            channel = self.signals.names.index("output_torque")
            counted[channel] = (time < first[:, None]) | (time > last[:, None])
        return counted

    def locked(self, noise: float) -> np.ndarray:
        """Which samples (n, k) may be after lock-up, measured with a `noise` in s."""
        return np.asarray(self.signals.time > self.recordings.measured_time[:, None] - self._margin(noise))

    def _margin(self, noise: float) -> float:
        return float(_LOCK_UP * noise + _MARGIN * (self.signals.time[1] - self.signals.time[0]))
