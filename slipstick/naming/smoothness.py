"""Priors of a measured law for where it is hardly determined: how large it is, and how much neighbours differ.

The coefficients of a fit have a prior of one width, which takes strong laws toward 0 in directions that the recordings
hardly determine, such as a mean that another parameter can take. The width for which the law is most likely follows
from the law itself (MacKay, Neural Comput. 4, 415, 1992).

The values of a law at its points are given the prior of a random walk: the steps from point to point are independent
and normal, with mean 0 and one variance. Its estimate from the law itself (the largest marginal likelihood) decides how
far neighbours tell what the recordings do not. Bands of such posteriors contain about as much of a fixed curve as they
state (Wahba, J. R. Stat. Soc. B 45, 133, 1983; Nychka, J. Am. Stat. Assoc. 83, 1134, 1988).
"""

import numpy as np

_EIGHTHS = np.arange(-16 * 8, 16 * 8 + 1) / 8
"""Natural logarithms of the ratios of variances that are tried, about the ratio at which the prior counts as much as
the recordings in the mean direction: from none of the steps to all of them."""
_ROUNDS, _SETTLED = 50, 1e-3
"""Rounds in which the width of a prior is found at most, and the relative change at which it is."""
_NOTHING = 1e-9
"""Share of the largest eigenvalue, or of what a prior tells, below which an eigenvalue, or what is told, is 0."""
_ROUNDING = 1e-15
"""Share of the largest variance below which a variance is a rounding error."""
_BRIDGE = 1 / 12
"""Mean squared deviation of a random walk in continuous time from its chords, over that of its second differences: a
sixth of the variance of a step, of which a second difference has twice."""


def widened(coefficients: np.ndarray, covariance: np.ndarray, precision: np.ndarray,
            unsettled: float = 0.0) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (c,) of a law and their covariance (c, c) with a wider prior, where they are larger than it expects.

    They were estimated with independent normal priors of mean 0 and this `precision` (c,), which is multiplied by the
    factor that is returned, at most 1. In each direction they may be as far from the most likely ones as a rise of the
    log-likelihood by `unsettled` nats is worth: where the recordings tell little, a wide prior would magnify that.
    """
    own = precision > 0
    root, before, likeliest = np.sqrt(precision[own]), covariance[np.ix_(own, own)], coefficients[own]
    # In axes in which the recordings and the prior tell each coordinate by itself, and the prior with variance 1.
    shares, axes = np.linalg.eigh(root[:, None] * before * root)
    told, at, factor = np.maximum(1 / shares - 1, 0.0), axes.T @ (root * likeliest) / shares, 1.0
    known = told / (told + 2 * unsettled + _NOTHING)
    told, at = known * told, known * at
    for _ in range(_ROUNDS):
        variance = 1 / (told + factor)
        determined, size = len(told) - factor * variance.sum(), float(((variance * at) ** 2).sum())
        last, factor = factor, determined / size if size > determined > 0 else 1.0
        if abs(factor / last - 1) < _SETTLED:
            break
    axes = axes / root[:, None]
    change = np.eye(len(precision))[:, own]  # of all with their own: the others follow as they are correlated
    change[~own] = np.linalg.solve(before, covariance[np.ix_(own, ~own)]).T
    wider = (axes * variance) @ axes.T - before
    return coefficients + change @ (axes @ (variance * at) - likeliest), covariance + change @ wider @ change.T, factor


def smoothed(onto: np.ndarray, coefficients: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (c,) of a law and their covariance (c, c), when its values also have the prior of a random walk.

    `onto` (m, c) gives the values at the m points.
    """
    steps = np.diff(onto, axis=0)
    # In axes in which each coordinate is told with variance 1, and the prior has no correlation.
    variance, axes = np.linalg.eigh(covariance)
    variance = np.maximum(variance, _ROUNDING * variance.max())
    axes, at = (axes * np.sqrt(variance)).T, (axes / np.sqrt(variance)).T @ coefficients
    rough, turn = np.linalg.eigh(axes @ (steps.T @ steps) @ axes.T)
    axes, at, rough = turn.T @ axes, turn.T @ at, np.where(rough > _NOTHING * rough.max(), rough, 0.0)
    kept = rough[rough > 0]
    if not len(kept):  # the same value at all points
        return coefficients, covariance
    ratios = np.exp(_EIGHTHS) / np.exp(np.log(kept).mean())
    weights = 1 + ratios[:, None] * rough
    evidence = len(kept) * np.log(ratios) - np.log(weights).sum(axis=1) + (at**2 / weights).sum(axis=1)
    best = weights[np.argmax(evidence)]
    return axes.T @ (at / best), (axes.T / best) @ axes


def between_points(change: np.ndarray, covariance: np.ndarray) -> float:
    """Standard deviation of a law from its chords between points with these values (m,), whose covariance is (m, m).

    It follows from the second differences of the values, less what their errors contribute: 0 for a straight line.
    """
    if len(change) < 3:
        return 0.0
    second = np.diff(np.eye(len(change)), 2, axis=0)
    squares = (second @ change) ** 2 - np.einsum("ij,jk,ik->i", second, covariance, second)
    return float(np.sqrt(_BRIDGE * max(squares.mean(), 0.0)))

