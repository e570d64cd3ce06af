"""The search space of a fit, and the nominal candidate from which a search starts."""

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.families import POSITIVE
from slipstick.uncertainty.fit.settings import Bounds, FitSettings
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import WIDEST_BETA, Unknowns

_CORRELATION = 0.98  # largest partial correlation of a search; at 1 the correlation matrix is singular
_MARGIN = 0.02  # smallest distance of the mean of a beta input from the ends of its support, relative to the support


def search_space(settings: FitSettings, problem: InferenceProblem) -> Unknowns:
    """The unknowns and their bounds; the means are restricted to the domain of the model. Raises `InvalidValue`."""
    d = len(problem.axes)
    mean, std = (_per_input(bounds, d, "pairs of bounds") for bounds in (settings.mean_bounds, settings.std_bounds))
    lower, upper = np.maximum(mean[:, 0], problem.lower), np.minimum(mean[:, 1], problem.upper)
    families = tuple(_per_input(settings.families, d, "families").tolist())
    support = np.column_stack([problem.lower, problem.upper])
    for axis, family in enumerate(families):
        if family in POSITIVE:
            lower[axis] = max(lower[axis], 1e-6)
        elif family == "beta":
            margin = _MARGIN * (support[axis, 1] - support[axis, 0])
            lower[axis] = max(lower[axis], support[axis, 0] + margin)
            upper[axis] = min(upper[axis], support[axis, 1] - margin)
            widest = WIDEST_BETA * (support[axis, 1] - support[axis, 0]) / 2
            if std[axis, 0] >= widest:
                raise InvalidValue(f"No beta input of {problem.axes[axis]} has a std of {std[axis, 0]:.4g}",
                                   f"Choose std_bounds below {widest:.4g}, or another family")
    if np.any(lower >= upper):
        ranges = [f"{low:g} to {high:g} ({axis})" for axis, low, high in zip(problem.axes, *support.T, strict=True)]
        raise InvalidValue("The bounds of a mean lie outside the domain of the model",
                           f"Choose mean_bounds within {', '.join(ranges)}")
    bounds = settings.output_std_bounds or problem.output_std_bounds
    problem.require_output_std(bounds[0])
    noise = np.log(bounds)
    partial = np.full(d * (d - 1) // 2 if settings.correlated else 0, _CORRELATION)
    return Unknowns(problem.axes, families, support, settings.correlated,
                    np.concatenate([lower, np.log(std[:, 0]), noise[:1], -partial]),
                    np.concatenate([upper, np.log(std[:, 1]), noise[1:], partial]))


def nominal_candidate(problem: InferenceProblem, space: Unknowns) -> Candidate:
    """The candidate before a fit: means of 1, the smallest stds, and the RMS residual as output std, within bounds."""
    d = len(problem.lower)
    vector = np.where(np.arange(len(space.lower)) < d, 1.0, space.lower)
    vector[2 * d + 1:] = 0.0
    vector = np.clip(vector, space.lower, space.upper)
    residual = problem.model(vector[None, :d], problem.conditions)[0] - problem.measured_time
    locked = residual[np.isfinite(residual)]
    if locked.size and np.any(locked):
        vector[2 * d] = np.clip(np.log(np.sqrt(np.mean(locked**2))), space.lower[2 * d], space.upper[2 * d])
    return space.candidate(vector)


def _per_input(values: tuple[Bounds, ...] | tuple[str, ...], dimension: int, what: str) -> np.ndarray:
    if len(values) not in (1, dimension):
        raise InvalidValue(f"There are {len(values)} {what} for {dimension} inputs",
                           "Give one for all inputs, or one per input")
    return np.array([values[index % len(values)] for index in range(dimension)])
