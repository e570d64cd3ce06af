"""The load block: measured torque -> output speed."""

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.relaxation import relaxed
from slipstick.blocks.whitening import BlockNoise
from slipstick.clutch.lag import lagged_signal
from slipstick.naming import bases
from slipstick.naming.filters import first_order, smoothed_walk
from slipstick.naming.bases import sensor_basis

KNOWN = 0.03
CONDITIONS_WITHIN = 0.02


def level_columns(values):
    levels = np.unique(values)
    if len(levels) > len(values) / 4:
        return np.ones((len(values), 1))
    return (values[:, None] == levels).astype(float)


def lock_spike(scene):
    """1 at the sample that follows lock-up, (n, k)."""
    time, lock = scene.time, scene.recordings.measured_time
    at = np.clip(np.searchsorted(time, lock), 1, len(time) - 2)
    spike = np.zeros((len(lock), len(time)))
    spike[np.arange(len(lock)), at] = 1.0
    return spike


class LoadBlock:
    name, signal = "load", "output_speed"
    random = ("output_viscous", "brake_torque", "load_inertia", "lock_up", "breakaway")
    forced = True

    def __init__(self, scene):
        self.scene = scene
        self.fine = bases.FINE
        c = scene.recordings.conditions
        self.measured = scene.measured("output_speed")
        self.torque = scene.measured("output_torque")
        self.inertia, self.brake = c.load_inertia, c.brake_torque
        self.inertia_levels, self.brake_levels = level_columns(c.load_inertia), level_columns(c.brake_torque)
        self.fixed = ("clock", *(f"inertia {i}" for i in range(self.inertia_levels.shape[1])),
                      *(f"brake {i}" for i in range(self.brake_levels.shape[1])))
        self.fixed_std = np.array([scene.step, *[CONDITIONS_WITHIN] * (len(self.fixed) - 1)])
        self.widest = np.array([0.1, 0.05, 0.05, 0.5, 0.5])
        self.random_std = np.array([KNOWN, 1e-3, 1e-3, 1e-3, 1e-3])
        self.counted = scene.slipping | scene.locked  # the torque jumps between
        self.viscous = scene.value("output_viscous")
        self.spike = lock_spike(scene)
        after = scene.smooth["output_torque"].max()
        self.kick = after * scene.step / self.inertia  # rad/s

    def rates(self, points):
        return np.repeat((self.viscous * (1 + points[:, 0]) / self.inertia)[:, None], len(self.scene.time) - 1, 1)

    def base(self, points, laws=()):
        torque = self.torque - (self.brake * (1 + points[:, 1]))[:, None]
        reference = self.clean(points, laws)
        for pair, coefficients in laws:
            kind, basis = self.forcing(pair, reference)
            if kind == "torque":
                torque = torque + np.einsum("m,nmk->nk", coefficients, basis)
        inertia = (self.inertia / (1 + points[:, 2]))[:, None]
        speed = relaxed(self.scene.time, torque / inertia, self.viscous * (1 + points[:, 0]) / inertia[:, 0],
                        np.zeros(len(torque)), least=0.0)
        self._guess = speed
        self.moving = (speed[:, 1:] > 0)
        total = speed
        for pair, coefficients in laws:
            kind, basis = self.forcing(pair, reference)
            if kind == "reading":
                total = total + np.einsum("m,nmk->nk", coefficients, basis)
        # what a kick at lock-up and at breakaway adds
        extra = self._kicks(points)
        return total + np.einsum("nq,nqk->nk", points[:, 3:5], extra)

    def _kicks(self, points):
        lock = self.spike * (self.kick / self.scene.step)[:, None]
        start = np.zeros_like(self.spike)
        first = np.argmax(self.moving, axis=1)
        start[np.arange(len(first)), np.minimum(first + 1, start.shape[1] - 1)] = 1
        start = start * (self.kick / self.scene.step)[:, None]
        return first_order(self.scene.time, np.stack([lock, start], axis=1), self.rates(points), self.moving)

    def noise(self, points):
        std, rho = self.scene.noise["output_speed"]
        tstd, trho = self.scene.noise["output_torque"]
        rate = self.rates(points) * self.scene.step
        onto = np.where(self.moving, self.scene.step / self.inertia[:, None], 0.0)
        return BlockNoise(std, rho, tstd, trho, np.where(self.moving, np.exp(-rate), 1.0), onto)

    def clean(self, points, laws=()):
        """The speed (n, k) from the torque without noise."""
        torque = self.scene.smooth["output_torque"]
        for pair, coefficients in laws:
            if pair[0] == "load torque":
                torque = torque + np.einsum("m,nmk->nk", coefficients, self.forcing(pair, None)[1])
        return relaxed(self.scene.time, (torque - (self.brake * (1 + points[:, 1]))[:, None]) / self.inertia[:, None] * (1 + points[:, 2:3]),
                       self.rates(points)[:, 0], np.zeros(len(points)), least=0.0)

    def true_speed(self, predicted):
        """The speed (n, k) after the integrated noise of the torque has been estimated and removed."""
        noise = self.noise(np.zeros((len(predicted), len(self.random))))
        left = np.where(self.counted, self.measured - predicted, 0.0)
        walk = (noise.onto[:, -1] * noise.input_std) ** 2 * (1 + noise.input_correlation) / (1 - noise.input_correlation)
        white = noise.std**2 * (1 + noise.correlation) / (1 - noise.correlation)
        return predicted + smoothed_walk(left, walk / white)

    def respond(self, points, torque):
        """Response (n, p, k) to torques (n, p, k) in N m on the shaft."""
        return first_order(self.scene.time, torque / self.inertia[:, None, None], self.rates(points), self.moving)

    def shared_columns(self, points, laws, predicted):
        return self.columns(points, laws, predicted)[1]

    def columns(self, points, laws, predicted):
        speed = self.clean(points, laws)
        viscous = -self.viscous * speed
        brake = np.broadcast_to(-self.brake[:, None], speed.shape)
        net = self.scene.smooth["output_torque"] - self.brake[:, None] - self.viscous * speed
        own = self.respond(points, np.stack([viscous, brake, net], axis=1))
        own = np.concatenate([own, self._kicks(points)], axis=1)
        clock = bases.late(speed, self.scene.time)
        fixed = np.concatenate([clock[:, None], own[:, 2:3] * self.inertia_levels[:, :, None],
                                own[:, 1:2] * self.brake_levels[:, :, None]], axis=1)
        return own, fixed

    def pairs(self):
        found = [("load torque", on) for on in ("output speed", "time", "run order", "input speed", "pressure", "output position", "motor speed")]
        found += [("output speed sensor", on) for on in ("offset", "gain", "lag")]
        found += [("output torque sensor", on) for on in ("offset", "gain", "lag", "pressure")]
        return found

    def forcing(self, pair, predicted):
        """Kind and basis: "torque" on the shaft in N m, or "reading" in rad/s."""
        s, (quantity, on) = self.scene, pair
        if quantity == "output speed sensor":
            return "reading", sensor_basis(on, predicted, s.time, s.value("current_delay"))
        if quantity == "output torque sensor":
            return "torque", -s.torque_error(on, s.smooth["output_torque"])
        speed = s.smooth["output_speed"]
        seen = speed > 0
        if on in ("run order", "motor speed"):
            x = s.run if on == "run order" else s.recordings.conditions.motor_speed
            h = bases.between(x)
            return "torque", -(np.ones_like(speed)[:, None] * h[:, :, None]) * s.typical_torque
        x = {"output speed": np.maximum(speed, 0), "time": np.broadcast_to(s.time, speed.shape),
             "input speed": s.smooth["input_speed"], "pressure": np.maximum(0, s.smooth["pressure"]),
             "output position": np.cumsum(np.maximum(speed, 0), axis=1) * s.step}[on]
        knots = bases.from_zero(x, seen, self.fine) if on in ("output speed", "pressure") else bases.evenly(x, seen, self.fine)
        return "torque", -bases.hats(x, knots) * s.typical_torque

    def basis(self, pair, points, laws, predicted):
        kind, basis = self.forcing(pair, self.clean(points, laws))
        return basis if kind == "reading" else self.respond(points, basis)


class LockBlock:
    """After lock-up: input speed = gear * output speed."""

    name, signal = "lock", "input_speed"
    random = ("gear_ratio",)

    def __init__(self, scene, speed):
        """`speed` (n, k) is the output speed of the load block: a measured one would share its noise with the residual."""
        self.scene = scene
        self.fine = bases.FINE
        self.output = speed
        self.measured = scene.measured("input_speed") - scene.gear * scene.measured("output_speed")
        self.counted = scene.locked
        self.fixed = ("clock",)
        self.fixed_std = np.array([scene.step])
        self.widest = np.array([0.05])
        self.random_std = np.array([1e-6])

    def base(self, points, laws=()):
        total = self.scene.gear * points[:, :1] * self.output
        for pair, c in laws:
            total = total + np.einsum("m,nmk->nk", c, self.basis(pair, points, laws, None))
        return total

    def noise(self, points):
        a, b = self.scene.noise["input_speed"], self.scene.noise["output_speed"]
        va, vb = a[0] ** 2, (self.scene.gear * b[0]) ** 2
        return BlockNoise(np.sqrt(va + vb), (va * a[1] + vb * b[1]) / (va + vb))

    def shared_columns(self, points, laws, predicted):
        return self.columns(points, laws, predicted)[1]

    def columns(self, points, laws, predicted):
        return self.scene.gear * self.output[:, None], bases.late(self.scene.gear * self.output, self.scene.time)[:, None]

    def pairs(self):
        return [(f"{q} speed sensor", on) for q in ("input", "output") for on in ("offset", "gain", "lag")] + [("stick torque", "twist")]

    def basis(self, pair, points, laws, predicted):
        s, (quantity, on) = self.scene, pair
        if quantity == "stick torque":
            locked = s.time >= s.recordings.measured_time[:, None]
            torque = np.where(locked, s.measured("output_torque"), 0)
            rate = np.gradient(s.smooth["output_torque"], s.time, axis=1) / s.gear
            return (rate * 1e-3)[:, None]
        is_input = quantity.startswith("input")
        signal = np.where(s.time < s.recordings.measured_time[:, None], s.smooth["input_speed"], s.gear * self.output) if is_input else self.output
        b = sensor_basis(on, signal, s.time, s.value("current_delay"))
        return b if is_input else -s.gear * b
