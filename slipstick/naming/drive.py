"""The converter before the input shaft, whose curve is off by a factor over the speed ratio, and its motor.

    T_conv(w, m) = t(w/m) (m / c(w/m))^2 (1 + e(w/m)),   m = motor (1 - sag pump),   pump = (m / c)^2 / the largest one

with the torque ratio t and the capacity factor c. The error e is a cubic spline: curves of converters are smooth,
and what one that is linear between so few knots leaves was called a torque where noise is weak. The motor is slower
under the torque of the pump.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from slipstick.bench.converter import Converter
from slipstick.blocks.input import curves_of

KNOTS = 8
"""Knots of the error of the converter's torque over the speed ratio."""
_CLOSER = 4
"""Pieces between two knots of a curve with the error, which is linear between its points."""
_OUTERMOST = 0.001
"""Share of the samples beyond the outermost knots."""
_SLOPE_STEP = 1e-3
"""Relative step of the derivatives of the converter's torque: far below the distance of the points of its curve."""
_POINTS = 2000
"""Points of the tables of the converter: far closer than those of its curve."""
_LEAST = 1e-6


class AtSpeed(NamedTuple):
    """The converter at speeds (n, k): its `torque` in N m, with `slope` in N m s/rad over the speed.

    `motor` (n, k) is the change of the torque with the logarithm of the motor speed, `ratio` the speed ratio, and
    `pump` the torque of the pump over the largest one.
    """

    torque: np.ndarray
    slope: np.ndarray
    motor: np.ndarray
    ratio: np.ndarray
    pump: np.ndarray


@dataclass(frozen=True, eq=False)
class Drive:
    """A converter with `curves` (3, c) of torque ratio and capacity over the speed ratio, and `knots` (KNOTS,) of e.

    `largest` is the largest torque of the pump in N m. `ratios` (t,) are the points of its tables, at equal distances,
    and `onto` (KNOTS, t) maps the errors at the knots to them.
    """

    curves: np.ndarray
    knots: np.ndarray
    largest: float
    ratios: np.ndarray
    onto: np.ndarray

    @classmethod
    def of(cls, converter: Converter, motor: np.ndarray, speed: np.ndarray) -> "Drive":
        """The drive by motors at (n,) rad/s of a shaft at (n, k) rad/s, over whose speed ratios the knots are."""
        curves = curves_of(converter)
        low, high = np.quantile(np.clip(speed / motor[:, None], 0, 1), [_OUTERMOST, 1 - _OUTERMOST])
        knots, ratios = np.linspace(low, high, KNOTS), np.linspace(curves[0, 0], curves[0, -1], _POINTS)
        spline = scipy.interpolate.CubicSpline(knots, np.eye(KNOTS), axis=1)
        return cls(curves, knots, float(((motor.max() / curves[2]) ** 2).max()), ratios,
                   spline(np.clip(ratios, knots[0], knots[-1])))

    def torque(self, speed: np.ndarray, motor: np.ndarray) -> np.ndarray:
        """Torque in N m by the given curve."""
        ratio = speed / motor
        torque, capacity = (np.interp(ratio, *self.curves[[0, row]]) for row in (1, 2))
        return np.asarray(torque * (motor / capacity) ** 2)

    def at(self, speed: np.ndarray, motor: np.ndarray, sag: float, errors: np.ndarray) -> AtSpeed:
        """The converter at a `speed` (n, k), with `motor` (n, 1) without sag, and the `errors` (KNOTS,)."""
        motor, pump = self._sagged(speed, motor, sag)
        table, h = self._table(errors), _SLOPE_STEP * motor
        slope = (self._off(speed + h, motor, table) - self._off(speed - h, motor, table)) / (2 * h)
        faster, slower = (self._off(speed, motor * (1 + sign * _SLOPE_STEP), table) for sign in (1, -1))
        change = faster - slower
        return AtSpeed(self._off(speed, motor, table), slope, change / (2 * _SLOPE_STEP), speed / motor, pump)

    def torque_at(self, speed: np.ndarray, motor: np.ndarray, sag: float, errors: np.ndarray) -> np.ndarray:
        """The `torque` of `at` alone."""
        return self._off(speed, self._sagged(speed, motor, sag)[0], self._table(errors))

    def _sagged(self, speed: np.ndarray, free: np.ndarray, sag: float) -> tuple[np.ndarray, np.ndarray]:
        """Motor speed (n, k) in rad/s, and the torque of the pump over the largest one."""
        motor, pump = free, np.zeros(speed.shape)
        for _ in range(2):
            capacity = np.interp(speed / motor, *self.curves[[0, 2]])
            pump = (motor / capacity) ** 2 / self.largest
            motor = free * (1 - sag * pump)
        return motor, pump

    def _off(self, speed: np.ndarray, motor: np.ndarray, table: np.ndarray) -> np.ndarray:
        """Torque (n, k) in N m of a curve with the errors in `table`."""
        return np.asarray(self.torque(speed, motor) * (1 + np.interp(speed / motor, self.ratios, table)))

    def basis(self, ratio: np.ndarray) -> np.ndarray:
        """Changes (n, KNOTS, k) of e at speed ratios (n, k) with the errors at the knots."""
        return np.stack([np.interp(ratio, self.ratios, cardinal) for cardinal in self.onto], axis=1)

    def tables(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Torque of turbine and pump over the square of the motor speed at the `ratios`, with the `errors` (KNOTS,)."""
        torque, capacity = (np.interp(self.ratios, self.curves[0], row) for row in self.curves[1:])
        return torque / capacity**2 * (1 + self._table(errors)), 1 / capacity**2

    def corrected(self, motor: float, sag: float, errors: np.ndarray) -> Converter:
        """The converter with the `errors` (KNOTS,) of its curve, and with the sag at this `motor` speed in rad/s."""
        between = np.linspace(self.knots[0], self.knots[-1], _CLOSER * (KNOTS - 1) + 1)
        ratio = np.union1d(self.curves[0], between)
        torque, capacity = (np.interp(ratio, self.curves[0], row) for row in self.curves[1:])
        speeds = np.full(ratio.shape, motor)
        given, pump = self.torque(ratio * speeds, speeds), (speeds / capacity) ** 2
        sagged = self.torque(ratio * speeds, speeds * (1 - sag * pump / self.largest))
        factor = np.where(given > 0, sagged / np.maximum(given, _LEAST), 1.0)
        factor = factor * (1 + np.interp(ratio, self.ratios, self._table(errors)))
        return Converter(tuple(ratio.tolist()), tuple(np.maximum(torque * factor, 0.0).tolist()),
                         tuple(capacity.tolist()))

    def _table(self, errors: np.ndarray) -> np.ndarray:
        """Relative errors of the torque at the `ratios`."""
        return np.asarray(self.onto.T @ errors)
