"""The input shaft between converter and plates, against a torque of the plates: its speed, and changes of it.

    J w' = factor T_conv(w, m) + T_given - b_iv w - T_ic - torque,   T_conv = t(w/m) (m / c(w/m))^2

with the motor speed m, the torque ratio t and the capacity factor c of the converter. The motor may be slower than
stated, and slower still under the torque of the pump, and the converter's torque is off by a factor over the speed
ratio. Laws of the converter are a further factor over time. These errors are integrated with the speed, because near a
ratio of 1 the curve is so steep that a percent of motor speed changes the torque far from linearly.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.naming.block import changed
from slipstick.naming.drive import KNOTS, AtSpeed, Drive
from slipstick.naming.filters import first_order
from slipstick.naming.mechanics import CONDITIONS_WITHIN, lock_spike
from slipstick.naming.scene import Scene
from slipstick.naming.shaft_kernel import turn
from slipstick.numerics.levels import list_levels
from slipstick.numerics.threads import mapped, parts_of

CONVERTER_WITHIN = 0.05
"""Relative standard deviation of the converter's torque at a knot: its curve comes from another bench."""
_SAG_WITHIN = 0.03
"""Standard deviation of the share of its speed that the motor loses under the largest torque of the pump."""
_STEPS = 2
"""Runge-Kutta steps in a sample; four change the speed by less than a hundredth of the sensor's noise."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """About a speed, w' = forcing / inertia - rate w: `inertia` (n, 1) in kg m^2, `rate` (n, k - 1) in 1/s.

    The `converter` is that at this speed, without the `factor` (n, k) of its torque.
    """

    inertia: np.ndarray
    rate: np.ndarray
    converter: AtSpeed
    factor: np.ndarray

    @property
    def driven(self) -> np.ndarray:
        """The torque (n, k) in N m of the converter."""
        return np.asarray(self.factor * self.converter.torque)


class Shaft:
    """The shaft in each engagement. Points (n, 6) are relative to nominal, in the order of `InputBlock.random`.

    All engagements have in common the `shared` sag of the motor, errors of its levels, and those of the converter.
    """

    def __init__(self, scene: Scene) -> None:
        conditions, physics = scene.recordings.conditions, scene.bench.physics
        self._time, self._step, self._given_torque = scene.time, scene.step, scene.given_torque
        self._inertia, self._coulomb, self._viscous = (
            scene.value(name) for name in ("input_inertia", "input_coulomb", "input_viscous"))
        self._motor = conditions.motor_speed
        initial, column = initial_input_speed(physics.curves, np.tile(scene.base, (len(scene), 1)), conditions)
        self._initial = initial[np.arange(len(scene)), column]
        self._drive = Drive.of(physics.curves, self._motor, scene.smooth["input_speed"])
        self._levels = np.column_stack(list_levels(self._motor, scene.run))
        count = self._levels.shape[1]
        self.shared = ("sag", *(f"motor {i}" for i in range(count)), *(f"converter {i}" for i in range(KNOTS)))
        self.shared_std = (_SAG_WITHIN, *[CONDITIONS_WITHIN] * count, *[CONVERTER_WITHIN] * KNOTS)
        self._kick = scene.smooth["output_torque"].max() / scene.gear * lock_spike(scene)  # N m
        self._sag, self._level_errors, self._errors = 0.0, np.zeros(count), np.zeros(KNOTS)

    def at(self, shared: np.ndarray) -> "Shaft":
        """The shaft with what engagements share, (p,)."""
        return changed(self, _sag=float(shared[0]), _level_errors=shared[1:-KNOTS], _errors=shared[-KNOTS:])

    def kick(self, points: np.ndarray) -> np.ndarray:
        """The torque (n, k) in N m that brakes the shaft at lock-up."""
        return np.asarray(points[:, 4, None] * self._kick)

    def turned(self, points: np.ndarray, torque: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """Speed (n, k) in rad/s against a torque (n, k) in N m, with a factor (n, k) of the converter's torque."""
        speed, drive, motor = np.empty(torque.shape), self._drive, self._motor_at(points)
        ratio, tables = drive.ratios, drive.tables(self._errors)
        start = self._initial * motor / self._motor * (1 + points[:, 5])
        drive_torque = self._given_torque - self._coulomb * (1 + points[:, 1])
        viscous, inertia = self._viscous * (1 + points[:, 2]), self._inertia * (1 + points[:, 0])

        def turned(rows: slice) -> None:
            turn(self._time, torque[rows], factor[rows], start[rows], motor[rows], drive_torque[rows], viscous[rows],
                 inertia[rows], ratio[0], (len(ratio) - 1) / (ratio[-1] - ratio[0]), *tables, self._sag / drive.largest,
                 _STEPS, speed[rows])

        mapped(turned, parts_of(len(torque)))
        return speed

    def about(self, points: np.ndarray, speed: np.ndarray, factor: np.ndarray) -> Linearised:
        """The equation about a `speed` (n, k) in rad/s, with a `factor` (n, k) of the converter's torque."""
        now = self._drive.at(speed, self._motor_at(points)[:, None], self._sag, self._errors)
        inertia = (self._inertia * (1 + points[:, 0]))[:, None]
        rate = (self._viscous * (1 + points[:, 2]))[:, None] / inertia - factor * now.slope / inertia
        return Linearised(inertia, 0.5 * (rate[:, 1:] + rate[:, :-1]), now, factor)

    def responded(self, torque: np.ndarray, about: Linearised) -> np.ndarray:
        """Change (n, p, k) in rad/s under torques (n, p, k) in N m that drive the shaft further."""
        return first_order(self._time, torque / about.inertia[:, None], about.rate)

    def columns(self, points: np.ndarray, speed: np.ndarray, about: Linearised,
                torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes in rad/s (n, 6, k) with the parameters, and (n, p, k) with what engagements share.

        `about` is the equation about the `speed` (n, k) against the `torque` (n, k) in N m.
        """
        now, ones = about.converter, np.ones(speed.shape)
        given, motor = about.driven, about.factor * now.motor
        losses = self._coulomb * (1 + points[:, 1:2]) + self._viscous * (1 + points[:, 2:3]) * speed
        net = given + self._given_torque[:, None] - losses - torque
        own = self.responded(np.stack([-net / (1 + points[:, :1]), -self._coulomb * ones, -self._viscous * speed,
                                       motor, self._kick], axis=1), about)
        decay = np.exp(-np.cumsum(about.rate * self._step, axis=1))
        start = np.concatenate([np.ones((len(speed), 1)), decay], axis=1) * self._initial[:, None]
        own[:, 3] += start  # the shaft turns with the motor before the plates meet
        basis = self._drive.basis(now.ratio)
        sag, converter = -motor * now.pump, (given / (1 + self._errors @ basis))[:, None] * basis
        fixed = self.responded(np.concatenate([sag[:, None], converter], axis=1), about)
        levels = own[:, 3:4] * self._levels[:, :, None]
        return (np.concatenate([own, start[:, None]], axis=1),
                np.concatenate([fixed[:, :1], levels, fixed[:, 1:]], axis=1))

    def level_errors(self, shared: np.ndarray) -> np.ndarray:
        """Relative errors (n,) of the stated motor speeds."""
        return np.asarray(self._levels @ shared[1:-KNOTS])

    def converter(self, shared: np.ndarray) -> Converter:
        """The converter with the `shared` errors of its curve, and with the sag of the motor at its mean speed."""
        return self._drive.corrected(float(np.sqrt(np.mean(self._motor**2))), shared[0], shared[-KNOTS:])

    def driven_at(self, points: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Torque (n, k) in N m of the converter at a `speed` (n, k)."""
        return self._drive.torque_at(speed, self._motor_at(points)[:, None], self._sag, self._errors)

    def _motor_at(self, points: np.ndarray) -> np.ndarray:
        """Motor speed (n,) in rad/s without sag."""
        return np.asarray(self._motor * (1 + self._levels @ self._level_errors) * (1 + points[:, 3]))
