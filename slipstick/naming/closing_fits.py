"""Fits of the closing piston with the law of each pair that promises something."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numba import get_num_threads

from slipstick.naming.answer import is_another_effect
from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import CLOSING, Block, Pair
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.evidence import Gain, gains, table
from slipstick.naming.piston_laws import OVER_RATE
from slipstick.naming.restarts import annealed, evidence_of, from_common, regained
from slipstick.naming.selection import is_unexplained
from slipstick.naming.settings import NamingSettings
from slipstick.naming.torque_lag import OF_FRICTION
from slipstick.naming.varying_lag import CONSTANT, with_constant_lag
from slipstick.numerics.threads import mapped

Argument = TypeVar("Argument")
_QUANTITIES = (*CLOSING, "chamber pressure")
_FITTED, _PROMISING = 6, 3.0  # pairs that are fitted, and the least linear gain in nats of one
_FIRST, _FIRST_OF_LAG = 3, 10
"""Iterations by which the pairs that are fitted to the end are chosen: a lag that changes is not searched, but needs
more. Its law does not move the piston."""


def shows_closing(pair: Pair) -> bool:
    """Whether a pair is asked for while the plates close; the other ones of the clutch are in full contact."""
    return pair[0] in _QUANTITIES or pair == OF_FRICTION  # the lag of the torque sensor is the same there


def changing_lags(block: Block) -> list[Pair]:
    """The pairs of lags that change within an engagement."""
    return [pair for pair in block.pairs(rare=True) if pair[0] in CONSTANT]


def lags_beside(now: CurvedFit) -> list[Pair]:
    """Those that are asked for where something is missing: beside another law they follow what few numbers leave of it.
    """
    return [] if now.laws else changing_lags(now.block)


def fits_with_pairs(now: CurvedFit, settings: NamingSettings, pairs: Sequence[Pair] | None = None,
                    ask: Ask = lambda _: None) -> list[tuple[Gain, CurvedFit]]:
    """The fits with the best of the `pairs` that promise something, from `now` and common points.

    By default they are all usual ones, but the constant lag beside one that changes, which is the same effect, and one
    law over the piston rate beside the other; and lags that change where something is missing. Each comes with what its
    pair gains in the linear model.

    Where something is missing every pair is tried: a strong law may promise nothing far from the best fit with it. A
    parameter that scatters as widely as it can shows that as well, since it may explain each engagement by itself.
    """
    block = now.block
    strained, lacks = np.any(now.variance >= block.widest**2), is_unexplained(now.chi2, now.chi2, settings)
    if pairs is None:
        known = {with_constant_lag(law) for law in now.laws} - {*now.laws}
        known |= {OVER_RATE[law] for law in now.laws if law in OVER_RATE}
        usual = [pair for pair in block.pairs() if shows_closing(pair) and pair not in known]
        pairs = [*usual, *(lags_beside(now) if lacks else ())]
    about = table(now, pairs)
    promising = gains([about], list(now.laws), list(about.further))
    if not (strained or lacks):
        promising = [gain for gain in promising[:_FITTED] if gain.nats.sum() >= _PROMISING]
    linear_gains = {gain.pair: gain for gain in promising}

    def begun_with(pair: Pair) -> CurvedFit:
        is_lag = pair[0] in CONSTANT
        first = fit_curved(block, (*now.laws, pair), start=now, iterations=_FIRST_OF_LAG if is_lag else _FIRST)
        if (strained or lacks) and not is_lag:
            first = max(first, annealed(block, now, pair), key=evidence_of)
        return first

    def ended(start: CurvedFit) -> CurvedFit:
        best = fit_curved(block, start.laws, start=start, iterations=10)
        again = from_common(block, best.mean, best.shared, best.held, iterations=10)
        best = max(best, again, key=evidence_of)
        return regained(block, best) if lacks else best

    begun = _in_threads(begun_with, list(linear_gains), lambda pair: ask(Asked("clutch", ("clutch",), pair)))
    begun.sort(key=evidence_of, reverse=True)
    best = begun[:1 + settings.rivals]
    others = [fit for fit in begun if is_another_effect(fit.laws[-1], begun[0].laws[-1])]
    best += [fit for fit in others[:1] if fit not in best]  # the lead is that over another effect
    alike = {OVER_RATE[fit.laws[-1]] for fit in best if fit.laws[-1] in OVER_RATE}
    best += [fit for fit in begun if fit.laws[-1] in alike and fit not in best]
    fits = _in_threads(ended, best, lambda start: ask(Asked("clutch", ("clutch",), start.laws[-1])))
    return [(linear_gains[fit.laws[-1]], fit) for fit in fits]


def _in_threads(function: Callable[[Argument], CurvedFit], arguments: Sequence[Argument],
                before: Callable[[Argument], None]) -> list[CurvedFit]:
    """What `function` makes of each argument, as many at a time as there are threads; `before` is called with each."""
    fits, threads = list[CurvedFit](), get_num_threads()
    for start in range(0, len(arguments), threads):
        batch = arguments[start:start + threads]
        for argument in batch:
            before(argument)
        fits += mapped(function, batch)
    return fits
