"""Held-out log-likelihood: how well experiments are predicted by a fit that has not seen their kind.

Folds leave out a whole motor speed or a whole current profile: an effect must carry over to conditions it was not
fitted on. The fit without a fold is one Newton step from the fit to all, in the linearised experiments.
"""

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.study.climb import RIDGE, Limits, bounded
from slipstick.study.comparison import Comparison
from slipstick.study.marginal import log_likelihood
from slipstick.study.mixed import MixedFit

_FEWEST = 3
"""Groups that make folds; recordings of fewer kinds are split at random."""
_RANDOM_FOLDS = 5


def folds(conditions: Conditions, seed: int) -> list[np.ndarray]:
    """Boolean rows (n,) of the experiments to leave out; every experiment is left out once in each way of grouping."""
    found = []
    for column in (conditions.motor_speed, conditions.current_profile):
        groups = np.unique(column)
        if len(groups) >= _FEWEST:
            found += [column == group for group in groups]
    if not found:
        place = np.random.default_rng(seed).permutation(len(conditions)) % _RANDOM_FOLDS
        found = [place == fold for fold in range(min(_RANDOM_FOLDS, len(conditions)))]
    return found


def without(found: MixedFit, rows: np.ndarray) -> np.ndarray:
    """theta (p,) of the fit to all experiments but `rows` (n,), within its bounds."""
    integrated, limits = found.marginal, Limits.of(found.design)
    kept = ~rows
    information = integrated.information[kept].sum(axis=0) + np.diag(limits.precision)
    pull = limits.precision * (limits.centre - found.state.theta)
    # At the fit itself nothing pulls: what the determinant takes up is shared among the experiments.
    each = integrated.score - (integrated.score.sum(axis=0) + pull) / len(rows)
    score = each[kept].sum(axis=0) + pull
    lower, upper = limits.within(found.state.theta)
    return np.asarray(found.state.theta + bounded(information + RIDGE * np.eye(len(score)), score, lower, upper))


def held_out(comparison: Comparison, found: MixedFit, left_out: list[np.ndarray]) -> np.ndarray:
    """Natural log-likelihood (n,) of each experiment by the fits without it, the mean over the folds that it is in."""
    integrated = found.marginal
    inside = log_likelihood(comparison, integrated, found.state.noise)
    total, count = np.zeros(len(inside)), np.zeros(len(inside))
    for rows in left_out:
        change = without(found, rows) - found.state.theta
        square = change @ integrated.information[rows] @ change - 2 * integrated.score[rows] @ change
        total[rows] += inside[rows] - 0.5 * square
        count[rows] += 1
    return total / count
