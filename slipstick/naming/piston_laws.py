"""The laws of the clutch block: which input of its kernel each pair changes, and the basis of that change."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.naming import bases, sensor_errors
from slipstick.naming.block import CLOSING
from slipstick.naming.law_map import LawMap, of_sensor, over, over_runs, unit_of
from slipstick.naming.scene import OF_PLATES, WITHIN, Pair, Scene
from slipstick.naming.sensor_lags import lag_scale
from slipstick.naming.touching import Contact
from slipstick.naming.varying_lag import OVER
from slipstick.numerics import piecewise

PAIRS: tuple[Pair, ...] = (
    *(("friction coefficient", on)
      for on in ("slip", "pressure", "heat", "time in contact", "run order", "motor speed")),
    ("chamber pressure", "input speed"), ("contact pressure", "lag"), ("piston gain", "run order"),
    ("clearance", "run order"), ("film torque", "run order"), ("film torque", "slip"), ("clearance", "pressure"),
    ("piston rate", "pressure"), ("piston rate", "piston rate"), ("piston rate", "piston position"),
    ("piston rate", "direction"))
"""All pairs of the clutch, without those of the torque sensor and over further recorded channels."""
_FURTHER: tuple[Pair, ...] = (
    *(("friction coefficient", on) for on in WITHIN if on != "piston position"),  # which is the same in full contact
    *(("chamber pressure", on) for on in WITHIN if on not in ("pressure", "piston position")),
    *(("friction lag", on) for on in OVER if on != "piston position"))
"""Pairs that are asked for besides where something is missing in full contact, and while the plates close for lags."""
_OF_RUNS = ("friction coefficient", "piston gain", "clearance", "film torque")
"""Quantities that may depend on a further channel, as they do on the run order."""

ADDED = ("chamber", "gain", "clearance", "friction", "film", "rate_extra", "lag")
"""Inputs of the kernel that are signals (n, k), to which laws add; the lag is that of its torque."""
_FROM_ZERO = ("slip", *OF_PLATES)
"""Signals near whose zero laws of the friction change fastest; the knots are closer there."""
_CHAMBER = 0.1
"""Unit in bar of chamber pressures, so that coefficients are about 1."""
_RATE, _DRAG = 0.1, 0.05
"""Units of laws of the piston rate, over the largest rate, so that coefficients are about 1."""
OVER_RATE: dict[Pair, Pair] = {("piston rate", "direction"): ("piston rate", "piston rate"),
                               ("piston rate", "piston rate"): ("piston rate", "direction")}
"""Pairs whose laws are both over the rate that the pressure gives, and differ only where that is near 0."""


@dataclass(frozen=True, eq=False)
class PistonLaw:
    """The `kind` of input that a law changes, its number of coefficients `size`, its `basis` and its `values`.

    The basis is (n, m, k) for the kinds in `ADDED`; the knots (m + 1,) of a table that is 0 at the first one for "rate"
    (relative, over the size of the rate in m/s), "drag" (over the rate) and "place" (over m); empty for a "reading".

    Changes of friction, film torque and piston gain are relative. Friction has a mean of 0 over the samples in full
    contact; others known up to a constant are 0 at the first knot. A larger clearance delays the contact. What
    depends on the direction is added to the rate that the pressure gives. A contact pressure lags like the torque of a
    slow sensor, which is right for a lag of the whole friction torque.
    """

    kind: str
    size: int
    basis: np.ndarray
    values: LawMap

    @classmethod
    def signal(cls, kind: str, basis: np.ndarray, values: LawMap) -> "PistonLaw":
        """A law that adds a basis (n, m, k)."""
        return cls(kind, basis.shape[1], basis, values)


@dataclass(frozen=True, eq=False)
class Loading:
    """What laws depend on: `pressure` in bar and the samples `counted`, (n, k) each, and the time `in_contact`."""

    scene: Scene
    pressure: np.ndarray
    in_contact: Contact
    counted: np.ndarray
    fine: int
    finer: Mapping[Pair, int]

    def knots(self, pair: Pair) -> int:
        """Number of knots of the law of a pair over a signal: fewer where only the closing of the plates shows it."""
        fewest = self.scene.settings.knots if pair[0] in CLOSING else self.fine
        return bases.doubled(fewest, self.finer.get(pair, 0))

    def is_same(self, other: "Loading") -> bool:
        """Whether both hold the same arrays, so that laws over them are the same."""
        return (self.scene is other.scene and self.pressure is other.pressure and self.in_contact is other.in_contact
                and self.counted is other.counted and self.fine == other.fine
                and self.finer == other.finer)


def pairs_of(scene: Scene, rare: bool) -> list[Pair]:
    """All pairs of the clutch, with or without `rare` ones."""
    return [*PAIRS, *sensor_errors.pairs_of(scene, rare, "output torque sensor"),
            *((quantity, on) for quantity in _OF_RUNS for on in scene.channels),
            *(pair for pair in _FURTHER if rare and pair not in PAIRS)]


def law_of(pair: Pair, given: Loading) -> PistonLaw:
    """The law of a pair; raises `KeyError` for a pair that the clutch does not have."""
    scene, (quantity, on) = given.scene, pair
    if quantity == "output torque sensor" or pair == ("contact pressure", "lag"):
        error = of_sensor(pair, scene, given.finer.get(pair, 0))
        return PistonLaw("reading", error.onto.shape[1], np.zeros(0), error)
    if on in scene.of_runs:
        return _between(pair, given)
    if quantity == "friction coefficient":
        return _friction(pair, given)
    count = given.knots(pair)
    values = np.eye(count)
    if quantity == "friction lag":
        x = _abscissa(on, given)
        knots = _knots(on, x, given.counted & (given.in_contact.time > 0), count)
        return PistonLaw.signal("lag", piecewise.hats(x, knots) * lag_scale(scene),
                                over(pair, knots, lag_scale(scene) * values))
    if quantity == "film torque":
        knots = bases.evenly(scene.slip, given.counted & (given.in_contact.full == 0), count)
        # Without the first hat, which the film coefficient replaces.
        return PistonLaw.signal("film", piecewise.hats(scene.slip, knots)[:, 1:],
                                over(pair, knots, values[:, 1:], relative=True, up_to="constant"))
    stroke, rate = scene.value("contact_position"), scene.bench.scales.piston_rate
    if pair == ("chamber pressure", "input speed"):
        x = scene.smooth["input_speed"]
        knots = bases.evenly(x, given.counted, given.knots(pair))
        hats = piecewise.hats(x, np.concatenate([[0.0], knots]))[:, 1:]
        return PistonLaw.signal("chamber", hats * _CHAMBER, over(pair, knots, _CHAMBER * np.eye(len(knots))))
    if quantity == "chamber pressure":
        x = _abscissa(on, given)
        knots = _knots(on, x, given.counted & (given.in_contact.full > 0), count)
        # Without the first hat, which is the bias of the pressure.
        return PistonLaw.signal("chamber", piecewise.hats(x, knots)[:, 1:] * _CHAMBER,
                                over(pair, knots, _CHAMBER * values[:, 1:], up_to="constant"))
    if on == "pressure" and quantity in ("clearance", "piston rate"):
        x = np.maximum(given.pressure, 0)
        knots = bases.from_zero(x, given.counted, count)
        hats = piecewise.hats(x, knots)
        if quantity == "clearance":
            # Without the first hat: a clearance at no pressure is an initial position.
            return PistonLaw.signal("clearance", hats[:, 1:] * stroke,
                                    over(pair, knots, stroke * values[:, 1:], up_to="constant"))
        return PistonLaw.signal("rate_extra", hats * rate * _RATE, over(pair, knots, _RATE * rate * values))
    knots = np.linspace(0, 1, count)
    if pair == ("piston rate", "piston rate"):
        top = max(map(abs, free_rates(given)))
        law = over(pair, knots * top, values[:, 1:], relative=True, up_to="constant")
        return PistonLaw("rate", count - 1, knots * top, law)
    if pair == ("piston rate", "piston position"):
        # The kernel's table is over the state of the piston, which the gain turns into its position.
        law = over(pair, knots * stroke * scene.value("temperature_gain"), rate * values[:, 1:], up_to="constant")
        return PistonLaw("place", count - 1, knots * stroke, law)
    if pair == ("piston rate", "direction"):
        # Friction is not 0 where the rate is, and differs between both ways: a change of the rate instead of a share.
        knots = np.linspace(*free_rates(given), count)
        law = over(pair, knots, _DRAG * rate * values[:, 1:], up_to="constant", x_unit="m/s")
        return PistonLaw("drag", count - 1, knots, law)
    raise KeyError(pair)


def free_rates(given: Loading) -> tuple[float, float]:
    """The least and the largest piston rate in m/s that the pressure gives while the plates close."""
    value, moving = given.scene.value, given.counted & (given.in_contact.full == 0)
    driven = (value("piston_pressure") * (given.pressure - value("pressure_bias"))
              + value("piston_pressure_rate") * np.gradient(given.pressure, given.scene.step, axis=1)
              - value("piston_return") * given.in_contact.position / value("temperature_gain"))
    knots = bases.evenly(driven / value("piston_inertia"), moving, 2)
    return float(knots[0]), float(knots[1])


_KINDS = {"friction coefficient": "friction", "film torque": "film", "piston gain": "gain", "clearance": "clearance",
          "friction lag": "lag"}
"""Inputs of the kernel that laws over what is constant in an engagement change."""


def _between(pair: Pair, given: Loading) -> PistonLaw:
    """A law over what is constant in an engagement: of the clearance in m, of the others relative."""
    scene, (quantity, on), finer = given.scene, pair, given.finer.get(pair, 0)
    absolute = quantity == "clearance"
    size = scene.value("contact_position") if absolute else lag_scale(scene) if quantity == "friction lag" else 1.0
    if quantity == "film torque":
        # A data sheet knows the film coefficient, and no more than the first runs can have it while the oil warms up.
        runs = scene.constant_in_run(on)
        knots = bases.between_knots(runs, bases.doubled(scene.settings.knots, finer))
        between = piecewise.hats(runs, knots)[:, 1:]
        values = over(pair, knots, np.eye(len(knots))[:, 1:], True, "constant", unit_of(on, scene))
    else:
        centred = quantity != "friction lag"
        between = scene.between(on, centred, finer)
        values = over_runs(pair, scene, finer, size, relative=not absolute and centred, centred=centred)
    basis = between[:, :, None] * np.full(given.pressure.shape, size)[:, None]
    return PistonLaw.signal(_KINDS[quantity], basis, values)


def _friction(pair: Pair, given: Loading) -> PistonLaw:
    """A relative law of the friction over a signal."""
    loaded = given.counted & (given.in_contact.full > 0)
    x = _abscissa(pair[1], given)
    knots = _knots(pair[1], x, loaded, given.knots(pair))
    hats = piecewise.hats(x, knots)
    # Without a constant, which times an engagement's own coefficient would explain the scatter of that.
    centre = np.einsum("nmk,nk->m", hats, loaded) / max(1, loaded.sum())
    points = bases.supported(knots, x, loaded)
    values = over(pair, points, piecewise.hats(points, knots) - centre, relative=True, up_to="constant")
    return PistonLaw.signal("friction", hats - centre[:, None], values)


def _knots(on: str, x: np.ndarray, seen: np.ndarray, count: int) -> np.ndarray:
    """Knots (count,) of a law over values x where `seen`, both (n, k)."""
    return (bases.from_zero if on in _FROM_ZERO else bases.evenly)(x, seen, count)


def _abscissa(on: str, given: Loading) -> np.ndarray:
    """The signal (n, k) that a law depends on."""
    if on in OF_PLATES:
        return of_plates(given.scene, given.in_contact)[on]
    return np.maximum(given.pressure, 0) if on == "pressure" else given.scene.abscissa(on)


def of_plates(scene: Scene, in_contact: Contact) -> dict[str, np.ndarray]:
    """The values (n, k) of `OF_PLATES` with the times `in_contact`."""
    return {"heat": scene.heat(in_contact.friction), "time in contact": in_contact.time,
            "piston position": in_contact.position}
