"""Which pairs the closing piston asks for, by fits with the law of each that promises something."""

from collections.abc import Sequence

import numpy as np

from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Laws, Pair
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.evidence import gains, table
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.search import relocated, retimed
from slipstick.naming.selection import Finding, is_enough, is_unexplained, priced, rivals
from slipstick.naming.settings import NamingSettings

_QUANTITIES = ("piston gain", "clearance", "film torque", "piston rate", "chamber pressure")
_LAGS = (("output torque sensor", "lag"), ("contact pressure", "lag"))
_RESTARTS, _RISE = 4, 1.0  # of a fit from its own means, and the nats that one must gain for another one
_FITTED, _PROMISING = 6, 3.0  # pairs that are fitted, and the least linear gain in nats of one
_FIRST = 3  # iterations by which the pairs that are fitted to the end are chosen
_MISFIT = 1.5  # reduced chi-square of an engagement from which its piston is searched again
_MOST = 2


def shows_closing(pair: Pair) -> bool:
    """Whether a pair is asked for while the plates close; the other ones of the clutch are in full contact."""
    return pair[0] in _QUANTITIES or pair in _LAGS


def settled(block: ClutchBlock, points: np.ndarray, shared: np.ndarray, laws: tuple[Pair, ...] = (),
            coefficients: dict[Pair, np.ndarray] | None = None) -> CurvedFit:
    """The best fit from `points` (n, q) and `shared` values, from searches where it fails, and from its own means."""
    known = coefficients or {}
    found = retimed(block, points, shared, [(law, known[law]) for law in laws])
    best = fit_curved(block, laws, points=found, coefficients=known, shared=shared, iterations=8)
    rows = best.chi2 > max(_MISFIT, 2 * float(np.median(best.chi2)))
    if rows.any():
        found = relocated(block, best.points, best.shared, best.held, rows)
        again = fit_curved(block, laws, points=found, coefficients=best.coefficients, shared=best.shared, iterations=8)
        best = max(best, again, key=evidence_of)
    for _ in range(_RESTARTS):
        again = from_common(block, best.mean, best.shared, best.held, iterations=8)
        if not evidence_of(again) > evidence_of(best) + _RISE:
            break
        best = again
    return best


def from_common(block: ClutchBlock, means: np.ndarray, shared: np.ndarray, held: Laws, iterations: int) -> CurvedFit:
    """A fit with the laws `held` that begins where all engagements have the parameters `means` (q,).

    Points that a fit without a law has scattered to explain what it cannot do not come back by steps of their own.
    """
    points = np.tile(means, (len(block.measured), 1))
    return fit_curved(block, [law for law, _ in held], points=retimed(block, points, shared, held),
                      coefficients=dict(held), shared=shared, iterations=iterations)


def evidence_of(fit: CurvedFit) -> float:
    """Evidence of all engagements in nats."""
    return float(fit.evidence.sum())


def closing(block: ClutchBlock, start: CurvedFit, settings: NamingSettings, least: float = 0.0,
            ask: Ask = lambda _: None) -> tuple[CurvedFit, list[Finding]]:
    """Add pairs of the piston to the fit `start` while they gain more than `least` nats."""
    now, findings = start, list[Finding]()
    for _ in range(_MOST):
        tried = _tried(block, now, settings, ask)
        enough = [one for one in tried if is_enough(one[0], settings)]
        if enough:
            # A fit without the law may only have stopped early: it begins again where the one with it ended.
            other = enough[0][2]
            points = retimed(block, other.points, other.shared, now.held)
            again = max(fit_curved(block, now.laws, points=points, coefficients=now.coefficients, shared=other.shared),
                        from_common(block, other.mean, other.shared, now.held, iterations=12), key=evidence_of)
            if (again.evidence - now.evidence).sum() > settings.nats:
                now = again
                tried = _tried(block, now, settings, ask, [pair for _, pair, _ in enough])
                enough = [one for one in tried if is_enough(one[0], settings)]
        further = settings.further * sum(one.nats for one in findings)
        if not enough or enough[0][0].sum() < max(least, further):
            break
        gain, pair, now = enough[0]
        findings.append(Finding(("clutch",), pair, gain, rivals(gain, [(g, p) for g, p, _ in enough[1:]], settings)))
    return now, findings


def _tried(block: ClutchBlock, now: CurvedFit, settings: NamingSettings, ask: Ask,
           pairs: Sequence[Pair] | None = None) -> list[tuple[np.ndarray, Pair, CurvedFit]]:
    """Gain, pair and fit of those of the `pairs` that promise most, the largest gain first."""
    tried = [(priced(one.evidence - now.evidence, one.leverage(pair)), pair, one)
             for pair, one in fits_with_pairs(block, now, settings, pairs, ask).items()]
    return sorted(tried, key=lambda one: -float(one[0].sum()))


def fits_with_pairs(block: ClutchBlock, now: CurvedFit, settings: NamingSettings,
                    pairs: Sequence[Pair] | None = None, ask: Ask = lambda _: None) -> dict[Pair, CurvedFit]:
    """The fits with the best of the `pairs` that promise something, by default of all, from `now` and common points.

    Where something is missing every pair is tried: a strong law may promise nothing far from the best fit with it. A
    parameter that scatters as widely as it can shows that as well, since it may explain each engagement by itself.
    """
    about = table(now, [pair for pair in block.pairs() if shows_closing(pair)])
    known = [pair for pair in about.places if (pairs is None or pair in pairs) and pair not in now.laws]
    promising = gains([about], list(now.laws), known)
    strained = np.any(now.variance >= block.widest**2)
    if not (strained or is_unexplained(now.chi2, now.chi2, settings)):
        promising = [one for one in promising[:_FITTED] if one.nats.sum() >= _PROMISING]
    begun = []
    for one in promising:
        ask(Asked("clutch", ("clutch",), one.pair))
        begun.append(fit_curved(block, (*now.laws, one.pair), start=now, iterations=_FIRST))
    begun.sort(key=evidence_of, reverse=True)
    found = {}
    for start in begun[:1 + settings.rivals]:
        ask(Asked("clutch", ("clutch",), start.laws[-1]))
        best = fit_curved(block, start.laws, start=start, iterations=10)
        again = from_common(block, best.mean, best.shared, best.held, iterations=10)
        found[best.laws[-1]] = max(best, again, key=evidence_of)
    return found
