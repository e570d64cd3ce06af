"""The linear mixed model of linearised engagements: z_i = J_i beta_i + e_i, beta_i ~ N(mean, diag(variance)).

The engagement i enters through A_i = J_i' V^-1 J_i and a_i = J_i' V^-1 z_i, V the covariance of its noise. Generalized
least squares gives the mean, restricted maximum likelihood the variances (Patterson and Thompson, Biometrika 58, 545,
1971), the best linear unbiased prediction the beta_i. In directions that the engagements do not determine, the mean is
held where it was at the start.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.calibration.identification import complete, find_undetermined, known_from, projector
from slipstick.engine.linear_model import integrated

_UNTOLD = 1e-9
"""Information on a variance, as a share of that of its range, below which the variance stays as it was."""
_SCORINGS, _SETTLED = 200, 1e-6
"""Most steps of Fisher scoring, and the expected rise of the log-likelihood below which it ends."""


@dataclass(frozen=True, eq=False)
class Engagements:
    """`information` A_i (n, d, d) and `pull` a_i (n, d) of n engagements, with bounds (d,) of the mean.

    The mean differs from `start` (d,) in no direction that is `held` (d, q), as `identification.find_undetermined` has
    them.
    """

    information: np.ndarray
    pull: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray
    held: np.ndarray

    @property
    def known(self) -> np.ndarray:
        """Standard deviations (d,) of the parameters within their bounds."""
        return known_from(self.lower, self.upper)

    @property
    def widest(self) -> np.ndarray:
        """Largest variances (d,): three standard deviations to either side fit between the bounds, as runs must."""
        return np.asarray(((self.upper - self.lower) / 6) ** 2)


@dataclass(frozen=True, eq=False)
class RandomEffects:
    """Estimated `mean` (d,) and `variance` (d,) between engagements; `covariance`, `uncertainty` (d, d) are theirs.

    `each` (n, d) are the predicted beta_i, `posterior` (n, d, d) their covariance given the data. `marginal` (n, d, d)
    is J_i' (V + J_i diag(variance) J_i')^-1 J_i. `covariance` has the variance that the bounds leave to the directions
    `held` (d, q).
    """

    mean: np.ndarray
    covariance: np.ndarray
    variance: np.ndarray
    uncertainty: np.ndarray
    each: np.ndarray
    posterior: np.ndarray
    marginal: np.ndarray
    held: np.ndarray

    @property
    def undetermined(self) -> np.ndarray:
        """Which means (d,) have more than half of their variance from bounds and not from the engagements."""
        return np.asarray((self.held**2).sum(axis=1) > 0.5 * np.diag(self.covariance))

    @property
    def standard_error(self) -> np.ndarray:
        """Of the mean, (d,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def scatter(self) -> np.ndarray:
        """Standard deviations between engagements, (d,)."""
        return np.asarray(np.sqrt(self.variance))

    @property
    def scatter_error(self) -> np.ndarray:
        """How much larger the scatter is where its variance is larger by one standard error, (d,).

        It is the usual standard error where there is much scatter, and finite where none is found.
        """
        return np.asarray(np.sqrt(self.variance + np.sqrt(np.diag(self.uncertainty))) - self.scatter)

    @property
    def degrees_of_freedom(self) -> np.ndarray:
        """Of each variance of the mean, by Satterthwaite's approximation (Biometrics Bulletin 2, 110, 1946): (d,)."""
        estimated = self.covariance - self.held @ self.held.T
        slopes = ((estimated @ self.marginal) ** 2).sum(axis=0)  # of covariance[k, k] in variance[l]
        spread = np.einsum("kl,lm,km->k", slopes, self.uncertainty, slopes)
        return np.asarray(2 * np.diag(self.covariance) ** 2 / np.maximum(spread, np.finfo(float).tiny))

    def intervals(self, level: float) -> np.ndarray:
        """Of the mean, (d, 2), from Student's distribution."""
        half = scipy.stats.t.ppf(0.5 + 0.5 * level, np.maximum(self.degrees_of_freedom, 1.0)) * self.standard_error
        return np.stack([self.mean - half, self.mean + half], axis=1)


def estimate(engagements: Engagements, variance: np.ndarray) -> RandomEffects:
    """Estimate by Fisher scoring from `variance` (d,) on, between 0 and `widest` of the engagements."""
    variance = np.minimum(variance, engagements.widest)
    likelihood, step = _restricted_likelihood(engagements, variance), np.zeros_like(variance)
    ranges = known_from(np.zeros_like(variance), engagements.widest)
    for _ in range(_SCORINGS):
        slope, expected = _slope(engagements, variance)
        untold = np.diag(expected) * ranges**2 < _UNTOLD
        expected = expected + np.diag(np.where(untold, 1 / ranges**2, 0.0))
        scale = np.sqrt(np.diag(expected))
        scaled = expected / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(scaled)
        root = np.sqrt(np.maximum(values, 1e-12))[:, None] * vectors.T
        room = (engagements.widest - variance) * scale + 1e-300
        bounds = -variance * scale - 1e-300, room
        step = scipy.optimize.lsq_linear(root, np.linalg.solve(root.T, slope / scale), bounds).x / scale
        rise = float(slope @ step - 0.5 * step @ expected @ step)
        if rise < _SETTLED:
            break
        share = 1.0
        while share > 1e-3:
            tried = np.clip(variance + share * step, 0.0, engagements.widest)
            tried_likelihood = _restricted_likelihood(engagements, tried)
            if tried_likelihood > likelihood:
                break
            share *= 0.5
        else:
            break
        variance, likelihood = tried, tried_likelihood
    return predicted(engagements, variance)


def predicted(engagements: Engagements, variance: np.ndarray) -> RandomEffects:
    """The mean and the beta_i for given variances."""
    marginal, pull, gain, _ = marginals(engagements, variance)
    information, _, mean = _mean(engagements, marginal, pull)
    covariance = np.linalg.inv(information)
    estimated = covariance - engagements.held @ engagements.held.T
    each = mean + variance * (pull - marginal @ mean)
    kept = np.eye(len(variance)) - variance[:, None] * marginal
    posterior = gain + kept @ estimated @ kept.transpose(0, 2, 1)
    known = known_from(np.zeros_like(variance), engagements.widest)
    expected = _slope(engagements, variance)[1]
    uncertainty = np.linalg.pinv(complete(expected, find_undetermined(expected, known), known), hermitian=True)
    return RandomEffects(mean, covariance, variance, uncertainty, each, posterior, marginal, engagements.held)


def marginals(engagements: Engagements, variance: np.ndarray) -> tuple[np.ndarray, ...]:
    """J' W^-1 J and J' W^-1 z, W = V + J diag(variance) J', the covariance of beta_i - mean given data and mean, and
    the log-determinants (n,) of V^-1 W."""
    information = engagements.information
    gain, logdet = integrated(information, variance)
    through = information @ gain
    return (information - through @ information, engagements.pull - (through @ engagements.pull[..., None])[..., 0],
            gain, logdet)


def _mean(engagements: Engagements, marginal: np.ndarray,
          pull: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Information (d, d) of the mean, its product with the mean (d,) without bounds, and the mean (d,) within bounds.

    In directions that are held the information is that of the bounds.
    """
    own, held, known = marginal.sum(axis=0), engagements.held, engagements.known
    information, free = complete(own, held, known), projector(held, known)
    score = free.T @ pull.sum(axis=0) + (information - free.T @ own) @ engagements.start
    return information, score, _bounded_mean(information, score, engagements.lower, engagements.upper)


def _restricted_likelihood(engagements: Engagements, variance: np.ndarray) -> float:
    """Restricted log-likelihood, without what does not depend on the variances."""
    marginal, pull, gain, logdet = marginals(engagements, variance)
    information, score, mean = _mean(engagements, marginal, pull)
    square = -np.einsum("np,npq,nq->", engagements.pull, gain, engagements.pull) - 2 * score @ mean
    square += mean @ information @ mean
    return float(-0.5 * (square + logdet.sum() + np.linalg.slogdet(information)[1]))


def _slope(engagements: Engagements, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope (d,) and expected information (d, d) of the restricted log-likelihood in the variances."""
    marginal, pull, *_ = marginals(engagements, variance)
    information, _, mean = _mean(engagements, marginal, pull)
    left = pull - marginal @ mean
    covariance = np.linalg.inv(information) - engagements.held @ engagements.held.T
    through = marginal @ covariance
    own = through @ marginal
    slope = 0.5 * ((left**2).sum(axis=0) - np.einsum("ndd->d", marginal - own))
    # 0.5 trace(P Z_k Z_k' P Z_l Z_l'), where P has the blocks marginal_i - marginal_i covariance marginal_m.
    squares = np.einsum("nkp,nkq->kpq", marginal, marginal) @ covariance
    expected = (marginal**2).sum(axis=0) - 2 * (marginal * own).sum(axis=0) + np.einsum("kpq,lqp->kl", squares, squares)
    return slope, 0.5 * expected


def _bounded_mean(information: np.ndarray, score: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The mean of most likelihood within the bounds."""
    mean = np.linalg.solve(information, score)
    if np.all((mean >= lower) & (mean <= upper)):
        return np.asarray(mean)
    scale = np.sqrt(np.diag(information))
    root = np.linalg.cholesky(information / np.outer(scale, scale)).T
    target = np.linalg.solve(root.T, score / scale)
    bounded = scipy.optimize.lsq_linear(root, target, (lower * scale, upper * scale)).x / scale
    return np.asarray(np.clip(bounded, lower, upper))
