"""What each pair gains: held-out log-likelihood of every engagement, with all random effects estimated again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.fit import BlockFit, Part, joined, linearised, predict
from slipstick.naming.grams import Fitted, Gram, estimate, likelihood, solve

FOLDS = 6
"""Folds of the engagements: with 54 of them each is fitted on 45."""


@dataclass(frozen=True, eq=False)
class Table:
    """The products of a block about its `fit`, with the columns of its pairs."""

    fit: BlockFit
    part: Part

    @property
    def places(self) -> dict[Pair, np.ndarray]:
        """Places of the columns of each pair among the fixed ones."""
        return self.part.places


@dataclass(frozen=True, eq=False)
class Gain:
    """What a `pair` adds to the log-likelihood of each engagement, `nats` (n,), when these `blocks` get it.

    `fitted` is the linear fit with it, in which `places` are its coefficients.
    """

    pair: Pair
    nats: np.ndarray
    fitted: Fitted
    places: np.ndarray
    blocks: tuple[str, ...]

    @property
    def law(self) -> np.ndarray:
        """Coefficients of the law."""
        return np.asarray(self.fitted.coefficients[self.places])


def table(fit: BlockFit, pairs: Sequence[Pair] | None = None) -> Table:
    """The products with the columns of all pairs of a block, or of those among `pairs`."""
    predict(fit.block, fit.points, fit.shared, fit.held)  # a block holds what was predicted last, perhaps with a rival
    further = [pair for pair in fit.block.pairs() if (pairs is None or pair in pairs) and pair not in fit.laws]
    return Table(fit, linearised(fit.block, fit.points, fit.shared, fit.held, fit.noise, fit.predicted,
                                 [*fit.laws, *further]))


def held_out(gram: Gram, fitted: Fitted, folds: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) of each engagement with coefficients from the other `folds` (n,)."""
    found = np.empty(len(gram))
    for fold in np.unique(folds):
        rows = folds == fold
        others = solve(gram, fitted.marginal[~rows].sum(axis=0))
        found[rows] = likelihood(fitted.marginal[rows], fitted.logdet[rows], others.coefficients)
    return found


def gains(tables: Sequence[Table], current: Sequence[Pair], pairs: Sequence[Pair], seed: int = 0) -> list[Gain]:
    """What each of `pairs` gains beside the `current` laws in the blocks of `tables`, the largest gain first."""
    n = len(tables[0].part.gram)
    folds = np.random.default_rng(seed).permutation(np.arange(n) % FOLDS)
    bases: dict[tuple[str, ...], tuple[Fitted, np.ndarray]] = {}
    found = []
    for pair in pairs:
        mine = [one for one in tables if pair in one.places]
        blocks = tuple(one.fit.block.name for one in mine)
        laws = [law for law in current if any(law in one.places for one in mine)]
        if not mine:
            continue
        if blocks not in bases:
            gram = joined([one.part for one in mine], laws).gram
            base = estimate(gram, np.concatenate([np.maximum(one.fit.fitted.variance, 1e-8) for one in mine]))
            bases[blocks] = base, held_out(gram, base, folds)
        base, reference = bases[blocks]
        joint = joined([one.part for one in mine], [*laws, pair])
        fitted = estimate(joint.gram, np.maximum(base.variance, 1e-8))
        found.append(Gain(pair, held_out(joint.gram, fitted, folds) - reference, fitted, joint.places[pair], blocks))
    return sorted(found, key=lambda one: -float(one.nats.sum()))
