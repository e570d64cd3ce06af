"""The lock block: after lock-up, input speed = g * output speed.

The signal is input speed - g * output speed in rad/s, as both sensors measure it, with the nominal gear ratio g: 0 but
for a gear ratio g (1 + b), a clock that is late, and errors of either sensor.
"""

from collections.abc import Mapping

import numpy as np
import scipy

from slipstick.blocks.sensor_noise import added
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import bases, sensor_errors
from slipstick.naming.block import Laws, Pair, changed
from slipstick.naming.law_map import LawMap, of_sensor, single
from slipstick.naming.scene import Scene

_TWIST = 1e-3
"""Compliance in rad/s for each N m/s that is the unit of a twist law, so that coefficients are about 1."""
_WINDOWS, _ORDER = ((0.8,), (0.4, 0.8, 1.6), (0.4, 0.8, 1.6, 3.2)), 4
"""Lengths, in time constants of the valve, and order of the polynomials whose derivative is that of the torque; for
laws that are not finer, once and twice finer. A longer window has less of the noise of the torque and less of the
oscillation after lock-up, and a mixture of some has what the recordings ask for: on three benches with such a twist,
the one of 0.8 alone leaves chi-squares of 1.1 to 4.4 where three leave 1.0 to 2.2."""


class LockBlock:
    """Difference of both speeds after lock-up; its parameter is the gear ratio."""

    name, signal = "lock", "input_speed"
    freed: tuple[str, ...] = ()
    random: tuple[str, ...] = ("gear_ratio",)
    fixed: tuple[str, ...] = ("clock",)

    def __init__(self, scene: Scene, speed: np.ndarray) -> None:
        """`speed` (n, k) in rad/s is that of the load block: a measured one would share its noise with the residual."""
        self.scene, self.fine = scene, scene.settings.fine_knots
        self.finer: Mapping[Pair, int] = {}
        self.output = speed
        self.measured = scene.measured("input_speed") - scene.gear * scene.measured("output_speed")
        self.counted = scene.locked
        self.fixed_std = np.array([scene.step])
        self.widest = np.array([0.05])
        self.random_std = np.array([1e-6])  # a gear has teeth: the ratio is exact
        self._shared = np.zeros(1)

    def at(self, shared: np.ndarray) -> "LockBlock":
        """The block with the delay of the clock, `shared` (1,) in s."""
        return changed(self, _shared=shared)

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """g b * output speed and the laws, (n, k) in rad/s, at `points` (n, 1)."""
        total = self.scene.gear * points[:, :1] * self.output
        for pair, coefficients in laws:
            total = total + coefficients @ self.basis(pair, points, laws, total)
        return np.asarray(total + self._shared @ self._of_clock())

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of both sensors."""
        std, rho = self.scene.noise["output_speed"]
        return BlockNoise(*added(self.scene.noise["input_speed"], (self.scene.gear * std, rho)))

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes (n, 1, k) in rad/s with the gear ratio, and (n, 1, k) in rad/s^2 with the clock."""
        return self.scene.gear * self.output[:, None], self._of_clock()

    def _of_clock(self) -> np.ndarray:
        """Change (n, 1, k) in rad/s^2 with the clock."""
        return bases.later(self.scene.gear * self.output, self.scene.time, 0.0)[:, None]

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of both speed sensors, and a twist of the shaft between them."""
        return [*sensor_errors.pairs_of(self.scene, rare, "input speed sensor", "output speed sensor"),
                ("stick torque", "twist")]

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in rad/s of the difference of speeds with the coefficients of a law."""
        scene, (quantity, on) = self.scene, pair
        if quantity == "stick torque":
            # Measured, because an elastic shaft oscillates and the torque of rigidly coupled ones does not.
            torque, windows = scene.measured("output_torque"), self._windows(self.finer.get(pair, 0))
            rates = [scipy.signal.savgol_filter(torque, width, _ORDER, deriv=1, delta=scene.step, axis=1)
                     for width in windows]
            return np.asarray(np.stack(rates, axis=1) / scene.gear * _TWIST)
        if quantity.startswith("output"):
            reading = sensor_errors.reading(scene, *pair, self.output, self.finer.get(pair, 0))
            return np.asarray(-scene.gear * reading)
        # A lag of the sensor keeps what it read before lock-up for a while.
        slipping = scene.time < scene.recordings.measured_time[:, None]
        signal = np.where(slipping, scene.smooth["input_speed"], scene.gear * self.output)
        return sensor_errors.reading(scene, quantity, on, signal, self.finer.get(pair, 0))

    def law(self, pair: Pair) -> LawMap:
        """The values of a law: an error is what a sensor reads too much, a twist a compliance on the input side."""
        finer = self.finer.get(pair, 0)
        if pair[0] == "stick torque":  # a slow torque has the same rate in all windows
            return single(np.full(len(self._windows(finer)), _TWIST), "rad/(N m)")
        return of_sensor(pair, self.scene, finer)

    def _windows(self, finer: int) -> list[int]:
        """Odd numbers of samples, ascending and each once, over which the torque is differentiated."""
        time = self.scene.bench.scales.time / self.scene.step
        return sorted({max(_ORDER + 1, round(length * time)) // 2 * 2 + 1 for length in _WINDOWS[finer]})
