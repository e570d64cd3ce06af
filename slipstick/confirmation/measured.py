"""Measured laws in place of formulas: pair and shape of a named effect may be right where its formula is not."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from slipstick.clutch.laws import MOST_LAWS, MeasuredLaw
from slipstick.confirmation.fit import SimulationFit, fit_simulation, shared_of
from slipstick.naming.selection import priced


def with_measured_laws(formulas: SimulationFit, laws: Mapping[str, MeasuredLaw], points: np.ndarray,
                       is_enough: Callable[[np.ndarray], bool]) -> SimulationFit:
    """The fit `formulas`, with the measured law of each effect whose formula describes the recordings worse.

    `laws` are those of named effects; the formula of an effect that is not in the fit was no improvement. A law has
    more values than a formula has coefficients: the gain (n,) in nats must be enough beyond their price, of which each
    engagement pays the same, since the values are not fitted here. Fits begin at the `points` (n, q) that were
    estimated beside the laws.
    """
    now = formulas
    for effect, law in laws.items():
        terms = now.block.terms
        if len(terms.laws) == MOST_LAWS:
            break
        swapped = replace(terms, effects=tuple(name for name in terms.effects if name != effect),
                          laws=(*terms.laws, law))
        shared = shared_of(now, swapped)
        factor = swapped.unknowns[-1]
        shared[-1] = (factor.typical - factor.neutral) / factor.span
        found = fit_simulation(now.block.traces, swapped, points, shared)
        price = len(law.change) - (len(terms.unknowns) - len(swapped.unknowns) + 1)
        if is_enough(priced(found.evidence - now.evidence, np.full(len(points), price / len(points)))):
            now = found
    return now
