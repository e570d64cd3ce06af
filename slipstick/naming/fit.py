"""The mixed-effects fit of blocks with given laws, by Gauss-Newton steps.

Every step solves the linear mixed model about the parameters of each engagement (linear_model.py). Blocks that share a
law are fitted together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Self

import numpy as np

from slipstick.blocks.whitening import BlockNoise
from slipstick.engine.linear_model import Fitted, estimate
from slipstick.naming.block import Block, Laws, Pair, changed, first_shared
from slipstick.naming.linear_model import Columns, Joint, Part, columns_of, joined, part_of
from slipstick.numerics.threads import mapped

_FIRST, _LEAST = 0.01**2, 1e-10  # variances of relative parameters: to begin with, and at least
_STEPS = 20
"""Most steps; nearly all fits settle before."""
_SETTLED = 0.05
"""Change of the likelihood in nats, or rise that the linear model promises, at which a fit ends: no decision depends on
it."""
_PROMISED = 1.0
"""Nats below which a step that lowers the likelihood is not halved: columns are not exact, and no decision depends on
it."""
_HALVINGS = 6
"""Times that a step is halved at most. A lag of the converter that sets in with the slip needs six."""
_FEW = 10
"""Degrees of freedom below which an engagement has no chi-square. Engagements that never come to full contact had one
of 0 there, which hid what the others left."""
_LOWEST, _HIGHEST = -0.7, 0.9  # of parameters relative to nominal, so that gains and times keep their sign


@dataclass(frozen=True, eq=False)
class BlockFit:
    """A block with `laws`: `points` (n, q) relative to nominal, `shared` (p,) and `coefficients` of the laws.

    `fitted` is the linear mixed model about them, `predicted` (n, k) the output of the block, which is at these values,
    and `noise` that of the block.
    """

    block: Block
    laws: tuple[Pair, ...]
    points: np.ndarray
    shared: np.ndarray
    coefficients: dict[Pair, np.ndarray]
    fitted: Fitted
    predicted: np.ndarray
    noise: BlockNoise

    @property
    def held(self) -> Laws:
        """The laws with their coefficients."""
        return [(law, self.coefficients[law]) for law in self.laws]

    def resolved(self, finer: Mapping[Pair, int]) -> Self:
        """The same where further laws are doubled so many times; its own ones must then be fitted again."""
        return replace(self, block=changed(self.block, finer={**self.block.finer, **finer}))

    def columns(self, laws: Sequence[Pair]) -> Columns:
        """The columns about its values, with those of these laws."""
        return columns_of(self.block, self.points, self.shared, self.held, self.predicted, laws)

    def places(self, pair: Pair) -> np.ndarray:
        """Places of the coefficients of one of the laws among those of the linear mixed model."""
        first = len(self.block.random) + len(self.block.fixed)
        first += sum(len(self.coefficients[law]) for law in self.laws[:self.laws.index(pair)])
        return np.arange(first, first + len(self.coefficients[pair]))

    def leverage(self, pair: Pair) -> np.ndarray:
        """Share (n,) of each engagement in what is known of a law beside all other parameters.

        It adds up to the number of coefficients, less what the prior tells.
        """
        places, along = self.places(pair), self._along(pair)
        return np.asarray(np.einsum("pk,npq,ql,lk->n", along, self.fitted.marginal[:, :-1, :-1], along,
                                    self.fitted.covariance[np.ix_(places, places)], optimize=True))

    def expected(self, pair: Pair) -> np.ndarray:
        """Standard errors (n,) in which each engagement shows a law, if the law is as it was fitted.

        Its square is twice the log-likelihood that an engagement without noise loses without the law, where all that
        engagements share follows as far as it can.
        """
        step = self._along(pair) @ self.fitted.coefficients[self.places(pair)]
        return np.asarray(np.sqrt(np.maximum(step @ (self.fitted.marginal[:, :-1, :-1] @ step).T, 0.0)))

    def _along(self, pair: Pair) -> np.ndarray:
        """Changes (c, m) of all that engagements share with the m coefficients of a law."""
        places, covariance = self.places(pair), self.fitted.covariance
        return np.asarray(covariance[:, places] @ np.linalg.inv(covariance[np.ix_(places, places)]))

    @property
    def chi2(self) -> np.ndarray:
        """Reduced chi-square (n,) of the engagements."""
        return reduced(self.block, self.fitted.squares)

    @property
    def excess(self) -> np.ndarray:
        """By how much the squared residuals (n,) of the engagements exceed those of noise."""
        return np.asarray(np.maximum(self.fitted.squares - _freedom(self.block), 0.0))


def _freedom(block: Block) -> np.ndarray:
    """Degrees of freedom (n,) of the engagements beside their own parameters."""
    return np.asarray(block.counted.sum(axis=1) - len(block.random))


def reduced(block: Block, squares: np.ndarray) -> np.ndarray:
    """Reduced chi-square (n,) of sums of squares (n,), 1 for engagements of which too few samples count to tell."""
    freedom = _freedom(block)
    return np.asarray(np.where(freedom < _FEW, 1.0, squares / np.maximum(freedom, 1)))


def _alone(parts: Sequence[Part], joint: Joint, fitted: Fitted) -> list[Fitted]:
    """The fit of each part by itself, at the coefficients and variances of the joint one."""
    alone, first = [], 0
    for part, rows in zip(parts, joint.rows, strict=True):
        q = part.gram.random
        variance = fitted.variance[first:first + q]
        first += q
        own = replace(estimate(part.gram, variance, fixed=True), covariance=fitted.covariance[np.ix_(rows, rows)])
        alone.append(own.at(fitted.coefficients[rows]))
    return alone


def fit(block: Block, laws: tuple[Pair, ...] = (), start: BlockFit | None = None) -> BlockFit:
    """Fit `block` with `laws` from another fit on, or from nominal values.

    The integrated noise of a measured input depends on the parameters of the block. It is that of the nominal values
    at first, and then that of the fit: if it changed from step to step, their likelihoods could not be compared.
    """
    first_fit = fit_together([block], [laws], [start])[0]
    if start is not None or first_fit.noise.decay is None:
        return first_fit
    return fit_together([block], [laws], [replace(first_fit, noise=first_fit.block.noise(first_fit.points))])[0]


def fit_together(blocks: Sequence[Block], laws: Sequence[tuple[Pair, ...]], starts: Sequence[BlockFit | None],
                 iterations: int = _STEPS, rough: float = 0.0) -> list[BlockFit]:
    """Fit several blocks with `laws` each, from other fits on. Those that blocks share have the same coefficients.

    A `rough` fit ends where a step rises by less than this share of the rise from the `starts`.

    Steps that lower the likelihood, at the variances for which they were made, are halved: the columns of a wrong model
    may lead away from where it is best. The noise is that of the start where there is one, so that the likelihoods of a
    fit and of those that go on from it can be compared, or that at nominal values.
    """
    all_laws = list(dict.fromkeys(law for block_laws in laws for law in block_laws))
    # In the order of coefficients in `joined`.
    laws = [tuple(law for law in all_laws if law in block_laws) for block_laws in laws]
    now = _State.begun(blocks, starts, all_laws)
    variance = np.concatenate([np.full(len(block.random), _FIRST) if start is None
                               else np.maximum(start.fitted.variance, 1e-8)
                               for block, start in zip(blocks, starts, strict=True)])
    widest = np.concatenate([block.widest for block in blocks])
    noises: list[BlockNoise | None] = [None if start is None else start.noise for start in starts]
    best: tuple[float, _State] | None = None
    likeliest: tuple[float, list[BlockFit]] | None = None
    promised, halvings = np.inf, 0
    begun = sum(start.fitted.posterior for start in starts if start is not None)
    for _ in range(iterations):
        each = [(now, *of_block) for of_block in zip(blocks, laws, now.points, now.shared, noises, strict=True)]
        there, predicted, noises, parts = zip(*mapped(lambda arguments: _about(*arguments), each), strict=True)
        joint = joined(parts, all_laws)
        now = now.complete(joint.places)
        # At the variances for which the step was made: with others the likelihood may rise or fall without a step.
        reached = estimate(joint.gram, variance, fixed=True).at(now.common)
        if best is not None and reached.posterior <= best[0] - _SETTLED:
            if promised < _PROMISED or halvings == _HALVINGS:
                break
            now, halvings = now.halfway(best[1]), halvings + 1
            continue
        fitted = estimate(joint.gram, variance)
        variance = np.clip(fitted.variance, _LEAST, widest**2)
        here = fitted.at(now.common)
        rise = np.inf if best is None else abs(here.posterior - best[0])
        promised = fitted.posterior - here.posterior
        best = here.posterior, now
        # Variances are those of what a step promises: where it does not keep it, those before are more likely.
        likelier = max(here, reached, key=attrgetter("posterior"))
        if likeliest is None or likelier.posterior > likeliest[0] - _SETTLED:
            alone = [likelier] if len(parts) == 1 else _alone(parts, joint, likelier)
            values = [{law: now.values[law] for law in block_laws} for block_laws in laws]
            likeliest = likelier.posterior, [BlockFit(*of_block) for of_block in zip(
                there, laws, now.points, now.shared, values, alone, predicted, noises, strict=True)]
        if min(rise, promised) < max(_SETTLED, rough * (here.posterior - begun)):
            break
        halvings = 0
        now = now.stepped(fitted, [part.gram.random for part in parts], joint.places)
    assert likeliest is not None
    return likeliest[1]


@dataclass(frozen=True, eq=False)
class _State:
    """Where a fit of blocks is: `means` (q,), `points` (n, q) and `shared` (p,) of each, and `values` of the laws."""

    means: list[np.ndarray]
    points: list[np.ndarray]
    shared: list[np.ndarray]
    values: dict[Pair, np.ndarray]

    @classmethod
    def begun(cls, blocks: Sequence[Block], starts: Sequence[BlockFit | None], laws: Sequence[Pair]) -> "_State":
        """Where the `starts` end, and where there is none at nominal values."""
        each = list(zip(blocks, starts, strict=True))
        known = {law: c for start in starts if start is not None for law, c in start.coefficients.items()}
        return cls([np.zeros(len(block.random)) if start is None else start.fitted.coefficients[:len(block.random)]
                    for block, start in each],
                   [np.zeros((len(block.measured), len(block.random))) if start is None else start.points
                    for block, start in each],
                   [first_shared(block) if start is None else start.shared for block, start in each],
                   {law: known[law] for law in laws if law in known})

    @property
    def common(self) -> np.ndarray:
        """The coefficients of the joint linear model."""
        return np.concatenate([*self.means, *self.shared, *self.values.values()])

    def held(self, laws: Sequence[Pair]) -> Laws:
        """Those of some `laws` that have values."""
        return [(law, self.values[law]) for law in laws if law in self.values]

    def complete(self, places: Mapping[Pair, np.ndarray]) -> "_State":
        """With values of 0 for those laws of the joint model at `places` that have none yet."""
        return replace(self, values={law: self.values.get(law, np.zeros(len(at))) for law, at in places.items()})

    def stepped(self, fitted: Fitted, random: Sequence[int], places: Mapping[Pair, np.ndarray]) -> "_State":
        """Where the joint linear model puts it, with so many `random` columns in each block."""
        ends = np.cumsum([*random, *(len(common) for common in self.shared)])
        parts = np.split(fitted.coefficients[:ends[-1]], ends[:-1])
        means, shared = parts[:len(random)], parts[len(random):]
        each = np.split(fitted.each, ends[:len(random) - 1], axis=1)
        points = [np.clip(mean + effects, _LOWEST, _HIGHEST) for mean, effects in zip(means, each, strict=True)]
        return _State(means, points, shared, {law: fitted.coefficients[at] for law, at in places.items()})

    def halfway(self, other: "_State") -> "_State":
        """Between this and the `other` one."""
        def middle(starts: list[np.ndarray], ends: list[np.ndarray]) -> list[np.ndarray]:
            return [0.5 * (start + end) for start, end in zip(starts, ends, strict=True)]

        return _State(middle(self.means, other.means), middle(self.points, other.points),
                      middle(self.shared, other.shared),
                      {law: 0.5 * (c + other.values[law]) for law, c in self.values.items()})


def _about(now: _State, block: Block, laws: tuple[Pair, ...], points: np.ndarray, shared: np.ndarray,
           noise: BlockNoise | None) -> tuple[Block, np.ndarray, BlockNoise, Part]:
    """The block with the values of its laws, what it predicts, its noise unless it is known, and its linear model."""
    held = now.held(laws)
    there = block.at(shared)
    predicted = there.base(points, held)
    noise = noise or there.noise(points)
    return there, predicted, noise, part_of(there, columns_of(there, points, shared, held, predicted, laws), noise)
