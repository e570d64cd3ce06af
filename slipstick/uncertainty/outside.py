"""The probability that the inputs lie outside the domain of a model, a box."""

import numpy as np
import scipy

from slipstick.uncertainty.chaos.cornish_fisher import FARTHEST
from slipstick.uncertainty.inputs import Inputs


def axis_mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Marginal probability that each input lies outside [lower, upper] (d,): shape (d,), exact."""
    edges = np.column_stack([lower, upper])
    return np.array([_axis_mass_outside(inputs, index, edges[index]) for index in range(inputs.dimension)])


def mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray, normals: np.ndarray) -> float:
    """Probability that the inputs lie outside the box [lower, upper] (d,).

    The value is exact for independent inputs. For dependent inputs it is the fraction of the samples at the standard
    normals `normals` (m, d), or the largest marginal probability if that is greater.
    """
    axes = axis_mass_outside(inputs, lower, upper)
    if inputs.independent:
        with np.errstate(divide="ignore"):  # log 0 if an input lies outside with probability 1
            return abs(float(np.expm1(np.sum(np.log1p(-np.minimum(axes, 1.0))))))
    points = inputs.points(normals)
    return max(float(np.mean(np.any((points < lower) | (points > upper), axis=1))), float(axes.max()))


def _axis_mass_outside(inputs: Inputs, index: int, edges: np.ndarray) -> float:
    if inputs.marginal_std[index] == 0:
        return float(not edges[0] <= inputs.mean[index] <= edges[1])
    low, high = inputs.scores(index, edges)
    below, above = (scipy.special.ndtr(score) if score > -FARTHEST else 0.0 for score in (low, -high))
    return float(below + above)  # 0 beyond an edge at the end of a support or further, where scores are limited
