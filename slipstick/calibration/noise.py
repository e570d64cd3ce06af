"""The noise of each channel: standard deviation, and autocorrelation from sample to sample."""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.blocks.sensor_noise import HIGHEST


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

    def move(self, other: "Noise", share: float) -> "Noise":
        """The noise a share of the way to another, in variance and correlation."""
        variance = self.std**2 + share * (other.std**2 - self.std**2)
        return Noise(np.sqrt(variance), self.correlation + share * (other.correlation - self.correlation))


def fit_noise(products: np.ndarray, counts: np.ndarray) -> Noise:
    """The noise of channels from the three products of their residuals (channels, 3) and counts (channels, 2)."""
    fitted = [_fit_autoregressive(*product, *count) for product, count in zip(products, counts, strict=True)]
    return Noise(*np.array(fitted).T)


def _fit_autoregressive(every: float, inner: float, across: float, samples: float, pairs: float) -> tuple[float, float]:
    def variance(rho: float) -> float:
        return float((every + rho**2 * inner - rho * across) / ((1 - rho**2) * samples))

    def height(rho: float) -> float:
        return float(samples * np.log(variance(rho)) + pairs * np.log1p(-(rho**2)))

    if pairs == 0:
        return float(np.sqrt(variance(0.0))), 0.0
    rho = float(scipy.optimize.minimize_scalar(height, bounds=(-HIGHEST, HIGHEST), method="bounded").x)
    return float(np.sqrt(variance(rho))), rho
