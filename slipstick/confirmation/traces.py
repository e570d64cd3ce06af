"""The recordings of engagements as one row of independent values each, and simulations in the same form.

A row consists of the measured signals and the shifting time. The noise of a sensor is autoregressive, so that

    e_t = (y_t - rho y_{t-1}) / (std sqrt(1 - rho^2))

are independent with unit variance. Means of `WIDTH` of them, times the root of `WIDTH`, are so too, and say all about
effects that last longer. The filter is linear: residuals and derivatives are those of filtered signals.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.bench.converter import Converter
from slipstick.clutch.ensemble import LOCKED, Response
from slipstick.confirmation.rows_kernel import fill_rows
from slipstick.naming.scene import Scene
from slipstick.numerics.threads import mapped
from slipstick.recordings.processing import blended_at_lock_up, block_means

WIDTH = 4
"""Samples in a mean: 8 ms at 500 Hz, a fifth of the fastest time constant of the shipped benches."""
TIME = "shifting_time"
"""The channel of the shifting time."""
_FAILED = 1e6
"""Value of a row where the simulation failed: so far off that no fit goes there."""


@dataclass(frozen=True, eq=False)
class Traces:
    """Rows of K values of the n engagements of a `scene`: the `measured` (n, K), and which are `counted` (n, K).

    `noise` maps each channel, the shifting time last, to the standard deviation of its values over that of the sensor's
    noise, which third differences only tell roughly: 1 at first, then what a fit leaves. `clocks` are delays of the
    signals' clocks in s, at which fits begin, and `converter` is that of the bench with the errors of its curve.
    `conditions` are those that are simulated: as the blocks have measured them in each engagement, which stated levels
    may be off by per cents. Parameters that are `freed` are known from a data sheet, and yet determined by the fits.
    """

    scene: Scene
    measured: np.ndarray
    counted: np.ndarray
    noise: dict[str, float]
    clocks: dict[str, float]
    converter: Converter
    conditions: Conditions
    freed: tuple[str, ...] = ()

    @classmethod
    def of(cls, scene: Scene, clocks: dict[str, float], converter: Converter,
           conditions: Conditions | None = None, freed: Collection[str] = ()) -> "Traces":
        """The rows of the recordings of a scene, with `conditions` other than the stated ones where they are known."""
        conditions = scene.recordings.conditions if conditions is None else conditions
        noise = dict.fromkeys((*scene.smooth, TIME), 1.0)
        blank = cls(scene, np.zeros((0, 0)), np.zeros((0, 0), bool), noise, clocks, converter, conditions,
                    tuple(freed))
        signals = {name: scene.measured(name) for name in blank.signals}
        near_lock = ~(scene.slipping | scene.locked)
        counted = []
        for name in signals:
            # The torque jumps at lock-up: how far the jump is off, the shifting time says.
            bad = near_lock.copy() if name == "output_torque" else np.zeros_like(near_lock)
            bad[:, 1:] |= bad[:, :-1].copy()
            counted.append(block_means(bad.astype(float), WIDTH) == 0)
        counted.append(np.ones((len(scene), 1), bool))
        return replace(blank, measured=blank.rows(signals, scene.recordings.measured_time),
                       counted=np.concatenate(counted, axis=1))

    def simulated(self, response: Response, clocks: Sequence[float] | np.ndarray) -> np.ndarray:
        """The rows (m, K) of simulated engagements, of the n conditions again and again.

        `clocks` (c,) are the delays of the clocks of the signals in samples.
        """
        time, times = self.scene.time, self.times(response)
        signals = {name: getattr(response, name) for name in self.signals}
        if "output_torque" in signals:
            signals["output_torque"] = blended_at_lock_up(response.output_torque[None], times[None], time)[0]
        return self.rows(signals, times, dict(zip(self.signals, clocks, strict=True)))

    def times(self, response: Response) -> np.ndarray:
        """Shifting times (m,) in s of simulated engagements; where one did not lock, the end of its profile."""
        given = self.conditions
        latest = np.resize(given.profile_time[given.current_profile, -1], response.status.shape)
        return np.where(response.status == LOCKED, response.shifting_time, latest)

    def rows(self, signals: Mapping[str, np.ndarray], times: np.ndarray,
             clocks: Mapping[str, float] = MappingProxyType({})) -> np.ndarray:
        """Signals (m, k) and shifting times (m,) as rows (m, K), with `clocks` that are late by these samples."""
        values = np.empty((len(times), self.columns[TIME].stop))

        def fill_columns(name: str) -> None:
            std, rho = self.scene.noise[name]
            fill_rows(signals[name], clocks.get(name, 0.0), rho,
                      np.sqrt(WIDTH) / (std * self.noise[name]), WIDTH, _FAILED, values[:, self.columns[name]])

        mapped(fill_columns, self.signals)
        values[:, -1] = times / self.time_noise
        return values

    @property
    def time_noise(self) -> float:
        """Standard deviation of the noise of the shifting time in s."""
        return self.scene.timer_noise * self.noise[TIME]

    @property
    def columns(self) -> dict[str, slice]:
        """Where the values of each channel are in a row."""
        k = len(self.scene.time) // WIDTH
        return {name: slice(i * k, i * k + 1) if name == TIME else slice(i * k, (i + 1) * k)
                for i, name in enumerate(self.channels)}

    @property
    def signals(self) -> tuple[str, ...]:
        """The measured signals."""
        return self.channels[:-1]

    @property
    def channels(self) -> tuple[str, ...]:
        """The measured signals, and the shifting time last."""
        return tuple(self.noise)

    def with_noise(self, squares: dict[str, float]) -> "Traces":
        """With such noise that mean squares of 1 are left where a fit has left `squares`.

        That of the shifting time, of which each engagement has one value, is only made larger.
        """
        least = {TIME: 1.0}
        factors = {name: float(np.sqrt(max(least.get(name, 0.0), square))) for name, square in squares.items()}
        scale = np.ones(self.measured.shape[1])
        for name, columns in self.columns.items():
            scale[columns] = factors[name]
        noise = {name: self.noise[name] * factor for name, factor in factors.items()}
        return replace(self, measured=self.measured / scale, noise=noise)

    def mean_squares(self, residuals: np.ndarray) -> dict[str, float]:
        """Mean squares of the counted residuals (n, K) in each channel."""
        return {name: float((residuals[:, columns] ** 2)[self.counted[:, columns]].mean())
                for name, columns in self.columns.items()}
