"""The control: the effect on another quantity that promises most. A wrong effect must not close the gap."""

from collections.abc import Collection

from slipstick.clutch import effects
from slipstick.confirmation.fit import SimulationFit, fit_simulation, refit_above
from slipstick.confirmation.promised import estimate_likelihoods
from slipstick.confirmation.terms import Terms


def control(before: SimulationFit, quantities: Collection[str]) -> tuple[str, SimulationFit] | None:
    """The effect on none of the `quantities` that explains most of what the fit `before` leaves, and its fit.

    An effect that a study may also find under one of these is the named one, or resembles it. Effects are ranked by the
    linear mixed model about that fit. None where all effects are excluded.
    """
    gained = estimate_likelihoods(before, [effect for effect in effects.CATALOGUE
                                           if not {quantity for quantity, _ in effect.pairs} & set(quantities)])
    if not gained:
        return None
    name, block = max(gained, key=gained.__getitem__), before.block
    fit = fit_simulation(block.traces, Terms(block.scene.bench, (name,)), before.fitted.points, widest=block.widest)
    return name, fit if fit.evidence.sum() > before.evidence.sum() else refit_above(fit, before)
