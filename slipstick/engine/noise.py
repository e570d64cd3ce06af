"""The noise of a sensor, from its signal, and from what a fit leaves of it.

A signal shows its noise only in differences of neighbouring samples, which say little of strongly correlated noise.
What a fit leaves has no signal, so that differences over more samples show the noise as well. A model that lacks
something leaves that, too: slowly, so that second differences lack it, or suddenly in a few samples, which are left
out.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.errors import InvalidValue

_LAGS = (1, 2, 4, 8)
"""Samples between those of a second difference."""
_BEGIN, HIGHEST = 0.9, 0.999
"""Largest magnitude of an autocorrelation by differences of neighbours, which hardly depend on a larger one, and at
all: a random walk has 1."""
_LEAST = 0.1
"""Least standard deviation, over the least that could by itself give the second differences of neighbouring samples."""
_KEPT = 0.8
"""Share of the smallest values in a standard deviation that jumps do not reach. The median absolute value would be a
multiple of the resolution of the sensor."""
_SECOND_ERROR = 6.0
"""Sampling variance of the logarithm of the robust variance of second differences, times the number of samples: 1.8
times that of independent normal values (correlation of neighbouring differences, and the values that are left out)."""
_THIRD, _LAGGED = np.array([1.0, -3.0, 3.0, -1.0]), np.array([1.0, -2.0, 0.0, 2.0, -1.0])
_ROUNDED = 100.0
"""Spacings of floating point numbers below which differences of a signal are no noise, but rounding."""


@dataclass(frozen=True)
class Noise:
    """Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""

    std: float
    correlation: float

    @property
    def fresh(self) -> float:
        """Standard deviation of what is new in each sample."""
        return self.std * float(np.sqrt(1 - self.correlation**2))

    @property
    def power(self) -> float:
        """Power at low frequencies, in the square of the unit: the sum of all autocovariances."""
        return self.std**2 * (1 + self.correlation) / (1 - self.correlation)


def estimate_sensor_noise(name: str, values: np.ndarray) -> Noise:
    """Return the noise in rows (n, k) of the signal `name`, from third differences and sums of two successive ones.

    A smooth signal does not reach either, and jumps are rare. Raises `InvalidValue` if there is no noise.
    """
    third, lagged = (robust_std(_convolve(values, taps)) for taps in (_THIRD, _LAGGED))
    if not third > _ROUNDED * np.spacing(np.abs(values).max()):
        raise InvalidValue(f"The signal {name} shows no noise, so its residuals cannot be weighted",
                           "Record it with a finer resolution, or add the noise of its sensor")

    def excess(rho: float) -> float:
        return filter_variance(_LAGGED, rho) * third**2 - filter_variance(_THIRD, rho) * lagged**2

    low, high = excess(-HIGHEST), excess(HIGHEST)
    rho = scipy.optimize.brentq(excess, -HIGHEST, HIGHEST) if low < 0 < high else (
        HIGHEST if high <= 0 else -HIGHEST)
    rho = float(np.clip(rho, -_BEGIN, _BEGIN))
    return Noise(float(third / np.sqrt(filter_variance(_THIRD, rho))), rho)


def bound_noise(noise: Noise, values: np.ndarray) -> Noise:
    """Return a noise whose third differences are no larger than those of the signal (n, k) that it is a part of.

    What a fit leaves beyond that is missing in the model.
    """
    largest = robust_std(_convolve(values, _THIRD)) / np.sqrt(filter_variance(_THIRD, noise.correlation))
    return Noise(min(noise.std, float(largest)), noise.correlation)


def _convolve(values: np.ndarray, taps: np.ndarray) -> np.ndarray:
    return np.asarray(np.apply_along_axis(np.convolve, 1, values, taps, "valid"))


def estimate_residual_noise(left: np.ndarray, counted: np.ndarray, carried: np.ndarray | None, noise: Noise) -> Noise:
    """Return the noise of a sensor of whose signal a fit leaves `left` (n, k), where `counted` (n, k).

    `carried` (r, k) are draws of what the noise of measured inputs contributes. Where too few samples count, the sensor
    keeps its assumed `noise`.
    """
    observed = np.array([second_variance(left, counted, samples) for samples in _LAGS])
    if not np.all(observed > 0):
        return noise
    known = np.zeros(len(_LAGS)) if carried is None else np.array(
        [second_variance(carried, np.broadcast_to(counted[:len(carried)], carried.shape), samples)
         for samples in _LAGS])

    def log_ratios(values: np.ndarray) -> np.ndarray:
        rho = float(np.tanh(values[1]))
        own = np.exp(2 * values[0]) * np.array([filter_variance(second_taps(samples), rho) for samples in _LAGS])
        return np.asarray(np.log((own + known) / observed))

    most = float(np.arctanh(HIGHEST))
    least = float(np.log(_LEAST * np.sqrt(observed[0] / filter_variance(second_taps(1), -1.0))))
    bounds = (least, -most), (np.inf, most)
    correlation = float(np.clip(noise.correlation, -_BEGIN, _BEGIN))
    begin = np.clip([0.5 * np.log(observed[0] / filter_variance(second_taps(1), correlation)), np.arctanh(correlation)],
                    *bounds)
    estimate = scipy.optimize.least_squares(log_ratios, begin, bounds=bounds).x
    return Noise(float(np.exp(estimate[0])), float(np.tanh(estimate[1])))


def estimate_loudness(left: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the standard deviation (n,) of the noise in each row (n, k) over that in all, by second differences.

    Estimates are drawn to 1 by their sampling error, so that equal noise remains equal (empirical Bayes).
    """
    counts = np.maximum(counted.sum(axis=1), 3)
    own = np.array([second_variance(row[None], samples[None], 1) for row, samples in zip(left, counted, strict=True)])
    typical = float(np.median(own[own > 0])) if (own > 0).any() else 1.0
    ratio = np.log(np.maximum(own, 1e-300) / typical)
    ratio = np.where(own > 0, ratio, 0.0)
    error = _SECOND_ERROR / counts
    between = max(0.0, float(np.median((ratio - np.median(ratio)) ** 2) / 0.455 - np.median(error)))
    return np.asarray(np.exp(0.5 * ratio * between / (between + error)))


def draw_noise(noise: Noise, shape: tuple[int, int], random: np.random.Generator) -> np.ndarray:
    """Return noise (n, k)."""
    fresh = random.standard_normal(shape)
    fresh[:, 1:] *= np.sqrt(1 - noise.correlation**2)
    return np.asarray(noise.std * scipy.signal.lfilter([1], [1, -noise.correlation], fresh, axis=1))


def second_variance(values: np.ndarray, counted: np.ndarray, samples: int) -> float:
    """Variance of second differences over `samples`, 0 where there are none."""
    ends, middle = slice(2 * samples, None), slice(samples, -samples)
    every = counted[:, ends] & counted[:, middle] & counted[:, :-2 * samples]
    if not every.any():
        return 0.0
    return robust_std((values[:, ends] - 2 * values[:, middle] + values[:, :-2 * samples])[every]) ** 2


def second_taps(samples: int) -> np.ndarray:
    """Filter of second differences over `samples`."""
    taps = np.zeros(2 * samples + 1)
    taps[[0, samples, -1]] = 1.0, -2.0, 1.0
    return taps


def robust_std(values: np.ndarray) -> float:
    """Standard deviation of normal values from the smallest ones."""
    squares = values.ravel() ** 2
    kept = int(_KEPT * len(squares))
    edge = scipy.stats.norm.ppf(0.5 + 0.5 * _KEPT)
    # The share of the variance that the smallest values of a normal variable have.
    share = 1 - 2 * edge * scipy.stats.norm.pdf(edge) / _KEPT
    return float(np.sqrt(np.partition(squares, kept)[:kept].mean() / share))


def filter_variance(taps: np.ndarray, rho: float) -> float:
    """Variance of an autoregressive process of variance 1 after a filter."""
    lags = np.abs(np.subtract.outer(np.arange(len(taps)), np.arange(len(taps))))
    return float(taps @ np.power(rho, lags) @ taps)
