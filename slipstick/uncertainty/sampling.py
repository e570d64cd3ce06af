"""Samples of the standard normals, and the share of the inputs outside the box that a model covers."""

from functools import lru_cache

import numpy as np
from scipy.special import ndtr
from scipy.stats import qmc

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs


@lru_cache(maxsize=8)
def normal_germs(dimension: int, count: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points of N(0, I), shape (count, dimension), read-only; the same for the same seed.

    Raises `InvalidValue` unless `count` is a power of two: other counts of Sobol points are out of balance.
    """
    if count < 1 or count & (count - 1):
        raise InvalidValue(f"{count} samples are no power of two", "Take 1024, 2048, 4096 and so on")
    germs: np.ndarray = qmc.MultivariateNormalQMC(np.zeros(dimension), rng=seed).random(count)
    germs.flags.writeable = False
    return germs


def axis_mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Probability that each input by itself lies outside [lower, upper] (d,): shape (d,), exact."""
    edges = np.column_stack([lower, upper])
    return np.array([_outside(inputs, number, edges[number]) for number in range(inputs.dimension)])


def mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray, theta: np.ndarray) -> float:
    """Probability that the inputs lie outside the box [lower, upper] (d,).

    Exact for independent inputs. Else the share of the samples at the standard normals `theta` (m, d), but never
    less than what one input by itself leaves outside.
    """
    axes = axis_mass_outside(inputs, lower, upper)
    if inputs.independent:
        with np.errstate(divide="ignore"):  # log 0 where an input lies wholly outside
            return abs(float(np.expm1(np.sum(np.log1p(-np.minimum(axes, 1.0))))))
    return max(count_outside(inputs.points(theta), lower, upper) / len(theta), float(axes.max()))


def count_outside(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> int:
    """How many of the points (m, d) lie outside the box [lower, upper] (d,)."""
    return int(np.count_nonzero(np.any((points < lower) | (points > upper), axis=1)))


def _outside(inputs: Inputs, number: int, edges: np.ndarray) -> float:
    if inputs.marginal_std[number] == 0:
        return float(not edges[0] <= inputs.mean[number] <= edges[1])
    low, high = inputs.scores(number, edges)
    return float(ndtr(low) + ndtr(-high))
