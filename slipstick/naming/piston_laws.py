"""The laws of the clutch block: which input of its kernel each pair changes, and the basis of that change."""

from dataclasses import dataclass

import numpy as np

from slipstick.naming import bases
from slipstick.naming.block import Pair
from slipstick.naming.scene import Scene

PAIRS: tuple[Pair, ...] = (
    *(("friction coefficient", on)
      for on in ("slip", "pressure", "heat", "time in contact", "run order", "motor speed")),
    ("chamber pressure", "input speed"), ("contact pressure", "lag"), ("piston gain", "run order"),
    ("clearance", "run order"), ("film torque", "run order"), ("clearance", "pressure"), ("piston rate", "pressure"),
    ("piston rate", "piston rate"), ("piston rate", "piston position"), ("piston rate", "direction"),
    *(("output torque sensor", on) for on in ("offset", "gain", "lag", "pressure")))
"""All pairs of the clutch."""

ADDED = ("chamber", "gain", "clearance", "friction", "film", "rate_extra")
"""Inputs of the kernel that are signals (n, k), to which laws add."""
_READINGS = {"offset": 1, "gain": 2, "lag": 4, "pressure": bases.KNOTS - 1}
"""Number of coefficients of the errors of the torque sensor."""
_CHAMBER = 0.1
"""Unit in bar of chamber pressures, so that coefficients are about 1."""
_RATE, _DRAG = 0.1, 0.05
"""Units of laws of the piston rate, over the largest rate, so that coefficients are about 1."""


@dataclass(frozen=True, eq=False)
class PistonLaw:
    """The `kind` of input that a law changes, its number of coefficients `size`, and its `basis`.

    The basis is (n, m, k) for the kinds in `ADDED`; the knots (m + 1,) of a table that is 0 at the first one for "rate"
    (relative, over m/s) and "place" (in m/s, over m); a rate (1,) in m/s for "drag"; empty for a "reading".
    """

    kind: str
    size: int
    basis: np.ndarray

    @classmethod
    def signal(cls, kind: str, basis: np.ndarray) -> "PistonLaw":
        """A law that adds a basis (n, m, k)."""
        return cls(kind, basis.shape[1], basis)


@dataclass(frozen=True, eq=False)
class Loading:
    """What laws depend on: `pressure` in bar, the time `in_contact` in s, and the samples `counted`, (n, k) each."""

    scene: Scene
    pressure: np.ndarray
    in_contact: np.ndarray
    counted: np.ndarray
    fine: int

    def is_same(self, other: "Loading") -> bool:
        """Whether both hold the same arrays, so that laws over them are the same."""
        return (self.scene is other.scene and self.pressure is other.pressure and self.in_contact is other.in_contact
                and self.counted is other.counted and self.fine == other.fine)


def law_of(pair: Pair, given: Loading) -> PistonLaw:
    """The law of a pair; raises `KeyError` for a pair that the clutch does not have."""
    scene, (quantity, on) = given.scene, pair
    stroke, rate = scene.value("contact_position"), scene.bench.scales.piston_rate
    if quantity in ("friction coefficient", "film torque"):
        kind = "friction" if quantity == "friction coefficient" else "film"
        return PistonLaw.signal(kind, _relative(on, given))
    if quantity == "piston gain":
        return PistonLaw.signal("gain", _between("run order", given))
    if pair == ("clearance", "run order"):
        return PistonLaw.signal("clearance", _between(on, given) * stroke)
    if pair == ("chamber pressure", "input speed"):
        x = scene.smooth["input_speed"]
        knots = np.concatenate([[0.0], bases.evenly(x, given.counted, given.fine)])
        return PistonLaw.signal("chamber", bases.hats(x, knots)[:, 1:] * _CHAMBER)
    if on == "pressure" and quantity in ("clearance", "piston rate"):
        x = np.maximum(given.pressure, 0)
        hats = bases.hats(x, bases.from_zero(x, given.counted, bases.KNOTS))
        if quantity == "clearance":
            # Without the first hat: a clearance at no pressure is an initial position.
            return PistonLaw.signal("clearance", hats[:, 1:] * stroke)
        return PistonLaw.signal("rate_extra", hats * rate * _RATE)
    if pair == ("piston rate", "piston rate"):
        return PistonLaw("rate", bases.KNOTS - 1, np.linspace(0, 1, bases.KNOTS) * rate)
    if pair == ("piston rate", "piston position"):
        return PistonLaw("place", bases.KNOTS - 1, np.linspace(0, 1, bases.KNOTS) * stroke)
    if pair == ("piston rate", "direction"):
        return PistonLaw("drag", 1, np.array([_DRAG * rate]))
    if quantity in ("output torque sensor", "contact pressure"):
        return PistonLaw("reading", _READINGS[on], np.zeros(0))
    raise KeyError(pair)


def _between(on: str, given: Loading) -> np.ndarray:
    """Basis (n, m, k) over what is constant in an engagement."""
    between = bases.between(given.scene.constant_in_run(on))
    return np.asarray(between[:, :, None] * np.ones(given.pressure.shape)[:, None])


def _relative(on: str, given: Loading) -> np.ndarray:
    """Basis (n, m, k) of relative changes of friction or film torque."""
    if on in ("run order", "motor speed"):
        return _between(on, given)
    loaded = given.counted & (given.in_contact > 0)
    hats = bases.hats(_abscissa(on, given), friction_knots(on, given))
    # Without a constant, which times an engagement's own coefficient would explain the scatter of that.
    centre = np.einsum("nmk,nk->m", hats, loaded) / max(1, loaded.sum())
    return np.asarray(hats - centre[:, None])


def friction_knots(on: str, given: Loading) -> np.ndarray:
    """Where the coefficients of a law of the friction are its values, but for a constant: (m,)."""
    loaded = given.counted & (given.in_contact > 0)
    spaced = bases.evenly if on == "pressure" else bases.from_zero
    return np.asarray(spaced(_abscissa(on, given), loaded, given.fine))


def _abscissa(on: str, given: Loading) -> np.ndarray:
    """The signal (n, k) that a law of the friction depends on."""
    scene = given.scene
    signals: dict[str, np.ndarray] = {
        "slip": scene.slip, "pressure": np.maximum(given.pressure, 0), "heat": scene.heat,
        "time in contact": given.in_contact}
    return signals[on]
