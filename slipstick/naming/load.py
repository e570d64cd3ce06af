"""The load block: measured torque -> output speed in rad/s.

    J w' = torque - brake - b_ov w + kicks,   w(0) = 0,   w >= 0

with J in kg m^2 and torques in N m. Its columns are responses to torques, computed from the torque without noise: the
measured one would share its integrated noise with the residual.
"""

from collections.abc import Mapping

import numpy as np

from slipstick.blocks.relaxation import relaxed
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import bases, sensor_errors
from slipstick.naming.block import Laws, Pair, changed, fineness
from slipstick.naming.filters import first_order
from slipstick.naming.law_map import LawMap, of_sensor, over, over_runs
from slipstick.naming.mechanics import (
    CONDITIONS_WITHIN,
    KNOWN,
    TORQUE_GAIN,
    lock_spike,
    steepness,
    true_torque,
    with_walk,
)
from slipstick.naming.scene import OF_PLATES, WITHIN, Scene
from slipstick.numerics import piecewise
from slipstick.numerics.levels import list_levels

_SIGNALS = ("output speed", "time", "run order", "input speed", "pressure", "output position", "motor speed")
_OF_BRAKE = ("output speed", "time", "run order", "output position")
"""What the brake torque may depend on beside further channels."""
_AGAINST = ("load torque", "brake torque")
"""Quantities whose laws act on the load: in N m, and as a share of the brake torque of each engagement."""
SENSOR = "output speed sensor"
_FROM_ZERO = ("output speed", "pressure", "slip", *OF_PLATES)
"""Signals near whose zero laws change fastest; the knots are closer there."""


class LoadBlock:
    """Output speed from the measured torque; parameters are losses, brake, inertia, and kicks at lock-up and breakaway.

    `base` keeps where the load moves and the torque without a gain error, and `columns`, `basis` and `noise` refer to
    its last call.
    """

    name, signal = "load", "output_speed"
    freed: tuple[str, ...] = ()
    random: tuple[str, ...] = ("output_viscous", "brake_torque", "load_inertia", "lock_up", "breakaway")

    def __init__(self, scene: Scene) -> None:
        conditions = scene.recordings.conditions
        self.scene, self.fine = scene, scene.settings.fine_knots
        self.finer: Mapping[Pair, int] = {}
        self.measured, self.torque = scene.measured(self.signal), bases.bent(scene.measured("output_torque"))
        self.counted = scene.slipping | scene.locked  # the torque jumps between
        self.inertia, self.brake = conditions.load_inertia, conditions.brake_torque
        self.viscous = scene.value("output_viscous")
        self._inertias = np.column_stack(list_levels(self.inertia))
        self._brakes = np.column_stack(list_levels(self.brake, scene.run))
        self.fixed: tuple[str, ...] = ("clock", *(f"inertia {i}" for i in range(self._inertias.shape[1])),
                                       *(f"brake {i}" for i in range(self._brakes.shape[1])))
        self.fixed_std = np.array([scene.step, *[CONDITIONS_WITHIN] * (len(self.fixed) - 1)])
        self.widest = np.array([0.1, 0.05, 0.05, 0.5, 0.5])
        self.random_std = np.array([KNOWN, 1e-3, 1e-3, 1e-3, 1e-3])  # the fixed ones hold the mean of all but the first
        self._spike = lock_spike(scene)
        self._kick = scene.smooth["output_torque"].max() / self.inertia  # rad/s^2
        self._moving = np.ones((len(scene), len(scene.time) - 1), bool)
        self._shared = np.zeros(len(self.fixed))
        self._torques: dict[tuple[Pair, int, int], np.ndarray] = {}
        self._read, self._steep = scene.smooth["output_torque"], np.ones(self.torque.shape)
        self._speed = self.clean(np.zeros((len(scene), len(self.random))))

    def at(self, shared: np.ndarray) -> "LoadBlock":
        """The block with what engagements share, (p,): delay of the clock in s, errors of inertias and brake torques.
        """
        return changed(self, _shared=shared)

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """Output speed (n, k) in rad/s at `points` (n, 5), and at what engagements share."""
        torque = self.torque - self._braking(points)[:, None]
        self._read = true_torque(self.scene, laws, self.finer)
        self._speed = reference = self._driven(points, self._net(points, laws, self._read))
        self._steep = steepness(self.scene, self._read, laws, self.finer)
        for pair, coefficients in laws:
            if pair[0] != SENSOR:
                torque = torque + coefficients @ self._torque(pair)
        speed = self._driven(points, torque)
        self._moving = speed[:, 1:] > 0
        speed = speed + sensor_errors.error(self.scene, reference, laws, SENSOR, self.finer)
        speed = speed + bases.late(reference, self.scene.time, float(self._shared[0]))
        return np.asarray(speed + np.einsum("nq,nqk->nk", points[:, 3:], self._kicks(points)))

    def clean(self, points: np.ndarray) -> np.ndarray:
        """The speed (n, k) in rad/s from the torque without noise and without errors of its sensor, and without kicks.
        """
        return self._driven(points, self._net(points, (), true_torque(self.scene, (), self.finer)))

    def _driven(self, points: np.ndarray, torque: np.ndarray) -> np.ndarray:
        return relaxed(self.scene.time, torque * self._inverse(points)[:, None], self._rates(points)[:, 0],
                       np.zeros(len(points)), least=0.0)

    def _net(self, points: np.ndarray, laws: Laws, true: np.ndarray) -> np.ndarray:
        """The torque (n, k) in N m that drives the load under the `true` one of the clutch, without viscous losses."""
        torque = true - self._braking(points)[:, None]
        for pair, coefficients in laws:
            if pair[0] in _AGAINST:
                torque = torque + coefficients @ self._torque(pair)
        return np.asarray(torque)

    def _inverse(self, points: np.ndarray) -> np.ndarray:
        """1 / J (n,) in 1/(kg m^2)."""
        return np.asarray((1 + points[:, 2] + self.level_errors(self._shared)["load_inertia"]) / self.inertia)

    def _braking(self, points: np.ndarray) -> np.ndarray:
        """Brake torque (n,) in N m."""
        return np.asarray(self.brake * (1 + points[:, 1] + self.level_errors(self._shared)["brake_torque"]))

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of the speed sensor, and that of the torque sensor integrated while the load moves."""
        rate = self._rates(points) * self.scene.step
        onto = np.where(self._moving, self.scene.step / self.inertia[:, None], 0.0)
        return BlockNoise(*self.scene.noise["output_speed"], *self.scene.noise["output_torque"],
                          np.where(self._moving, np.exp(-rate), 1.0), onto)

    def true_speed(self, predicted: np.ndarray) -> np.ndarray:
        """The `predicted` speed (n, k) in rad/s without the integrated noise of the torque."""
        noise = self.noise(np.zeros((len(predicted), len(self.random))))
        return with_walk(predicted, self.measured, self.counted, noise)

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes in rad/s (n, 5, k) with the parameters, and (n, p, k) with clock and stated conditions."""
        speed = self._speed
        viscous = -self.viscous * speed
        brake = np.broadcast_to(-self.brake[:, None], speed.shape)
        net = self._net(points, laws, self._read) + viscous * (1 + points[:, :1])
        of_inertia = net / (self.inertia * self._inverse(points))[:, None]
        own = self._respond(points, np.stack([viscous, brake, of_inertia], axis=1))
        own = sensor_errors.as_read(self.scene, own, speed, laws, SENSOR, self.finer)
        clock = bases.later(speed, self.scene.time, float(self._shared[0]))
        fixed = np.concatenate([clock[:, None], own[:, 2:3] * self._inertias[:, :, None],
                                own[:, 1:2] * self._brakes[:, :, None]], axis=1)
        return np.concatenate([own, self._kicks(points)], axis=1), fixed

    def level_errors(self, shared: np.ndarray) -> dict[str, np.ndarray]:
        """Relative errors (n,) of the stated inertias (of their inverse) and brake torques."""
        first = 1 + self._inertias.shape[1]
        return {"load_inertia": self._inertias @ shared[1:first], "brake_torque": self._brakes @ shared[first:]}

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of load torque, brake torque and both sensors."""
        # With the same brake torque in all engagements, a share of it is a torque.
        of_brake = (*_OF_BRAKE, *self.scene.channels) if np.ptp(self.brake) > 0 else ()
        signals = dict.fromkeys((*_SIGNALS, *WITHIN)) if rare else _SIGNALS
        return [*(("load torque", on) for on in (*signals, *self.scene.channels) if self.scene.knows(on)),
                *(("brake torque", on) for on in of_brake),
                *sensor_errors.pairs_of(self.scene, rare, "output speed sensor", "output torque sensor")]

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in rad/s with the coefficients of a law: torques against the load, or shares of the brake.
        """
        if pair[0] == SENSOR:
            return sensor_errors.reading(self.scene, *pair, self._speed, self.finer.get(pair, 0))
        torque = self._torque(pair) / (self._steep[:, None] if pair == TORQUE_GAIN else 1.0)
        return sensor_errors.as_read(self.scene, self._respond(points, torque), self._speed, laws, SENSOR, self.finer)

    def law(self, pair: Pair) -> LawMap:
        """The values of a law: a load torque is against the motion, an error is what a sensor reads too much."""
        scene, (quantity, on) = self.scene, pair
        if quantity.endswith("sensor"):
            return of_sensor(pair, scene, self.finer.get(pair, 0))
        is_share = quantity == "brake torque"
        size = 1.0 if is_share else scene.typical_torque
        if on in scene.of_runs:
            return over_runs(pair, scene, self.finer.get(pair, 0), size, is_share, centred=is_share)
        return over(pair, self.knots(pair), size * np.eye(fineness(self, pair)), is_share)

    def _torque(self, pair: Pair) -> np.ndarray:
        """Torques (n, m, k) in N m that drive the load. Those over signals of the scene are computed once."""
        if pair == TORQUE_GAIN:
            return -sensor_errors.reading(self.scene, *pair, self._read, self.finer.get(pair, 0))
        key = pair, self.fine, self.finer.get(pair, 0)
        if key not in self._torques:
            self._torques[key] = self._over_signals(pair)
        return self._torques[key]

    def _over_signals(self, pair: Pair) -> np.ndarray:
        scene, (quantity, on) = self.scene, pair
        if quantity == "output torque sensor":
            return -sensor_errors.reading(scene, *pair, scene.smooth["output_torque"], self.finer.get(pair, 0))
        is_share = quantity == "brake torque"
        size = self.brake[:, None, None] if is_share else scene.typical_torque
        if on in scene.of_runs:
            # Not centred: no parameter is a torque that all engagements have in common. That of the brake is.
            between = scene.between(on, is_share, self.finer.get(pair, 0))
            return np.asarray(-np.ones((len(scene), 1, len(scene.time))) * between[:, :, None] * size)
        return np.asarray(-piecewise.hats(scene.abscissa(on), self.knots(pair)) * size)

    def knots(self, pair: Pair) -> np.ndarray:
        """Where the coefficients of a law of a torque are its values: (m,) in the unit of what it depends on."""
        spaced = bases.from_zero if pair[1] in _FROM_ZERO else bases.evenly
        x, moving = self.scene.abscissa(pair[1]), self.scene.smooth["output_speed"] > 0
        return np.asarray(spaced(x, moving, fineness(self, pair)))

    def _rates(self, points: np.ndarray) -> np.ndarray:
        """b_ov / J (n, k - 1) in 1/s."""
        rates = self.viscous * (1 + points[:, 0]) * self._inverse(points)
        return np.repeat(rates[:, None], len(self.scene.time) - 1, 1)

    def _respond(self, points: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Change (n, p, k) in rad/s under further torques (n, p, k) in N m; a load that rests stays at rest."""
        return first_order(self.scene.time, torque * self._inverse(points)[:, None, None], self._rates(points),
                           self._moving)

    def _kicks(self, points: np.ndarray) -> np.ndarray:
        """Changes (n, 2, k) in rad/s by the largest torque over one sample, at lock-up and at breakaway."""
        start = np.zeros_like(self._spike)
        start[np.arange(len(start)), np.minimum(_begins(self._moving) + 1, start.shape[1] - 1)] = 1
        return first_order(self.scene.time, np.stack([self._spike, start], axis=1) * self._kick[:, None, None],
                           self._rates(points), self._moving)


def _begins(moving: np.ndarray) -> np.ndarray:
    """Where the longest motion (n,) of each row of `moving` (n, k) begins.

    Noise of the torque may move a load for a few samples before it breaks away, and a kick there is forgotten at rest.
    """
    begins = np.empty(len(moving), int)
    for i, row in enumerate(moving):
        rests = np.flatnonzero(~row)
        ends = np.concatenate([[-1], rests, [len(row)]])
        begins[i] = ends[np.argmax(np.diff(ends))] + 1
    return begins
