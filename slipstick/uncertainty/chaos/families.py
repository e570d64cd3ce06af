"""The distribution families of an input (Table I and lognormal), parametrized by mean and std.

An input x is mapped to its normal score z by P(X <= x) = P(N(0, 1) <= z), and back. Both maps are accurate in either
tail.
"""

from typing import Literal, get_args

import numpy as np
import scipy

from slipstick.uncertainty.chaos import cornish_fisher
from slipstick.uncertainty.chaos.cornish_fisher import FARTHEST
from slipstick.uncertainty.chaos.germs import Germ

Family = Literal["normal", "lognormal", "gamma", "beta", "uniform"]
FAMILIES: tuple[Family, ...] = get_args(Family)
POSITIVE = ("lognormal", "gamma")
"""Families with positive values only."""
LARGEST = 1e6
"""Largest mean and std in multiples of nominal, and largest ratio of both for `POSITIVE` families: far beyond it, their
moments overflow."""
HERMITE = Germ("hermite")
_NARROW = 1e-7  # std, relative to the mean (gamma) or support (beta), below which a variable is treated as normal


def germ_of(family: Family, mean: float, std: float, support: np.ndarray) -> Germ:
    """The germ of the family; `support` (2,) holds the bounds of a beta variable.

    A lognormal variable is a function of the Hermite germ, because its own orthogonal polynomials are not complete.
    """
    if family == "gamma" and std > _NARROW * mean:
        return Germ("laguerre", ((mean / std) ** 2,))
    if family == "beta" and std > _NARROW * (support[1] - support[0]):
        return Germ("jacobi", beta_shape(mean, std, support))
    return Germ("legendre") if family == "uniform" and std > 0 else HERMITE


def from_score(family: Family, score: np.ndarray, mean: float, std: float, support: np.ndarray) -> np.ndarray:
    """Values at the normal scores `score`, same shape."""
    if family == "lognormal" and std > 0:
        log_mean, log_std = logarithm_moments(mean, std)
        return np.asarray(np.exp(log_mean + log_std * score))
    values = mean + std * germ_of(family, mean, std, support).of_normal(score)
    return values


def to_score(family: Family, values: np.ndarray, mean: float, std: float, support: np.ndarray) -> np.ndarray:
    """Normal scores of `values`, same shape, for a positive std. Values outside the support have a score of +-37."""
    score: np.ndarray
    if family == "lognormal":
        log_mean, log_std = logarithm_moments(mean, std)
        with np.errstate(divide="ignore"):
            score = (np.log(np.maximum(values, 0.0)) - log_mean) / log_std
        np.maximum(score, -FARTHEST, out=score)
        return score
    germ = germ_of(family, mean, std, support)
    if germ == HERMITE:
        score = (values - mean) / std
        return score
    if germ.cornish_fisher_moments is not None:
        return cornish_fisher.score((values - mean) / std, *germ.cornish_fisher_moments)
    if family == "gamma":
        shape = (mean / std) ** 2
        scaled = np.maximum(values, 0.0) * shape / mean
        below, above = scipy.special.gammainc(shape, scaled), scipy.special.gammaincc(shape, scaled)
    elif family == "beta":
        a, b = beta_shape(mean, std, support)
        standard = np.clip((values - support[0]) / (support[1] - support[0]), 0.0, 1.0)
        below, above = scipy.special.betainc(a, b, standard), scipy.special.betaincc(a, b, standard)
    else:
        below = np.clip(0.5 + (values - mean) / (np.sqrt(12.0) * std), 0.0, 1.0)
        above = 1 - below
    score = np.clip(np.where(below < 0.5, scipy.special.ndtri(below), -scipy.special.ndtri(above)), -FARTHEST, FARTHEST)
    return score


def logarithm_moments(mean: float, std: float) -> tuple[float, float]:
    """Mean and std of the logarithm of a lognormal variable."""
    variance = float(np.log1p((std / mean) ** 2))
    return float(np.log(mean)) - variance / 2, float(np.sqrt(variance))


def beta_shape(mean: float, std: float, support: np.ndarray) -> tuple[float, float]:
    """The shape (a, b) of a beta variable on `support`; not positive if the std is larger than the support allows."""
    width = support[1] - support[0]
    standard_mean = (mean - support[0]) / width
    total = standard_mean * (1 - standard_mean) * (width / std) ** 2 - 1
    return float(standard_mean * total), float((1 - standard_mean) * total)
