"""The input shaft: measured torque and motor speed determine the input speed, by the first line of eqs. 3 and 4.

    Ji Omega' = T_conv(Omega, motor speed) + T_given - b_iv Omega - T_ic - torque / g_r

The torque at the sensor is g_r times that of the clutch, slipping or sticking. The speed in the converter curve is the
integrated one: with the measured speed the steep end of the curve would turn noise into a bias.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from slipstick.bench import Conditions, parameters
from slipstick.bench.converter import Converter
from slipstick.bench.physics import Physics
from slipstick.blocks.block import signals_of
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.recordings import Recordings

_GEAR, _INERTIA, _COULOMB, _VISCOUS = (
    parameters.index(name) for name in ("gear_ratio", "input_inertia", "input_coulomb", "input_viscous"))
_STEPS = 4
"""Runge-Kutta steps between two samples. Halving them changes the speed by less than a hundredth of the sensor's noise
on both shipped benches (checked by a test); one explicit step would look like a lag of half a sample."""


@dataclass(frozen=True, eq=False)
class Input:
    """Input speed in rad/s at `time` (k,), from `torque` (n, k) in N m, the `conditions` and a `converter`."""

    time: np.ndarray
    torque: np.ndarray
    conditions: Conditions
    converter: Converter
    steps: int = _STEPS
    output: str = "input_speed"
    parameters: tuple[str, ...] = ("gear_ratio", "input_inertia", "input_coulomb", "input_viscous")

    @classmethod
    def of(cls, recordings: Recordings, physics: Physics) -> "Input":
        """The input shaft of recordings; raises `BadRecording` where they have no signals."""
        signals = signals_of(recordings)
        return cls(signals.time, signals["output_torque"], recordings.conditions, physics.curves)

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """Input speed (n, k) in rad/s."""
        initial, column = initial_input_speed(self.converter, vectors, self.conditions)
        given = self.conditions.input_torque
        drive = np.zeros(len(vectors)) if given is None else given
        speed = np.empty(self.torque.shape)
        integrate(self.time, self.torque, initial[np.arange(len(vectors)), column], self.conditions.motor_speed,
                  drive - vectors[:, _COULOMB], vectors[:, _VISCOUS], vectors[:, _GEAR], vectors[:, _INERTIA],
                  curves_of(self.converter), self.steps, speed)
        return speed


def curves_of(converter: Converter) -> np.ndarray:
    """Speed ratio, torque ratio and capacity factor of a converter, (3, m)."""
    return np.array([converter.speed_ratio, converter.torque_ratio, converter.capacity_factor])


@njit(nogil=True, cache=True, error_model="numpy")
def converter_torque(speed, motor_speed, curves):  # type: ignore[no-untyped-def]
    """Output torque in N m of a converter with `curves` (3, m), at one input and one motor speed in rad/s."""
    ratio = min(curves[0, -1], max(curves[0, 0], speed / motor_speed))
    j = min(len(curves[0]) - 2, max(0, np.searchsorted(curves[0], ratio) - 1))
    share = (ratio - curves[0, j]) / (curves[0, j + 1] - curves[0, j])
    factor = motor_speed / (curves[2, j] + share * (curves[2, j + 1] - curves[2, j]))
    return (curves[1, j] + share * (curves[1, j + 1] - curves[1, j])) * factor * factor


@njit(nogil=True, cache=True, error_model="numpy")
def _rate(speed, torque, motor_speed, drive, viscous, inertia, curves):  # type: ignore[no-untyped-def]
    converter = converter_torque(speed, motor_speed, curves)
    return (converter + drive - viscous * speed - torque) / inertia


@njit(nogil=True, cache=True, error_model="numpy")
def integrate(time, torque, initial, motor_speed, drive, viscous, gear, inertia, curves,  # type: ignore[no-untyped-def]
              steps, out):
    """Fill `out` (n, k) with the input speed in rad/s at `time` (k,), by `steps` Runge-Kutta steps in a sample."""
    for i in range(len(initial)):
        speed = initial[i]
        out[i, 0] = speed
        for k in range(len(time) - 1):
            h = (time[k + 1] - time[k]) / steps
            for step in range(steps):
                before = (torque[i, k] + (torque[i, k + 1] - torque[i, k]) * step / steps) / gear[i]
                after = (torque[i, k] + (torque[i, k + 1] - torque[i, k]) * (step + 1) / steps) / gear[i]
                middle = 0.5 * (before + after)
                a = _rate(speed, before, motor_speed[i], drive[i], viscous[i], inertia[i], curves)
                b = _rate(speed + 0.5 * h * a, middle, motor_speed[i], drive[i], viscous[i], inertia[i], curves)
                c = _rate(speed + 0.5 * h * b, middle, motor_speed[i], drive[i], viscous[i], inertia[i], curves)
                d = _rate(speed + h * c, after, motor_speed[i], drive[i], viscous[i], inertia[i], curves)
                speed += h / 6 * (a + 2 * b + 2 * c + d)
            out[i, k + 1] = speed
