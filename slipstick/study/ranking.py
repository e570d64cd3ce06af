"""Candidates against each other: held-out log-likelihood first, then BIC, then how often each wins in a bootstrap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.clutch import effects
from slipstick.study.comparison import Comparison
from slipstick.study.held_out import folds, held_out
from slipstick.study.mixed import MixedFit

_BOOTSTRAP = 1000
_AT_BOUND = 1e-3
APART = 2.0
"""Standard errors by which a candidate must trail the best to be told apart from it."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate's place. `gain` (n,): held-out log-likelihood of each experiment above that of the fit without it.

    `behind` is how far it trails the best, in standard errors of the difference over experiments (`in_errors`),
    `share` how often it is the best of all in a bootstrap over experiments, `bic` the rise of the criterion over the
    fit without it (n experiments; less is better), `rise` that of the log-likelihood it was fitted to. `at_bound`: an
    amplitude ran into its bound, so that its value is the bound's and no result.
    """

    effect: str
    found: MixedFit
    gain: np.ndarray
    behind: float
    share: float
    bic: float
    rise: float
    at_bound: bool

    @property
    def sure(self) -> float:
        """Standard errors by which it predicts held-out experiments better than the fit without it."""
        return in_errors(self.gain)

    @property
    def tied(self) -> bool:
        """Whether it cannot be told apart from the best."""
        return self.behind < APART and not self.at_bound


def gained(comparison: Comparison, without: MixedFit, found: MixedFit, seed: int) -> np.ndarray:
    """Held-out log-likelihood of each experiment by one fit above that by another, (n,)."""
    left_out = folds(comparison.recordings.conditions, seed)
    gain: np.ndarray = held_out(comparison, found, left_out) - held_out(comparison, without, left_out)
    return gain


def rank(comparison: Comparison, without: MixedFit, candidates: Mapping[str, MixedFit], seed: int) -> list[Ranked]:
    """The candidates, the best first; those at a bound come last and are never the best of the others."""
    left_out = folds(comparison.recordings.conditions, seed)
    before = held_out(comparison, without, left_out)
    gains = np.array([held_out(comparison, one, left_out) - before for one in candidates.values()])
    n = len(before)
    stuck = np.array([at_bound(effect, found) for effect, found in candidates.items()])
    judged = np.where(stuck[:, None] & ~stuck.all(), -1e9, gains)
    best = gains[judged.sum(axis=1).argmax()]
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), _BOOTSTRAP)
    wins = np.bincount((drawn @ judged.T).argmax(axis=1), minlength=len(gains)) / _BOOTSTRAP
    ranked = []
    for (effect, found), gain, share, bound in zip(candidates.items(), gains, wins, stuck, strict=True):
        rise = float(found.log_likelihood.sum() - without.log_likelihood.sum())
        more = len(found.state.theta) - len(without.state.theta)
        ranked.append(Ranked(effect, found, gain, max(0.0, in_errors(best - gain)), float(share),
                             float(more * np.log(n) - 2 * rise), rise, bool(bound)))
    return sorted(ranked, key=lambda one: (one.at_bound, -one.gain.sum()))


def at_bound(effect: str, found: MixedFit) -> bool:
    """Whether an amplitude of the effect added last ran into its bound."""
    last = effects.find(effect).coefficients
    moved = zip(found.state.theta[-len(last):], found.design.unknowns[-len(last):], last, strict=True)
    return any(min(value - one.lower, one.upper - value) < _AT_BOUND * (one.upper - one.lower)
               for value, one, its in moved if not its.shape)


def rivals(ranking: Sequence[Ranked], name: str, others: Sequence[str], near: float) -> list[Ranked]:
    """Candidates of a round that trail the one named by less than `near` standard errors, and are none of the `others`.

    None where it was no candidate, as an open term is not beside the catalogue's.
    """
    own = next((one for one in ranking if one.effect == name), None)
    return [] if own is None else [one for one in ranking if one.effect not in (name, *others) and not one.at_bound
                                   and in_errors(own.gain - one.gain) < near]


def in_errors(differences: np.ndarray) -> float:
    """How sure differences of log-likelihood between experiments are of their sign: the mean in standard errors.

    Each counts as log(1 + nats), with its sign: where a fit goes badly wrong it is off by thousands of nats, and one
    such experiment would hide all others in the error. 0 where there are no differences.
    """
    said = np.sign(differences) * np.log1p(np.abs(differences))
    spread = said.std(ddof=1) * np.sqrt(len(said))
    return float(said.sum() / spread) if spread > 0 else 0.0
