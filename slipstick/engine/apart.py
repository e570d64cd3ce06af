"""The runs that are set aside, fitted by themselves with what all others have told.

An effect that acts in a few runs is one in which they disagree with all others, and they are set aside. Means of
parameters, values that runs share, and the forms of laws are then known from the others, within their errors, and
parameters scatter as they do there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy

from slipstick.engine.fit import Fit, begin, fit, join
from slipstick.engine.laws import Candidate, list_candidates, list_curves
from slipstick.engine.model import nominal_own_values
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Pair, Recorded, Term, explain
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import explain_signals, temper

_EXCLUDED = 0.0027
"""Probability below which laws of different runs are not the same: that of three standard errors."""


def fit_apart(recorded: Recorded, rows: np.ndarray, others: Sequence[Fit], settings: EngineSettings) -> list[Fit]:
    """Return the fits of the runs `rows`, with what the fits of the others have told.

    What each run leaves counts as its noise, so that the worst one does not hide what others have in common.
    """
    told = join(others)
    apart, laws = _inform(recorded, told).take(rows), _list_laws(recorded, told.laws)
    fits, explained = list[Fit](), dict[str, np.ndarray]()
    for each in others:
        group = explain(apart.select({part.name for part in each.recorded.parts}), explained)
        known = {pair: laws[pair].take(rows).renew(group) for pair in each.laws if pair in laws}
        priors = {pair: Prior(1.0, form=each.state.laws[pair][:, None]) for pair in known}
        state = replace(begin(group), laws=each.state.laws)
        fitted = temper(fit(group, known, priors, state, group.widest**2), settings, state)
        fits.append(fitted)
        explained |= explain_signals(fitted, settings)
    return fits


def allow(recorded: Recorded, others: Sequence[Fit], fits: Sequence[Fit], pair: Pair) -> bool:
    """Return whether other runs allow the law that fits of some runs have: whether it may be the same as in these.

    The difference of both estimates is compared with their errors, by its chi-square.
    """
    apart = next(each for each in fits if pair in each.laws)
    acting = join([each for each in others if set(each.models) & set(apart.laws[pair].variables)])
    law = _list_laws(recorded, {pair: apart.laws[pair]}).get(pair)
    if law is None:
        return False
    is_other = np.isin(recorded.rows, acting.recorded.rows)
    beside = acting.beside({pair: law.take(is_other).renew(acting.recorded)},
                           {pair: replace(apart.priors[pair], form=apart.priors[pair].root(law), amplitude=1.0)})
    (there, spread), (here, error) = (_estimate(each, pair) for each in (apart, beside))
    square = float((there - here) @ np.linalg.solve(spread + error, there - here))
    return square < scipy.stats.chi2.isf(_EXCLUDED, len(here))


def _estimate(fitted: Fit, pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of a law in units of its prior, and their covariance."""
    places = fitted.products.places(list(fitted.laws).index(pair), fitted.roots)
    return fitted.fitted.coefficients[places], fitted.fitted.covariance[np.ix_(places, places)]


def _inform(recorded: Recorded, told: Fit) -> Recorded:
    """Return recordings that are set aside, with the noise and what is known of terms as others have told it."""
    count, fitted = len(told.recorded.random), told.fitted
    errors = np.sqrt(np.diag(fitted.covariance))
    known: dict[str, tuple[float, float, float]] = {}
    for place, term in enumerate(told.recorded.random):
        known[term.name] = told.means[place], errors[place], np.hypot(np.sqrt(fitted.variance[place]), errors[place])
    for place, term in enumerate(told.recorded.shared):
        known[term.name] = told.state.shared[place], errors[count + place], 0.0

    def inform(term: Term) -> Term:
        target, std, widest = map(float, known[term.name])
        return replace(term, target=target, std=std, widest=widest)

    noise = {part.name: part for part in told.recorded.parts}
    parts = tuple(replace(part, sensors=shown.sensors, noise=shown.noise, disturbances=shown.disturbances)
                  for part in recorded.parts for shown in [noise[part.name]])
    return replace(recorded, set_aside=True, parts=parts, random=tuple(map(inform, recorded.random)),
                   shared=tuple(map(inform, recorded.shared)))


def _list_laws(recorded: Recorded, laws: Mapping[Pair, Candidate]) -> dict[Pair, Candidate]:
    """Return laws of other runs for all runs, without those over what is the same in all at nominal parameters."""
    if not laws:
        return {}
    own = {part.name: nominal_own_values(part) for part in recorded.parts}
    all_laws = {each.pair: each for each in list_candidates(recorded, own)}
    all_laws |= {pair: law for pair, (law, _) in list_curves(recorded, own).items()}
    return {pair: all_laws[pair].with_knots(law) for pair, law in laws.items() if pair in all_laws}
