"""The linear mixed model of whitened runs, in small matrices.

A run i has whitened columns R_i (random), F_i (fixed) and the residual y_i, of which only the products
G_i = [R F y]' [R F y] enter:

    y_i = R_i b_i + [R_i F_i] c + e_i,   b_i ~ N(0, diag(variance)),   e_i ~ N(0, 1),   c ~ N(target, 1 / precision)

The covariance of y_i is W_i = 1 + R_i diag(variance) R_i'. Products under its inverse, and its determinant, follow from
the q random columns alone by the Woodbury identity. Generalized least squares gives c, where the prior counts as
observations of c; best linear unbiased prediction gives the b_i.

The variances are estimated by restricted maximum likelihood (Patterson and Thompson, Biometrika 58, 545, 1971) with
scoring steps that never lower it. A variance may be zero.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

_MOST = 100
"""Most iterations of a bounded step for each variance: it takes some two."""
_STEPS, _HALVINGS = 40, 10
"""Most scoring steps, and most halvings of one. On 45 fits of the shipped recordings the steps ended after 2 to 9."""

_SETTLED = 1e-3
"""Rise of the restricted likelihood in nats by a whole step after which the steps end: scoring steps shorten quickly,
so that what is left to rise is less."""

_RIDGE = 1e-9
"""Relative to the information on a variance: two random columns may be the same where recordings leave them."""

REACH = 3.0
"""Standard deviations of its prior by which a coefficient may differ from its target."""

_HOLDINGS, _HOLD, _BEYOND = 4, 1e6, 1e-2
"""Most rounds of holding coefficients at the end of their reach, the precision that holds them over that of the data,
and the share of the reach that they may be off then."""


@dataclass(frozen=True, eq=False)
class Gram:
    """`products` (n, c, c) of q = `random` random columns, c - q - 1 fixed ones, and the residual last.

    `precision` (c - 1,) and `target` (c - 1,) are those of the normal prior of the coefficients; a precision of 0 is no
    prior. `widest` (q,) are the largest standard deviations of the random effects. Coefficients are in the inverse unit
    of their column.
    """

    products: np.ndarray
    random: int
    precision: np.ndarray
    target: np.ndarray
    widest: np.ndarray

    def __len__(self) -> int:
        return len(self.products)

    @property
    def reach(self) -> np.ndarray:
        """Largest differences (c - 1,) of coefficients from their targets; laws, whose priors are wide, have none."""
        return np.where(self.precision > 1, REACH / np.sqrt(np.maximum(self.precision, 1)), np.inf)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Estimated `coefficients` (c - 1,), their `covariance`, and the `variance` (q,) of the random effects.

    `each` (n, q) are the predicted random effects, `marginal` (n, c, c) the products under the marginal covariance W_i,
    `logdet` (n,) its log-determinant.
    """

    gram: Gram
    coefficients: np.ndarray
    covariance: np.ndarray
    variance: np.ndarray
    marginal: np.ndarray
    logdet: np.ndarray
    each: np.ndarray

    @property
    def likelihood(self) -> np.ndarray:
        """Log-likelihood (n,) of the runs in nats, up to a constant of the data."""
        return likelihood(self.marginal, self.logdet, self.coefficients)

    @property
    def posterior(self) -> float:
        """Log-likelihood of all runs in nats with the prior of the coefficients, up to a constant."""
        off = self.coefficients - self.gram.target
        return float(self.likelihood.sum() - 0.5 * self.gram.precision @ off**2)

    def at(self, coefficients: np.ndarray) -> "Fitted":
        """The same linear model at other `coefficients` (c - 1,), with the random effects that follow."""
        return replace(self, coefficients=coefficients, each=_predicted(self.gram, self.spread, coefficients))

    @property
    def follows(self) -> np.ndarray:
        """How far the random effects of each run follow the means, (n, q, q): not at all where it tells all itself."""
        q = self.gram.random
        return np.asarray(np.linalg.inv(np.eye(q) + self.variance[:, None] * self.gram.products[:, :q, :q]))

    @property
    def spread(self) -> np.ndarray:
        """Covariances (n, q, q) of the random effects given the data and the coefficients."""
        q = self.gram.random
        return integrated(self.gram.products[:, :q, :q], self.variance)[0]

    @property
    def held(self) -> np.ndarray:
        """Whether coefficients (c - 1,) are held at the end of their reach, by a precision that no data have."""
        return np.asarray(np.abs(self.coefficients - self.gram.target) > self.gram.reach * (1 - _BEYOND))

    @property
    def squares(self) -> np.ndarray:
        """Sum of squared whitened residuals (n,) after the random effects of each run."""
        q = self.gram.random
        own = self.coefficients[:q] + self.each
        fixed = np.tile(self.coefficients[q:], (len(own), 1))
        left = np.concatenate([-own, -fixed, np.ones((len(own), 1))], axis=1)
        return np.asarray(np.einsum("np,npq,nq->n", left, self.gram.products, left))


def likelihood(marginal: np.ndarray, logdet: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) in nats, up to a constant of the data, of runs at coefficients (c - 1,).

    `marginal` (n, c, c) and `logdet` (n,) are those of `marginalise`. The random effects are integrated out, the prior
    is not in it.
    """
    left = np.append(-coefficients, 1.0)
    return np.asarray(-0.5 * (np.einsum("p,npq,q->n", left, marginal, left) + logdet))


def marginalise(gram: Gram, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Products under the marginal covariance (n, c, c), its log-determinants (n,), and those (n, q, q) of the b_i.

    `variance` is (q,). The last are the covariances of the b_i given the data and the coefficients. Nothing is
    subtracted from products of the random columns: at the edge of a jump these may be larger by 15 digits than what is
    left of them.
    """
    q, products = gram.random, gram.products
    square = products[:, :q, :q]
    spread, logdet = integrated(square, variance)
    own = np.linalg.solve(np.eye(q) + square * variance, products[:, :q])
    marginal = np.empty_like(products)
    marginal[:, :q], marginal[:, q:, :q] = own, own[:, :, q:].transpose(0, 2, 1)
    np.subtract(products[:, q:, q:], products[:, q:, :q] @ (variance[:, None] * own[:, :, q:]), out=marginal[:, q:, q:])
    return marginal, logdet, spread


def integrated(square: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Covariances (n, q, q) of the b_i given the data, and log-determinants (n,) of the W_i, by the Woodbury identity.

    `square` (n, q, q) are the products of the random columns with each other.
    """
    root = np.sqrt(variance)
    inner = np.eye(len(root)) + root[:, None] * square * root
    return root[:, None] * np.linalg.inv(inner) * root, np.linalg.slogdet(inner)[1]


class Solved(NamedTuple):
    """`coefficients` (c - 1,) by generalized least squares with a prior, and their `covariance` (c - 1, c - 1).

    `precision` and `target` (c - 1,) are those of the prior, or what holds a coefficient at the end of its reach.
    """

    coefficients: np.ndarray
    covariance: np.ndarray
    precision: np.ndarray
    target: np.ndarray


def solve(gram: Gram, marginal: np.ndarray) -> Solved:
    """The coefficients given `marginal` (c, c), the sum of the products of those runs that count.

    A coefficient is at most `REACH` standard deviations of its prior from its target: what asks for a clock that is 200
    samples late is not a clock.
    """
    products, pull = marginal[:-1, :-1], marginal[:-1, -1]
    precision, target = gram.precision, gram.target
    reach = gram.reach
    for _ in range(_HOLDINGS):
        information = products + np.diag(precision)
        scale = 1 / np.sqrt(np.diag(information))  # columns have units, and may differ by many orders of magnitude
        inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
        solved = Solved(inverse @ (pull + precision * target), inverse, precision, target)
        beyond = np.abs(solved.coefficients - gram.target) > reach * (1 + _BEYOND)
        if not beyond.any():
            break
        target = np.where(beyond, gram.target + np.clip(solved.coefficients - gram.target, -reach, reach), target)
        precision = np.where(beyond, np.maximum(precision, _HOLD * np.diag(products)), precision)
    return solved


def estimate(gram: Gram, variance: np.ndarray, fixed: bool = False) -> Fitted:
    """Fit from the variances `variance` (q,) on, or with them if `fixed`.

    Estimated variances are at most the squares of `widest` of the gram.
    """
    if not fixed:
        variance = _most_likely(gram, variance)
    marginal, logdet, spread = marginalise(gram, variance)
    coefficients, covariance, *_ = solve(gram, marginal.sum(axis=0))
    return Fitted(gram, coefficients, covariance, variance, marginal, logdet, _predicted(gram, spread, coefficients))


def _predicted(gram: Gram, spread: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Random effects (n, q) at these coefficients (c - 1,), with covariances `spread` (n, q, q) given the data."""
    pull = gram.products[:, :gram.random, -1] - gram.products[:, :gram.random, :-1] @ coefficients
    return np.asarray((spread @ pull[..., None])[..., 0])


def restricted_likelihood(gram: Gram, variance: np.ndarray) -> float:
    """Log-likelihood in nats up to a constant of the data: coefficients and random effects are integrated out."""
    random = np.ascontiguousarray(gram.products[:, :gram.random])
    return _restricted(gram, random, gram.products.sum(axis=0), variance).likelihood


def weigh_scatter(fitted: Fitted, place: int, most: float) -> float:
    """Nats by which the runs ask for a random effect with a larger standard deviation than `most`.

    The other variances are those of the largest restricted likelihood either way.
    """
    gram, largest = fitted.gram, fitted.gram.widest.copy()
    largest[place] = min(most, largest[place])
    within = _most_likely(replace(gram, widest=largest), fitted.variance)
    return restricted_likelihood(gram, fitted.variance) - restricted_likelihood(gram, within)


class _Restricted(NamedTuple):
    """The restricted log-likelihood in nats up to a constant, its slope (q,) in the variances, and information (q, q).

    The information is the expected one for known coefficients. It is larger than that of the restricted likelihood by
    what the coefficients take, and costs less.
    """

    likelihood: float
    slope: np.ndarray
    information: np.ndarray


def _most_likely(gram: Gram, variance: np.ndarray) -> np.ndarray:
    """Variances (q,) of the largest restricted likelihood, by scoring with halved steps between 0 and the widest.

    They are those that are given where these have none, as of equations that diverge.
    """
    largest = gram.widest**2
    random, total = np.ascontiguousarray(gram.products[:, :gram.random]), gram.products.sum(axis=0)
    variance = np.minimum(variance, largest)
    here = _restricted(gram, random, total, variance)
    for _ in range(_STEPS if np.isfinite(here.likelihood) else 0):
        step, share = _step(here, variance, largest), 1.0
        for _ in range(_HALVINGS):
            tried = np.clip(variance + share * step, 0.0, largest)
            there = _restricted(gram, random, total, tried)
            if there.likelihood >= here.likelihood:
                break
            share *= 0.5
        else:
            break
        rise = there.likelihood - here.likelihood
        variance, here = tried, there
        if share == 1.0 and rise < _SETTLED:
            break
    return variance


def _restricted(gram: Gram, random: np.ndarray, total: np.ndarray, variance: np.ndarray) -> _Restricted:
    """At `variance` (q,), with the rows `random` (n, q, c) of the products, and the sum `total` (c, c) of all."""
    n, q, c = random.shape
    square = random[:, :, :q]
    spread, logdet = integrated(square, variance)
    through = spread @ random
    own = random - square @ through  # the random rows of the products under the inverse of W_i
    marginal = total - random.reshape(n * q, c).T @ through.reshape(n * q, c)
    coefficients, covariance, precision, target = solve(gram, marginal)
    left = np.append(-coefficients, 1.0)
    likelihood = -0.5 * (logdet.sum() - np.linalg.slogdet(covariance)[1]
                         + left @ marginal @ left + precision @ (coefficients - target) ** 2)
    rows = own.reshape(n * q, c)
    squares = ((rows @ left) ** 2).reshape(n, q).sum(axis=0)
    taken = ((rows[:, :-1] @ covariance) * rows[:, :-1]).sum(axis=1).reshape(n, q).sum(axis=0)
    trace = np.einsum("nkk->k", own[:, :, :q]) - taken
    return _Restricted(float(likelihood), 0.5 * (squares - trace), 0.5 * (own[:, :, :q] ** 2).sum(axis=0))


def _step(at: _Restricted, variance: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """The scoring step (q,) that promises most between the bounds.

    Random columns that are nearly the same share their information: a step beyond a bound that is cut there promises
    nothing of the others, and may lower the likelihood however short it is.
    """
    step, free = np.zeros_like(variance), (np.diag(at.information) > 0) & (largest > 0)
    if free.any():
        scale = 1 / np.sqrt(np.diag(at.information)[free])
        values, axes = np.linalg.eigh(at.information[np.ix_(free, free)] * np.outer(scale, scale))
        root = np.sqrt(np.maximum(values, 0) + _RIDGE)
        factor, here, most = root[:, None] * axes.T, variance[free] / scale, largest[free] / scale
        aim = factor @ here + axes.T @ (scale * at.slope[free]) / root
        there, _ = scipy.optimize.nnls(factor, aim, maxiter=_MOST * len(aim))
        if (there > most).any():
            there = scipy.optimize.lsq_linear(factor, aim, (0, most), "bvls").x  # takes ten times as long
        step[free] = scale * (there - here)
    return step
