"""The valve block: current -> pressure."""

from dataclasses import replace

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks import Valve
from slipstick.naming import bases
from slipstick.naming.bases import sensor_basis
from slipstick.naming.filters import play, valve_response
from slipstick.naming.scene import Pair, Scene
from slipstick.blocks.whitening import BlockNoise

_FINE = 2


class ValveBlock:
    name, signal = "valve", "pressure"
    random = ("current_delay", "current_bias", "current_gain")

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.fine = bases.FINE
        c = scene.recordings.conditions
        self.valve = Valve.of(scene.recordings)
        self.columns_of = [parameters.index(name) for name in self.random]
        self.counted = np.ones(scene.measured("pressure").shape, bool)
        self.measured = scene.measured("pressure")
        self.fixed = ("clock",)
        self.fixed_std = np.array([scene.step])
        self.widest = np.array([0.1, 0.2, 0.1])
        self.random_std = np.array([np.inf] * 3)  # all three are calibrated
        k = len(scene.time)
        self.times = np.linspace(scene.time[0], scene.time[-1], _FINE * (k - 1) + 1)
        profile = c.current_profile
        self.current = np.array([np.interp(self.times, c.profile_time[p], c.profile_current[p])
                                 for p in range(len(c.profile_time))])[profile]
        self.clock = 0.0

    def vectors(self, points):
        vectors = np.tile(self.scene.base, (len(points), 1))
        vectors[:, self.columns_of] *= 1 + points
        return vectors

    def noise(self, points):
        return BlockNoise(*self.scene.noise["pressure"])

    def respond(self, points, demand):
        """Response (n, p, k) to demand (n, p, 2 k - 1)."""
        tau = self.vectors(points)[:, self.columns_of[0]]
        return valve_response(self.scene.step / _FINE, demand, tau)[..., ::_FINE]

    def own(self, points, clock=None):
        """Pressure (n, k) as a sensor reads it whose clock is `clock` s late: at the command it is not smooth."""
        late = self.clock if clock is None else clock
        return replace(self.valve, time=self.scene.time - late).predict(self.vectors(points))

    def at(self, shared):
        """Set what all engagements share; `base` then contains it."""
        self.clock = float(shared[0])

    def base(self, points, laws=()):
        base = total = self.own(points)
        for pair, c in laws:
            total = total + np.einsum("m,nmk->nk", c, self.basis(pair, points, laws, base))
        return total

    def pressure(self, points, laws=()):
        """The pressure without errors of its sensor and of its clock."""
        clock, self.clock = self.clock, 0.0
        pressure = self.base(points, [(pair, c) for pair, c in laws if pair[0] != "pressure sensor"])
        self.clock = clock
        return pressure

    def demand(self, points):
        v = self.vectors(points)
        return v[:, self.columns_of[2], None] * (self.current - v[:, self.columns_of[1], None])

    def shared_columns(self, points, laws, predicted):
        return self.columns(points, laws, predicted)[1]

    def columns(self, points, laws, predicted):
        base = self.own(points)
        steps = 1e-4
        own = []
        for j in range(3):
            moved = points.copy()
            moved[:, j] += steps
            own.append((self.own(moved) - base) / steps)
        h = 0.1 * self.scene.step
        clock = (self.own(points, self.clock + h) - self.own(points, self.clock - h)) / (2 * h)
        return np.stack(own, axis=1), clock[:, None]

    def pairs(self):
        run, speed = self.scene.run, self.scene.recordings.conditions.motor_speed
        found = [("valve current", "current"), ("valve current", "past current"), ("line pressure", "time"),
                 ("pressure sensor", "offset"), ("pressure sensor", "lag")]
        for quantity in ("line pressure", "valve current", "valve delay"):
            found += [(quantity, "motor speed"), (quantity, "run order")]
        return found

    def basis(self, pair: Pair, points, laws, predicted):
        """Columns (n, m, k) of the law of a pair."""
        s, (quantity, on) = self.scene, pair
        if quantity == "pressure sensor":
            return sensor_basis(on, predicted, s.time, s.value("current_delay"))
        gain = self.vectors(points)[:, self.columns_of[2]]
        if on in ("motor speed", "run order"):
            x = s.run if on == "run order" else s.recordings.conditions.motor_speed
            h = bases.between(x)
            own = self.columns(points, laws, predicted)[0]
            j = {"line pressure": 2, "valve current": 1, "valve delay": 0}[quantity]
            column = own[:, j] if j < 2 else predicted
            return column[:, None] * h[:, :, None]
        if on == "current":
            knots = np.linspace(self.current.min(), self.current.max(), self.fine + 2)
            h = bases.hats(self.current, knots)
            start = h[:, :, :1]
            return self.respond(points, gain[:, None, None] * (h - start)[:, 1:-1])
        if on == "past current":
            widths = self.current.max() * np.array([0.005, 0.01, 0.02, 0.04, 0.08])
            change = np.stack([play(self.current, w) - self.current for w in widths], axis=1)
            return self.respond(points, gain[:, None, None] * change)
        if on == "time":
            h = bases.hats(np.broadcast_to(self.times, self.current.shape), np.linspace(0, self.times[-1], self.fine))
            return self.respond(points, self.demand(points)[:, None] * h[:, 1:])
        raise KeyError(pair)
