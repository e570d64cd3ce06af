"""What each pair gains: held-out log-likelihood of every engagement, with all random effects estimated again."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.fit import BlockFit
from slipstick.naming.grams import Fitted, estimate, likelihood, solve
from slipstick.naming.linear_model import (
    Further,
    Joint,
    Part,
    further_of,
    joined,
    part_of,
)
from slipstick.naming.selection import in_agreement
from slipstick.numerics.threads import mapped

FOLDS = 6
"""Folds of the engagements: with 54 of them each is fitted on 45."""


@dataclass(frozen=True, eq=False)
class Table:
    """The products of a block about its `fit` with its laws, and those of each `further` pair that may be added.

    Pairs that were `asked` for are its laws, or have no columns, where they are not among the further ones.
    """

    fit: BlockFit
    part: Part
    further: Mapping[Pair, Further]
    asked: Collection[Pair] = ()


@dataclass(frozen=True, eq=False)
class Gain:
    """What a `pair` adds to the log-likelihood of each engagement, `nats` (n,), when these `blocks` get it.

    `fitted` is the linear fit with it, in which `places` are its coefficients. Those from other engagements are `held`
    (n, c - 1), and without the pair `without` (n, c - 1), where it has 0.
    """

    pair: Pair
    nats: np.ndarray
    held: np.ndarray
    without: np.ndarray
    fitted: Fitted
    places: np.ndarray
    blocks: tuple[str, ...]

    @property
    def scores(self) -> np.ndarray:
        """Scores (n,) of engagements without the pair in the direction that the others give, in standard errors.

        They are standard normal where the pair adds nothing. An engagement in which the others expect less than one
        standard error has a share of its score.
        """
        left = np.hstack([-self.without, np.ones((len(self.nats), 1))])
        return np.asarray((left * self._along[1]).sum(axis=1) / np.maximum(self.expected, 1.0))

    @property
    def agreement(self) -> float:
        """Mean of the scores in standard errors."""
        return in_agreement(self.scores)

    @property
    def expected(self) -> np.ndarray:
        """Standard errors (n,) in which each engagement shows the law that the others give."""
        step, along = self._along
        return np.asarray(np.sqrt(np.maximum((step * along).sum(axis=1), 0.0)))

    @property
    def _along(self) -> tuple[np.ndarray, np.ndarray]:
        """What changes with the pair (n, c), the residual last, and its products with all columns (n, c)."""
        step = np.hstack([self.held - self.without, np.zeros((len(self.nats), 1))])
        return step, np.einsum("npq,nq->np", self.fitted.marginal, step)

    @property
    def law(self) -> np.ndarray:
        """Coefficients of the law."""
        return np.asarray(self.fitted.coefficients[self.places])


def table(fit: BlockFit, pairs: Sequence[Pair], known: Table | None = None) -> Table:
    """The products of a block about a fit with `pairs` that are not among its laws, beside those that are `known`."""
    block, columns = fit.block, fit.columns(fit.laws)
    part, further = (part_of(block, columns, fit.noise), {}) if known is None else (known.part, known.further)
    new = [pair for pair in pairs if pair not in fit.laws and pair not in further]
    found = mapped(lambda pair: block.basis(pair, fit.points, fit.held, fit.predicted), new)
    bases = {pair: its for pair, its in zip(new, found, strict=True) if its.shape[1]}
    return Table(fit, part, {**further, **further_of(block, columns, fit.noise, bases)}, pairs)


def held_out(fitted: Fitted, folds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Log-likelihood (n,) of each engagement with coefficients from the other `folds` (n,), and these (n, c - 1)."""
    found, coefficients = np.empty(len(folds)), np.empty((len(folds), fitted.marginal.shape[1] - 1))
    members = [np.flatnonzero(folds == fold) for fold in np.unique(folds)]
    sums = np.array([fitted.marginal[rows].sum(axis=0) for rows in members])
    for i, rows in enumerate(members):
        coefficients[rows] = others = solve(fitted.gram, np.delete(sums, i, axis=0).sum(axis=0)).coefficients
        found[rows] = likelihood(fitted.marginal[rows], fitted.logdet[rows], others)
    return found, coefficients


def gains(tables: Sequence[Table], current: Sequence[Pair], pairs: Sequence[Pair], seed: int = 0) -> list[Gain]:
    """What each of `pairs` gains beside the `current` laws in the blocks of `tables`, the largest gain first."""
    n = len(tables[0].part.gram)
    folds = np.random.default_rng(seed).permutation(np.arange(n) % FOLDS)
    mine = {pair: [one for one in tables if pair in one.further] for pair in pairs}
    mine = {pair: its for pair, its in mine.items() if its}
    blocks = {pair: tuple(one.fit.block.name for one in its) for pair, its in mine.items()}
    bases = dict[tuple[str, ...], tuple[Joint, Fitted, np.ndarray, np.ndarray]]()
    for pair, its in mine.items():
        if blocks[pair] not in bases:
            laws = [law for law in current if any(law in one.part.places for one in its)]
            joint = joined([one.part for one in its], laws)
            base = estimate(joint.gram, np.concatenate([np.maximum(one.fit.fitted.variance, 1e-8) for one in its]))
            bases[blocks[pair]] = joint, base, *held_out(base, folds)

    def gain(pair: Pair) -> Gain:
        joint, base, reference, without = bases[blocks[pair]]
        beside = joint.beside(pair, [one.further[pair] for one in mine[pair]])
        fitted = estimate(beside.gram, np.maximum(base.variance, 1e-8))
        reached, coefficients = held_out(fitted, folds)
        start = np.zeros_like(coefficients)
        start[:, :without.shape[1]] = without  # the columns of the pair are the last ones
        return Gain(pair, reached - reference, coefficients, start, fitted, beside.places[pair], blocks[pair])

    found = mapped(gain, list(mine))
    return sorted(found, key=lambda one: -float(one.nats.sum()))
