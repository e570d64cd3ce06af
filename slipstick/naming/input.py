"""The input block: measured torque -> input speed in rad/s.

The shaft turns under the torque as it was measured, and under what laws add to it. Columns are responses of the
linearisation about the speed without noise, which would be a bias where the converter's curve bends.
"""

from collections.abc import Mapping

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import bases, sensor_errors
from slipstick.naming.block import Laws, Pair, changed, fineness
from slipstick.naming.converter_lag import lag_columns, lag_unit, lagging, mean_lag
from slipstick.naming.law_map import LawMap, of_sensor, over, over_runs
from slipstick.naming.mechanics import KNOWN, TORQUE_GAIN, steepness, true_torque, with_walk
from slipstick.naming.scene import OF_PLATES, WITHIN, Scene
from slipstick.naming.shaft import Shaft
from slipstick.naming.varying_lag import OVER, Trail, trailing, with_constant_lag
from slipstick.numerics import piecewise

_LAG, _ROUNDS = ("converter torque", "lag"), 4
"""The pair of a lag of the converter, and rounds in which the speed under it is found."""
_CHANGING_LAG = "converter lag"
SENSOR = "input speed sensor"
_SIGNALS = ("input speed", "pressure", "time", "run order", "output speed", "motor speed")
_OF_CONVERTER = ("lag", "run order")
"""What the torque of the converter depends on, as a share of it."""
_FROM_ZERO = ("output speed", "pressure", "slip", *OF_PLATES)
"""Signals near whose zero laws change fastest; the knots are closer there."""


class InputBlock:
    """Input speed from the measured torque; parameters are inertia, losses, motor speed, kick at lock-up, and start.

    `base` linearises about its parameters, and `columns`, `basis` and `noise` refer to its last call.
    """

    name, signal = "input", "input_speed"
    freed: tuple[str, ...] = ()
    random: tuple[str, ...] = ("input_inertia", "input_coulomb", "input_viscous", "motor_speed", "lock_up", "start")

    def __init__(self, scene: Scene) -> None:
        self.scene, self.fine = scene, scene.settings.fine_knots
        self.finer: Mapping[Pair, int] = {}
        self.measured, self.torque = scene.measured(self.signal), bases.bent(scene.measured("output_torque"))
        self.counted = scene.slipping | scene.locked  # the torque jumps between
        self._shaft = Shaft(scene)
        self.fixed: tuple[str, ...] = ("clock", *self._shaft.shared)
        self.fixed_std = np.array([scene.step, *self._shaft.shared_std])
        self.widest = np.array([0.1, 0.1, 0.1, 0.05, 0.5, 0.05])
        self.random_std = np.array([KNOWN, KNOWN, KNOWN, 1e-3, 1e-3, 1e-2])  # motor speeds have shared means
        self._clock = 0.0
        self._torques: dict[tuple[Pair, int, int], np.ndarray] = {}
        self._read, self._steep = scene.smooth["output_torque"], np.ones(self.torque.shape)
        nominal = np.zeros((len(scene), len(self.random)))
        self._speed = self.clean(nominal)
        self._about = self._shaft.about(nominal, self._speed, self._factor(()))

    def at(self, shared: np.ndarray) -> "InputBlock":
        """The block with what engagements share, (p,): delay of the clock in s, sag, errors of motor speeds and
        converter.
        """
        return changed(self, _clock=float(shared[0]), _shaft=self._shaft.at(shared[1:]))

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """Input speed (n, k) in rad/s at `points` (n, 6), and at what engagements share."""
        torque, factor = self.torque / self.scene.gear, self._factor(laws)
        self._read = true_torque(self.scene, laws, self.finer)
        self._speed = reference = self._turned(points, laws, self._read, factor)
        self._steep = steepness(self.scene, self._read, laws, self.finer)
        self._about = self._shaft.about(points, reference, factor)
        for pair, coefficients in laws:
            if _is_lag(pair):
                torque = torque - self._lagging(pair, self._about.driven, coefficients)
            elif pair[0] != SENSOR and not _is_factor(pair):
                torque = torque - coefficients @ self._given_by(pair)
        speed = self._shaft.turned(points, torque - self._shaft.kick(points), factor)
        speed = speed + sensor_errors.error(self.scene, reference, laws, SENSOR, self.finer)
        return np.asarray(speed + bases.late(reference, self.scene.time, self._clock))

    def clean(self, points: np.ndarray) -> np.ndarray:
        """The speed (n, k) in rad/s from the torque without noise and without errors of its sensor, and without a kick.
        """
        return self._turned(points, (), true_torque(self.scene, (), self.finer), self._factor(()))

    def _turned(self, points: np.ndarray, laws: Laws, true: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """The speed (n, k) in rad/s under the `true` torque (n, k) in N m behind the gear, and a factor (n, k)."""
        torque = self._against(laws, true)
        speed = self._shaft.turned(points, torque, factor)
        # The lagging torque is that at the speed that it leads to, which is found by iteration.
        for _ in range(_ROUNDS if any(_is_lag(pair) for pair, _ in laws) else 0):
            driven = factor * self._shaft.driven_at(points, speed)
            speed = self._shaft.turned(points, torque - self._late(laws, driven), factor)
        return speed

    def _against(self, laws: Laws, true: np.ndarray) -> np.ndarray:
        """The torque (n, k) in N m against the motion, without losses and lags of the converter."""
        torque = true / self.scene.gear
        for pair, coefficients in laws:
            if pair[0] == "input torque":
                torque = torque - coefficients @ self._given_by(pair)
        return np.asarray(torque)

    def _factor(self, laws: Laws) -> np.ndarray:
        """The factor (n, k) of the converter's torque."""
        factor = np.ones(self.torque.shape)
        for pair, coefficients in laws:
            if _is_factor(pair):
                factor = factor + coefficients @ self._given_by(pair)
        return factor

    def _late(self, laws: Laws, driven: np.ndarray) -> np.ndarray:
        """The torque (n, k) in N m by which those of the laws that are lags of the one `driven` (n, k) drive more."""
        late = [self._lagging(pair, driven, coefficients) for pair, coefficients in laws if _is_lag(pair)]
        return np.asarray(np.sum(late, axis=0)) if late else np.zeros(driven.shape)

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of the speed sensor, and the integrated one of the torque sensor, where `base` was called last."""
        (std, rho), (input_std, input_rho) = (self.scene.noise[name] for name in ("input_speed", "output_torque"))
        step, about = self.scene.step, self._about
        return BlockNoise(std, rho, input_std / self.scene.gear, input_rho, np.exp(-about.rate * step),
                          np.broadcast_to(step / about.inertia, about.rate.shape))

    def true_speed(self, predicted: np.ndarray) -> np.ndarray:
        """The `predicted` speed (n, k) in rad/s without the integrated noise of the torque."""
        return with_walk(predicted, self.measured, self.counted, self.noise(predicted))

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes in rad/s (n, 6, k) with the parameters, and (n, p, k) with clock, sag, motor speeds and converter."""
        speed, against = self._speed, self._against(laws, self._read) - self._late(laws, self._about.driven)
        changes = self._shaft.columns(points, speed, self._about, against)
        own, fixed = (sensor_errors.as_read(self.scene, change, speed, laws, SENSOR, self.finer) for change in changes)
        return own, np.concatenate([bases.later(speed, self.scene.time, self._clock)[:, None], fixed], axis=1)

    def level_errors(self, shared: np.ndarray) -> dict[str, np.ndarray]:
        """Relative errors (n,) of the stated motor speeds."""
        return {"motor_speed": self._shaft.level_errors(shared[1:])}

    def converter(self, shared: np.ndarray) -> Converter:
        """The converter with the `shared` errors of its curve, and with the sag of the motor at its mean speed."""
        return self._shaft.converter(shared[1:])

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of torques on the shaft, of the converter, and of both sensors."""
        signals = dict.fromkeys((*_SIGNALS, *WITHIN)) if rare else _SIGNALS
        of_converter = (*_OF_CONVERTER, *((*WITHIN, "motor speed") if rare else ()))
        return [*(("input torque", on) for on in (*signals, *self.scene.channels) if self.scene.knows(on)),
                *(("converter torque", on) for on in (*of_converter, *self.scene.channels) if self.scene.knows(on)),
                *((_CHANGING_LAG, on) for on in (OVER if rare else ()) if self.scene.knows(on)),
                *sensor_errors.pairs_of(self.scene, rare, "input speed sensor", "output torque sensor")]

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in rad/s with the coefficients of a law."""
        if pair[0] == SENSOR:
            return sensor_errors.reading(self.scene, *pair, self._speed, self.finer.get(pair, 0))
        torque = self._torque(pair, laws) / (self._steep[:, None] if pair == TORQUE_GAIN else 1.0)
        change = self._shaft.responded(torque, self._about)
        return sensor_errors.as_read(self.scene, change, self._speed, laws, SENSOR, self.finer)

    def law(self, pair: Pair) -> LawMap:
        """The values of a law: an input torque drives the shaft, an error is what a sensor reads too much.

        A law of the converter but its lag is relative.
        """
        scene, (quantity, on), finer = self.scene, pair, self.finer.get(pair, 0)
        if quantity.endswith("sensor"):
            return of_sensor(pair, scene, finer)
        if pair == _LAG:
            return mean_lag(scene, finer)
        of_converter = quantity == "converter torque"
        if of_converter and on in scene.of_runs:
            return over_runs(pair, scene, finer, relative=True)
        if of_converter:
            return over(pair, self._knots_of(pair), np.eye(fineness(self, pair)), relative=True)
        unit = self._unit(quantity)
        if on in scene.of_runs:
            return over_runs(pair, scene, finer, unit, centred=False)
        sign = 1.0 if quantity == _CHANGING_LAG else -1.0
        return over(pair, self._knots_of(pair), sign * unit * np.eye(fineness(self, pair)))

    def _unit(self, quantity: str) -> float:
        """Unit of a lag in s, or of an input torque in N m, so that coefficients are about 1."""
        return lag_unit(self.scene) if quantity == _CHANGING_LAG else self.scene.typical_torque / self.scene.gear

    def _torque(self, pair: Pair, laws: Laws) -> np.ndarray:
        """Torques (n, m, k) in N m that drive the shaft."""
        driven = self._about.driven
        if pair == _LAG:
            return lag_columns(self.scene, driven, self.finer.get(pair, 0))
        basis = self._given_by(pair)
        if _is_lag(pair):
            held = next((c for law, c in laws if law == pair), np.zeros(basis.shape[1]))
            return Trail.of(held @ basis, self.scene.step).columns(driven, basis)
        return self._about.converter.torque[:, None] * basis if _is_factor(pair) else basis

    def _lagging(self, pair: Pair, driven: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """The torque (n, k) in N m by which a lag of the one `driven` (n, k) by the converter drives the shaft more."""
        if pair == _LAG:
            return lagging(self.scene, driven, coefficients, self.finer.get(_LAG, 0))
        return trailing(driven, coefficients @ self._given_by(pair), self.scene.step)

    def _given_by(self, pair: Pair) -> np.ndarray:
        """Torques in N m, relative changes of the converter's torque, or lags in s, (n, m, k).

        They do not depend on the speed that they lead to, and most are computed once.
        """
        if pair == TORQUE_GAIN:
            return sensor_errors.reading(self.scene, *pair, self._read, self.finer.get(pair, 0)) / self.scene.gear
        key = pair, self.fine, self.finer.get(pair, 0)
        if key not in self._torques:
            self._torques[key] = self._over_signals(pair)
        return self._torques[key]

    def _over_signals(self, pair: Pair) -> np.ndarray:
        scene, (quantity, on) = self.scene, pair
        if quantity == "output torque sensor":
            torque = scene.smooth["output_torque"]
            return sensor_errors.reading(scene, *pair, torque, self.finer.get(pair, 0)) / scene.gear
        of_converter = _is_factor(pair)  # whose curve is what all engagements have in common
        size = 1.0 if of_converter else self._unit(quantity)
        if on in scene.of_runs:
            between = scene.between(on, of_converter, self.finer.get(pair, 0))
            return np.asarray(np.repeat(size * between[:, :, None], len(scene.time), axis=2))
        hats = piecewise.hats(scene.abscissa(on), self._knots_of(pair))
        return (-size if quantity == "input torque" else size) * hats

    def _knots_of(self, pair: Pair) -> np.ndarray:
        """Where the coefficients of a law over a signal are its values: (m,) in the unit of the signal."""
        x, spaced = self.scene.abscissa(pair[1]), bases.from_zero if pair[1] in _FROM_ZERO else bases.evenly
        return spaced(x, np.ones(x.shape, bool), fineness(self, pair))


def _is_lag(pair: Pair) -> bool:
    return with_constant_lag(pair) == _LAG


def _is_factor(pair: Pair) -> bool:
    """Whether a law changes the converter's torque by a share of it."""
    return pair[0] == "converter torque" and pair != _LAG
