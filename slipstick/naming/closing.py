"""Which pairs the closing piston asks for, by fits with the law of each that promises something."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.naming.answer import next_best
from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Pair, finest
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.evidence import Gain, gains, table
from slipstick.naming.law_map import refined
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import annealed, evidence_of, from_common, regained
from slipstick.naming.search import retimed
from slipstick.naming.selection import (
    Finding,
    Rival,
    in_errors,
    is_enough,
    is_finding,
    is_shown,
    is_unexplained,
    leads,
    priced,
    rivals,
)
from slipstick.naming.settings import NamingSettings

_QUANTITIES = ("piston gain", "clearance", "film torque", "piston rate", "chamber pressure")
_LAGS = (("output torque sensor", "lag"), ("contact pressure", "lag"))
_FITTED, _PROMISING = 6, 3.0  # pairs that are fitted, and the least linear gain in nats of one
_FIRST = 3  # iterations by which the pairs that are fitted to the end are chosen
_MOST = 2


def shows_closing(pair: Pair) -> bool:
    """Whether a pair is asked for while the plates close; the other ones of the clutch are in full contact."""
    return pair[0] in _QUANTITIES or pair in _LAGS


@dataclass(frozen=True, eq=False)
class _Tried:
    """A pair fitted in full: its priced `gain` (n,) in evidence, and the `fit`, with a law `finer` so many times.

    Scores in the linear model have an `agreement` of so many standard errors.
    """

    pair: Pair
    gain: np.ndarray
    fit: CurvedFit
    finer: int
    agreement: float

    @property
    def expected(self) -> np.ndarray:
        """Standard errors (n,) in which engagements should show the law."""
        return self.fit.expected(self.pair)

    def beside(self, now: CurvedFit) -> "_Tried":
        """The same beside another fit without the pair."""
        return replace(self, gain=priced(self.fit.evidence - now.evidence, self.fit.leverage(self.pair)))


def _best_of(tried: Sequence[_Tried]) -> list[_Tried]:
    """The best fit with each pair, the largest gain first."""
    best = dict[Pair, _Tried]()
    for one in sorted(tried, key=lambda one: -float(one.gain.sum())):
        best.setdefault(one.pair, one)
    return list(best.values())


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
                tried = _best_of([*(one.beside(now) for one in enough),
                                  *_tried(block, now, settings, ask, [one.pair for one in enough])])
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
        others = [Rival(one.pair, float(one.gain.sum()), in_errors(best.gain - one.gain)) for one in tried]
        findings.append(Finding(("clutch",), best.pair, best.gain, tied, next_best(best.pair, others),
                                best.expected, best.agreement))
    return now, findings


def _tried(block: ClutchBlock, now: CurvedFit, settings: NamingSettings, ask: Ask,
           pairs: Sequence[Pair] | None = None) -> list[_Tried]:
    """Those of the `pairs` that promise most, the largest gain first.

    Few knots do not follow a strong law that bends often: it has more where they gain enough.
    """
    tried, before = list[_Tried](), block.finer
    for linear, one in fits_with_pairs(block, now, settings, pairs, ask):
        pair, agreement = linear.pair, linear.agreement
        found = _Tried(pair, priced(one.evidence - now.evidence, one.leverage(pair)), one, before.get(pair, 0),
                       agreement)
        while settings.further * found.gain.sum() > settings.nats and found.finer < finest(block, pair):
            block.finer = {**before, pair: found.finer}
            its = _resolved(block, found.fit, [pair])
            more = _Tried(pair, priced(its.evidence - now.evidence, its.leverage(pair)), its, found.finer + 1,
                          agreement)
            if more.gain.sum() < found.gain.sum() + settings.nats:
                break
            found = more
        block.finer = before
        tried.append(found)
    return sorted(tried, key=lambda one: -float(one.gain.sum()))


def _enough(tried: Sequence[_Tried], now: CurvedFit, settings: NamingSettings) -> list[_Tried]:
    """Those that were `tried` from a fit `now` on that are enough for a finding.

    What few engagements show counts only if the one that gains most is enough.
    """
    found = [one for one in tried if is_finding(one.gain, one.expected, one.agreement, now.chi2[None],
                                                one.fit.chi2[None], settings)]
    return found if found[:1] == tried[:1] else [
        one for one in tried if is_shown(one.gain, one.expected, one.agreement, settings)]


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
                    pairs: Sequence[Pair] | None = None, ask: Ask = lambda _: None) -> list[tuple[Gain, CurvedFit]]:
    """The fits with the best of the `pairs` that promise something, by default of all, from `now` and common points.

    Each comes with what its pair gains in the linear model.

    Where something is missing every pair is tried: a strong law may promise nothing far from the best fit with it. A
    parameter that scatters as widely as it can shows that as well, since it may explain each engagement by itself.
    """
    about = table(now, [pair for pair in block.pairs() if shows_closing(pair)])
    known = [pair for pair in about.further if pairs is None or pair in pairs]
    promising = gains([about], list(now.laws), known)
    strained, lacks = np.any(now.variance >= block.widest**2), is_unexplained(now.chi2, now.chi2, settings)
    if not (strained or lacks):
        promising = [one for one in promising[:_FITTED] if one.nats.sum() >= _PROMISING]
    begun = []
    for one in promising:
        ask(Asked("clutch", ("clutch",), one.pair))
        first = fit_curved(block, (*now.laws, one.pair), start=now, iterations=_FIRST)
        if strained or lacks:
            first = max(first, annealed(block, now, one.pair), key=evidence_of)
        begun.append(first)
    begun.sort(key=evidence_of, reverse=True)
    found, linear = list[tuple[Gain, CurvedFit]](), {one.pair: one for one in promising}
    for start in begun[:1 + settings.rivals]:
        ask(Asked("clutch", ("clutch",), start.laws[-1]))
        best = fit_curved(block, start.laws, start=start, iterations=10)
        again = from_common(block, best.mean, best.shared, best.held, iterations=10)
        best = max(best, again, key=evidence_of)
        found.append((linear[best.laws[-1]], regained(block, best) if lacks else best))
    return found
