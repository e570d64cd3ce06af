"""Seeded samples of standard normals, and the density of measured times by sampling."""

from functools import lru_cache

import numpy as np
from scipy.stats import qmc

from slipstick.errors import InvalidValue

_NEGLIGIBLE = -700.0  # natural log: a sample this far below the nearest adds nothing, and subnormal numbers are slow


@lru_cache(maxsize=8)
def standard_normals(dimension: int, count: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points of N(0, I), shape (count, dimension), read-only; the same for the same seed.

    Raises `InvalidValue` unless `count` is a power of two: other counts of Sobol points are out of balance.
    """
    if count < 1 or count & (count - 1):
        raise InvalidValue(f"{count} samples are no power of two", "Take 1024, 2048, 4096 and so on")
    germs: np.ndarray = qmc.MultivariateNormalQMC(np.zeros(dimension), rng=seed).random(count)
    germs.flags.writeable = False
    return germs


def log10_mean_density(outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 of the mean over m samples of N(times; outputs, output_std^2), per ms: shape (n,).

    Shapes: `outputs` (m, n) s, `times` (n,) s. NaN samples count as 0; -inf where all are NaN.
    """
    exponents = (outputs - times) / output_std
    exponents *= exponents
    exponents *= -0.5
    exponents[np.isnan(exponents)] = -np.inf
    top = exponents.max(axis=0)
    exponents -= np.where(np.isfinite(top), top, 0.0)
    np.maximum(exponents, _NEGLIGIBLE, out=exponents)
    log_mean = top + np.log(np.exp(exponents, out=exponents).mean(axis=0))
    density: np.ndarray = (log_mean - np.log(output_std * np.sqrt(2 * np.pi))) / np.log(10.0) - 3.0
    return density
