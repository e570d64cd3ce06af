"""Which pairs the closing piston asks for: the choice among fits with the law of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.naming.answer import next_best
from slipstick.naming.asked import Ask
from slipstick.naming.block import Pair, finest, twice_as_fine
from slipstick.naming.closing_fits import fits_with_pairs, lags_beside
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fineness import finer_while
from slipstick.naming.law_map import refined
from slipstick.naming.piston_laws import OVER_RATE
from slipstick.naming.released import release_piston, tie
from slipstick.naming.restarts import evidence_of, from_common, settled
from slipstick.naming.search import retimed
from slipstick.naming.selection import (
    NEAR,
    Finding,
    Rival,
    in_errors,
    is_finding,
    is_shown,
    is_unexplained,
    leads,
    priced,
    rivals,
)
from slipstick.naming.settings import NamingSettings
from slipstick.naming.torque_lag import OF_FRICTION, OF_SENSOR
from slipstick.naming.varying_lag import CONSTANT

_MOST = 2


@dataclass(frozen=True, eq=False)
class _Tried:
    """A pair fitted in full: its priced `gain` (n,) in evidence, and the `fit`.

    Scores in the linear model have an `agreement` of so many standard errors.
    """

    pair: Pair
    gain: np.ndarray
    fit: CurvedFit
    agreement: float

    @property
    def finer(self) -> int:
        """How many times the resolution of its law is doubled."""
        return self.fit.block.finer.get(self.pair, 0)

    @property
    def nats(self) -> float:
        """Gain of all engagements in nats."""
        return float(self.gain.sum())

    @property
    def expected(self) -> np.ndarray:
        """Standard errors (n,) in which engagements should show the law."""
        return self.fit.expected(self.pair)

    def beside(self, now: CurvedFit) -> "_Tried":
        """The same beside another fit without the pair."""
        return replace(self, gain=_gain(self.fit, self.pair, now))


def _gain(fit: CurvedFit, pair: Pair, now: CurvedFit) -> np.ndarray:
    """What a fit with a pair gains (n,) in evidence beside the one `now` without it, less the price of its law."""
    return priced(fit.evidence - now.evidence, fit.leverage(pair))


def _best_of(tried: Sequence[_Tried]) -> list[_Tried]:
    """The best fit with each pair, the largest gain first."""
    best = dict[Pair, _Tried]()
    for trial in sorted(tried, key=lambda trial: -trial.nats):
        best.setdefault(trial.pair, trial)
    return list(best.values())


def closing(start: CurvedFit, settings: NamingSettings, ask: Ask = lambda _: None,
            named: Sequence[Finding] = (),
            elsewhere: Callable[[CurvedFit], np.ndarray] = lambda fit: np.zeros(len(fit.points)),
            ) -> tuple[CurvedFit, list[Finding]]:
    """Add pairs of the piston to the fit `start` while they gain enough.

    Other blocks gain `elsewhere` (n,) if the lag of the friction in a fit is that of the torque sensor.
    Those of its laws that were `named` in full contact come first among the findings, as far as the whole clutch asks
    for them beside those of the piston.
    """
    now, findings, nats = start, list[Finding](), max((finding.nats for finding in named), default=0.0)
    while len(findings) < _MOST:
        now, tried, enough = _ask_all(now, settings, ask)
        if enough or is_unexplained(now.chi2, now.chi2, settings):
            finer = _finer(now, settings, enough[0].gain if enough else None)
            if finer is not None:
                now = followed(finer, settings)
                continue
        if not enough or enough[0].nats < settings.further * max(nats, sum(finding.nats for finding in findings)):
            break
        best, without = _plainest(enough, settings), now
        now = best.fit
        sensors = [(trial.gain + elsewhere(trial.fit), OF_SENSOR) for trial in enough if trial.pair == OF_FRICTION]
        alike = _alike(best, tried)
        apart = [trial for trial in tried if trial is not best and trial not in alike]
        tied = rivals(best.gain, [*((trial.gain, trial.pair) for trial in apart if trial in enough), *sensors],
                      settings)
        tied += tuple(Rival(trial.pair, trial.nats, in_errors(best.gain - trial.gain)) for trial in alike)
        others = [Rival(pair, float(gain.sum()), in_errors(best.gain - gain))
                  for gain, pair in [*((trial.gain, trial.pair) for trial in apart), *sensors]]
        finding = Finding(("clutch",), best.pair, best.gain, tied, next_best(best.pair, others), best.expected,
                          best.agreement)
        findings.append(tie(finding, release_piston(without, best.fit), settings))
    return _backward(now, named, findings, settings)


def _ask_all(now: CurvedFit, settings: NamingSettings, ask: Ask) -> tuple[CurvedFit, list[_Tried], list[_Tried]]:
    """The fit without a further law, the pairs that were tried from it on, and those of them that are enough.

    Lags that change are tried beside those that are enough. A fit without the law may only have stopped early: it
    begins again where the best one with it ended.
    """
    tried, lags = _tried(now, settings, ask), lags_beside(now)
    if lags and not is_unexplained(now.chi2, now.chi2, settings) and _enough(tried, now, settings):
        tried = _best_of([*tried, *_tried(now, settings, ask, lags)])
    enough = _enough(tried, now, settings)
    again = _again(now, enough[0].fit) if enough else now
    if (again.evidence - now.evidence).sum() <= settings.nats:
        return now, tried, enough
    tried = _best_of([*(trial.beside(again) for trial in enough),
                      *_tried(again, settings, ask, [trial.pair for trial in enough])])
    return again, tried, _enough(tried, again, settings)


def _again(now: CurvedFit, other: CurvedFit) -> CurvedFit:
    """The best fit with the laws of `now` that begins where the `other` one, with a further law, ended."""
    block = now.block
    coefficients = {law: other.coefficients[law] for law in now.laws}
    points = retimed(block, other.points, other.shared, now.held)
    return max(fit_curved(block, now.laws, points=other.points, coefficients=coefficients, shared=other.shared),
               fit_curved(block, now.laws, points=points, coefficients=now.coefficients, shared=other.shared),
               from_common(block, other.mean, other.shared, now.held, iterations=12), key=evidence_of)


def _tried(now: CurvedFit, settings: NamingSettings, ask: Ask, pairs: Sequence[Pair] | None = None) -> list[_Tried]:
    """Those of the `pairs` that promise most, the largest gain first."""
    tried = [_Tried(linear_gain.pair, _gain(fit, linear_gain.pair, now), fit, linear_gain.agreement)
             for linear_gain, fit in fits_with_pairs(now, settings, pairs, ask)]
    most = max((trial.nats for trial in tried), default=0.0)
    tried = [_finest(now, trial, settings) if trial.nats > max(settings.nats, NEAR * most) else trial
             for trial in tried]
    return sorted(tried, key=lambda trial: -trial.nats)


def _finest(now: CurvedFit, trial: _Tried, settings: NamingSettings) -> _Tried:
    """A pair with as many knots as gain more than a share: few do not follow a strong law that bends often."""
    def doubled(coarse: _Tried) -> _Tried:
        return replace(coarse, fit=_resolved(coarse.fit, {coarse.pair: coarse.finer + 1})).beside(now)

    return finer_while(trial, finest(now.block, trial.pair), doubled, settings.nats, settings.further)


def _enough(tried: Sequence[_Tried], now: CurvedFit, settings: NamingSettings) -> list[_Tried]:
    """Those that were `tried` from a fit `now` on that are enough for a finding.

    What few engagements show counts only if the one that gains most is enough.
    """
    enough = [trial for trial in tried if is_finding(trial.gain, trial.expected, trial.agreement, now.chi2[None],
                                                     trial.fit.chi2[None], settings)]
    return enough if enough[:1] == tried[:1] else [
        trial for trial in tried if is_shown(trial.gain, trial.expected, trial.agreement, settings)]


def _plainest(enough: Sequence[_Tried], settings: NamingSettings) -> _Tried:
    """The one that gains most. A lag that changes must lead the others: it can follow what is left of their laws."""
    return next((trial for trial in enough if trial.pair[0] not in CONSTANT
                 and not leads(enough[0].gain, trial.gain, settings)), enough[0])


def _alike(best: _Tried, others: Sequence[_Tried]) -> list[_Tried]:
    """The other law over the piston rate, if it explains most of what the best one does.

    Both follow most changes of a rate, with knots that few recordings tell apart: what differs is the rate near 0.
    """
    return [trial for trial in others if trial.pair == OVER_RATE.get(best.pair) and trial.nats > NEAR * best.nats]


def _finer(now: CurvedFit, settings: NamingSettings, further: np.ndarray | None = None,
           least: float = 0.0) -> CurvedFit | None:
    """The fit with finer laws, if they gain enough, and do as well as a further law that gains `further` (n,).

    Enough is that of the settings, and the `least` in nats.
    """
    doubled = twice_as_fine(now.block, now.laws)
    if not doubled:
        return None
    finer = _resolved(now, doubled)
    price = np.sum([finer.leverage(law) - now.leverage(law) for law in doubled], axis=0)
    gain = priced(finer.evidence - now.evidence, price)
    is_better = gain.sum() > max(settings.nats, least) and (further is None or not leads(further, gain, settings))
    return finer if is_better else None


def _backward(now: CurvedFit, named: Sequence[Finding], later: Sequence[Finding],
              settings: NamingSettings) -> tuple[CurvedFit, list[Finding]]:
    """Without those findings of full contact alone that the clutch does not ask for beside `later` ones.

    A piston that is not explained closes the plates too early or too late, which looks like a law of the friction. The
    gain of the others is that in the whole clutch, so that they can be compared with those of the piston.
    """
    kept = list[Finding]()
    for finding in named:
        if not later or finding.blocks != ("contact",):
            kept.append(finding)
            continue
        others = {law: c for law, c in now.coefficients.items() if law != finding.pair}
        without = settled(now.block, now.points, now.shared, tuple(others), others)
        now = max(now, fit_curved(now.block, (*others, finding.pair), start=without), key=evidence_of)  # no less likely
        gain, expected = _gain(now, finding.pair, without), now.expected(finding.pair)
        if is_finding(gain, expected, finding.agreement, without.chi2[None], now.chi2[None], settings):
            kept.append(replace(finding, gain=gain, expected=expected))
        else:
            now = without
    return now, [*kept, *later]


def followed(now: CurvedFit, settings: NamingSettings, least: float = 0.0) -> CurvedFit:
    """The fit with as many knots of its laws as the clutch asks for, where each doubling gains the `least` in nats.

    Those of full contact needed fewer there: it has other samples, of a smaller range.
    """
    while is_unexplained(now.chi2, now.chi2, settings):
        finer = _finer(now, settings, least=least)
        if finer is None:
            break
        now = finer
    return now


def _resolved(now: CurvedFit, finer: Mapping[Pair, int]) -> CurvedFit:
    """The fit from `now` on where these of its laws are doubled so many times."""
    block = now.resolved(finer).block
    begun = {law: refined(now.block.law(law), now.coefficients[law], block.law(law)) for law in finer}
    return fit_curved(block, now.laws, start=now, coefficients=begun, iterations=10)
