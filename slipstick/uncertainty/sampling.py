"""Seeded quasi-random standard normals, and the density of measured times by averaging over samples."""

from functools import lru_cache

import numpy as np
import scipy

from slipstick.errors import InvalidValue

_MOST_SAMPLES = 1 << 30  # number of different points of scipy's Sobol sequences
_NEGLIGIBLE = -700.0  # natural log relative to the largest term; smaller terms are subnormal, which is slow


@lru_cache(maxsize=8)
def standard_normals(dimension: int, count: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points of N(0, I), shape (count, dimension), read-only and reproducible from the seed.

    Raises `InvalidValue` unless `count` is a power of two, which the balance of Sobol points requires, or for too many.
    """
    if count > _MOST_SAMPLES:
        raise InvalidValue(f"{count} samples are too many", f"Take at most {_MOST_SAMPLES}; 4096 suffice for most uses")
    if count < 1 or count & (count - 1):
        raise InvalidValue(f"The number of samples, {count}, is not a power of two", "Take 1024, 2048, 4096 and so on")
    normals: np.ndarray = scipy.stats.qmc.MultivariateNormalQMC(np.zeros(dimension), rng=seed).random(count)
    normals.flags.writeable = False
    return normals


def log10_mean_density(outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 of the mean over m samples of N(times; outputs, output_std^2), per ms: shape (n,).

    Shapes: `outputs` (m, n) s, `times` (n,) s. A NaN sample has a density of 0; the result is -inf if all are NaN.
    """
    exponents = (outputs - times) / output_std
    exponents *= exponents
    exponents *= -0.5
    exponents[np.isnan(exponents)] = -np.inf
    top = exponents.max(axis=0)
    exponents -= np.where(np.isfinite(top), top, 0.0)
    np.maximum(exponents, _NEGLIGIBLE, out=exponents)
    log_mean = top + np.log(np.exp(exponents, out=exponents).mean(axis=0))
    return np.asarray((log_mean - np.log(output_std * np.sqrt(2 * np.pi))) / np.log(10.0) - 3.0)
