"""The unknowns of a fit as one vector: d means, log std of d inputs, log of the output std, partial correlations.

Stds are searched on a log scale: they span decades, and on a linear scale the search ended decades of likelihood
lower wherever the true std was small. Partial correlations, d (d - 1) / 2 of them where inputs may depend on one
another, each lie between -1 and 1 whatever the others are (Joe, J. Multivariate Anal. 97, 2177, 2006).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.families import POSITIVE, Family
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import Candidate, Problem
from slipstick.uncertainty.settings import Bounds, FitSettings

_CORRELATION = 0.98  # largest partial correlation of a search: at 1 one input fixes the other
_WITHIN = 0.02  # of a support that a beta mean keeps away from its ends
_FULL = 0.9  # of the largest std a beta variable can have


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is searched, and where: bounds `lower`, `upper` (k,) of the vector for the inputs `axes`."""

    axes: tuple[str, ...]
    families: tuple[Family, ...]
    support: np.ndarray
    correlated: bool
    lower: np.ndarray
    upper: np.ndarray

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of each unknown."""
        pairs = combinations(range(len(self.axes)), 2) if self.correlated else ()
        return (*(f"mean of {axis}" for axis in self.axes), *(f"std of {axis}" for axis in self.axes), "output std",
                *(self._correlation(first, second) for first, second in pairs))

    @cached_property
    def logs(self) -> np.ndarray:
        """Which unknowns are searched as logarithms, shape (k,)."""
        place, d = np.arange(len(self.lower)), len(self.axes)
        return (place >= d) & (place <= 2 * d)

    def plain(self, vector: np.ndarray) -> np.ndarray:
        """A vector (k,) with its stds as they are, and not their logarithms."""
        plain: np.ndarray = np.where(self.logs, np.exp(np.where(self.logs, vector, 0.0)), vector)
        return plain

    def of_plain(self, plain: np.ndarray) -> np.ndarray:
        """The vector (k,) within the bounds whose `plain` this is."""
        within = np.clip(plain, self.plain(self.lower), self.plain(self.upper))
        vector = np.where(self.logs, np.log(np.where(self.logs, within, 1.0)), within)
        clipped: np.ndarray = np.clip(vector, self.lower, self.upper)  # against rounding
        return clipped

    def candidate(self, vector: np.ndarray) -> Candidate:
        """The candidate of a vector (k,). A beta variable gets the largest std it can have where that is too large."""
        d = len(self.axes)
        mean, std = np.array(vector[:d]), np.exp(vector[d:2 * d])
        for axis, family in enumerate(self.families):
            if family == "beta":
                low, high = self.support[axis]
                std[axis] = min(std[axis], _FULL * np.sqrt((mean[axis] - low) * (high - mean[axis])))
        correlation = correlation_of(vector[2 * d + 1:], d) if self.correlated else None
        return Candidate(Inputs(mean, std, families=self.families, correlation=correlation, support=self.support),
                         float(np.exp(vector[2 * d])))

    def vector(self, candidate: Candidate) -> np.ndarray:
        """The vector (k,) of a candidate, within the bounds."""
        inputs = candidate.inputs
        partial = partial_of(inputs.factor) if self.correlated else np.empty(0)
        with np.errstate(divide="ignore"):
            whole = np.concatenate([inputs.mean, np.log(inputs.marginal_std), [np.log(candidate.output_std)], partial])
        clipped: np.ndarray = np.clip(whole, self.lower, self.upper)
        return clipped

    def _correlation(self, first: int, second: int) -> str:
        name = f"correlation of {self.axes[first]} and {self.axes[second]}"
        return name if first == 0 else f"partial {name} given {' and '.join(self.axes[:first])}"


def unknowns(settings: FitSettings, problem: Problem) -> Unknowns:
    """What the settings leave to search; the means stay where the model covers. Raises `InvalidValue`."""
    d = len(problem.axes)
    mean, std = (_each(bounds, d, "pairs of bounds") for bounds in (settings.mean_bounds, settings.std_bounds))
    lower, upper = np.maximum(mean[:, 0], problem.lower), np.minimum(mean[:, 1], problem.upper)
    families = tuple(_each(settings.families, d, "families").tolist())
    support = np.column_stack([problem.lower, problem.upper])
    for axis, family in enumerate(families):
        if family in POSITIVE:
            lower[axis] = max(lower[axis], 1e-6)
        elif family == "beta":
            margin = _WITHIN * (support[axis, 1] - support[axis, 0])
            lower[axis] = max(lower[axis], support[axis, 0] + margin)
            upper[axis] = min(upper[axis], support[axis, 1] - margin)
            widest = _FULL * (support[axis, 1] - support[axis, 0]) / 2
            if std[axis, 0] >= widest:
                raise InvalidValue(f"No beta input of {problem.axes[axis]} has a std of {std[axis, 0]:.4g}",
                                   f"Choose std_bounds below {widest:.4g}, or another family")
    if np.any(lower >= upper):
        raise InvalidValue("The bounds of a mean lie outside what the model covers",
                           f"Choose mean_bounds within {problem.lower} to {problem.upper}")
    noise = np.log(settings.output_std_bounds)
    partial = np.full(d * (d - 1) // 2 if settings.correlated else 0, _CORRELATION)
    return Unknowns(problem.axes, families, support, settings.correlated,
                    np.concatenate([lower, np.log(std[:, 0]), noise[:1], -partial]),
                    np.concatenate([upper, np.log(std[:, 1]), noise[1:], partial]))


def nominal(problem: Problem, space: Unknowns) -> Candidate:
    """The model before a fit: all means 1, the least std, and the noise that explains the residuals best.

    That noise is their root mean square; each unknown stays in its bounds.
    """
    d = len(problem.lower)
    vector = np.where(np.arange(len(space.lower)) < d, 1.0, space.lower)
    vector[2 * d + 1:] = 0.0
    vector = np.clip(vector, space.lower, space.upper)
    residual = problem.model(vector[None, :d], problem.conditions)[0] - problem.measured_time
    locked = residual[np.isfinite(residual)]
    if locked.size and np.any(locked):
        vector[2 * d] = np.clip(np.log(np.sqrt(np.mean(locked**2))), space.lower[2 * d], space.upper[2 * d])
    return space.candidate(vector)


def correlation_of(partial: np.ndarray, dimension: int) -> np.ndarray:
    """The correlation matrix (d, d) of canonical partial correlations (d (d - 1) / 2,), row after row."""
    factor = np.zeros((dimension, dimension))
    rest = np.ones(dimension)  # what earlier columns leave of the unit length of each row
    table = np.zeros((dimension, dimension))
    table[np.triu_indices(dimension, 1)] = partial
    for column in range(dimension):
        factor[column, column] = np.sqrt(rest[column])
        for row in range(column + 1, dimension):
            factor[row, column] = table[column, row] * np.sqrt(rest[row])
            rest[row] -= factor[row, column] ** 2
    correlation: np.ndarray = factor @ factor.T
    np.fill_diagonal(correlation, 1.0)
    return correlation


def partial_of(factor: np.ndarray) -> np.ndarray:
    """The canonical partial correlations of the Cholesky factor (d, d) of a correlation matrix."""
    d = len(factor)
    table = np.zeros((d, d))
    for column in range(d):
        for row in range(column + 1, d):
            rest = 1.0 - np.sum(factor[row, :column] ** 2)
            table[column, row] = factor[row, column] / np.sqrt(rest)
    partial: np.ndarray = table[np.triu_indices(d, 1)]
    return partial


def _each(values: tuple[Bounds, ...] | tuple[str, ...], dimension: int, what: str) -> np.ndarray:
    if len(values) not in (1, dimension):
        raise InvalidValue(f"There are {len(values)} {what} for {dimension} inputs",
                           "Give one for all inputs, or one each")
    return np.array([values[place % len(values)] for place in range(dimension)])
