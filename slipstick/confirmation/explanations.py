"""The effects of the catalogue that would explain what the simulation leaves where blocks could not be tested.

Without the signals at both ends of a block only the simulation of the whole bench tells what is missing in it: it can
be compared with formulas of the catalogue, but no law is measured, and other effects are not excluded.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from slipstick.clutch.effects import Effect
from slipstick.confirmation.fit import SimulationFit, fit_simulation, refit_above
from slipstick.confirmation.promised import estimate_likelihoods
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.worth import Worth, worth
from slipstick.naming.selection import in_errors, is_enough, leads
from slipstick.naming.settings import NamingSettings

_FITTED = 3
"""Effects that are fitted in full, of those that promise most: the linear model ranks strong effects roughly."""


@dataclass(frozen=True)
class Explanation:
    """An effect that the fit of the simulation asks for in addition, fitted without the other explanations."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    effect: str
    """Name of the effect."""
    nats: float
    """Gain of the natural log-likelihood by the effect."""
    errors: float
    """Standard errors over engagements in which they gain."""
    tied: bool
    """Whether the recordings do not tell it from the explanation that gains most."""
    chi_square: dict[str, float]
    """Mean squared residual of each signal and of the shifting time that it leaves in a usual engagement, in units of
    the noise: the geometric mean, or for the shifting time the median as that of normal noise."""
    sufficient: bool
    """Whether none of the signals is above the setting `naming.strong`; there is none where only shifting times are."""
    worth: Worth
    """How much it changes shifting times and signals."""


def explanations(fit: SimulationFit, effects: Iterable[Effect], settings: NamingSettings) -> list[Explanation]:
    """Those of the `effects` that gain enough beside the terms of a fit, that which gains most first."""
    block = fit.block
    gained = estimate_likelihoods(fit, effects)
    extensions = []
    for name in sorted(gained, key=lambda effect: -gained[effect])[:_FITTED]:
        terms = replace(block.terms, effects=(*block.terms.effects, name))
        # The parameters of a fit that lacks an effect are bent to make it good; the nominal ones are not.
        extended = fit_simulation(block.traces, terms, np.zeros_like(fit.fitted.points), widest=block.widest)
        extended = extended if is_enough(extended.evidence - fit.evidence, settings) else refit_above(extended, fit)
        if is_enough(extended.evidence - fit.evidence, settings):
            extensions.append((name, extended))
    extensions.sort(key=lambda extension: -float(extension[1].evidence.sum()))

    def describe(name: str, extended: SimulationFit) -> Explanation:
        gain, best, left = extended.evidence - fit.evidence, extensions[0][1], extended.usual_chi_square
        tied = extended is not best and not leads(best.evidence, extended.evidence, settings)
        is_left = any(left[signal] > settings.strong for signal in block.traces.signals)
        return Explanation(name, float(gain.sum()), in_errors(gain), tied, left, not is_left, worth(extended, name))

    return [describe(*extension) for extension in extensions]
