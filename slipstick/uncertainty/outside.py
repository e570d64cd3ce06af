"""The probability of the inputs outside the box that a model covers."""

import numpy as np
from scipy.special import ndtr

from slipstick.uncertainty.inputs import Inputs


def axis_mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Probability that each input by itself lies outside [lower, upper] (d,): shape (d,), exact."""
    edges = np.column_stack([lower, upper])
    return np.array([_outside(inputs, number, edges[number]) for number in range(inputs.dimension)])


def mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray, normals: np.ndarray) -> float:
    """Probability that the inputs lie outside the box [lower, upper] (d,).

    Exact for independent inputs. Else the share of the samples at the standard normals `normals` (m, d), but never
    less than what one input by itself leaves outside.
    """
    axes = axis_mass_outside(inputs, lower, upper)
    if inputs.independent:
        with np.errstate(divide="ignore"):  # log 0 where an input lies wholly outside
            return abs(float(np.expm1(np.sum(np.log1p(-np.minimum(axes, 1.0))))))
    return max(count_outside(inputs.points(normals), lower, upper) / len(normals), float(axes.max()))


def count_outside(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> int:
    """How many of the points (m, d) lie outside the box [lower, upper] (d,)."""
    return int(np.count_nonzero(np.any((points < lower) | (points > upper), axis=1)))


def _outside(inputs: Inputs, number: int, edges: np.ndarray) -> float:
    if inputs.marginal_std[number] == 0:
        return float(not edges[0] <= inputs.mean[number] <= edges[1])
    low, high = inputs.scores(number, edges)
    return float(ndtr(low) + ndtr(-high))
