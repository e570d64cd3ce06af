"""What each effect of the catalogue promises to explain of what a fit of the simulation leaves."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from slipstick.clutch.effects import Effect
from slipstick.confirmation.fit import SimulationFit, shared_of
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.naming.grams import Gram, estimate
from slipstick.naming.linear_model import gram_of


class About:
    """The linear mixed model about a `fit` of the simulation, to which columns can be added."""

    def __init__(self, fit: SimulationFit) -> None:
        """Compute the columns of the parameters and of the coefficients."""
        self.fit, block, fitted = fit, fit.block, fit.fitted
        block.at(fitted.shared)
        self.own, self.fixed = block.columns(fitted.points, (), fitted.predicted)
        self.z = block.measured - fitted.predicted + np.einsum("nq,nqk->nk", fitted.points, self.own)
        self.z = self.z + fitted.shared @ self.fixed

    def beside(self, columns: np.ndarray) -> Gram:
        """The products with further `columns` (n, m, K)."""
        return gram_of(self.fit.block, [self.own, self.fixed, columns], self.z, self.fit.fitted.noise,
                       columns.shape[1])


def promised(fit: SimulationFit, effects: Iterable[Effect]) -> dict[str, float]:
    """The log-likelihood in nats, up to a constant, that each of these effects promises beside the terms of a fit.

    The column of an effect is what it changes at its typical coefficients. Effects of which the recordings tell nothing
    are left out: those over a run order that was not recorded.
    """
    about, block, fitted = About(fit), fit.block, fit.fitted
    found = {}
    for effect in effects:
        if effect.uses_run_order and not block.scene.run.any():
            continue
        more = replace(block.terms, effects=(*block.terms.effects, effect.name))
        other = SimulatedBench(block.traces, more, block.widest)
        typical = shared_of(fit, more)
        for place, one in enumerate(other.terms.unknowns):
            if one.term == effect.name:
                typical[place] = (one.typical - one.neutral) / one.span
        column = other.rows_at(fitted.points[None], typical)[0] - fitted.predicted
        gram = about.beside(column[:, None])
        found[effect.name] = float(estimate(gram, fitted.variance, fixed=True).likelihood.sum())
    return found
