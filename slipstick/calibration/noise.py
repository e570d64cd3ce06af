"""The noise of each channel: standard deviation, and autocorrelation from sample to sample."""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.errors import InvalidValue

_HIGHEST = 0.999
"""Largest magnitude of an autocorrelation: a random walk has 1, whose variance is infinite."""
_KEPT = 0.8
"""Share of the smallest values in a standard deviation that jumps do not reach. The median absolute value would be a
multiple of the resolution of the sensor."""
_THIRD, _LAGGED = np.array([1.0, -3.0, 3.0, -1.0]), np.array([1.0, -2.0, 0.0, 2.0, -1.0])


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of the channels: standard deviation `std` (channels,), in their units, and `correlation` (channels,).

    The noise is a first-order autoregressive process: its correlation over j samples is correlation^j.
    """

    std: np.ndarray
    correlation: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """Weights (channels, 3) of the three products of `linearised` in x' V^-1 y, V the covariance of the noise."""
        rho = self.correlation
        scale = 1 / (self.std**2 * (1 - rho**2))
        return np.asarray(scale[:, None] * np.stack([np.ones_like(rho), rho**2, -rho], axis=1))

    def moved(self, other: "Noise", share: float) -> "Noise":
        """The noise a share of the way to another, in variance and correlation."""
        variance = self.std**2 + share * (other.std**2 - self.std**2)
        return Noise(np.sqrt(variance), self.correlation + share * (other.correlation - self.correlation))


def most_likely(products: np.ndarray, counts: np.ndarray) -> Noise:
    """The noise of channels from the three products of their residuals (channels, 3) and counts (channels, 2)."""
    fitted = [_autoregressive(*one, *its) for one, its in zip(products, counts, strict=True)]
    return Noise(*np.array(fitted).T)


def _autoregressive(every: float, inner: float, across: float, samples: float, pairs: float) -> tuple[float, float]:
    def variance(rho: float) -> float:
        return float((every + rho**2 * inner - rho * across) / ((1 - rho**2) * samples))

    def height(rho: float) -> float:
        return float(samples * np.log(variance(rho)) + pairs * np.log1p(-(rho**2)))

    if pairs == 0:
        return float(np.sqrt(variance(0.0))), 0.0
    rho = float(scipy.optimize.minimize_scalar(height, bounds=(-_HIGHEST, _HIGHEST), method="bounded").x)
    return float(np.sqrt(variance(rho))), rho


def sensor_noise(name: str, values: np.ndarray) -> tuple[float, float]:
    """Standard deviation and autocorrelation of the noise in rows (n, k), of a signal or of residuals.

    From the third differences and the sums of two successive ones: a smooth signal does not reach either, and jumps are
    rare. `name` is that of the signal in the error message: raises `InvalidValue` if there
    is no noise.
    """
    third, lagged = (robust_std(np.apply_along_axis(np.convolve, 1, values, taps, "valid"))
                     for taps in (_THIRD, _LAGGED))
    if not third > 0:
        raise InvalidValue(f"The signal {name} shows no noise, so its residuals cannot be weighted",
                           "Record it with a finer resolution, or add the noise of its sensor")

    def excess(rho: float) -> float:
        return filtered(_LAGGED, rho) * third**2 - filtered(_THIRD, rho) * lagged**2

    low, high = excess(-_HIGHEST), excess(_HIGHEST)
    rho = scipy.optimize.brentq(excess, -_HIGHEST, _HIGHEST) if low < 0 < high else (
        _HIGHEST if high <= 0 else -_HIGHEST)
    return third / np.sqrt(filtered(_THIRD, rho)), float(rho)


def robust_std(values: np.ndarray) -> float:
    """Standard deviation of normal values from the smallest ones."""
    squares = values.ravel() ** 2
    kept = int(_KEPT * len(squares))
    edge = scipy.stats.norm.ppf(0.5 + 0.5 * _KEPT)
    # The share of the variance that the smallest values of a normal variable have.
    share = 1 - 2 * edge * scipy.stats.norm.pdf(edge) / _KEPT
    return float(np.sqrt(np.partition(squares, kept)[:kept].mean() / share))


def filtered(taps: np.ndarray, rho: float) -> float:
    """Variance of an autoregressive process of variance 1 after a filter."""
    lags = np.abs(np.subtract.outer(np.arange(len(taps)), np.arange(len(taps))))
    return float(taps @ np.power(rho, lags) @ taps)
