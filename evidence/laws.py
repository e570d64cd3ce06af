"""Measured laws beside the hidden ones: how far apart, and whether the band of the measured one holds the other."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from .answer import Answer, LawOfPair
from .generator.dependences import WORDS
from .generator.truth import HiddenEffect, Truth

LEVEL = 0.9  # of the band
_PER_UNIT = {"energy": 1e-3}
"""Units of the generator in those of the laws: J in kJ."""
_OVER = {**WORDS, "contact_pressure": "pressure", "free_piston_rate": "piston rate"}
_OTHER_NUMBER = ("contact_pressure", "free_piston_rate")
"""Abscissas that are not the number over which laws of their pair are."""
_AGAINST = ("input_drag",)
"""Quantities with the opposite sign of those of the laws: an input torque drives the shaft."""
_OTHER_QUANTITY = ("piston_feed", "contact_pressure", "valve_current")
"""Quantities that act otherwise than those of the laws of their pair."""


@dataclass(frozen=True)
class Difference:
    """A measured law beside the hidden one over the visited range.

    `share` is the RMS of their difference, and `stated` that of the standard errors of the measured law, both over the
    RMS of the hidden law. `held` is the share of the range in which the band contains the hidden law.
    """

    share: float
    stated: float
    held: float


def compare_laws(answer: Answer, truth: Truth) -> list[Difference]:
    """Return the differences of those measured laws whose pair is a hidden one over the same number."""
    laws = {law.pair: law for law in answer.laws}
    differences = [compare(laws[hidden.pair], hidden, truth) for hidden in truth.hidden
                   if hidden.pair in laws and hidden.grid and _OVER.get(hidden.abscissa) == hidden.pair[1]
                   and hidden.abscissa not in _OTHER_NUMBER and hidden.quantity not in _OTHER_QUANTITY]
    return [difference for difference in differences if difference is not None]


def compare(law: LawOfPair, hidden: HiddenEffect, truth: Truth) -> Difference | None:
    """Compare a law with a hidden one, weighted by the visits of the recordings.

    The slip of the generator is that behind the gear, and that of the laws is the gear ratio times as large. The
    generator has forces on the piston, in bar and as spring rates, where laws have the rate that they cause. What a law
    is known up to is fitted to the difference first; a relative change that is known up to a constant is taken relative
    to its mean. None where the law has no point among the visits.
    """
    grid, change, visits = (np.array(values, float) for values in (hidden.grid, hidden.change, hidden.visits))
    base = 1.0 if hidden.base is None else hidden.base
    if hidden.kind == "ratio":
        change = (change - 1) * (1.0 if law.relative else base)
    elif law.relative:
        change = change / base
    change = change * _rate_per_unit(hidden.quantity, grid, truth.parameters)
    if hidden.quantity in _AGAINST:
        change = -change
    points = np.array(law.x)
    x = grid * (truth.parameters["gr"] if hidden.abscissa == "slip" else _PER_UNIT.get(hidden.abscissa, 1.0))
    if law.pair[1] == "run order":
        x = points[0] + grid * np.ptp(points)
    visits = visits * ((x >= points[0]) & (x <= points[-1]))
    if not visits.any() or not change.any():
        return None
    measured, std = np.interp(x, points, law.change), np.interp(x, points, law.std)
    if law.relative and law.up_to == "constant":
        measured, change = ((1 + values) / np.average(1 + values, weights=visits) - 1 for values in (measured, change))
    columns = np.vander(grid, {"nothing": 0, "constant": 1, "line": 2}[law.up_to])
    left = measured - change
    left, change = (values - _project(columns, values, visits) for values in (left, change))
    wide, size = float(ndtri((1 + LEVEL) / 2)), float(np.average(change**2, weights=visits))
    if size <= 0:
        return None
    share, stated = (float(np.sqrt(np.average(values**2, weights=visits) / size)) for values in (left, std))
    return Difference(share, stated, float(np.average(np.abs(left) <= wide * std, weights=visits)))


def _rate_per_unit(quantity: str, position: np.ndarray, parameters: dict[str, float]) -> np.ndarray | float:
    """Return the piston rate in m/s for each unit of a force on the piston at these positions (m,); 1 for others."""
    if quantity == "net_pressure":
        return parameters["b2"] / parameters["c2"]
    return -position / parameters["c2"] if quantity == "spring_rate" else 1.0


def _project(columns: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    root = np.sqrt(weights)
    return np.asarray(columns @ np.linalg.lstsq(columns * root[:, None], values * root, rcond=None)[0])
