"""What each effect of the catalogue promises to explain of what a fit of the simulation leaves."""

from collections.abc import Iterable
from dataclasses import replace

from slipstick.clutch.effects import Effect
from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.starts import About
from slipstick.engine.linear_model import estimate


def estimate_likelihoods(fit: SimulationFit, effects: Iterable[Effect]) -> dict[str, float]:
    """The log-likelihood in nats, up to a constant, that each of these effects promises beside the terms of a fit.

    The column of an effect is what it changes at its typical coefficients. Effects of which the recordings tell nothing
    are left out: those over a run order that was not recorded.
    """
    about, terms, likelihoods = About(fit.block, fit.fitted), fit.block.terms, {}
    for effect in effects:
        if not effect.uses_run_order or fit.block.scene.run.any():
            more = replace(terms, effects=(*terms.effects, effect.name))
            gram = about.beside(about.column(more, effect.name)[:, None])
            likelihoods[effect.name] = float(estimate(gram, fit.fitted.variance, fixed=True).likelihood.sum())
    return likelihoods
