"""The unknowns of a fit as one vector: d means, log std of d inputs, log of the output std.

Stds are searched on a log scale: they span decades, and on a linear scale the search ended decades of likelihood
lower wherever the true std was small.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import Candidate, Problem
from slipstick.uncertainty.settings import Bounds, FitSettings


@dataclass(frozen=True, eq=False)
class Box:
    """Bounds `lower`, `upper` (2 d + 1,) of the vector of unknowns."""

    lower: np.ndarray
    upper: np.ndarray


def box(settings: FitSettings, problem: Problem) -> Box:
    """The bounds of the search; the means stay where the model covers. Raises `InvalidValue` if nothing is left."""
    dimension = len(problem.lower)
    mean, std = (_each(bounds, dimension) for bounds in (settings.mean_bounds, settings.std_bounds))
    lower, upper = np.maximum(mean[:, 0], problem.lower), np.minimum(mean[:, 1], problem.upper)
    if np.any(lower >= upper):
        raise InvalidValue("The bounds of a mean lie outside the table",
                           f"Choose mean_bounds within {problem.lower} to {problem.upper}")
    noise = np.log(settings.output_std_bounds)
    return Box(np.concatenate([lower, np.log(std[:, 0]), noise[:1]]),
               np.concatenate([upper, np.log(std[:, 1]), noise[1:]]))


def candidate(vector: np.ndarray) -> Candidate:
    """The candidate of a vector of unknowns."""
    dimension = len(vector) // 2
    std = np.exp(vector[dimension:])
    return Candidate(Inputs(vector[:dimension], std[:dimension]), float(std[-1]))


def vector(candidate: Candidate) -> np.ndarray:
    """The vector of unknowns of a candidate with independent inputs."""
    inputs = candidate.inputs
    return np.concatenate([inputs.mean, np.log(inputs.marginal_std), [np.log(candidate.output_std)]])


def nominal(problem: Problem, box: Box) -> Candidate:
    """The model before a fit: all means 1, the least std, and the noise that explains the residuals best.

    That noise is their root mean square; each unknown stays in the box.
    """
    dimension = len(problem.lower)
    mean = np.clip(np.ones(dimension), box.lower[:dimension], box.upper[:dimension])
    residual = problem.model(mean[None], problem.conditions)[0] - problem.measured_time
    locked = residual[np.isfinite(residual)]
    variance = np.mean(locked**2) if locked.size else 0.0
    noise = np.clip(np.sqrt(variance), *np.exp([box.lower[-1], box.upper[-1]]))
    return Candidate(Inputs(mean, np.exp(box.lower[dimension:-1])), float(noise))


def _each(bounds: tuple[Bounds, ...], dimension: int) -> np.ndarray:
    if len(bounds) not in (1, dimension):
        raise InvalidValue(f"There are {len(bounds)} pairs of bounds for {dimension} inputs",
                           "Give one pair for all inputs, or one each")
    return np.broadcast_to(np.array(bounds), (dimension, 2))
