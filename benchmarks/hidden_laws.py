"""Measured laws beside the hidden ones: how far apart, and whether the band of the measured one holds the other."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from slipstick.clutch.effects.effect import SCALAR_DEPENDENCES
from slipstick.naming.block import Pair
from slipstick.naming.measured import LawPoints
from tests.validation.hidden.pairs import DEPENDS_ON

_PER_UNIT = {"energy": 1e-3, "heat": 1e-3}
"""Units of the hidden bench in those of the laws: J in kJ."""
_OTHER = {"load_point", "pump_angle", "heat"}
"""Abscissas of the hidden bench that are not the number over which their pair has its law. Its heat cools with a time
constant of some tenths of a second, and that of the laws is all energy of friction."""
_AGAINST = {"input_drag"}
"""Quantities of the hidden bench with the opposite sign of those of the laws: an input torque drives the shaft."""
_FED = "piston_feed"
"""Quantity of the hidden bench that acts with the rate of the pressure, over which the piston rate has no laws."""
_LEVEL = 0.9


@dataclass(frozen=True)
class Difference:
    """A measured law beside the hidden one over the visited range.

    `share` is the RMS of their difference, and `stated` that of the standard errors of the measured law, both over the
    RMS of the hidden law. `held` is the share of the range in which the band contains the hidden law.
    """

    pair: tuple[str, str]
    share: float
    stated: float
    held: float


def differences(known: Mapping[str, Any], laws: Mapping[Pair, LawPoints],
                parameters: Mapping[str, float]) -> list[dict[str, Any]]:
    """Those of the measured `laws` whose pair is a hidden one over a number, as `compared` does, for a JSON file."""
    hidden = zip(known["hidden"], known["changed"], strict=True)
    found = [compared(laws[its["pair"]], changed, parameters) for its, changed in hidden
             if its["pair"] in laws and is_over_a_number(its["pair"], changed)]
    return [asdict(one) for one in found if one is not None]


def is_over_a_number(pair: tuple[str, str], changed: Mapping[str, Any]) -> bool:
    """Whether a law of this pair and an entry of `changed` are laws over the same number."""
    abscissa = changed["abscissa"]
    return (pair[1] in SCALAR_DEPENDENCES and DEPENDS_ON.get(abscissa) == pair[1] and abscissa not in _OTHER
            and changed["quantity"] != _FED)


def compared(law: LawPoints, changed: Mapping[str, Any], parameters: Mapping[str, float]) -> Difference | None:
    """Compare a law with an entry of `changed` of a truth, weighted by the visits of the recordings.

    The hidden bench has these nominal `parameters`. Its slip is that behind the gear; that of the laws is the gear
    ratio times as large. It has forces on the piston, in bar and as spring rates, where laws have the piston rate that
    they cause.
    What a law is known up to is fitted to the difference first. A relative change that is known up to a constant is
    a share of the mean over the recordings: both are taken relative to that. None where the law has no point among the
    visits.
    """
    grid, change, visits = (np.array(changed[name], float) for name in ("grid", "change", "visits"))
    if changed["kind"] == "ratio":
        change = (change - 1) * (1.0 if law.relative else changed["base"])
    elif law.relative:
        change = change / changed["base"]
    if changed["quantity"] in _AGAINST:
        change = -change
    change = change * _rate_per_unit(changed["quantity"], grid, parameters)
    assert law.x is not None
    x = grid * (parameters["gr"] if changed["abscissa"] == "slip" else _PER_UNIT.get(changed["abscissa"], 1.0))
    if law.pair[1] == "run order":
        x = law.x[0] + grid * np.ptp(law.x)
    visits = visits * ((x >= law.x[0]) & (x <= law.x[-1]))
    if not visits.any():
        return None
    measured, std = np.interp(x, law.x, law.change), np.interp(x, law.x, law.std)
    if law.relative and law.up_to_constant:
        measured, change = ((1 + values) / np.average(1 + values, weights=visits) - 1 for values in (measured, change))
    columns = np.vander(grid, {"nothing": 0, "constant": 1, "line": 2}[law.up_to])
    left = measured - change
    left, change = (values - _fitted(columns, values, visits) for values in (left, change))
    wide, size = float(ndtri((1 + _LEVEL) / 2)), np.average(change**2, weights=visits)
    share, stated = (float(np.sqrt(np.average(values**2, weights=visits) / size)) for values in (left, std))
    return Difference(law.pair, share, stated, float(np.average(np.abs(left) <= wide * std, weights=visits)))


def _rate_per_unit(quantity: str, position: np.ndarray, parameters: Mapping[str, float]) -> np.ndarray | float:
    """Piston rate in m/s for each unit of a force on the piston at these positions (m,); 1 for other quantities."""
    if quantity == "net_pressure":
        return parameters["b2"] / parameters["c2"]
    return -position / parameters["c2"] if quantity == "spring_rate" else 1.0


def _fitted(columns: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    root = np.sqrt(weights)
    return np.asarray(columns @ np.linalg.lstsq(columns * root[:, None], values * root, rcond=None)[0])
