"""Steps of a fit of a block that is far from linear: what engagements share is damped, and each has its own damping.

The method is that of `curved`, whose two terms are the sum of squared whitened residuals of an engagement, and the sum
of squared deviations of its parameters from their mean in standard deviations.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.engine.linear_model import Gram, marginalise, solve
from slipstick.naming.block import Pair, SearchedBlock
from slipstick.numerics.threads import mapped

_OWN_DAMPINGS = (0.003, 0.0, 0.03, 0.3, 3.0)
"""Dampings of the step of an engagement, relative to its second derivatives; the first takes 0.3 % off a step."""
_CHORDS, _NEGLIGIBLE = 6, 0.1
"""Most corrections of a step by chords, and the decrease of the two terms of all engagements on which nothing
depends."""

DAMPING, _LEAST_DAMPING, _FACTOR, _TRIALS = 1e-3, 1e-5, 10.0, 5
"""Damping to begin with, relative to the information about each common value, and at least; the factor by which it
falls after a step that succeeds and rises after one that does not; and the trials of a step, up to a damping of 10."""

_LONGEST = 0.25
"""Longest step of a parameter of an engagement, relative to nominal: the linear model does not hold further away."""

_HOLDINGS, _HOLD = 3, 1e6
"""Most rounds of holding parameters at their bounds, and the curvature that holds them over that of the data."""

LOWEST, HIGHEST = -0.9, 2.0
"""Bounds of the parameters of an engagement, relative to nominal: none changes its sign, or is more than tripled."""


@dataclass(frozen=True, eq=False)
class Values:
    """Where a fit is: `points` (n, q) and their `mean` (q,), `shared` (p,), and `coefficients` of each law."""

    points: np.ndarray
    mean: np.ndarray
    shared: np.ndarray
    coefficients: dict[Pair, np.ndarray]

    @property
    def laws(self) -> list[tuple[Pair, np.ndarray]]:
        """The laws with their coefficients."""
        return list(self.coefficients.items())

    @property
    def common(self) -> np.ndarray:
        """All that engagements share (q + p + m,): means, shared values, and coefficients."""
        return np.concatenate([self.mean, self.shared, *self.coefficients.values()])


def squares_of(block: SearchedBlock, predicted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Sums of squared whitened residuals (n,) of a prediction (n, k)."""
    return np.asarray((whitened((block.measured - predicted)[:, None], block.counted, noise) ** 2).sum(axis=(1, 2)))


def scatter_of(values: Values, variance: np.ndarray) -> np.ndarray:
    """Sums of squared deviations (n,) of the points from their mean, in standard deviations."""
    return np.asarray(((values.points - values.mean) ** 2 / variance).sum(axis=1))


def prior_of(values: Values, gram: Gram) -> float:
    """Sum of squares of what engagements share, in standard deviations of its priors."""
    return float((values.common**2 * gram.precision).sum())


def _damped(values: Values, gram: Gram, variance: np.ndarray, damping: float) -> np.ndarray:
    """What engagements share (q + p + m,) in the linear mixed model, damped about its present values."""
    marginal = marginalise(gram, variance)[0].sum(axis=0)
    information = damping * np.diag(marginal)[:-1]
    marginal[:-1, :-1] += np.diag(information)  # as an engagement that says: as now
    marginal[:-1, -1] += information * values.common
    return solve(gram, marginal).coefficients


def _with_common(block: SearchedBlock, values: Values, common: np.ndarray) -> Values:
    """Values with this `common` part (q + p + m,), shared ones within their bounds, and the points as they are."""
    q, p = len(values.mean), len(values.shared)
    mean, shared, rest = np.split(common, [q, q + p])
    ends = np.cumsum([len(law) for _, law in values.laws])
    coefficients = dict(zip(values.coefficients, np.split(rest, ends[:-1]), strict=True)) if len(ends) else {}
    return Values(values.points, mean, np.clip(shared, *block.bounds), coefficients)


def _own_terms(values: Values, gram: Gram, variance: np.ndarray,
               common: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope (n, q) of half the two terms in the points, downwards, at this `common` part, and curvature (n, q, q)."""
    q = gram.random
    own, others = gram.products[:, :q, :q], gram.products[:, :q, q:-1] @ common[q:]
    slope = gram.products[:, :q, -1] - others - (own @ values.points[..., None])[..., 0]
    return slope - (values.points - common[:q]) / variance, own + np.diag(1 / variance)


def within_bounds(points: np.ndarray, curvature: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Newton steps (n, q) from `points` (n, q), in which parameters stop at their bounds and the others allow for it.

    A step that is too long is shortened as a whole: it is the direction that follows a narrow valley.
    """
    q = points.shape[1]
    held, place = np.zeros(points.shape, bool), np.zeros(points.shape)
    change = np.linalg.solve(curvature, slope[..., None])[..., 0]
    for _ in range(_HOLDINGS):
        moved = points + change
        beyond = ~held & ((moved < LOWEST) | (moved > HIGHEST))
        if not beyond.any():
            break
        place = np.where(beyond, np.clip(moved, LOWEST, HIGHEST) - points, place)
        held |= beyond
        hold = _HOLD * np.einsum("nqq->nq", curvature) * held
        change = np.linalg.solve(curvature + hold[..., None] * np.eye(q), (slope + hold * place)[..., None])[..., 0]
    change *= np.minimum(1, _LONGEST / np.maximum(np.abs(change).max(axis=1, keepdims=True), _LONGEST))
    return np.asarray(np.clip(points + change, LOWEST, HIGHEST) - points)


def stepped(block: SearchedBlock, values: Values, gram: Gram, own: np.ndarray, variance: np.ndarray,
            noise: BlockNoise, cost: float, damping: float) -> tuple[SearchedBlock, Values, float]:
    """A step that lowers the `cost`, with the block there, and the damping of the next one.

    They are the same block and values where none was found. `own` (n, q, k) are the slopes in the points.
    """
    for _ in range(_TRIALS):
        common = _damped(values, gram, variance, damping)
        begun = _with_common(block, values, common)
        slope, curvature = _own_terms(values, gram, variance, common)
        there = block.at(begun.shared)
        moved, least = _try_dampings(there, begun, slope, curvature, variance, noise)
        if block.follows_chords:
            moved, least = _follow_by_chords(there, moved, curvature, own, variance, noise)
        if least.sum() + prior_of(moved, gram) < cost:
            return there, moved, max(damping / _FACTOR, _LEAST_DAMPING)
        damping = max(damping * _FACTOR, DAMPING)
    return block, values, damping


def _try_dampings(block: SearchedBlock, begun: Values, slope: np.ndarray, curvature: np.ndarray, variance: np.ndarray,
                  noise: BlockNoise) -> tuple[Values, np.ndarray]:
    """The values with the best points of several dampings and of none, and their two terms (n,)."""
    n, q = begun.points.shape

    def measure(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        squares = squares_of(block, block.base(points, begun.laws), noise)
        return points, squares + scatter_of(replace(begun, points=points), variance)

    def tried(damping: float) -> tuple[np.ndarray, np.ndarray]:
        return measure(begun.points + within_bounds(begun.points, curvature * (1 + damping * np.eye(q)), slope))

    each = [measure(begun.points), *mapped(tried, _OWN_DAMPINGS)]
    points, terms_of_each = (np.stack(values) for values in zip(*each, strict=True))
    best = np.argmin(terms_of_each, axis=0), np.arange(n)
    return replace(begun, points=points[best]), terms_of_each[best]


def _follow_by_chords(block: SearchedBlock, begun: Values, curvature: np.ndarray, own: np.ndarray,
                      variance: np.ndarray, noise: BlockNoise) -> tuple[Values, np.ndarray]:
    """The values with points that follow their curves for what engagements share, and their two terms (n,).

    Steps are corrected from where they led by the slopes of where they began: a correction takes one prediction, and
    new slopes take one for each parameter. A correction that does not lower the terms of an engagement is damped more.
    """
    white = whitened(own, block.counted, noise)

    def measure(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        left = whitened((block.measured - block.base(points, begun.laws))[:, None], block.counted, noise)
        return left, (left**2).sum(axis=(1, 2)) + scatter_of(replace(begun, points=points), variance)

    points, (n, q) = begun.points, begun.points.shape
    damping = np.full((n, 1, 1), _OWN_DAMPINGS[0])
    left, least = measure(points)
    for _ in range(_CHORDS):
        slope = (white @ left.transpose(0, 2, 1))[..., 0] - (points - begun.mean) / variance
        moved = points + within_bounds(points, curvature * (1 + damping * np.eye(q)), slope)
        left_there, there = measure(moved)
        lower, before = there < least, least.sum()
        points, least = np.where(lower[:, None], moved, points), np.where(lower, there, least)
        left = np.where(lower[:, None, None], left_there, left)
        if lower.all() and before - least.sum() < _NEGLIGIBLE:
            break
        easier = np.maximum(damping / _FACTOR, _OWN_DAMPINGS[0])
        damping = np.where(lower[:, None, None], easier, damping * _FACTOR)
    return replace(begun, points=points), least
