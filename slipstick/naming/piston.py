"""The clutch block: pressure and speeds -> output torque in N m, up to lock-up (the equations are in `piston_kernel`).

The pressure is that of the valve block, without noise: the piston integrates it. The block is far from linear in its
parameters, so that start values are searched (`search`) and its columns are finite differences.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.sensor_noise import added
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import bases, sensor_errors
from slipstick.naming.block import Laws, Pair, changed
from slipstick.naming.law_map import LawMap
from slipstick.naming.mechanics import KNOWN
from slipstick.naming.piston_kernel import NAMES, close
from slipstick.naming.piston_laws import ADDED, Loading, PistonLaw, law_of, pairs_of
from slipstick.naming.piston_tangent import KINDS, respond
from slipstick.naming.scene import Scene
from slipstick.naming.touching import Contact
from slipstick.naming.varying_lag import Trail
from slipstick.numerics.threads import mapped

OWN = ("friction_coefficient", "pressure_bias", "initial_position", "temperature_gain", "piston_return",
       "film_coefficient", "ramp_share")
"""Parameters of the clutch that differ between engagements."""
_SUB = 2
"""Steps of Heun's method in a sample."""
_STEP, _LAW_STEP = 1e-4, 1e-3
"""Steps of the finite differences with respect to parameters and to coefficients of laws."""
_CLOCK_STEP = 1e-5
"""Step in s of the finite difference with respect to the clock."""
_SENSOR = "output torque sensor"
_FACTORS = ("friction", "film")
"""Kinds of laws that change factors of the torque."""
_EMPTY = np.zeros(0)
Late = Callable[[float], np.ndarray]
"""The pressure (n, k) in bar of so many s before each sample."""


class _Added(NamedTuple):
    """What laws add to each quantity of `ADDED`, (n, k), and the lag of the friction, if it has any."""

    sums: dict[str, np.ndarray]
    lag: Trail | None


class ClutchBlock:
    """Output torque of slipping plates; its parameters are those of friction and of the closing piston.

    `in_contact`, on which laws depend, is without contact as long as no fit of the piston is known. `modes` (n, r, k)
    in N m are how far the torque is known, because the pressure is.
    """

    name, signal, follows_chords = "clutch", "output_torque", False
    freed: tuple[str, ...] = ()
    random: tuple[str, ...] = OWN
    fixed: tuple[str, ...] = ("clock",)

    def __init__(self, scene: Scene, pressure: np.ndarray, late: Late | None = None) -> None:
        """`pressure` (n, k) in bar is that of the valve block, and `late` what it was some time before.

        Without `late` it is linear between two samples.
        """
        self.scene, self.fine = scene, scene.settings.fine_knots
        self.finer: Mapping[Pair, int] = {}
        self.measured = scene.measured(self.signal)
        self.pressure, self.late = pressure, late
        self.change = np.gradient(pressure, scene.time, axis=1)
        self.slip = np.maximum(scene.smooth["input_speed"] / scene.gear - scene.smooth["output_speed"], 0.0)
        self.counted = scene.slipping
        self.in_contact = Contact(*np.zeros((4, *pressure.shape)))
        self.modes: np.ndarray | None = None
        self.clock, self._inputs = 0.0, self._inputs_at(0.0)
        self._sums: tuple[list[tuple[PistonLaw, bytes]], _Added] | None = None
        self.end = last_of(self.counted)
        self.fixed_std, self.bounds = np.array([scene.step]), np.array([[-np.inf], [np.inf]])
        self.widest = np.array([0.1, 0.2, 0.4, 0.3, 0.05, 0.05, 0.05])
        self.random_std = np.array([np.inf, np.inf, np.inf, np.inf, KNOWN, KNOWN, KNOWN])
        self._nominal = scene.base[[parameters.index(name) for name in NAMES]]
        self._own = [NAMES.index(name) for name in OWN]
        self._known: tuple[Loading, dict[Pair, PistonLaw]] = self._loading(), {}

    def at(self, shared: np.ndarray) -> Self:
        """The block with the clock, `shared` (1,) in s: the sensor reads the torque that much later.

        `base` contains it. The inputs are delayed, and not the torque, whose rise has corners between two samples.
        """
        return self if float(shared[0]) == self.clock else self._at_clock(float(shared[0]))

    def _at_clock(self, clock: float) -> Self:
        self._known_laws()  # which both then have
        return changed(self, clock=clock, _inputs=self._inputs_at(clock), _sums=None)

    def _inputs_at(self, clock: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The pressure in bar of `clock` s before, its derivative in bar/s, and the slip, (n, k) each."""
        late = clock / self.scene.step
        slip = bases.delayed(self.slip, late)
        if clock and self.late is not None:
            pressure = self.late(clock)
            return pressure, np.gradient(pressure, self.scene.time, axis=1), slip
        return bases.delayed(self.pressure, late), bases.delayed(self.change, late), slip

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """Torque (n, k) in N m as the sensor reads it, at `points` (n, q); 0 after the samples that are counted."""
        return self._read(self._closed(points, laws, self.end)[0], laws)

    def part(self, points: np.ndarray, laws: Laws, rows: np.ndarray) -> np.ndarray:
        """Torque (n, k) in N m of the engagements `rows` (n,) alone, and 0 of the others."""
        return self._read(self._closed(points, laws, np.where(rows, self.end, 0))[0], laws)

    def predicted_beyond(self, points: np.ndarray) -> np.ndarray:
        """Torque (n, k) in N m up to the measured lock-up, where samples near it are not counted."""
        lock = np.searchsorted(self.scene.time, self.scene.recordings.measured_time).astype(np.int64)
        return self._read(self._closed(points, (), lock + 1)[0], ())

    def contact(self, points: np.ndarray) -> Contact:
        """How long the plates of each engagement have touched, and what heats them."""
        torque, position = self._closed(points, (), self.end)
        nothing = self._added(()).sums
        film, _ = self._at_once(points, (), self.end, {**nothing, "friction": nothing["friction"] - 1})
        ramp = self.scene.value("contact_position") * self.scene.value("ramp_share")
        width = ramp * (1 + self._all(points)[:, OWN.index("ramp_share"), None])
        return Contact.of(self.scene, position, width, self.end, torque - film, self.measured - torque)

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of the sensor, and what the error of the explained pressure makes of the torque in full contact."""
        error, rho = self.scene.pressure_error
        sensor = added(self.scene.noise[self.signal], (self.torque_per_bar * error, rho))
        return BlockNoise(*sensor, modes=self.modes)

    def knowing(self, points: np.ndarray) -> Self:
        """The block whose torque is known at `points` (n, q) as far as the pressure is."""
        return changed(self, modes=self._modes_at(points))

    def _modes_at(self, points: np.ndarray) -> np.ndarray | None:
        """Changes of the torque at `points` (n, q) with the modes of the pressure."""
        if self.scene.pressure_modes is None:
            return None
        (*now, slip), torque, moved = self._inputs, self.base(points), []
        for mode in self.scene.pressure_modes.transpose(1, 0, 2):
            changes = mode, np.gradient(mode, self.scene.time, axis=1)
            late = (bases.delayed(change, self.clock / self.scene.step) for change in changes)
            inputs = *(signal + change for signal, change in zip(now, late, strict=True)), slip
            moved.append(changed(self, _inputs=inputs).base(points) - torque)
        return np.stack(moved, axis=1)

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes in N m (n, q, k) with the parameters, and (n, p, k) in N m/s with the clock."""
        moved = mapped(lambda step: self.base(points + step, laws), list(_STEP * np.eye(points.shape[1])))
        own = np.stack([(moved_torque - predicted) / _STEP for moved_torque in moved], axis=1)
        return own, self.shared_columns(points, laws, predicted)

    def shared_columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Change (n, 1, k) in N m/s with the clock."""
        later = self._at_clock(self.clock + _CLOCK_STEP).base(points, laws)
        return np.asarray(((later - predicted) / _CLOCK_STEP)[:, None])

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of friction, film, piston, pressure in the chamber, and the torque sensor."""
        return pairs_of(self.scene, rare)

    def size(self, pair: Pair) -> int:
        """Number of coefficients of the law of a pair."""
        return self._law(pair).size

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in N m with the coefficients of a law."""
        law = self._law(pair)
        if law.kind == "reading":
            # At the mean parameters, because a column with an engagement's own scatter would explain that.
            at = points if pair[1] == "lag" else np.tile(points.mean(axis=0), (len(points), 1))
            return sensor_errors.reading(self.scene, _SENSOR, pair[1], self.base(at, laws), self.finer.get(pair, 0))
        if law.size == 0:  # over what is the same in all engagements
            return np.zeros((len(points), 0, self.pressure.shape[1]))
        (added, lag), late = self._added(laws), self.clock / self.scene.step
        at_once, _ = self._at_once(points, laws, self.end, added)
        torque = at_once if lag is None else at_once + lag.change(at_once)
        if law.kind == "lag":
            lag = lag or Trail.of(added["lag"], self.scene.step)
            change = lag.columns(at_once, bases.delayed(law.basis, late))
        elif law.kind in ADDED:
            if law.kind in _FACTORS:
                # The torque is proportional to the factor of the friction, or of the film, that the law changes.
                more = {**added, law.kind: added[law.kind] + 1}
                factor = self._at_once(points, laws, self.end, more)[0] - at_once
                change = bases.delayed_times(law.basis, late, factor)
            else:
                basis = np.ascontiguousarray(bases.delayed(law.basis, late))
                change = np.empty(basis.shape)
                respond(*self._arguments(points, laws, self.end, added, KINDS.index(law.kind), basis, change))
            if lag is not None:
                change += np.stack([lag.change(column) for column in change.transpose(1, 0, 2)], axis=1)
        else:
            known = dict(laws)
            held = known.get(pair, np.zeros(law.size))
            moved = mapped(lambda step: self._closed(points, [*{**known, pair: held + step}.items()], self.end)[0],
                           list(_LAW_STEP * np.eye(law.size)))
            change = np.stack([(moved_torque - torque) / _LAW_STEP for moved_torque in moved], axis=1)
        errors, finer = self._errors(laws)
        return sensor_errors.as_read(self.scene, change, torque, errors, _SENSOR, finer)

    @property
    def torque_per_bar(self) -> float:
        """Torque of the plates in full contact in N m, for each bar: alpha g z / (z - l)."""
        value = self.scene.value
        return 1e5 * (value("gear_ratio") * value("friction_coefficient") * value("contact_position")
                      / (value("contact_position") - value("contact_length")))

    def _all(self, points: np.ndarray) -> np.ndarray:
        """Relative changes (n, 7) of the parameters `OWN`."""
        return points

    def _law(self, pair: Pair) -> PistonLaw:
        """The law of a pair, computed once as long as what laws depend on is the same."""
        given, laws = self._known_laws()
        if pair not in laws:
            laws[pair] = law_of(pair, given)
        return laws[pair]

    def _known_laws(self) -> tuple[Loading, dict[Pair, PistonLaw]]:
        """What laws depend on, and those of them that were computed."""
        given, known = self._loading(), self._known  # which another thread may replace
        if not given.is_same(known[0]):
            self._known = known = given, {}
        return known

    def law(self, pair: Pair) -> LawMap:
        """The values of a law, as `piston_laws` states them."""
        return self._law(pair).values

    def _loading(self) -> Loading:
        return Loading(self.scene, self.pressure, self.in_contact, self.counted, self.fine, self.finer)

    def _closed(self, points: np.ndarray, laws: Laws, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Torque in N m, as it is, and piston position in m, (n, k) each, up to the samples `end` (n,)."""
        added, lag = self._added(laws)
        torque, position = self._at_once(points, laws, end, added)
        return torque if lag is None else torque + lag.change(torque), position

    def _at_once(self, points: np.ndarray, laws: Laws, end: np.ndarray,
                 added: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """The same where the friction does not lag, and `added` is added to the quantities of `ADDED`."""
        torque, position = np.zeros((2, *self.pressure.shape))
        close(*self._arguments(points, laws, end, added, torque, position))
        return torque, position

    def _arguments(self, points: np.ndarray, laws: Laws, end: np.ndarray, added: Mapping[str, np.ndarray],
                   *others: Any) -> tuple[Any, ...]:
        """Those of the kernels: the piston up to the samples `end` (n,), with `laws` and what is `added`, and `others`.
        """
        values = np.tile(self._nominal, (len(points), 1))
        values[:, self._own] *= 1 + self._all(points)
        tables = dict.fromkeys(("drag", "rate", "place"), (_EMPTY, _EMPTY))
        for pair, c in laws:
            law = self._law(pair)
            if law.kind in tables:
                tables[law.kind] = law.basis, law.values.onto @ c
        signals = (added[kind] for kind in ("chamber", "gain", "clearance", "friction", "film", "rate_extra"))
        return (self.scene.step, _SUB, self.clock, end, *self._inputs, values, *signals, *tables["drag"],
                *tables["rate"], *tables["place"], *others)

    def _read(self, torque: np.ndarray, laws: Laws) -> np.ndarray:
        """What the sensor reads of a torque (n, k) in N m, with errors that are among the laws."""
        errors, finer = self._errors(laws)
        return np.asarray(torque + sensor_errors.error(self.scene, torque, errors, _SENSOR, finer))

    def _errors(self, laws: Laws) -> tuple[Laws, dict[Pair, int]]:
        """Those of the laws that are errors of the sensor, and how often each is doubled.

        A lag of the friction is one of them: both are the same in this block.
        """
        errors = [(pair, (_SENSOR, pair[1]), c) for pair, c in laws if self._law(pair).kind == "reading"]
        return [(error, c) for _, error, c in errors], {error: self.finer.get(pair, 0) for pair, error, _ in errors}

    def _added(self, laws: Laws) -> _Added:
        """What laws add: kept, because columns are differences at the same laws."""
        terms = [(self._law(pair), c) for pair, c in laws]
        terms = [(law, c) for law, c in terms if law.kind in ADDED]
        key = [(law, c.tobytes()) for law, c in terms]
        known = self._sums  # which another thread may replace
        if known is None or known[0] != key:
            sums, nothing = dict[str, np.ndarray](), np.zeros(self.pressure.shape)
            for law, c in terms:
                sums[law.kind] = sums.get(law.kind, nothing) + c @ law.basis
            late = self.clock / self.scene.step
            delayed = {kind: bases.delayed(total, late) for kind, total in sums.items()}
            lag = Trail.of(delayed["lag"], self.scene.step) if "lag" in delayed and delayed["lag"].any() else None
            self._sums = known = key, _Added({**dict.fromkeys(ADDED, nothing), **delayed}, lag)
        return known[1]


def last_of(counted: np.ndarray) -> np.ndarray:
    """Samples (n,) up to which a block is integrated: two more than are `counted` (n, k), for derivatives and lags."""
    return np.asarray(counted.sum(axis=1) + 2, np.int64)
