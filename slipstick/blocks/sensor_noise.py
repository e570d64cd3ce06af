"""The noise of a sensor, from its signal, and from what a block leaves of it.

A signal shows its noise only in differences of neighbouring samples. Where the noise is strongly correlated these say
little about its power at low frequencies: correlations of 0.85 and 0.999 hardly differ in them, but by a factor of
10,000 in that power. What a block leaves has no signal, so that differences over more samples show the noise as well,
and how it is correlated. A block that lacks something leaves that, too: slowly, so that second differences lack it, or
suddenly in a few samples, which are left out.
"""

import numpy as np

from slipstick.blocks.whitening import BlockNoise
from slipstick.engine.noise import HIGHEST as HIGHEST
from slipstick.engine.noise import (
    LAGS,
    Differences,
    SecondDifferences,
    estimate_residual_noise,
    filter_variance,
    second_variance,
)
from slipstick.engine.noise import Noise as SensorNoise

Noise = tuple[float, float]
"""Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""


def sensor_noise(name: str, values: np.ndarray) -> Noise:
    """Standard deviation and autocorrelation of the noise in rows (n, k) of a signal.

    From the third differences and the sums of two successive ones: a smooth signal does not reach either, and jumps are
    rare. `name` is that of the signal in the error message: raises `InvalidValue` if there is no noise.
    """
    shown = Differences.of_sensor(name, values)
    noise = shown.noise(shown.correlation)
    return noise.std, noise.correlation


def noise_of(left: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> Noise:
    """Noise of the output of a block whose residuals are `left` (n, k), where `counted` (n, k).

    The variances of second differences are those of the sensor's autoregressive noise and of the integrated noise of
    the input, which is known from the assumed `noise`. Where too few samples count the output keeps the assumed noise.
    """
    observed = np.array([[second_variance(left, counted, lag) for lag in LAGS]])
    if not np.all(observed > 0):
        return noise.std, noise.correlation
    walk = np.array([[_walk_variance(noise, counted, lag) for lag in LAGS]])
    [estimate], _ = estimate_residual_noise(SecondDifferences(LAGS, observed, walk, np.eye(len(LAGS))[None]),
                                            [SensorNoise(noise.std, noise.correlation)])
    return estimate.std, estimate.correlation


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
