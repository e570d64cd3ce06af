"""The linear mixed model of whitened engagements, in small matrices.

An engagement i has whitened columns R_i (random), F_i (fixed) and the residual y_i, of which only the products
G_i = [R F y]' [R F y] enter:

    y_i = R_i b_i + [R_i F_i] c + e_i,   b_i ~ N(0, diag(variance)),   e_i ~ N(0, 1),   c ~ N(target, 1 / precision)

The covariance of y_i is W_i = 1 + R_i diag(variance) R_i'. Products under its inverse, and its determinant, follow from
the q random columns alone by the Woodbury identity. Generalized least squares gives c, where the prior counts as
observations of c; best linear unbiased prediction gives the b_i.

The variances are estimated by restricted maximum likelihood (Patterson and Thompson, Biometrika 58, 545, 1971) with the
minorisation-maximisation steps of Zhou, Hu, Zhou and Lange (J. Comput. Graph. Stat. 28, 350, 2019). A step never lowers
the restricted likelihood, and a variance stays positive: one of zero is approached.
"""

from dataclasses import dataclass

import numpy as np

_ITERATIONS = 60
"""Most steps: a variance on its way to zero would take any number, for likelihood that nothing depends on."""

_SETTLED = 1e-2
"""Relative change of every variance that matters below which the steps end: the restricted likelihood was then within
0.02 nats of its maximum on eight random problems, although a small variance may still be off by a third."""

_MATTERS = 1e-3
"""Least nats that a variance is worth for its change to matter: one on its way to zero never settles."""

_LONGEST = 10.0
"""Largest factor of a variance in a step: where a parameter has no column, the step would be without bound."""

REACH = 3.0
"""Standard deviations of its prior by which a coefficient may differ from its target."""

_HOLDINGS, _HOLD, _BEYOND = 4, 1e6, 1e-2
"""Most rounds of holding coefficients at the end of their reach, the precision that holds them over that of the data,
and the share of the reach that they may be off then."""

_TINY = 1e-300
"""In place of a trace of zero, so that the variance of an empty column shrinks and does not become NaN."""


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
        """Log-likelihood (n,) of the engagements in nats, up to a constant of the data."""
        return likelihood(self.marginal, self.logdet, self.coefficients)

    @property
    def squares(self) -> np.ndarray:
        """Sum of squared whitened residuals (n,) after the random effects of each engagement."""
        q = self.gram.random
        own = self.coefficients[:q] + self.each
        fixed = np.tile(self.coefficients[q:], (len(own), 1))
        left = np.concatenate([-own, -fixed, np.ones((len(own), 1))], axis=1)
        return np.asarray(np.einsum("np,npq,nq->n", left, self.gram.products, left))


def likelihood(marginal: np.ndarray, logdet: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) in nats, up to a constant of the data, of engagements at coefficients (c - 1,).

    `marginal` (n, c, c) and `logdet` (n,) are those of `marginalise`. The random effects are integrated out, the prior
    is not in it.
    """
    left = np.append(-coefficients, 1.0)
    return np.asarray(-0.5 * (np.einsum("p,npq,q->n", left, marginal, left) + logdet))


def marginalise(gram: Gram, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Products under the marginal covariance (n, c, c), its log-determinants (n,), and those (n, q, q) of the b_i.

    `variance` is (q,). The last are the covariances of the b_i given the data and the coefficients.
    """
    q, root = gram.random, np.sqrt(variance)
    inner = np.eye(q) + root[:, None] * gram.products[:, :q, :q] * root
    spread = root[:, None] * np.linalg.inv(inner) * root
    through = gram.products[:, :, :q] @ spread
    return gram.products - through @ gram.products[:, :q], np.linalg.slogdet(inner)[1], spread


def solve(gram: Gram, marginal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (c - 1,) by generalized least squares with the prior of `gram`, and their covariance (c - 1, c - 1).

    `marginal` (m, c, c) are the products of the engagements that count, all or some of those of `gram`. A coefficient
    is at most `REACH` standard deviations of its prior from its target: what asks for a clock that is 200 samples late
    is not a clock.
    """
    products, pull = marginal[:, :-1, :-1].sum(axis=0), marginal[:, :-1, -1].sum(axis=0)
    precision, target = gram.precision, gram.target
    # Laws, whose priors are wide, go as far as they are asked to.
    reach = np.where(gram.precision > 1, REACH / np.sqrt(np.maximum(gram.precision, 1)), np.inf)
    for _ in range(_HOLDINGS):
        information = products + np.diag(precision)
        scale = 1 / np.sqrt(np.diag(information))  # columns have units, and may differ by many orders of magnitude
        inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
        coefficients = inverse @ (pull + precision * target)
        beyond = np.abs(coefficients - gram.target) > reach * (1 + _BEYOND)
        if not beyond.any():
            break
        target = np.where(beyond, gram.target + np.clip(coefficients - gram.target, -reach, reach), target)
        precision = np.where(beyond, np.maximum(precision, _HOLD * np.diag(products)), precision)
    return coefficients, inverse


def estimate(gram: Gram, variance: np.ndarray, fixed: bool = False) -> Fitted:
    """Fit from the variances `variance` (q,) on, or with them if `fixed`.

    Estimated variances are at most the squares of `widest` of the gram. A start of 0 stays 0.
    """
    variance, q = variance.copy(), gram.random
    for _ in range(0 if fixed else _ITERATIONS):
        marginal, _, _ = marginalise(gram, variance)
        coefficients, covariance = solve(gram, marginal)
        own = marginal[:, :q, :-1]
        # The slope of the restricted likelihood in a variance is half the difference of squares and trace.
        squares = ((marginal[:, :q, -1] - own @ coefficients) ** 2).sum(axis=0)
        trace = np.einsum("nkk->k", marginal[:, :q, :q]) - (own @ covariance * own).sum(axis=(0, 2))
        factor = np.sqrt(squares / np.maximum(trace, _TINY))
        # What a variance contributes to the likelihood is of the order of variance * trace.
        matters = variance * trace > _MATTERS
        variance = np.minimum(variance * np.clip(factor, 1 / _LONGEST, _LONGEST), gram.widest**2)
        if np.all(np.abs(factor[matters] - 1) < _SETTLED):
            break
    marginal, logdet, spread = marginalise(gram, variance)
    coefficients, covariance = solve(gram, marginal)
    pull = gram.products[:, :q, -1] - gram.products[:, :q, :-1] @ coefficients
    each = (spread @ pull[..., None])[..., 0]
    return Fitted(gram, coefficients, covariance, variance, marginal, logdet, each)
