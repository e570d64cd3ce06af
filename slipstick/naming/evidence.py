"""What each pair gains: held-out log-likelihood of every engagement, with all random effects estimated again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.fit import LAW_PRECISION, BlockFit, linearised, predict
from slipstick.naming.grams import Fitted, Gram, estimate, likelihood, solve

FOLDS = 6
"""Folds of the engagements: with 54 of them each is fitted on 45."""


@dataclass(frozen=True, eq=False)
class Table:
    """The products of a block about its `fit`, with the columns of its pairs at `places` among the fixed ones."""

    fit: BlockFit
    gram: Gram
    places: dict[Pair, np.ndarray]


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
    gram, basis = linearised(fit.block, fit.points, fit.shared, fit.held, fit.noise, fit.predicted, further)
    places, first = {}, len(fit.block.fixed)
    for pair, columns in basis.items():
        places[pair] = np.arange(first, first + columns.shape[1])
        first += columns.shape[1]
    return Table(fit, gram, places)


def joined(tables: Sequence[Table], laws: Sequence[Pair]) -> tuple[Gram, dict[Pair, np.ndarray]]:
    """One gram of several blocks, in which `laws` have the same coefficients, and the places of these.

    The residuals of blocks are independent given their inputs, so that the products add up.
    """
    random, fixed = [one.gram.random for one in tables], [len(one.fit.block.fixed) for one in tables]
    places, first = {}, sum(random) + sum(fixed)
    for law in laws:
        size = max((len(one.places[law]) for one in tables if law in one.places), default=0)
        places[law] = np.arange(first, first + size)
        first += size
    products = np.zeros((len(tables[0].gram), first + 1, first + 1))
    precision = np.full(first, LAW_PRECISION)
    for b, one in enumerate(tables):
        own = np.arange(random[b] + fixed[b])
        to = [np.concatenate([sum(random[:b]) + np.arange(random[b]),
                              sum(random) + sum(fixed[:b]) + np.arange(fixed[b])])]
        precision[to[0]] = one.gram.precision[own]
        rows = [own]
        for law in (law for law in laws if law in one.places):
            rows.append(random[b] + one.places[law])
            to.append(places[law][:len(one.places[law])])
        here = np.append(np.concatenate(rows), one.gram.products.shape[1] - 1)
        there = np.append(np.concatenate(to), first)
        products[:, there[:, None], there] += one.gram.products[:, here[:, None], here]
    widest = np.concatenate([one.gram.widest for one in tables])
    return Gram(products, sum(random), precision, np.zeros(first), widest), places


def held_out(gram: Gram, fitted: Fitted, folds: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) of each engagement with coefficients from the other `folds` (n,)."""
    found = np.empty(len(gram))
    for fold in np.unique(folds):
        rows = folds == fold
        coefficients, _ = solve(gram, fitted.marginal[~rows])
        found[rows] = likelihood(fitted.marginal[rows], fitted.logdet[rows], coefficients)
    return found


def gains(tables: Sequence[Table], current: Sequence[Pair], pairs: Sequence[Pair], seed: int = 0) -> list[Gain]:
    """What each of `pairs` gains beside the `current` laws in the blocks of `tables`, the largest gain first."""
    n = len(tables[0].gram)
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
            gram, _ = joined(mine, laws)
            base = estimate(gram, np.concatenate([np.maximum(one.fit.fitted.variance, 1e-8) for one in mine]))
            bases[blocks] = base, held_out(gram, base, folds)
        base, reference = bases[blocks]
        gram, places = joined(mine, [*laws, pair])
        fitted = estimate(gram, np.maximum(base.variance, 1e-8))
        found.append(Gain(pair, held_out(gram, fitted, folds) - reference, fitted, places[pair], blocks))
    return sorted(found, key=lambda one: -float(one.nats.sum()))
