"""The measured law of a finding: its values, how well they are known, and what of it the simulator takes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipstick.clutch.effects.effect import SENSORS
from slipstick.clutch.laws import DEPENDENCES, MOST_POINTS, OF_SENSORS, QUANTITIES, MeasuredLaw
from slipstick.errors import InvalidValue
from slipstick.naming.block import Block, Pair
from slipstick.naming.curved import SETTLED, CurvedFit
from slipstick.naming.fit import BlockFit
from slipstick.naming.law_map import UpTo
from slipstick.naming.linear_model import LAW_PRECISION
from slipstick.naming.mechanics import CONDITIONS_WITHIN
from slipstick.naming.smoothness import between_points, smoothed, widened

_IN_SIMULATOR = {"input torque": "converter torque"}
"""Quantities of pairs that the simulator has under another name: an input torque adds to the converter's."""
_COARSE = 0.1
"""Standard error of a lag over the lag: mixtures of four lags are up to 20 % off lags between them."""
_SEEN = 0.5
"""Largest standard error of a point, over that of the prior: friction is not seen at a slip of 0, for instance."""
_LINEARISED = 5.0
"""Factor by which the errors of a linearised law may be too small: a clearance was off by 10 of them."""


@dataclass(frozen=True, eq=False)
class LawPoints:
    """A law of a `pair` (quantity, depends on), measured at m points.

    `change` (m,) is at `x` (m,) in `x_unit`; a law that is a single number, such as a lag, has m = 1 and no x. Where
    `relative` the change is a share of the quantity, with the unit "1"; else it is in `unit`. `covariance` (m, m) is
    that of the changes. A law known `up_to` a constant, or a straight line, has a part that parameters of the model
    take as well: its changes are chosen with mean 0 over the recordings, or with 0 at one or both ends. A relative law
    is then a share of the mean quantity, and known up to a factor of one plus the change. The errors of
    `linearised` laws, those of the closing piston, are of a linear model about the fit, and may be several times too
    small.

    Over the run order, the motor speed and further channels x are the levels, or quantiles of many. A gain is a
    relative error of a sensor over its signal. The `Block.law` of each block states signs.
    """

    pair: Pair
    x: np.ndarray | None
    x_unit: str
    change: np.ndarray
    unit: str
    relative: bool
    covariance: np.ndarray
    up_to: UpTo = "nothing"
    linearised: bool = False

    def __post_init__(self) -> None:
        """Reject arrays that do not belong together."""
        m = len(self.change)
        shapes = [self.change.shape, self.covariance.shape, (m,) if self.x is None else self.x.shape]
        if shapes != [(m,), (m, m), (m,)] or (self.x is None and m != 1):
            raise InvalidValue(f"The law of the {' over the '.join(self.pair)} has arrays of the shapes {shapes}",
                               "Give m points and changes with a covariance (m, m), or one change without a point")

    @property
    def std(self) -> np.ndarray:
        """Standard errors (m,) of the changes."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def cautious_covariance(self) -> np.ndarray:
        """The `covariance` (m, m), with the errors of a linearised law as large as they may be."""
        return self.covariance * (_LINEARISED**2 if self.linearised else 1.0)

    def simulated(self) -> MeasuredLaw | None:
        """The law for the simulator, with at most 16 points; None where it is not a law of a quantity over a number.

        A law known up to a constant or a line belongs to the parameters of the fit that measured it. A gain error of a
        sensor is a law over its own signal, and what depends on the direction of the piston one over its rate.
        """
        quantity, on = _IN_SIMULATOR.get(self.pair[0], self.pair[0]), self.pair[1]
        if on == "gain":
            on = quantity.removesuffix(" sensor")
        if on == "direction":
            on = "piston rate"
        possible = OF_SENSORS if quantity in SENSORS else DEPENDENCES
        if quantity not in QUANTITIES or on not in possible or self.x is None or len(self.x) < 2:
            return None
        kept = thin_points(self.x, self.change, MOST_POINTS)
        return MeasuredLaw(quantity, on, tuple(self.x[kept]), tuple(self.change[kept]), self.relative)

    def to_dict(self) -> dict[str, Any]:
        """The law as JSON, with units."""
        return {"pair": list(self.pair), "x": None if self.x is None else self.x.tolist(), "x_unit": self.x_unit,
                "change": self.change.tolist(), "unit": self.unit, "relative": self.relative,
                "covariance": self.covariance.tolist(), "up_to": self.up_to, "linearised": self.linearised}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "LawPoints":
        """The law of `to_dict`."""
        quantity, depends_on = values["pair"]
        return cls((quantity, depends_on), None if values["x"] is None else np.array(values["x"], float),
                   values["x_unit"], np.array(values["change"], float), values["unit"], values["relative"],
                   np.array(values["covariance"], float), values["up_to"], values["linearised"])


def law_points(fit: BlockFit, pair: Pair) -> LawPoints:
    """The law of one of the pairs of a fit, without points at which the recordings do not determine it.

    A strong law has a wider prior than in the fit, and the values of a law over a number also have that of a random
    walk (smoothness.py). The lag of the sensor that a block predicts is the delay of its reading, with that of its
    clock: mixtures of few lags leave a part of other lags to the clock. The values over the stated motor speeds are off
    by what these are.
    """
    places = fit.places(pair)
    values = fit.block.law(pair)
    onto, coefficients = values.onto, fit.coefficients[pair]
    precision = np.full(len(coefficients), LAW_PRECISION)
    prior = (onto**2).sum(axis=1) / LAW_PRECISION
    if _has_clock(fit.block, pair):
        clock = fit.block.fixed.index("clock")
        onto, coefficients = np.insert(onto, 0, 1.0, axis=1), np.insert(coefficients, 0, fit.shared[clock])
        places, precision = np.insert(places, 0, len(fit.block.random) + clock), np.insert(precision, 0, 0.0)
    covariance = fit.fitted.covariance[np.ix_(places, places)]
    linearised = isinstance(fit, CurvedFit)
    coefficients, covariance, factor = widened(coefficients, covariance, precision, SETTLED if linearised else 0.0)
    seen = np.einsum("mp,pq,mq->m", onto, covariance, onto) <= _SEEN**2 * prior / factor
    if seen.sum() < 2 or values.x is None:
        seen[:] = True
    is_curve = values.x is not None and not values.at_levels
    if is_curve and len(coefficients) > 2:
        coefficients, covariance = smoothed(onto, coefficients, covariance)
    onto = onto[seen]
    change, covariance = onto @ coefficients, onto @ covariance @ onto.T
    if is_curve:
        covariance = covariance + between_points(change, covariance) ** 2 * np.eye(len(change))
    if values.x is not None and pair[1] == "motor speed":
        covariance = covariance + np.diag(_from_stated(values.x[seen], change) ** 2)
    return LawPoints(pair, None if values.x is None else values.x[seen], values.x_unit, change, values.unit,
                     values.relative, covariance, values.up_to, linearised)


def _from_stated(x: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Errors (m,) of the values `change` (m,) of a law at stated values x (m,), by how steep it is beside them."""
    steep = np.abs(np.diff(change) / np.diff(x))
    return np.asarray(CONDITIONS_WITHIN * x * np.maximum(np.append(steep, 0.0), np.insert(steep, 0, 0.0)))


def measure_laws(fits: Mapping[str, BlockFit]) -> dict[Pair, LawPoints]:
    """All laws in `fits`, by their pairs, each from the block that determines it best.

    That is the one with the smallest mean squared error over all that the blocks visit. For the lag of a sensor, the
    block whose clock is that of the sensor goes before others. A mean over blocks would count samples twice that two
    blocks share. A lag has a further error, because it need not be one of those in the mixture.
    """
    laws_of: dict[Pair, list[tuple[bool, LawPoints]]] = {}
    for fit in fits.values():
        for pair in fit.laws:
            laws_of.setdefault(pair, []).append((not _has_clock(fit.block, pair), law_points(fit, pair)))
    best = {pair: min(laws, key=lambda entry: (entry[0], _error(entry[1], [law for _, law in laws])))[1]
            for pair, laws in laws_of.items()}
    return {pair: replace(law, covariance=law.covariance + (_COARSE * law.change) ** 2) if pair[1] == "lag" else law
            for pair, law in best.items()}


def _error(law: LawPoints, laws: Sequence[LawPoints]) -> float:
    """Mean squared error of a law over the points of all `laws` of a pair; where it has no value, their mean square."""
    variance = np.diag(law.cautious_covariance)
    if law.x is not None:
        size = max(float((other.change**2).mean()) for other in laws)
        x = np.concatenate([other.x for other in laws if other.x is not None])
        variance = np.interp(x, law.x, variance, size, size)
    return float(variance.mean())


def _has_clock(block: Block, pair: Pair) -> bool:
    """Whether a pair is the lag of the sensor whose clock the block estimates."""
    return pair == (f"{block.signal} sensor".replace("_", " "), "lag") and "clock" in block.fixed


def thin_points(x: np.ndarray, change: np.ndarray, most: int) -> np.ndarray:
    """Indices of at most `most` points of a law `change` (m,) at the ascending x (m,), both ends among them.

    Points are left out one by one, each time that without which the law differs least, at its worst, from all points.
    """
    kept = np.arange(len(x))
    while len(kept) > most:
        fewer = [np.delete(kept, i) for i in range(1, len(kept) - 1)]
        worst = [np.abs(np.interp(x, x[points], change[points]) - change).max() for points in fewer]
        kept = fewer[int(np.argmin(worst))]
    return kept
