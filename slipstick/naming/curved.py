"""The mixed model of a block that is far from linear, by Laplace's approximation.

An engagement i is predicted as f(beta_i, c), with parameters beta_i ~ N(mean, diag(variance)) of its own and
coefficients c in common. With y the measured signal and | | the norm after whitening, its log-likelihood is that of
the most probable beta, corrected for how well beta is known (Tierney and Kadane, J. Am. Stat. Assoc. 81, 82, 1986):

    -1/2 [ |y - f(beta, c)|^2 + sum (beta - mean)^2 / variance + log det(1 + J'J diag(variance)) ]

J are the whitened slopes of f in beta: J'J stands for the second derivatives, as in Gauss-Newton's method. The
formula is exact where f is linear. At a beta that is far from the most probable one the first two terms are large, so
that a fit that is stuck in a local minimum loses to one that is not.

An iteration estimates mean and variance by expectation-maximisation with the beta_i held, solves the linear mixed
model about the beta_i (Lindstrom and Bates, Biometrics 46, 673, 1990), and goes a share of the way to its solution:
first the common share that lowers the first two terms most, summed over the engagements, then for each engagement the
share that lowers its own terms most. Where no common share lowers them, because the points that suit a law lie on no
straight way, the points are solved for at some shares of the common values. No step at all is among the choices, so
that a step never lowers the joint likelihood of the data and the beta_i at the variances for which it was made. Two
things are not in it: the priors of mean and c, and the determinant, which changes with J and the variances. The
evidence of an iteration can therefore be below that of the one before, and the best one is returned.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.naming.block import Pair, SearchedBlock
from slipstick.naming.fit import BlockFit, gram_of, predict
from slipstick.naming.grams import Fitted, Gram, estimate

_SHARES = (1.0, 0.5, 0.2, 0.05, 0.0)
"""Of the way to the solution of the linear model; the last is no step."""

_STUCK, _SOLVED, _SOLVED_AT = 0.05, 2, (1.0, 0.3)
"""Share of a step from which on it is as good as none, and the Gauss-Newton steps of the points alone that then follow,
at these shares of the common values."""

_LEAST = 1e-4**2
"""Smallest variance of a parameter, relative to nominal squared: far below what recordings tell, and not singular."""

_LONGEST = 0.25
"""Longest step of a parameter of an engagement, relative to nominal: the linear model does not hold further away."""

_MOST = 0.9
"""Share of the engagements whose steps are not cut: a few far ones shall not hold back the others."""

_LOWEST, _HIGHEST = -0.9, 2.0
"""Bounds of the parameters of an engagement, relative to nominal: none changes its sign, or is more than tripled."""

_FIRST_SCATTER, _OTHER_SCATTER = 0.01, 0.03
"""Standard deviations to begin with: that of the first parameter, which scales the output, is known best."""

_SPREADINGS, _SPREAD = 30, 0.01
"""Most steps of expectation-maximisation, and the relative change of the variances below which they end."""

_SETTLED = 0.3
"""Change of the evidence in nats below which the iterations end: far less than any decision depends on."""


@dataclass(frozen=True, eq=False)
class CurvedFit(BlockFit):
    """A fit of a curved block: as a `BlockFit`, and what integrates its random effects out.

    `mean` and `variance` (q,) are those of the `points` (n, q), relative to nominal. `evidence` (n,) is the
    log-likelihood in nats with the random effects integrated out, up to a constant of the data, with an equal share of
    the logarithm of the priors for each engagement. `squares` (n,) are the sums of squared whitened residuals. `fitted`
    is the linear mixed model about the points.
    """

    block: SearchedBlock
    mean: np.ndarray
    variance: np.ndarray
    evidence: np.ndarray
    squares: np.ndarray

    @property
    def chi2(self) -> np.ndarray:
        """Reduced chi-square (n,) of the engagements, of the residuals themselves and not of the linear model's."""
        counts = self.block.counted.sum(axis=1)
        return np.asarray(self.squares / np.maximum(counts - len(self.block.random), 1))


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

    def toward(self, aim: "_Values", own: float | np.ndarray, common: float) -> "_Values":
        """A share of the way to `aim`: `own`, one or (n, 1), of the points, and `common` of what engagements share."""
        coefficients = {pair: now + common * (aim.coefficients[pair] - now) for pair, now in self.laws}
        return _Values(self.points + own * (aim.points - self.points), self.mean + common * (aim.mean - self.mean),
                       self.shared + common * (aim.shared - self.shared), coefficients)


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
    noise, last, best = block.noise(values.points), np.inf, None
    for iteration in range(iterations + 1):
        predicted, gram = _linearised(block, values, noise)
        information = gram.products[:, :q, :q]
        if iteration or start is None:
            mean, variance = _spread(values.points, information, gram.precision[:q], block.widest, variance)
            values = replace(values, mean=mean)
        squares = _squares(block, predicted, noise)
        cost = squares + _scatter(values, variance)
        logdet = np.linalg.slogdet(np.eye(q) + information * variance)[1]
        common = np.concatenate([values.mean, values.shared, *values.coefficients.values()])
        prior = (common**2 * gram.precision).sum()
        evidence = -0.5 * (cost + logdet + prior / n)
        fitted = estimate(gram, variance, fixed=True)
        if best is None or evidence.sum() > best.evidence.sum():
            best = CurvedFit(block, tuple(laws), values.points, values.shared, values.coefficients, fitted, predicted,
                             noise, values.mean, variance, evidence, squares)
        if iteration == iterations or (iteration > 1 and abs(evidence.sum() - last) < _SETTLED):
            break
        last = evidence.sum()
        values = _stepped(block, values, _aim(values, fitted), variance, noise, cost)
    assert best is not None
    return best


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
    `precision` (q,) is that of the prior of the mean about 0.
    """
    mean = np.zeros_like(variance)
    for _ in range(_SPREADINGS):
        mean = (points / variance).sum(axis=0) / (len(points) / variance + precision)
        posterior = np.linalg.inv(information + np.diag(1 / variance))
        expected = ((points - mean) ** 2 + np.einsum("nqq->nq", posterior)).mean(axis=0)
        renewed = np.clip(expected, _LEAST, widest**2)
        settled = np.all(np.abs(renewed / variance - 1) < _SPREAD)
        variance = renewed
        if settled:
            break
    return mean, variance


def _squares(block: SearchedBlock, predicted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Sums of squared whitened residuals (n,) of a prediction (n, k)."""
    left = block.measured - predicted
    return np.asarray((whitened(left[:, None], block.counted, noise) ** 2).sum(axis=(1, 2)))


def _scatter(values: _Values, variance: np.ndarray) -> np.ndarray:
    """Sums of squared deviations (n,) of the points from their mean, in standard deviations."""
    return np.asarray(((values.points - values.mean) ** 2 / variance).sum(axis=1))


def _aim(values: _Values, fitted: Fitted) -> _Values:
    """The solution of the linear mixed model, with points no further from `values` than the model can be trusted."""
    q, p = values.points.shape[1], len(values.shared)
    mean, shared, rest = np.split(fitted.coefficients, [q, q + p])
    change = np.clip(mean + fitted.each, _LOWEST, _HIGHEST) - values.points
    ends = np.cumsum([len(law) for _, law in values.laws])
    coefficients = dict(zip(values.coefficients, np.split(rest, ends[:-1]), strict=True)) if len(ends) else {}
    # Points that are cut while a law is not would no longer suit it: the whole step is shortened, for most engagements.
    longest = float(np.quantile(np.abs(change).max(axis=1), _MOST))
    aim = _Values(values.points + change, mean, shared, coefficients)
    share = min(1.0, _LONGEST / max(longest, 1e-12))
    aim = values.toward(aim, share, share)
    change = np.clip(aim.points - values.points, -_LONGEST, _LONGEST)
    return _Values(values.points + change, aim.mean, aim.shared, aim.coefficients)


def _stepped(block: SearchedBlock, values: _Values, aim: _Values, variance: np.ndarray, noise: BlockNoise,
             cost: np.ndarray) -> _Values:
    """Go toward `aim`: the best common share, then the best of each engagement; `cost` (n,) is that of no step."""
    def cost_at(own: float, common: float) -> np.ndarray:
        there = values.toward(aim, own, common)
        return np.asarray(_squares(block, _predicted(block, there), noise) + _scatter(there, variance))

    together = [*(cost_at(share, share) for share in _SHARES[:-1]), cost]
    best = int(np.argmin([one.sum() for one in together]))
    common = _SHARES[best]
    if common <= _STUCK and len(values.coefficients):
        # Points on a straight way do not suit what is in common, which is far from linear: they are solved for.
        for share in _SOLVED_AT:
            found, its = _profiled(block, values.toward(aim, share, share), variance, noise)
            if its.sum() < together[best].sum():
                return found
    apart = [together[best] if share == common else cost_at(share, common) for share in _SHARES]
    own = np.array(_SHARES)[np.argmin(apart, axis=0)]
    return values.toward(aim, own[:, None], common)


def _profiled(block: SearchedBlock, values: _Values, variance: np.ndarray,
              noise: BlockNoise) -> tuple[_Values, np.ndarray]:
    """The points of each engagement solved for at what all have in common, by Gauss-Newton steps, and the cost (n,)."""
    q = values.points.shape[1]
    cost = _squares(block, _predicted(block, values), noise) + _scatter(values, variance)
    for _ in range(_SOLVED):
        predicted = _predicted(block, values)
        own, _ = block.columns(values.points, values.laws, predicted)
        white = whitened(np.concatenate([own, (block.measured - predicted)[:, None]], axis=1), block.counted, noise)
        products = white @ white.transpose(0, 2, 1)
        pull = products[:, :q, q] - (values.points - values.mean) / variance
        change = np.linalg.solve(products[:, :q, :q] + np.diag(1 / variance), pull[..., None])[..., 0]
        aim = np.clip(values.points + np.clip(change, -_LONGEST, _LONGEST), _LOWEST, _HIGHEST)
        moved, apart = [values.points + share * (aim - values.points) for share in _SHARES], []
        for points in moved[:-1]:
            there = replace(values, points=points)
            apart.append(_squares(block, _predicted(block, there), noise) + _scatter(there, variance))
        best = np.argmin([*apart, cost], axis=0)
        cost = np.min([*apart, cost], axis=0)
        values = replace(values, points=np.stack(moved)[best, np.arange(len(best))])
    return values, cost
