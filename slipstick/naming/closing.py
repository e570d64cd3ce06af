"""Which pairs the closing piston asks for, by fits with the law of each that promises something."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Laws, Pair, finest
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.evidence import gains, table
from slipstick.naming.law_map import refined
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.search import relocated, retimed
from slipstick.naming.selection import Finding, is_enough, is_finding, is_unexplained, leads, priced, rivals
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


@dataclass(frozen=True, eq=False)
class _Tried:
    """A pair fitted in full: its priced `gain` (n,) in evidence, and the `fit`, with a law `finer` so many times."""

    pair: Pair
    gain: np.ndarray
    fit: CurvedFit
    finer: int


def closing(block: ClutchBlock, start: CurvedFit, settings: NamingSettings, least: float = 0.0,
            ask: Ask = lambda _: None) -> tuple[CurvedFit, list[Finding]]:
    """Add pairs of the piston to the fit `start` while they gain more than `least` nats."""
    now, findings = start, list[Finding]()
    while len(findings) < _MOST:
        tried = _tried(block, now, settings, ask)
        enough = _enough(tried, now, settings)
        if enough:
            # A fit without the law may only have stopped early: it begins again where the one with it ended.
            other = enough[0].fit
            points = retimed(block, other.points, other.shared, now.held)
            again = max(fit_curved(block, now.laws, points=points, coefficients=now.coefficients, shared=other.shared),
                        from_common(block, other.mean, other.shared, now.held, iterations=12), key=evidence_of)
            if (again.evidence - now.evidence).sum() > settings.nats:
                now = again
                tried = _tried(block, now, settings, ask, [one.pair for one in enough])
                enough = _enough(tried, now, settings)
        further = settings.further * sum(one.nats for one in findings)
        if not enough or enough[0].gain.sum() < max(least, further):
            break
        best = enough[0]
        finer = _finer(block, now, settings, best.gain)
        if finer is not None:
            now = finer
            continue
        now, block.finer = best.fit, {**block.finer, best.pair: best.finer}
        tied = rivals(best.gain, [(one.gain, one.pair) for one in enough[1:]], settings)
        findings.append(Finding(("clutch",), best.pair, best.gain, tied))
    return now, findings


def _tried(block: ClutchBlock, now: CurvedFit, settings: NamingSettings, ask: Ask,
           pairs: Sequence[Pair] | None = None) -> list[_Tried]:
    """Those of the `pairs` that promise most, the largest gain first.

    Few knots do not follow a strong law that bends often: it has more where they gain enough.
    """
    tried, before = list[_Tried](), block.finer
    for pair, one in fits_with_pairs(block, now, settings, pairs, ask).items():
        finer = before.get(pair, 0)
        found = _Tried(pair, priced(one.evidence - now.evidence, one.leverage(pair)), one, finer)
        while settings.further * found.gain.sum() > settings.nats and found.finer < finest(block, pair):
            block.finer = {**before, pair: found.finer}
            its = _resolved(block, found.fit, [pair])
            more = _Tried(pair, priced(its.evidence - now.evidence, its.leverage(pair)), its, found.finer + 1)
            if not is_enough(more.gain - found.gain, settings):
                break
            found = more
        block.finer = before
        tried.append(found)
    return sorted(tried, key=lambda one: -float(one.gain.sum()))


def _enough(tried: Sequence[_Tried], now: CurvedFit, settings: NamingSettings) -> list[_Tried]:
    """Those that were `tried` from a fit `now` on that are enough for a finding.

    What few engagements show counts only if the one that gains most is enough.
    """
    found = [one for one in tried if is_finding(one.gain, now.chi2[None], one.fit.chi2[None], settings)]
    return found if found[:1] == tried[:1] else [one for one in tried if is_enough(one.gain, settings)]


def _finer(block: ClutchBlock, now: CurvedFit, settings: NamingSettings, further: np.ndarray) -> CurvedFit | None:
    """The fit with finer laws of the piston, if it does as well as a further law that gains `further` (n,)."""
    before = block.finer
    laws = [law for law in now.laws if shows_closing(law) and before.get(law, 0) < finest(block, law)]
    if not laws:
        return None
    found = _resolved(block, now, laws)
    price = np.sum([found.leverage(law) - now.leverage(law) for law in laws], axis=0)
    gain = priced(found.evidence - now.evidence, price)
    if is_enough(gain, settings) and not leads(further, gain, settings):
        return found
    block.finer = before
    return None


def _resolved(block: ClutchBlock, now: CurvedFit, laws: Sequence[Pair]) -> CurvedFit:
    """The fit from `now` on where these of its laws have twice the resolution, which the block keeps."""
    coarse = {law: block.law(law) for law in laws}
    block.finer = {**block.finer, **{law: block.finer.get(law, 0) + 1 for law in laws}}
    begun = {law: refined(its, now.coefficients[law], block.law(law)) for law, its in coarse.items()}
    return fit_curved(block, now.laws, start=now, coefficients=begun, iterations=10)


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
