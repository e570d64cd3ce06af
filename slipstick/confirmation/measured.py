"""Measured laws in place of formulas: pair and shape of a named effect may be right where its formula is not."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from slipstick.clutch.laws import MOST_LAWS, MeasuredLaw
from slipstick.confirmation.fit import SimulationFit, best, fit_extended, fit_simulation
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.starts import shared_of
from slipstick.naming.selection import priced


def with_measured_laws(formulas: SimulationFit, before: SimulationFit, laws: Mapping[str, MeasuredLaw],
                       points: np.ndarray, is_enough: Callable[[np.ndarray], bool]) -> SimulationFit:
    """The fit `formulas`, with the measured law of each effect whose formula describes the recordings worse.

    `laws` are those of named effects; the formula of an effect that is not in the fit was no improvement. A law has
    more values than a formula has coefficients: the gain (n,) in nats must be enough beyond their price, of which each
    engagement pays the same, since the values are not fitted here. Fits begin at the `points` (n, q) that were
    estimated beside the laws. That of a formula may have ended in another maximum, because a law is known up to a
    constant or a line, which these points contain: before a law takes its place, it also begins where the law has
    ended, and at the fit `before` either.
    """
    def is_better(law: SimulationFit, formula: SimulationFit, values: int) -> bool:
        price = values - (len(formula.block.terms.unknowns) - len(law.block.terms.unknowns) + 1)
        return is_enough(priced(law.evidence - formula.evidence, np.full(len(points), price / len(points))))

    now = formulas
    for effect, law in laws.items():
        terms = now.block.terms
        if len(terms.laws) == MOST_LAWS:
            break
        others = tuple(name for name in terms.effects if name != effect)
        swapped = replace(terms, effects=others, laws=(*terms.laws, law))
        shared = shared_of(now.block, now.fitted.shared, SimulatedBench(now.block.traces, swapped))
        factor = swapped.unknowns[-1]
        shared[len(swapped.unknowns) - 1] = (factor.typical - factor.neutral) / factor.span
        with_law = fit_simulation(now.block.traces, swapped, points, shared)
        if is_better(with_law, now, len(law.change)):
            formula = replace(terms, effects=(*others, effect))
            again = fit_extended(before, formula, with_law.fitted.points)
            now = with_law if is_better(with_law, best([now, again]), len(law.change)) else again
    return now
