"""The control: the effect on another quantity that promises most. A wrong effect must not close the gap."""

from collections.abc import Collection

import numpy as np

from slipstick.clutch import effects
from slipstick.confirmation.fit import SimulationFit, above, fit_simulation
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.terms import Terms
from slipstick.naming.grams import estimate
from slipstick.naming.linear_model import gram_of


def control(before: SimulationFit, quantities: Collection[str]) -> tuple[str, SimulationFit] | None:
    """The effect on none of the `quantities` that explains most of what the fit `before` leaves, and its fit.

    An effect that a study may also find under one of these is the named one, or resembles it. Effects are ranked by the
    linear mixed model about that fit. None where all effects are excluded.
    """
    block, points = before.block, before.fitted.points
    predicted, scene = before.fitted.predicted, before.block.scene
    own, _ = block.columns(points, (), predicted)
    z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own)
    gained = {}
    for effect in effects.CATALOGUE:
        acts_on = {quantity for quantity, _ in effect.pairs}
        if acts_on & set(quantities) or (effect.uses_run_order and not scene.run.any()):
            continue
        other = SimulatedBench(block.traces, Terms(scene.bench, (effect.name,)), block.widest)
        typical = [(one.typical - one.neutral) / one.span for one in other.terms.unknowns]
        column = other.rows_at(points[None], np.array(typical))[0] - predicted
        gram = gram_of(block, [own, column[:, None]], z, before.fitted.noise, 1)
        gained[effect.name] = float(estimate(gram, before.fitted.variance, fixed=True).likelihood.sum())
    if not gained:
        return None
    name = max(gained, key=gained.__getitem__)
    found = fit_simulation(block.traces, Terms(scene.bench, (name,)), points, widest=block.widest)
    return name, found if found.evidence.sum() > before.evidence.sum() else above(found, before)
