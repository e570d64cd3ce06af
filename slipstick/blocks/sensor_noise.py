"""The noise of a sensor, from its signal, and from what a block leaves of it.

A signal shows its noise only in differences of neighbouring samples. Where the noise is strongly correlated these say
little about its power at low frequencies: correlations of 0.85 and 0.999 hardly differ in them, but by a factor of
10,000 in that power. What a block leaves has no signal, so that differences over more samples show the noise as well,
and how it is correlated. A block that lacks something leaves that, too: slowly, so that second differences lack it, or
suddenly in a few samples, which are left out.
"""

import numpy as np
import scipy

from slipstick.blocks.whitening import BlockNoise
from slipstick.engine.noise import filter_variance, robust_std, second_taps, second_variance
from slipstick.errors import InvalidValue

Noise = tuple[float, float]
"""Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""

_LAGS = (1, 2, 4, 8)
"""Samples between those of a second difference. Correlations from 0.5 to 0.95 show in these; over more samples a
torque that is built up is no longer slow."""
_BEGIN = 0.9
"""Largest magnitude of an autocorrelation to begin a fit with. Beyond it second differences hardly depend on the
correlation: fits that began at 0.999 ended there, with a power at low frequencies that was 50,000 times too high."""
HIGHEST = 0.999
"""Largest magnitude of an autocorrelation: a random walk has 1, whose variance is infinite."""
_LEAST = 0.1
"""Least standard deviation, over the least that could by itself give the second differences of neighbouring samples.
Where the integrated noise of the input exceeds all that is left of a speed, its sensor would have no noise at all."""
_THIRD, _LAGGED = np.array([1.0, -3.0, 3.0, -1.0]), np.array([1.0, -2.0, 0.0, 2.0, -1.0])


def sensor_noise(name: str, values: np.ndarray) -> Noise:
    """Standard deviation and autocorrelation of the noise in rows (n, k) of a signal.

    From the third differences and the sums of two successive ones: a smooth signal does not reach either, and jumps are
    rare. `name` is that of the signal in the error message: raises `InvalidValue` if there is no noise.
    """
    third, lagged = (robust_std(np.apply_along_axis(np.convolve, 1, values, taps, "valid"))
                     for taps in (_THIRD, _LAGGED))
    if not third > 0:
        raise InvalidValue(f"The signal {name} shows no noise, so its residuals cannot be weighted",
                           "Record it with a finer resolution, or add the noise of its sensor")

    def excess(rho: float) -> float:
        return filter_variance(_LAGGED, rho) * third**2 - filter_variance(_THIRD, rho) * lagged**2

    low, high = excess(-HIGHEST), excess(HIGHEST)
    rho = scipy.optimize.brentq(excess, -HIGHEST, HIGHEST) if low < 0 < high else (
        HIGHEST if high <= 0 else -HIGHEST)
    return third / np.sqrt(filter_variance(_THIRD, rho)), float(rho)


def noise_of(left: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> Noise:
    """Noise of the output of a block whose residuals are `left` (n, k), where `counted` (n, k).

    The variances of second differences are those of the sensor's autoregressive noise and of the integrated noise of
    the input, which is known from the assumed `noise`. Where too few samples count the output keeps the assumed noise.
    """
    observed = np.array([second_variance(left, counted, lag) for lag in _LAGS])
    if not np.all(observed > 0):
        return noise.std, noise.correlation
    walk = np.array([_walk_variance(noise, counted, lag) for lag in _LAGS])

    def log_ratios(values: np.ndarray) -> np.ndarray:
        rho = float(np.tanh(values[1]))
        own = np.exp(2 * values[0]) * np.array([filter_variance(second_taps(lag), rho) for lag in _LAGS])
        return np.asarray(np.log((own + walk) / observed))

    most = float(np.arctanh(HIGHEST))
    least = float(np.log(_LEAST * np.sqrt(observed[0] / filter_variance(second_taps(1), -1.0))))
    bounds = (least, -most), (np.inf, most)
    correlation = float(np.clip(noise.correlation, -_BEGIN, _BEGIN))
    begun = np.clip([0.5 * np.log(observed[0] / filter_variance(second_taps(1), correlation)), np.arctanh(correlation)],
                    *bounds)
    estimate = scipy.optimize.least_squares(log_ratios, begun, bounds=bounds).x
    return float(np.exp(estimate[0])), float(np.tanh(estimate[1]))


def power(noise: Noise) -> float:
    """Power at low frequencies, in the square of the unit: the sum of all autocovariances."""
    std, rho = noise
    return std**2 * (1 + rho) / (1 - rho) if rho < 1 else np.inf


def added(first: Noise, second: Noise) -> Noise:
    """The sum of two autoregressive processes, as one of the same variance and first lag."""
    (std, rho), (other_std, other_rho) = first, second
    variance = std**2 + other_std**2
    return float(np.sqrt(variance)), float((std**2 * rho + other_std**2 * other_rho) / variance)


def in_common(left: np.ndarray, groups: np.ndarray) -> Noise:
    """What rows (n, k) of one of the `groups` (n,) leave in common, which is no noise: products of different rows.

    The noise of different rows is independent, so that none is in these, however well its own variance is known.
    """
    variance, lagged, count = 0.0, 0.0, 0
    for group in np.unique(groups):
        rows = left[groups == group]
        total, size = rows.sum(axis=0), len(rows)
        variance += float(total @ total - (rows**2).sum())
        lagged += float(total[1:] @ total[:-1] - (rows[:, 1:] * rows[:, :-1]).sum())
        count += size * (size - 1) * len(total)
    if not variance > 0:
        return 0.0, 0.0
    return float(np.sqrt(variance / count)), float(np.clip(lagged / variance, 0.0, HIGHEST))


def _walk_variance(noise: BlockNoise, counted: np.ndarray, lag: int) -> float:
    """Variance of second differences of the integrated noise of the input."""
    if noise.onto is None:
        return 0.0
    onto = float((noise.onto**2)[counted[:, 1:]].mean())
    sums = np.repeat([-1.0, 1.0], lag)
    return onto * noise.input_std**2 * filter_variance(sums, noise.input_correlation)
