"""The noise of a sensor, from what a block leaves of its signal.

A signal shows its noise only in differences of neighbouring samples. Where the noise is strongly correlated these say
little about its power at low frequencies: correlations of 0.85 and 0.999 hardly differ in them, but by a factor of
10,000 in that power. What a block leaves has no signal, so that differences over more samples show the noise as well,
and how it is correlated. A block that lacks something leaves that, too: slowly, so that second differences lack it, or
suddenly in a few samples, which are left out.
"""

import numpy as np
import scipy

from slipstick.blocks.whitening import BlockNoise
from slipstick.calibration.noise import filtered, robust_std

Noise = tuple[float, float]
"""Standard deviation in the unit of the signal, and autocorrelation from sample to sample."""

LAGS = (1, 2, 4, 8)
"""Samples between those of a second difference. Correlations from 0.5 to 0.95 show in these; over more samples a
torque that is built up is no longer slow."""
_HIGHEST = 0.999
"""Largest magnitude of a correlation: a random walk has 1, and no variance."""


def noise_of(left: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> Noise:
    """Noise of the output of a block whose residuals are `left` (n, k), where `counted` (n, k).

    The variances of second differences are those of the sensor's autoregressive noise and of the integrated noise of
    the input, which is known from the assumed `noise`. Where too few samples count the output keeps the assumed noise.
    """
    observed = np.array([_variance(left, counted, lag) for lag in LAGS])
    if not np.all(observed > 0):
        return noise.std, noise.correlation
    walk = np.array([_walk(noise, counted, lag) for lag in LAGS])

    def off(values: np.ndarray) -> np.ndarray:
        own = np.exp(2 * values[0]) * np.array([filtered(_taps(lag), float(np.tanh(values[1]))) for lag in LAGS])
        return np.asarray(np.log((own + walk) / observed))

    most = float(np.arctanh(_HIGHEST))
    begun = np.clip([np.log(noise.std), np.arctanh(noise.correlation)], [-np.inf, -most], [np.inf, most])
    found = scipy.optimize.least_squares(off, begun, bounds=([-np.inf, -most], [np.inf, most])).x
    return float(np.exp(found[0])), float(np.tanh(found[1]))


def power(noise: Noise) -> float:
    """Power at low frequencies, in the square of the unit: the sum of all autocovariances."""
    std, rho = noise
    return std**2 * (1 + rho) / (1 - rho) if rho < 1 else np.inf


def _variance(left: np.ndarray, counted: np.ndarray, lag: int) -> float:
    """Variance of second differences over `lag` samples, 0 where there are none."""
    ends, middle = slice(2 * lag, None), slice(lag, -lag)
    every = counted[:, ends] & counted[:, middle] & counted[:, :-2 * lag]
    if not every.any():
        return 0.0
    return robust_std((left[:, ends] - 2 * left[:, middle] + left[:, :-2 * lag])[every]) ** 2


def _walk(noise: BlockNoise, counted: np.ndarray, lag: int) -> float:
    """Variance of second differences of the integrated noise of the input."""
    if noise.onto is None:
        return 0.0
    onto = float((noise.onto**2)[counted[:, 1:]].mean())
    sums = np.repeat([-1.0, 1.0], lag)
    return onto * noise.input_std**2 * filtered(sums, noise.input_correlation)


def _taps(lag: int) -> np.ndarray:
    taps = np.zeros(2 * lag + 1)
    taps[[0, lag, -1]] = 1.0, -2.0, 1.0
    return taps
