"""The linear mixed model of whitened engagements, in small matrices.

An engagement i has whitened columns R_i (random), F_i (fixed) and the residual y_i, of which only the products
G_i = [R F y]' [R F y] enter:

    y_i = R_i b_i + [R_i F_i] c + e_i,   b_i ~ N(0, diag(variance)),   e_i ~ N(0, 1),   c ~ N(prior)

The variances are estimated by restricted maximum likelihood with the minorisation-maximisation steps of Zhou, Hu, Zhou
and Lange (J. Comput. Graph. Stat. 28, 350, 2019), which never lower the likelihood and keep variances positive.
"""

from dataclasses import dataclass, replace

import numpy as np

_ITERATIONS = 60
_SETTLED = 1e-3  # relative change of every variance that matters


@dataclass(frozen=True, eq=False)
class Gram:
    """`products` (n, c, c) of q random columns, c - q - 1 fixed ones, and the residual last.

    `precision` (c - 1,) and `target` (c - 1,) are those of the normal prior of the coefficients c; precision 0: none.
    """

    products: np.ndarray
    random: int
    precision: np.ndarray
    target: np.ndarray
    widest: np.ndarray

    def __len__(self) -> int:
        return len(self.products)

    def keep(self, columns: np.ndarray) -> "Gram":
        """Only these fixed columns, (m,) indices from the first fixed one on; all random ones and the residual stay."""
        chosen = np.concatenate([np.arange(self.random), self.random + np.asarray(columns, int)])
        rows = np.append(chosen, self.products.shape[1] - 1)
        return Gram(self.products[:, rows[:, None], rows], self.random, self.precision[chosen], self.target[chosen], self.widest)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Estimated `coefficients` (c - 1,), their `covariance`, and the `variance` (q,) of the random effects.

    `each` (n, q) are the predicted random effects, `marginal` (n, c, c) the products under the marginal covariance,
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
        """Log-likelihood (n,) of the engagements, up to a constant of the data."""
        return likelihood(self.marginal, self.logdet, self.coefficients)

    @property
    def squares(self) -> np.ndarray:
        """Sum of squared whitened residuals (n,) after the random effects of each engagement."""
        left = np.concatenate([-self.each - self.coefficients[:self.gram.random],
                               np.tile(-self.coefficients[self.gram.random:], (len(self.each), 1)),
                               np.ones((len(self.each), 1))], axis=1)
        return np.einsum("np,npq,nq->n", left, self.gram.products, left)


def likelihood(marginal: np.ndarray, logdet: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) of engagements at coefficients (c - 1,)."""
    left = np.append(-coefficients, 1.0)
    return np.asarray(-0.5 * (np.einsum("p,npq,q->n", left, marginal, left) + logdet))


def marginalise(gram: Gram, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Products under the marginal covariance (n, c, c), log-determinants (n,), and covariances (n, q, q) of b_i."""
    q, root = gram.random, np.sqrt(variance)
    inner = np.eye(q) + root[:, None] * gram.products[:, :q, :q] * root
    spread = root[:, None] * np.linalg.inv(inner) * root
    through = gram.products[:, :, :q] @ spread
    return gram.products - through @ gram.products[:, :q], np.linalg.slogdet(inner)[1], spread


def solve(gram: Gram, marginal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Generalized least squares: coefficients and their covariance."""
    information = marginal[:, :-1, :-1].sum(axis=0) + np.diag(gram.precision)
    pull = marginal[:, :-1, -1].sum(axis=0) + gram.precision * gram.target
    scale = 1 / np.sqrt(np.diag(information))
    inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    return inverse @ pull, inverse


def estimate(gram: Gram, variance: np.ndarray, fixed: bool = False) -> Fitted:
    """Fit from `variance` (q,) on, or with it if `fixed`."""
    variance, q = variance.copy(), gram.random
    for _ in range(0 if fixed else _ITERATIONS):
        marginal, _, _ = marginalise(gram, variance)
        coefficients, covariance = solve(gram, marginal)
        left = marginal[:, :q, -1] - marginal[:, :q, :-1] @ coefficients
        own = marginal[:, :q, :-1]
        trace = np.einsum("nkk->k", marginal[:, :q, :q]) - np.einsum("nkp,pr,nkr->k", own, covariance, own)
        factor = np.sqrt((left**2).sum(axis=0) / np.maximum(trace, 1e-300))
        # What a variance contributes to the likelihood is of the order of variance * trace: less does not matter.
        matters = variance * trace > 1e-3
        variance = np.minimum(variance * np.clip(factor, 0.1, 10), gram.widest**2)
        if np.all(np.abs(factor[matters] - 1) < _SETTLED * 10):
            break
    marginal, logdet, spread = marginalise(gram, variance)
    coefficients, covariance = solve(gram, marginal)
    pull = gram.products[:, :q, -1] - gram.products[:, :q, :-1] @ coefficients
    each = (spread @ pull[..., None])[..., 0]
    return Fitted(gram, coefficients, covariance, variance, marginal, logdet, each)


def without(gram: Gram, rows: np.ndarray) -> Gram:
    """The engagements that are not `rows`."""
    return replace(gram, products=np.delete(gram.products, rows, axis=0))
