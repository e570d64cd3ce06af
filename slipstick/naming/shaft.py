"""The input block: measured torque -> input speed."""

import numpy as np

from slipstick.blocks.input import _integrate
from slipstick.blocks.whitening import BlockNoise
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.naming import bases
from slipstick.naming.filters import first_order, smoothed_walk
from slipstick.naming.load import CONDITIONS_WITHIN, KNOWN, level_columns, lock_spike
from slipstick.naming.bases import sensor_basis
from slipstick.clutch.lag import lagged_signal

CONVERTER_WITHIN = 0.05


class InputBlock:
    name, signal = "input", "input_speed"
    random = ("input_inertia", "input_coulomb", "input_viscous", "motor_speed", "lock_up", "start")
    forced = True

    def __init__(self, scene):
        self.scene = scene
        self.fine = bases.FINE
        c = scene.recordings.conditions
        self.measured = scene.measured("input_speed")
        self.torque = scene.measured("output_torque")
        self.counted = scene.slipping | scene.locked
        self.converter = scene.bench.physics.curves
        self.motor = c.motor_speed
        self.motor_levels = level_columns(self.motor)
        self.J, self.tic, self.biv = scene.value("input_inertia"), scene.value("input_coulomb"), scene.value("input_viscous")
        self.given = np.zeros(len(self.motor)) if c.input_torque is None else c.input_torque
        self.curves = np.array([self.converter.speed_ratio, self.converter.torque_ratio, self.converter.capacity_factor])
        self.knots = np.linspace(*np.quantile(np.clip(scene.smooth["input_speed"] / self.motor[:, None], 0, 1), [0.001, 0.999]), 8)
        self.fixed = ("clock", "sag", *(f"motor {i}" for i in range(self.motor_levels.shape[1])),
                      *(f"converter {i}" for i in range(len(self.knots))))
        self.fixed_std = np.array([scene.step, 0.03, *[CONDITIONS_WITHIN] * self.motor_levels.shape[1],
                                   *[CONVERTER_WITHIN] * len(self.knots)])
        self.widest = np.array([0.1, 0.1, 0.1, 0.05, 0.5, 0.05])
        self.random_std = np.array([KNOWN, KNOWN, KNOWN, 1e-3, 1e-3, 1e-2])
        self.spike = lock_spike(scene)
        self.kick = scene.smooth["output_torque"].max() / scene.gear
        vectors = np.tile(scene.base, (len(self.motor), 1))
        initial, column = initial_input_speed(self.converter, vectors, c)
        self.initial = initial[np.arange(len(vectors)), column]

    def converter_torque(self, speed, motor):
        ratio = speed / motor
        t, c = np.interp(ratio, *self.curves[[0, 1]]), np.interp(ratio, *self.curves[[0, 2]])
        return t * (motor / c) ** 2

    def base(self, points, laws=()):
        guess = self.clean(points, laws)
        motor = self.motor * (1 + points[:, 3])
        J = self.J * (1 + points[:, 0])
        torque = self.torque.copy() / self.scene.gear
        for pair, coefficients in laws:
            kind, basis = self.forcing(pair, guess)
            if kind == "torque":
                torque = torque - np.einsum("m,nmk->nk", coefficients, basis)
        torque -= points[:, 4, None] * self.kick * self.spike
        speed = np.empty(self.torque.shape)
        self._integrated(points, torque, speed)
        self._linearise(points, self.scene.smooth["input_speed"])
        total = speed
        for pair, coefficients in laws:
            kind, basis = self.forcing(pair, guess)
            if kind == "reading":
                total = total + np.einsum("m,nmk->nk", coefficients, basis)
        return total

    def _integrated(self, points, torque, speed):
        _integrate(self.scene.time, torque, self.initial * (1 + points[:, 5]), self.motor * (1 + points[:, 3]),
                   self.given - self.tic * (1 + points[:, 1]), self.biv * (1 + points[:, 2]), np.ones(len(self.motor)),
                   self.J * (1 + points[:, 0]), self.curves, 2, speed)

    def clean(self, points, laws=()):
        """The speed (n, k) from the torque without noise."""
        speed = np.empty(self.torque.shape)
        torque = self.scene.smooth["output_torque"] / self.scene.gear
        for pair, coefficients in laws:
            if pair[0] == "input torque":
                torque = torque - np.einsum("m,nmk->nk", coefficients, self.forcing(pair, None)[1])
        self._integrated(points, torque, speed)
        return speed

    def _linearise(self, points, speed):
        motor = (self.motor * (1 + points[:, 3]))[:, None]
        h = 1e-3 * motor
        self.slope = (self.converter_torque(speed + h, motor) - self.converter_torque(speed - h, motor)) / (2 * h)
        J = (self.J * (1 + points[:, 0]))[:, None]
        rate = (self.biv * (1 + points[:, 2]))[:, None] / J - self.slope / J
        self.rate = 0.5 * (rate[:, 1:] + rate[:, :-1])
        self.Ji = J
        self.conv = self.converter_torque(speed, motor)
        self.dmotor = (self.converter_torque(speed, motor * 1.001) - self.converter_torque(speed, motor * 0.999)) / 0.002

    def noise(self, points):
        std, rho = self.scene.noise["input_speed"]
        tstd, trho = self.scene.noise["output_torque"]
        return BlockNoise(std, rho, tstd / self.scene.gear, trho, np.exp(-self.rate * self.scene.step),
                          np.broadcast_to(self.scene.step / self.Ji, self.rate.shape))

    def true_speed(self, predicted):
        """The speed (n, k) after the integrated noise of the torque has been estimated and removed."""
        noise = self.noise(None)
        left = np.where(self.counted, self.measured - predicted, 0.0)
        walk = (noise.onto[:, -1] * noise.input_std) ** 2 * (1 + noise.input_correlation) / (1 - noise.input_correlation)
        white = noise.std**2 * (1 + noise.correlation) / (1 - noise.correlation)
        return predicted + smoothed_walk(left, walk / white)

    def respond(self, points, torque):
        return first_order(self.scene.time, torque / self.Ji[:, None], self.rate)

    def shared_columns(self, points, laws, predicted):
        return self.columns(points, laws, predicted)[1]

    def columns(self, points, laws, predicted):
        speed = self.clean(points, laws)
        one = np.ones_like(speed)
        net = self.conv + self.given[:, None] - self.tic - self.biv * speed - self.scene.smooth["output_torque"] / self.scene.gear
        own = self.respond(points, np.stack([-net, -self.tic * one, -self.biv * speed, self.dmotor, self.kick * self.spike], axis=1))
        start = np.concatenate([np.ones((len(speed), 1)), np.exp(-np.cumsum(self.rate * self.scene.step, axis=1))], axis=1) * self.initial[:, None]
        own = np.concatenate([own, start[:, None]], axis=1)
        clock = bases.late(speed, self.scene.time)
        h = bases.hats(speed / self.motor[:, None], self.knots)
        # A motor that sags does so with the torque of the pump, which is that of the turbine over the torque ratio.
        pump = self.conv / np.maximum(np.interp(speed / self.motor[:, None], *self.curves[[0, 1]]), 1e-6)
        sag = -self.dmotor * pump / max(float(pump.max()), 1e-6)
        fixed = self.respond(points, np.concatenate([sag[:, None], self.conv[:, None] * h], axis=1))
        fixed = np.concatenate([clock[:, None], fixed[:, :1], own[:, 3:4] * self.motor_levels[:, :, None], fixed[:, 1:]], axis=1)
        return own, fixed

    def pairs(self):
        found = [("input torque", on) for on in ("input speed", "pressure", "time", "run order", "output speed", "motor speed")]
        found += [("converter torque", on) for on in ("lag", "run order")]
        found += [("input speed sensor", on) for on in ("offset", "gain", "lag")]
        found += [("output torque sensor", on) for on in ("offset", "gain", "lag", "pressure")]
        return found

    def forcing(self, pair, predicted):
        s, (quantity, on) = self.scene, pair
        speed = s.smooth["input_speed"]
        if quantity == "input speed sensor":
            return "reading", sensor_basis(on, predicted, s.time, s.value("current_delay"))
        if quantity == "output torque sensor":
            return "torque", s.torque_error(on, s.smooth["output_torque"]) / s.gear
        if quantity == "converter torque" and on == "lag":
            conv = self.converter_torque(speed if predicted is None else predicted, self.motor[:, None])
            return "torque", np.stack([lagged_signal(conv, s.time, np.full((1,), lag)) - conv
                                       for lag in s.value("current_delay") * np.array([0.2, 0.6, 2.0, 6.0])], axis=1)
        scale = s.typical_torque / s.gear
        if on in ("run order", "motor speed"):
            x = s.run if on == "run order" else s.recordings.conditions.motor_speed
            h = bases.between(x)
            size = self.converter_torque(speed, self.motor[:, None]) if quantity == "converter torque" else np.full(speed.shape, scale)
            return "torque", size[:, None] * h[:, :, None]
        x = {"input speed": speed, "time": np.broadcast_to(s.time, speed.shape), "pressure": np.maximum(0, s.smooth["pressure"]),
             "output speed": np.maximum(0, s.smooth["output_speed"])}[on]
        seen = np.ones(x.shape, bool)
        knots = bases.from_zero(x, seen, self.fine) if on in ("output speed", "pressure") else bases.evenly(x, seen, self.fine)
        return "torque", -bases.hats(x, knots) * scale

    def basis(self, pair, points, laws, predicted):
        kind, basis = self.forcing(pair, self.clean(points, laws))
        return basis if kind == "reading" else self.respond(points, basis)
