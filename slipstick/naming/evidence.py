"""What each pair gains: held-out log-likelihood of every engagement, with all random effects estimated again."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.engine.linear_model import Fitted, estimate, likelihood, solve
from slipstick.naming.block import Pair
from slipstick.naming.fit import BlockFit
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
    computed = mapped(lambda pair: block.basis(pair, fit.points, fit.held, fit.predicted), new)
    bases = {pair: basis for pair, basis in zip(new, computed, strict=True) if basis.shape[1]}
    return Table(fit, part, {**further, **further_of(block, columns, fit.noise, bases)}, pairs)


def hold_out(fitted: Fitted, folds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Log-likelihood (n,) of each engagement with coefficients from the other `folds` (n,), and these (n, c - 1)."""
    nats, coefficients = np.empty(len(folds)), np.empty((len(folds), fitted.marginal.shape[1] - 1))
    members = [np.flatnonzero(folds == fold) for fold in np.unique(folds)]
    sums = np.array([fitted.marginal[rows].sum(axis=0) for rows in members])
    for i, rows in enumerate(members):
        coefficients[rows] = others = solve(fitted.gram, np.delete(sums, i, axis=0).sum(axis=0)).coefficients
        nats[rows] = likelihood(fitted.marginal[rows], fitted.logdet[rows], others)
    return nats, coefficients


def gains(tables: Sequence[Table], current: Sequence[Pair], pairs: Sequence[Pair]) -> list[Gain]:
    """What each of `pairs` gains beside the `current` laws in the blocks of `tables`, the largest gain first."""
    n = len(tables[0].part.gram)
    folds = np.random.default_rng(0).permutation(np.arange(n) % FOLDS)
    tables_of = {pair: [table for table in tables if pair in table.further] for pair in pairs}
    tables_of = {pair: own for pair, own in tables_of.items() if own}
    blocks = {pair: tuple(table.fit.block.name for table in own) for pair, own in tables_of.items()}
    bases = dict[tuple[str, ...], tuple[Joint, Fitted, np.ndarray, np.ndarray]]()
    for pair, own in tables_of.items():
        if blocks[pair] not in bases:
            laws = [law for law in current if any(law in table.part.places for table in own)]
            joint = joined([table.part for table in own], laws)
            variances = [np.maximum(table.fit.fitted.variance, 1e-8) for table in own]
            base = estimate(joint.gram, np.concatenate(variances))
            bases[blocks[pair]] = joint, base, *hold_out(base, folds)

    def compute_gain(pair: Pair) -> Gain:
        joint, base, reference, without = bases[blocks[pair]]
        beside = joint.beside(pair, [table.further[pair] for table in tables_of[pair]])
        fitted = estimate(beside.gram, np.maximum(base.variance, 1e-8))
        reached, coefficients = hold_out(fitted, folds)
        start = np.zeros_like(coefficients)
        start[:, :without.shape[1]] = without  # the columns of the pair are the last ones
        return Gain(pair, reached - reference, coefficients, start, fitted, beside.places[pair], blocks[pair])

    computed = mapped(compute_gain, list(tables_of))
    return sorted(computed, key=lambda gain: -float(gain.nats.sum()))
