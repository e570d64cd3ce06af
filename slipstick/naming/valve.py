"""The valve block: current -> pressure in bar.

    p'' = -6/tau^2 p - 4/tau p' + 6/tau^2 k (u - a) - 2/tau k u',   p(0) = p'(0) = 0

with the delay tau in s, the bias a in A, the gain k in bar/A and the current u in A. Laws change the current, the line
pressure (the gain), the delay, or what the sensor reads. Those within an engagement enter as demanded pressures, whose
response the same filter gives; those between engagements as multiples of the columns of its parameters. A delay that
changes within an engagement is integrated.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks import Valve
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import bases, past_current, sensor_errors
from slipstick.naming.block import Laws, Pair, changed, fineness, is_changing_delay
from slipstick.naming.filters import valve_response, varying_response
from slipstick.naming.law_map import LawMap, of_sensor, over, over_runs, single
from slipstick.naming.scene import WITHIN, Scene
from slipstick.numerics import piecewise

_FINE = 2
"""Steps of the filter in a sample: a current that bends between samples is then followed to a quarter of the error."""
_STEP, _CLOCK_STEP = 1e-4, 0.1
"""Steps of the finite differences: relative, and of the clock in samples. The prediction is smooth and has no noise."""
_FURTHER: tuple[Pair, ...] = (
    *((quantity, on) for quantity in ("line pressure", "valve current") for on in WITHIN
      if on not in ("current", "pressure")),
    *(("valve delay", on) for on in WITHIN))
"""Pairs that are asked for besides where something is missing. A line pressure over the current is a valve current."""
_BETWEEN = {"valve delay": 0, "valve current": 1}
"""The parameter whose change between engagements is the law of a quantity."""
_SHORTEST = 0.1
"""Least factor by which a law may change a delay, so that it stays positive."""


def deviations_along_axes(covariance: np.ndarray) -> np.ndarray:
    """One standard deviation along each axis of a covariance (..., q, q), as columns (..., q, q)."""
    variance, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(variance, 0))[..., None, :])


class ValveBlock:
    """Pressure from the current profiles; its parameters are the delay, bias and gain of the valve.

    `base` keeps the pressure without errors of its sensor, and `basis` refers to its last call.
    """

    name, signal = "valve", "pressure"
    freed: tuple[str, ...] = ()
    random: tuple[str, ...] = ("current_delay", "current_bias", "current_gain")
    fixed: tuple[str, ...] = ("clock",)

    def __init__(self, scene: Scene) -> None:
        conditions, time = scene.recordings.conditions, scene.time
        self.scene, self.fine = scene, scene.settings.fine_knots
        self.finer: Mapping[Pair, int] = {}
        self.measured = scene.measured(self.signal)
        self.counted = np.ones(self.measured.shape, bool)
        self.fixed_std = np.array([scene.step])
        self.widest = np.array([0.1, 0.2, 0.1])
        self.random_std = np.array([np.inf] * 3)  # all three are calibrated
        self.valve = Valve.of(scene.recordings)
        self.times = np.linspace(time[0], time[-1], _FINE * (len(time) - 1) + 1)
        profiles = zip(conditions.profile_time, conditions.profile_current, strict=True)
        self.current = np.array([np.interp(self.times, *profile) for profile in profiles])[conditions.current_profile]
        self.clock = 0.0
        self._memories: dict[int, np.ndarray] = {}
        self._scaling = {("line pressure", on) for on in scene.of_runs}
        self._full = self._true = scene.smooth[self.signal]
        self._places = [parameters.index(name) for name in self.random]

    def at(self, shared: np.ndarray) -> "ValveBlock":
        """The block with the clock, `shared` (1,) in s: the sensor reads the pressure that much later.

        `base` contains it. It is not a column as in the other blocks, because at the command the pressure has a corner.
        """
        return changed(self, clock=float(shared[0]))

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """Pressure (n, k) in bar as the sensor reads it, at `points` (n, 3)."""
        at, late = self._slowed(points, laws), self.clock / self.scene.step
        self._full = self._own(at, self.clock)
        demand = self._changed_demand(at, laws)
        if demand is not None:  # the filter is linear
            self._full = self._full + bases.delayed(self._respond(at, demand[:, None])[:, 0], late)
        if any(is_changing_delay(pair, self.scene) for pair, _ in laws):
            self._full = self._full + bases.delayed(self._varying(at, laws)[0], late)
        for pair, c in laws:
            if pair[0] == "valve current" and pair[1] in self.scene.of_runs:
                self._full = self._full + bases.delayed(c @ self._added(pair, points, laws), late)
        # The line pressure scales what the current demands, and the sensor reads what comes of both.
        self._true = self._full * self._scale(laws)
        return np.asarray(self._true + sensor_errors.error(self.scene, self._true, laws, "pressure sensor", self.finer))

    def pressure(self, points: np.ndarray, laws: Laws = (), late: float = 0.0) -> np.ndarray:
        """Pressure (n, k) in bar of `late` s before each sample, without the errors of its sensor and of its clock."""
        return changed(self, clock=late).base(points, [(pair, c) for pair, c in laws if pair[0] != "pressure sensor"])

    def changes(self, points: np.ndarray, laws: Laws, moves: np.ndarray) -> np.ndarray:
        """Changes (n, r, k) of the pressure in bar with `moves` (n, 3, r) of the parameters."""
        now = self.pressure(points, laws)
        own = [(self.pressure(points + _STEP * unit, laws) - now) / _STEP for unit in np.eye(3)]
        return np.asarray(np.einsum("nqr,qnk->nrk", moves, np.array(own)))

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of the sensor: the current is commanded and has none."""
        return BlockNoise(*self.scene.noise[self.signal])

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes (n, 3, k) of the pressure in bar with each parameter, and (n, 1, k) in bar/s with the clock."""
        h, moved = _CLOCK_STEP * self.scene.step, changed(self)  # columns of laws refer to this one
        own = [(moved.base(points + _STEP * unit, laws) - predicted) / _STEP for unit in np.eye(3)]
        late, early = (changed(self, clock=self.clock + step).base(points, laws) for step in (h, -h))
        return np.stack(own, axis=1), ((late - early) / (2 * h))[:, None]

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of the current, the line pressure, the delay and the sensor."""
        usual = ("valve current", "current"), ("valve current", "past current"), ("line pressure", "time")
        return [*usual, *(pair for pair in _FURTHER if rare and pair not in usual and self.scene.knows(pair[1])),
                *sensor_errors.pairs_of(self.scene, rare, "pressure sensor"),
                *((quantity, on) for quantity in ("line pressure", "valve current", "valve delay")
                  for on in self.scene.of_runs)]

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in bar of the pressure with the coefficients of a law.

        Currents are in A, the line pressure, the delay and the bias relative.
        """
        if pair[0] == "pressure sensor":
            return sensor_errors.reading(self.scene, *pair, self._true, self.finer.get(pair, 0))
        if pair in self._scaling:
            change = self._full[:, None] * self._between(pair)[:, :, None]
        else:
            change = self._added(pair, points, laws) * self._scale(laws)[:, None]
        return sensor_errors.as_read(self.scene, change, self._true, laws, "pressure sensor", self.finer)

    def _between(self, pair: Pair) -> np.ndarray:
        """Basis (n, m) of a law over what is constant in an engagement."""
        return self.scene.between(pair[1], finer=self.finer.get(pair, 0))

    def _scale(self, laws: Laws) -> np.ndarray:
        """The factor (n, 1) of the line pressure over what is constant in an engagement."""
        scale = [c @ self._between(pair).T for pair, c in laws if pair in self._scaling]
        return np.asarray(1 + np.sum([np.zeros(len(self.current)), *scale], axis=0))[:, None]

    def _added(self, pair: Pair, points: np.ndarray, laws: Laws) -> np.ndarray:
        """Changes (n, m, k) in bar of the pressure with the coefficients of a law, before it is scaled and read."""
        scene, (quantity, on), slowed = self.scene, pair, self._slowed(points, laws)
        if on in scene.of_runs:
            step = _STEP * np.eye(3)[_BETWEEN[quantity]]
            column = (self._own(slowed + step, self.clock) - self._own(slowed, self.clock)) / _STEP
            if quantity == "valve delay":  # a change of the delay of each engagement, and not of the nominal one
                column = column * (1 + points[:, :1])
            return np.asarray(column[:, None] * self._between(pair)[:, :, None])
        if quantity == "valve delay":
            hats = piecewise.hats(self._abscissa(on), self._knots(pair))[:, 1:]
            return self._varying(slowed, laws, hats / self._factor(laws)[:, None])[1]
        gain = self._vectors(slowed)[:, self._places[2], None, None]
        if pair == ("valve current", "current"):
            hats = piecewise.hats(self.current, self._currents(pair))
            # From the current at the command on, where the pressure is at rest. Without the outer hats, which
            # current bias and gain replace.
            return self._respond(slowed, gain * (hats - hats[:, :, :1])[:, 1:-1])
        if on == "past current":
            return self._respond(slowed, gain * self._remembered(self.finer.get(pair, 0)))
        size = {"line pressure": self._demand(slowed)[:, None], "valve current": gain}[quantity]
        # Without the first hat, which at the command only gain or bias could be told from.
        return self._respond(slowed, size * piecewise.hats(self._abscissa(on), self._knots(pair))[:, 1:])

    def _factor(self, laws: Laws) -> np.ndarray:
        """Factor (n, 2 k - 1) of the delay by `laws` within an engagement."""
        changes = [np.interp(self._abscissa(pair[1]), self._knots(pair), [0.0, *c]) for pair, c in laws
                   if is_changing_delay(pair, self.scene)]
        return np.asarray(np.maximum(1 + np.sum([np.zeros(self.current.shape), *changes], axis=0), _SHORTEST))

    def _varying(self, points: np.ndarray, laws: Laws,
                 changes: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Change (n, k) in bar of the pressure by a delay that changes, and its derivatives (n, m, k).

        They are those with respect to relative `changes` (n, m, 2 k - 1) of the delay.
        """
        demand, further = self._demand(points), self._changed_demand(points, laws)
        demand = demand if further is None else demand + further
        delay = self._vectors(points)[:, self._places[0], None] * self._factor(laws)
        changed, columns = varying_response(self.scene.step / _FINE, demand, delay, changes)
        constant = self._respond(points, demand[:, None])[:, 0]
        return np.asarray(changed[:, ::_FINE] - constant), columns[..., ::_FINE]

    def _changed_demand(self, points: np.ndarray, laws: Laws) -> np.ndarray | None:
        """What `laws` within an engagement add to the demand, (n, 2 k - 1) in bar; None without such laws."""
        demands = [self._demanded(pair, points, c) for pair, c in laws
                   if pair[0] in ("valve current", "line pressure") and pair[1] not in self.scene.of_runs]
        return np.asarray(np.sum(demands, axis=0)) if demands else None

    def _demanded(self, pair: Pair, points: np.ndarray, c: np.ndarray) -> np.ndarray:
        """The demand (n, 2 k - 1) in bar with coefficients `c` of a law, the response to which is `c @ _added`."""
        gain = self._vectors(points)[:, self._places[2], None]
        if pair == ("valve current", "current"):
            change = np.interp(self.current, self._currents(pair), [0.0, *c, 0.0])
            return np.asarray(gain * (change - change[:, :1]))
        if pair == ("valve current", "past current"):
            return np.asarray(gain * (c @ self._remembered(self.finer.get(pair, 0))))
        change = np.interp(self._abscissa(pair[1]), self._knots(pair), [0.0, *c])
        return np.asarray((self._demand(points) if pair[0] == "line pressure" else gain) * change)

    def law(self, pair: Pair) -> LawMap:
        """The values of a law: currents in A, line pressure and delay relative.

        Over past current it is the half-width of the hysteresis in A: half the distance of the rising from the falling
        branch, once the current has turned by twice the width of each play operator.
        """
        scene, (quantity, on), finer = self.scene, pair, self.finer.get(pair, 0)
        if quantity == "pressure sensor":
            return of_sensor(pair, scene, finer)
        if on in scene.of_runs:
            if quantity == "valve current":  # a coefficient is a relative bias, which is taken off the current
                return over_runs(pair, scene, finer, -scene.value("current_bias"))
            return over_runs(pair, scene, finer, relative=True)
        if pair == ("valve current", "past current"):
            widths = past_current.widths(self.current)
            return single(np.pad(widths, (0, self._remembered(finer).shape[1] - len(widths))), "A")
        if pair == ("valve current", "current"):
            knots = self._currents(pair)
            first = piecewise.hats(self.current[:, 0], knots).mean(axis=0)
            return over(pair, knots, (np.eye(len(knots)) - first)[:, 1:-1], up_to="line")
        knots = self._knots(pair)
        return over(pair, knots, np.eye(len(knots))[:, 1:], quantity != "valve current", up_to="constant")

    def _currents(self, pair: Pair) -> np.ndarray:
        """Knots in A of laws over the current."""
        return np.linspace(self.current.min(), self.current.max(), fineness(self, pair) + 2)

    def _abscissa(self, on: str) -> np.ndarray:
        """What a law of the line pressure depends on, at the times (2 k - 1,) of the filter, for each engagement."""
        x = self.scene.abscissa(on)
        finely = np.repeat(x, _FINE, axis=1)[:, :len(self.times)]
        for place in range(1, _FINE):  # linear between the samples
            finely[:, place::_FINE] += place / _FINE * np.diff(x, axis=1)
        return finely

    def _knots(self, pair: Pair) -> np.ndarray:
        """Knots of laws over time or a signal, in its unit."""
        x = self.scene.abscissa(pair[1])
        return bases.evenly(x, np.ones(x.shape, bool), fineness(self, pair))

    def _remembered(self, finer: int) -> np.ndarray:
        """Changes (n, m, 2 k - 1) of the current in A with its own past, computed once."""
        if finer not in self._memories:
            delay = self.scene.value("current_delay")
            self._memories[finer] = past_current.remembered(self.current, self.times, delay, finer)
        return self._memories[finer]

    def _slowed(self, points: np.ndarray, laws: Laws) -> np.ndarray:
        """The points (n, 3) with the delays under `laws`.

        The pressure is far from linear in the delay, which some valves double.
        """
        change = [self._between(pair) @ coefficients for pair, coefficients in laws
                  if pair[0] == "valve delay" and pair[1] in self.scene.of_runs]
        factor = np.maximum(1 + np.sum([np.zeros(len(points)), *change], axis=0), _SHORTEST)
        return np.column_stack([(1 + points[:, 0]) * factor - 1, points[:, 1:]])

    def _vectors(self, points: np.ndarray) -> np.ndarray:
        """Parameter vectors (n, 20)."""
        vectors = np.tile(self.scene.base, (len(points), 1))
        vectors[:, self._places] *= 1 + points
        return vectors

    def _own(self, points: np.ndarray, clock: float) -> np.ndarray:
        """Pressure (n, k) without laws, read by a sensor that is `clock` s late."""
        return replace(self.valve, time=self.scene.time - clock).predict(self._vectors(points))

    def _demand(self, points: np.ndarray) -> np.ndarray:
        """k (u - a) in bar, (n, 2 k - 1)."""
        vectors = self._vectors(points)
        return np.asarray(vectors[:, self._places[2], None] * (self.current - vectors[:, self._places[1], None]))

    def _respond(self, points: np.ndarray, demand: np.ndarray) -> np.ndarray:
        """Pressure (n, p, k) in bar after the filter, for demands (n, p, 2 k - 1)."""
        delay = self._vectors(points)[:, self._places[0]]
        return valve_response(self.scene.step / _FINE, demand, delay)[..., ::_FINE]
