"""The measured law of a finding: its values at knots, and how well they are known."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.contact import ContactBlock
from slipstick.naming.fit import BlockFit
from slipstick.naming.load import LoadBlock

_OVER_SIGNALS = {"load torque": ("output speed", "time", "input speed", "pressure", "output position"),
                 "friction coefficient": ("slip", "pressure", "heat", "time in contact")}
"""Laws whose coefficients are values at knots."""


@dataclass(frozen=True, eq=False)
class LawPoints:
    """A law measured at `x` (m,), in the unit of what it depends on: `change` (m,) with its `covariance` (m, m).

    Of the load torque the change is in N m; that of the friction coefficient is relative, and known but for a constant.
    """

    x: np.ndarray
    change: np.ndarray
    covariance: np.ndarray


def measured(fits: Mapping[str, BlockFit]) -> dict[Pair, LawPoints]:
    """The laws of load and friction in `fits`, by their pairs."""
    found = {}
    for one in fits.values():
        first = len(one.block.random) + len(one.block.fixed)
        for pair in one.laws:
            places = np.arange(first, first + len(one.coefficients[pair]))
            first += len(places)
            if isinstance(one.block, LoadBlock | ContactBlock) and pair[1] in _OVER_SIGNALS.get(pair[0], ()):
                unit = one.block.scene.typical_torque if isinstance(one.block, LoadBlock) else 1.0
                found[pair] = LawPoints(one.block.knots(pair), unit * one.coefficients[pair],
                                        unit**2 * one.fitted.covariance[np.ix_(places, places)])
    return found
