"""The mixed model of a block that is far from linear, by Laplace's approximation.

An engagement i is predicted as f(beta_i, c), with parameters beta_i ~ N(mean, diag(variance)) of its own and
coefficients c in common. With y the measured signal and | | the norm after whitening, its log-likelihood is that of
the most probable beta, corrected for how well beta is known (Tierney and Kadane, J. Am. Stat. Assoc. 81, 82, 1986):

    -1/2 [ |y - f(beta, c)|^2 + sum (beta - mean)^2 / variance + log det(1 + J'J diag(variance)) ]

J are the whitened slopes of f in beta: J'J stands for the second derivatives, as in Gauss-Newton's method. The
formula is exact where f is linear. At a beta that is far from the most probable one the first two terms are large, so
that a fit that is stuck in a local minimum loses to one that is not.

An iteration estimates mean and variance by expectation-maximisation with the beta_i held, and solves the linear mixed
model about the beta_i (Lindstrom and Bates, Biometrics 46, 673, 1990) with what engagements share damped as by
Marquardt (J. Soc. Ind. Appl. Math. 11, 431, 1963): the beta_i that suit other c lie on curves, along which a linear
model holds for short steps. For each engagement steps of several dampings are tried, and none, and the one that suits
the new c best is taken. A block whose prediction takes long tries others than the first one only where that lowers the
two terms by much less than the linear model promises. A common step that does not lower the first two terms and the
priors is taken again with more damping, so that none lowers the joint likelihood of the data, the beta_i and c at the
variances for which it was made. The determinant is not in it, which changes with J and the variances: the evidence of
an iteration can be below that of the one before, and the best one is returned.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.naming.block import Pair, SearchedBlock
from slipstick.naming.fit import BlockFit, reduced
from slipstick.naming.grams import REACH, Gram, estimate, marginalise, solve
from slipstick.naming.linear_model import gram_of, predict
from slipstick.threads import mapped

_OWN_DAMPINGS = (0.003, 0.0, 0.03, 0.3, 3.0)
"""Dampings of the step of an engagement, relative to its second derivatives; the first takes 0.3 % off a step."""
_SUFFICIENT, _NEGLIGIBLE = 0.5, 0.01
"""Share of the promised decrease from which a block that is not `thorough` tries no other damping, and a decrease on
which nothing depends. In fits of the shipped recordings others add less than a hundredth to such steps."""

_DAMPING, _LEAST_DAMPING, _FACTOR, _TRIALS = 1e-3, 1e-5, 10.0, 5
"""Damping to begin with, relative to the information about each common value, and at least; the factor by which it
falls after a step that succeeds and rises after one that does not; and the trials of a step, up to a damping of 10."""

_LEAST = 1e-4**2
"""Smallest variance of a parameter, relative to nominal squared: far below what recordings tell, and not singular."""

_LONGEST = 0.25
"""Longest step of a parameter of an engagement, relative to nominal: the linear model does not hold further away."""

_HOLDINGS, _HOLD = 3, 1e6
"""Most rounds of holding parameters at their bounds, and the curvature that holds them over that of the data."""

LOWEST, HIGHEST = -0.9, 2.0
"""Bounds of the parameters of an engagement, relative to nominal: none changes its sign, or is more than tripled."""

_FIRST_SCATTER, _OTHER_SCATTER = 0.01, 0.03
"""Standard deviations to begin with: that of the first parameter, which scales the output, is known best."""

_SPREADINGS, _SPREAD = 30, 0.01
"""Most steps of expectation-maximisation, and the relative change of the variances below which they end."""

_SETTLED, _SETTLED_SHARE = 0.3, 0.01
"""Change of the evidence below which the iterations end: in nats, far less than any decision depends on, and as a share
of the standard error of the evidence over engagements, which is large where the model is wrong."""


@dataclass(frozen=True, eq=False)
class CurvedFit(BlockFit):
    """A fit of a curved block: as a `BlockFit`, and what integrates its random effects out.

    `mean` and `variance` (q,) are those of the `points` (n, q), relative to nominal. `evidence` (n,) is the
    log-likelihood in nats with the random effects integrated out, up to a constant of the data, with an equal share of
    the logarithm of the priors for each engagement. `squares` (n,) are the sums of squared whitened residuals. `fitted`
    is the linear mixed model about the points. `converged` says whether the evidence came to rest in the iterations.
    """

    block: SearchedBlock
    mean: np.ndarray
    variance: np.ndarray
    evidence: np.ndarray
    squares: np.ndarray
    converged: bool

    @property
    def chi2(self) -> np.ndarray:
        """Reduced chi-square (n,) of the engagements, of the residuals themselves and not of the linear model's."""
        return reduced(self.block, self.squares)


@dataclass(frozen=True, eq=False)
class _Values:
    """Where a fit is: `points` (n, q) and their `mean` (q,), `shared` (p,), and `coefficients` of each law."""

    points: np.ndarray
    mean: np.ndarray
    shared: np.ndarray
    coefficients: dict[Pair, np.ndarray]

    @property
    def laws(self) -> list[tuple[Pair, np.ndarray]]:
        return list(self.coefficients.items())

    @property
    def common(self) -> np.ndarray:
        """All that engagements share (q + p + m,): means, shared values, and coefficients."""
        return np.concatenate([self.mean, self.shared, *self.coefficients.values()])


def fit_curved(block: SearchedBlock, laws: Sequence[Pair] = (), start: CurvedFit | None = None, iterations: int = 12,
               points: np.ndarray | None = None, coefficients: Mapping[Pair, np.ndarray] | None = None,
               shared: np.ndarray | None = None) -> CurvedFit:
    """Fit a block with `laws`, from the fit `start` or else from `points` (n, q), nominal where neither is given.

    `coefficients` are starts of those of the laws, before those of `start`; a law begins with 0 otherwise. `shared`
    (p,) are starts of the shared values. A fit that starts from another one, with laws or shared values that begin
    with 0, is never below it.
    """
    known = {**({} if start is None else start.coefficients), **(coefficients or {})}
    begun = {pair: known[pair] if pair in known else np.zeros(block.size(pair)) for pair in laws}
    n, q = len(block.measured), len(block.random)
    if start is not None:
        shared = start.shared if shared is None else shared
        values, variance = _Values(start.points, start.mean, shared, begun), start.variance
    else:
        points = np.zeros((n, q)) if points is None else points
        shared = np.zeros(len(block.fixed)) if shared is None else shared
        values = _Values(points, points.mean(axis=0), shared, begun)
        variance = np.array([_FIRST_SCATTER, *[_OTHER_SCATTER] * (q - 1)]) ** 2
    noise, last, damping, best = block.noise(values.points), np.inf, _DAMPING, None
    for iteration in range(iterations + 1):
        predicted, gram = _linearised(block, values, noise)
        information = gram.products[:, :q, :q]
        if iteration or start is None:
            mean, variance = _spread(values.points, information, gram.precision[:q], block.widest, variance)
            values = replace(values, mean=mean)
        squares = _squares(block, predicted, noise)
        cost = squares + _scatter(values, variance)
        logdet = np.linalg.slogdet(np.eye(q) + information * variance)[1]
        prior = _prior(values, gram)
        evidence = -0.5 * (cost + logdet + prior / n)
        if best is None or evidence.sum() > best.evidence.sum():
            best = CurvedFit(block, tuple(laws), values.points, values.shared, values.coefficients,
                             estimate(gram, variance, fixed=True), predicted, noise, values.mean, variance, evidence,
                             squares, False)
        settled = max(_SETTLED, _SETTLED_SHARE * np.sqrt(n) * float(evidence.std()))
        at_rest = iteration > 1 and abs(evidence.sum() - last) < settled
        if iteration == iterations or at_rest:
            break
        last = evidence.sum()
        values, damping = _stepped(block, values, gram, variance, noise, float(cost.sum() + prior), damping)
    assert best is not None
    return replace(best, converged=bool(at_rest))


def _predicted(block: SearchedBlock, values: _Values) -> np.ndarray:
    """The prediction (n, k)."""
    found = predict(block, values.points, values.shared, values.laws)
    return np.asarray(found)


def _linearised(block: SearchedBlock, values: _Values, noise: BlockNoise) -> tuple[np.ndarray, Gram]:
    """The prediction (n, k), and the products of its slopes with the parameters themselves as coefficients."""
    predicted, laws = _predicted(block, values), values.laws
    own, fixed = block.columns(values.points, laws, predicted)
    free = [block.basis(pair, values.points, laws, predicted) for pair, _ in laws]
    z = block.measured - predicted + np.einsum("nq,nqk->nk", values.points, own)
    z = z + values.shared @ fixed
    for (_, law), columns in zip(laws, free, strict=True):
        z = z + law @ columns
    extra = sum(len(law) for _, law in laws)
    gram: Gram = gram_of(block, [own, fixed, *free], z, noise, extra)
    return predicted, gram


def _spread(points: np.ndarray, information: np.ndarray, precision: np.ndarray, widest: np.ndarray,
            variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (q,) of parameters of which `points` (n, q) are the most probable, known with `information`.

    Expectation-maximisation from `variance` on: the expected squares are those of the points about their mean, and
    the variances of the points themselves, which the inverse of `information` (n, q, q) + 1 / variance holds.
    `precision` (q,) is that of the prior of the mean about 0, from which the mean is as far as `solve` lets it.
    """
    mean, reach = np.zeros_like(variance), REACH / np.sqrt(np.maximum(precision, 1e-300))
    for _ in range(_SPREADINGS):
        mean = np.clip((points / variance).sum(axis=0) / (len(points) / variance + precision), -reach, reach)
        posterior = np.linalg.inv(information + np.diag(1 / variance))
        expected = ((points - mean) ** 2 + np.einsum("nqq->nq", posterior)).mean(axis=0)
        renewed = np.clip(expected, _LEAST, widest**2)
        settled = np.all(np.abs(renewed / variance - 1) < _SPREAD)
        variance = renewed
        if settled:
            break
    return mean, variance


def _squares(block: SearchedBlock, predicted: np.ndarray, noise: BlockNoise,
             rows: slice | np.ndarray = slice(None)) -> np.ndarray:
    """Sums of squared whitened residuals (m,) of a prediction (n, k) in the engagements `rows`, by default in all."""
    left = (block.measured - predicted)[rows, None]
    return np.asarray((whitened(left, block.counted[rows], noise.of(rows)) ** 2).sum(axis=(1, 2)))


def _scatter(values: _Values, variance: np.ndarray) -> np.ndarray:
    """Sums of squared deviations (n,) of the points from their mean, in standard deviations."""
    return np.asarray(((values.points - values.mean) ** 2 / variance).sum(axis=1))


def _prior(values: _Values, gram: Gram) -> float:
    """Sum of squares of what engagements share, in standard deviations of its priors."""
    return float((values.common**2 * gram.precision).sum())


def _damped(values: _Values, gram: Gram, variance: np.ndarray, damping: float) -> np.ndarray:
    """What engagements share (q + p + m,) in the linear mixed model, damped about its present values."""
    marginal = marginalise(gram, variance)[0].sum(axis=0)
    information = damping * np.diag(marginal)[:-1]
    marginal[:-1, :-1] += np.diag(information)  # as an engagement that says: as now
    marginal[:-1, -1] += information * values.common
    return solve(gram, marginal).coefficients


def _with_common(block: SearchedBlock, values: _Values, common: np.ndarray) -> _Values:
    """Values with this `common` part (q + p + m,), shared ones within their bounds, and the points as they are."""
    q, p = len(values.mean), len(values.shared)
    mean, shared, rest = np.split(common, [q, q + p])
    ends = np.cumsum([len(law) for _, law in values.laws])
    coefficients = dict(zip(values.coefficients, np.split(rest, ends[:-1]), strict=True)) if len(ends) else {}
    return _Values(values.points, mean, np.clip(shared, *block.bounds), coefficients)


def _own_terms(values: _Values, gram: Gram, variance: np.ndarray,
               common: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope (n, q) of half the two terms in the points, downwards, at this `common` part, and curvature (n, q, q)."""
    q = gram.random
    own, others = gram.products[:, :q, :q], gram.products[:, :q, q:-1] @ common[q:]
    slope = gram.products[:, :q, -1] - others - (own @ values.points[..., None])[..., 0]
    return slope - (values.points - common[:q]) / variance, own + np.diag(1 / variance)


def _within_bounds(points: np.ndarray, curvature: np.ndarray, slope: np.ndarray) -> np.ndarray:
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


def _stepped(block: SearchedBlock, values: _Values, gram: Gram, variance: np.ndarray, noise: BlockNoise,
             cost: float, damping: float) -> tuple[_Values, float]:
    """A step that lowers the `cost`, and the damping of the next one; the same values where none was found."""
    for _ in range(_TRIALS):
        common = _damped(values, gram, variance, damping)
        begun = _with_common(block, values, common)
        moved, least = _followed(block, begun, _own_terms(values, gram, variance, common), variance, noise)
        if least.sum() + _prior(moved, gram) < cost:
            return moved, max(damping / _FACTOR, _LEAST_DAMPING)
        damping = max(damping * _FACTOR, _DAMPING)
    return values, damping


def _followed(block: SearchedBlock, begun: _Values, terms: tuple[np.ndarray, np.ndarray], variance: np.ndarray,
              noise: BlockNoise) -> tuple[_Values, np.ndarray]:
    """The values with the best points that were tried, and their two terms (n,)."""
    (slope, curvature), (n, q) = terms, begun.points.shape

    def tried(damping: float, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        change = _within_bounds(begun.points, curvature * (1 + damping * np.eye(q)), slope)
        points: np.ndarray = begun.points + change
        return points, _terms_of(block, replace(begun, points=points), variance, noise, rows)

    rows = np.ones(n, bool)
    found = [(begun.points, _terms_of(block, begun, variance, noise, rows)), tried(_OWN_DAMPINGS[0], rows)]
    change = found[1][0] - begun.points
    promised = np.einsum("nq,nq->n", 2 * slope - (curvature @ change[..., None])[..., 0], change)
    left = rows if block.thorough else found[0][1] - found[1][1] < _SUFFICIENT * promised - _NEGLIGIBLE
    if left.any():
        found += mapped(lambda one: tried(one, left), _OWN_DAMPINGS[1:])
    points, terms_of_each = (np.stack(one) for one in zip(*found, strict=True))
    best = np.argmin(terms_of_each, axis=0), np.arange(n)
    return replace(begun, points=points[best]), terms_of_each[best]


def _terms_of(block: SearchedBlock, values: _Values, variance: np.ndarray, noise: BlockNoise,
              rows: np.ndarray) -> np.ndarray:
    """The two terms (n,) of the engagements `rows` (n,); infinite for the others."""
    found = np.full(len(rows), np.inf)
    found[rows] = _squares(block, block.part(values.points, values.shared, values.laws, rows), noise, rows)
    return np.asarray(found + _scatter(values, variance))
