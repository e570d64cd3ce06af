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
the new c best is taken. A block whose slopes take many predictions then follows the curve by chords: with the slopes of
where the step began, the beta_i are corrected for the residuals of where they are (Ortega and Rheinboldt, Iterative
Solution of Nonlinear Equations in Several Variables, section 7.1, 1970). A common step that does not lower the first
two terms and the priors is taken again with more damping, so that none lowers the joint likelihood of the data, the
beta_i and c at the variances for which it was made. The determinant is not in it, which changes with J and the
variances: the evidence of an iteration can be below that of the one before, and the best one is returned.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.blocks.whitening import BlockNoise
from slipstick.engine.linear_model import REACH, Gram, estimate
from slipstick.naming.block import Pair, SearchedBlock
from slipstick.naming.curved_steps import DAMPING, Values, prior_of, scatter_of, squares_of, stepped
from slipstick.naming.fit import BlockFit, reduced
from slipstick.naming.linear_model import columns_of, part_of

_LEAST = 1e-4**2
"""Smallest variance of a parameter, relative to nominal squared: far below what recordings tell, and not singular."""

_FIRST_SCATTER, _OTHER_SCATTER = 0.01, 0.03
"""Standard deviations to begin with: that of the first parameter, which scales the output, is known best."""

_SPREADINGS, _SPREAD = 30, 0.01
"""Most steps of expectation-maximisation, and the relative change of the variances below which they end."""

SETTLED, _SETTLED_SHARE = 0.3, 0.01
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
        values, variance = Values(start.points, start.mean, shared, begun), start.variance
    else:
        points = np.zeros((n, q)) if points is None else points
        shared = np.zeros(len(block.fixed)) if shared is None else shared
        values = Values(points, points.mean(axis=0), shared, begun)
        variance = np.array([_FIRST_SCATTER, *[_OTHER_SCATTER] * (q - 1)]) ** 2
    noise = block.noise(values.points)
    last, damping, best = np.inf, DAMPING, None
    block = block.at(values.shared)
    for iteration in range(iterations + 1):
        predicted, own, gram = _linearised(block, values, noise)
        information = gram.products[:, :q, :q]
        if iteration or start is None:
            mean, variance = _spread(values.points, information, gram.precision[:q], block.widest, variance)
            values = replace(values, mean=mean)
        squares = squares_of(block, predicted, noise)
        cost = squares + scatter_of(values, variance)
        logdet = np.linalg.slogdet(np.eye(q) + information * variance)[1]
        prior = prior_of(values, gram)
        evidence = -0.5 * (cost + logdet + prior / n)
        if best is None or evidence.sum() > best.evidence.sum():
            best = CurvedFit(block, tuple(laws), values.points, values.shared, values.coefficients,
                             estimate(gram, variance, fixed=True), predicted, noise, values.mean, variance, evidence,
                             squares, False)
        settled = max(SETTLED, _SETTLED_SHARE * np.sqrt(n) * float(evidence.std()))
        at_rest = iteration > 1 and abs(evidence.sum() - last) < settled
        if iteration == iterations or at_rest:
            break
        last = evidence.sum()
        block, values, damping = stepped(block, values, gram, own, variance, noise, float(cost.sum() + prior),
                                         damping)
    assert best is not None
    return replace(best, converged=bool(at_rest))


def _linearised(block: SearchedBlock, values: Values, noise: BlockNoise) -> tuple[np.ndarray, np.ndarray, Gram]:
    """The prediction (n, k), its slopes (n, q, k) in the points, and the products of all slopes.

    The parameters themselves are the coefficients of the latter.
    """
    predicted = block.base(values.points, values.laws)
    columns = columns_of(block, values.points, values.shared, values.laws, predicted, list(values.coefficients))
    return predicted, columns.own, part_of(block, columns, noise).gram


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
