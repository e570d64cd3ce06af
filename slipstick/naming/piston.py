"""The clutch block: pressure and speeds -> torque, up to lock-up."""

import numpy as np
from numba import njit, prange
from scipy.ndimage import gaussian_filter1d

from slipstick.bench import parameters
from slipstick.blocks.whitening import BlockNoise
from slipstick.clutch.lag import lagged_signal
from slipstick.naming import bases
from slipstick.naming.mechanics import KNOWN
from slipstick.naming.bases import sensor_basis

_NAMES = ("piston_pressure_rate", "piston_pressure", "piston_inertia", "piston_return", "pressure_bias", "temperature_gain",
          "contact_position", "initial_position", "contact_length", "film_coefficient", "friction_coefficient", "gear_ratio", "ramp_share")
_SUB = 2


@njit(nogil=True, cache=True, error_model="numpy")
def _table(x, at, value):  # type: ignore[no-untyped-def]
    m = len(at)
    if m == 0:
        return 0.0
    if x <= at[0]:
        return value[0]
    for j in range(1, m):
        if x < at[j]:
            return value[j - 1] + (value[j] - value[j - 1]) * (x - at[j - 1]) / (at[j] - at[j - 1])
    return value[m - 1]


@njit(nogil=True, cache=True, error_model="numpy")
def _travel(x3, gain, clearance, contact):  # type: ignore[no-untyped-def]
    return min(contact, max(0.0, gain * x3 - clearance))


@njit(nogil=True, cache=True, error_model="numpy", parallel=True)
def _clutch(step, sub, end, pressure, change, slip, p, chamber, gain_change, clearance, friction_change, film_change,  # type: ignore[no-untyped-def]
            rate_at, rate_value, place_at, place_value, drag, rate_extra, torque, position):
    # p columns as _NAMES
    for i in prange(len(p)):
        a, b, d = p[i, 0] / p[i, 2], p[i, 1] / p[i, 2], p[i, 3] / p[i, 2]
        bias, gain, contact = p[i, 4], p[i, 5], p[i, 6]
        x = p[i, 7]
        width = p[i, 12] * contact
        h = step / sub
        for t in range(end[i]):
            # torque at the sample
            z = min(contact, max(0.0, gain * (1 + gain_change[i, t]) * x - clearance[i, t]))
            position[i, t] = z
            s = min(1.0, max(0.0, 1.0 - (contact - z) / width))
            per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / (contact - z)
            force = z / (contact - p[i, 8]) * 1e5 * max(0.0, pressure[i, t] + chamber[i, t])
            torque[i, t] = p[i, 11] * (s * s * (3 - 2 * s) * p[i, 10] * (1 + friction_change[i, t]) * force
                                       + p[i, 9] * (1 + film_change[i, t]) * per_gap * slip[i, t])
            if t + 1 == end[i] or t + 1 == pressure.shape[1]:
                break
            for j in range(sub):
                w0, w1 = j / sub, (j + 1) / sub
                f0 = b * (pressure[i, t] * (1 - w0) + pressure[i, t + 1] * w0 + chamber[i, t] * (1 - w0) + chamber[i, t + 1] * w0 - bias) \
                    + a * (change[i, t] * (1 - w0) + change[i, t + 1] * w0)
                f1 = b * (pressure[i, t] * (1 - w1) + pressure[i, t + 1] * w1 + chamber[i, t] * (1 - w1) + chamber[i, t + 1] * w1 - bias) \
                    + a * (change[i, t] * (1 - w1) + change[i, t + 1] * w1)
                e0 = rate_extra[i, t] * (1 - w0) + rate_extra[i, t + 1] * w0
                e1 = rate_extra[i, t] * (1 - w1) + rate_extra[i, t + 1] * w1
                v0 = f0 - d * x
                if drag > 0:
                    v0 = v0 - drag * v0 / np.sqrt(v0 * v0 + drag * drag)
                r0 = v0 * (1 + _table(v0, rate_at, rate_value)) + _table(x, place_at, place_value) + e0
                y = x + h * r0
                v1 = f1 - d * y
                if drag > 0:
                    v1 = v1 - drag * v1 / np.sqrt(v1 * v1 + drag * drag)
                r1 = v1 * (1 + _table(v1, rate_at, rate_value)) + _table(y, place_at, place_value) + e1
                x = x + 0.5 * h * (r0 + r1)


_EMPTY = np.zeros(0)


class ClutchBlock:
    name, signal = "clutch", "output_torque"
    random = ("friction_coefficient", "pressure_bias", "initial_position", "temperature_gain", "piston_return", "film_coefficient", "ramp_share")
    curved = True

    def __init__(self, scene, pressure):
        """`pressure` (n, k) in bar is that of the valve block."""
        self.scene = scene
        self.fine = bases.FINE
        self.measured = scene.measured("output_torque")
        self.pressure = pressure
        self.change = np.gradient(pressure, scene.time, axis=1)
        self.slip = np.maximum(scene.smooth["input_speed"] / scene.gear - scene.smooth["output_speed"], 0.0)
        self.counted = scene.slipping.copy()
        self.in_contact = np.zeros(self.pressure.shape)
        self.end = np.maximum(self.counted.sum(axis=1) + 2, 2).astype(np.int64)
        self.fixed = ("clock",)
        self.fixed_std = np.array([scene.step])
        self.widest = np.array([0.1, 0.3, 0.5, 0.3, 0.1, 0.1, 0.1])
        self.random_std = np.array([np.inf, np.inf, np.inf, np.inf, KNOWN, KNOWN, KNOWN])
        self.columns_of = [parameters.index(n) for n in _NAMES]
        self.own_of = [_NAMES.index(n) for n in self.random]

    def simulate(self, points, laws=(), position=False):
        s = self.scene
        p = np.tile(s.base[self.columns_of], (len(points), 1))
        p[:, self.own_of] *= 1 + points
        zero = np.zeros(self.pressure.shape)
        kw = dict(chamber=zero, gain=zero, clearance=zero, friction=zero, film=zero, rate_extra=zero, rate=(_EMPTY, _EMPTY), place=(_EMPTY, _EMPTY), drag=0.0)
        lag = []
        for pair, c in laws:
            kind, basis = self.law(pair)
            if kind in ("chamber", "gain", "clearance", "friction", "film", "rate_extra"):
                kw[kind] = kw[kind] + np.einsum("m,nmk->nk", c, basis)
            elif kind in ("rate", "place"):
                kw[kind] = (basis, np.concatenate([[0.0], c]))
            elif kind == "drag":
                kw["drag"] = max(0.0, float(c[0])) * basis
            else:
                lag.append((kind, basis, c))
        torque, z = np.zeros(self.pressure.shape), np.zeros(self.pressure.shape)
        _clutch(s.step, _SUB, self.end, self.pressure, self.change, self.slip, p, kw["chamber"], kw["gain"], kw["clearance"], kw["friction"], kw["film"],
                *kw["rate"], *kw["place"], kw["drag"], kw["rate_extra"], torque, z)
        for kind, basis, c in lag:
            b = s.torque_error(basis, torque)
            torque = torque + np.einsum("m,nmk->nk", c, b[:, :len(c)])
        return (torque, z) if position else torque

    def predicted_beyond(self, points, laws=()):
        """Torque (n, k) up to the measured lock-up, where samples near it are not counted."""
        end, self.end = self.end, np.searchsorted(self.scene.time, self.scene.recordings.measured_time).astype(np.int64) + 1
        torque = self.simulate(points, laws)
        self.end = end
        return torque

    def base(self, points, laws=()):
        return self.simulate(points, laws)

    def noise(self, points):
        return BlockNoise(*self.scene.noise["output_torque"])

    def shared_columns(self, points, laws, predicted):
        return bases.late(predicted, self.scene.time)[:, None]

    def columns(self, points, laws, predicted):
        h = 1e-4
        own = []
        for j in range(points.shape[1]):
            moved, back = points.copy(), points.copy()
            moved[:, j] += h
            back[:, j] -= h
            own.append((self.simulate(moved, laws) - self.simulate(back, laws)) / (2 * h))
        return np.stack(own, axis=1), self.shared_columns(points, laws, predicted)

    def pairs(self):
        friction = [("friction coefficient", on) for on in ("slip", "pressure", "heat", "time in contact", "run order", "motor speed")]
        return [*friction, ("chamber pressure", "input speed"), ("contact pressure", "lag"),
                ("piston gain", "run order"), ("clearance", "run order"), ("film torque", "run order"),
                ("clearance", "pressure"), ("piston rate", "pressure"), ("piston rate", "piston rate"), ("piston rate", "piston position"),
                ("piston rate", "direction"), ("output torque sensor", "offset"), ("output torque sensor", "gain"), ("output torque sensor", "lag"), ("output torque sensor", "pressure")]

    def contact(self, points, laws):
        """Time in full contact (n, k) in s."""
        _, z = self.simulate(points, laws, position=True)
        full = z >= self.scene.value("contact_position") * (1 - 1e-9)
        return np.cumsum(full, axis=1) * self.scene.step

    def law(self, pair):
        """Kind of a law and its basis (n, m, k), or knots."""
        s, (quantity, on) = self.scene, pair
        seen = self.counted
        if quantity in ("friction coefficient", "film torque"):
            kind = "friction" if quantity.startswith("friction") else "film"
            if on in ("run order", "motor speed"):
                x = s.run if on == "run order" else s.recordings.conditions.motor_speed
                return kind, bases.between(x)[:, :, None] * np.ones(self.slip.shape)[:, None]
            x = {"slip": s.slip, "pressure": np.maximum(self.pressure, 0), "heat": s.heat, "time in contact": self.in_contact}[on]
            loaded = seen & (self.in_contact > 0)
            knots = bases.from_zero(x, loaded, self.fine)
            if on == "pressure":
                knots = bases.evenly(x, loaded, self.fine)
            h = bases.hats(x, knots)
            # Without a constant, which times an engagement's own coefficient would explain the scatter of that.
            centre = np.einsum("nmk,nk->m", h, loaded) / max(1, loaded.sum())
            return kind, h - centre[:, None]
        if pair == ("chamber pressure", "input speed"):
            x = s.smooth["input_speed"]
            return "chamber", bases.hats(x, np.concatenate([[0.0], bases.evenly(x, seen, bases.KNOTS)]))[:, 1:] * 0.1
        if quantity == "piston gain":
            return "gain", bases.between(s.run)[:, :, None] * np.ones(self.slip.shape)[:, None]
        if pair == ("clearance", "run order"):
            return "clearance", bases.between(s.run)[:, :, None] * np.ones(self.slip.shape)[:, None] * s.value("contact_position")
        if pair == ("clearance", "pressure"):
            x = np.maximum(self.pressure, 0)
            return "clearance", bases.hats(x, bases.from_zero(x, seen, bases.KNOTS))[:, 1:] * s.value("contact_position")
        scale = s.bench.scales.piston_rate
        if pair == ("piston rate", "pressure"):
            x = np.maximum(self.pressure, 0)
            return "rate_extra", bases.hats(x, bases.from_zero(x, seen, bases.KNOTS)) * scale * 0.1
        if pair == ("piston rate", "piston rate"):
            return "rate", np.linspace(0, 1, bases.KNOTS) * scale
        if pair == ("piston rate", "piston position"):
            return "place", np.linspace(0, 1, bases.KNOTS) * s.value("contact_position")
        if pair == ("piston rate", "direction"):
            return "drag", 0.05 * scale
        if quantity in ("output torque sensor", "contact pressure"):
            return "reading", on
        raise KeyError(pair)

    def size(self, pair):
        kind, basis = self.law(pair)
        if kind in ("rate", "place"):
            return bases.KNOTS - 1
        if kind == "drag":
            return 1
        if kind == "reading":
            return {"offset": 1, "gain": 2, "lag": 4, "pressure": bases.KNOTS - 1}[basis]
        return basis.shape[1]

    def basis(self, pair, points, laws, predicted):
        kind, basis = self.law(pair)
        if kind == "reading":
            typical = np.tile(points.mean(axis=0), (len(points), 1))  # a column with an engagement's own scatter would explain it
            return self.scene.torque_error(basis, self.simulate(typical if basis != "lag" else points, laws))
        known = dict(laws)
        base = self.simulate(points, laws)
        h, out = 1e-3, []
        c = known.get(pair, np.zeros(self.size(pair)))
        for j in range(len(c)):
            e = np.zeros(len(c)); e[j] = h
            up = self.simulate(points, list({**known, pair: c + e}.items()))
            out.append((up - base) / h)
        return np.stack(out, axis=1)


class OnsetBlock(ClutchBlock):
    """The clutch until shortly after the plates meet: friction hardly changes there, whatever it depends on."""

    name = "onset"

    def __init__(self, scene, pressure, after=0.02, contact=None):
        """`contact` (n, k) is the time in contact, where an earlier fit gives it: the window then ends after it begins."""
        super().__init__(scene, pressure)
        p = dict(zip(_NAMES, scene.base[self.columns_of]))
        full = p["gear_ratio"] * p["friction_coefficient"] * p["contact_position"] / (p["contact_position"] - p["contact_length"]) * 1e5 * np.maximum(pressure, 0)
        torque = gaussian_filter1d(self.measured, 2, axis=1)
        loaded = (torque > 0.5 * full) & (torque > 5 * scene.noise["output_torque"][0]) & (scene.time > 0.01)
        first = np.where(loaded.any(axis=1), np.argmax(loaded, axis=1), len(scene.time))
        self.first = first
        if contact is not None:
            first = np.maximum(first, np.where(contact[:, -1] > 0, np.argmax(contact > 0, axis=1), 0))
        window = np.arange(len(scene.time)) < (first + int(after / scene.step))[:, None]
        self.counted = self.counted & window
        self.end = np.maximum(self.counted.sum(axis=1) + 2, 2).astype(np.int64)
        self.widest = self.widest.copy()
        self.widest[0] = 0.6


class ContactBlock(ClutchBlock):
    """The clutch in full contact, where the piston drops out."""

    name = "contact"
    curved = False
    random = ("friction_coefficient",)

    def __init__(self, scene, pressure, points, laws=(), wait=0.02):
        """`points` (n, 7) are those of the clutch block."""
        super().__init__(scene, pressure)
        self.widest = np.array([0.2])
        self.fixed, self.fixed_std = (), np.zeros(0)
        self.random_std = np.array([np.inf])
        self.own_of = [_NAMES.index(n) for n in ClutchBlock.random]
        clutch = ClutchBlock(scene, pressure)
        self.in_contact = clutch.contact(points, laws)
        self.all_points = points.copy()
        self.all_points[:, 0] = 0.0
        self.counted = scene.slipping & (self.in_contact > wait)
        self.start_points = points[:, :1]

    def simulate(self, points, laws=(), position=False):
        full = self.all_points.copy()
        full[:, 0] = points[:, 0]
        return super().simulate(full, laws, position)

    def shared_columns(self, points, laws, predicted):
        return np.zeros((len(points), 0, predicted.shape[1]))  # in full contact the torque is smooth: no clock shows

    def basis(self, pair, points, laws, predicted):
        # At the mean friction coefficient: in a fit without a law that of each engagement has taken its part of the law.
        return super().basis(pair, np.tile(points.mean(axis=0), (len(points), 1)), laws, predicted)

    def pairs(self):
        return [pair for pair in super().pairs() if pair[0] in ("friction coefficient", "chamber pressure", "contact pressure", "output torque sensor")]
