"""The unknowns of a fit as one vector: d means, log std of d inputs, log of the output std, partial correlations.

Stds are searched on a log scale: they span decades, and on a linear scale the search ended decades of likelihood
lower wherever the true std was small. Partial correlations, d (d - 1) / 2 of them where inputs may depend on one
another, each lie between -1 and 1 whatever the others are (Joe, J. Multivariate Anal. 97, 2177, 2006).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from slipstick.uncertainty.chaos.families import Family
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.problem import Candidate

WIDEST_BETA = 0.9
"""Largest std of a beta input, as a share of the largest that a beta variable of its mean can have."""


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
    def is_logarithmic(self) -> np.ndarray:
        """Which unknowns are searched as logarithms, shape (k,)."""
        place, d = np.arange(len(self.lower)), len(self.axes)
        return (place >= d) & (place <= 2 * d)

    def to_natural(self, vector: np.ndarray) -> np.ndarray:
        """A vector (k,) with its stds as they are, and not their logarithms."""
        plain: np.ndarray = np.where(self.is_logarithmic, np.exp(np.where(self.is_logarithmic, vector, 0.0)), vector)
        return plain

    def from_natural(self, plain: np.ndarray) -> np.ndarray:
        """The vector (k,) within the bounds whose `plain` this is."""
        within = np.clip(plain, self.to_natural(self.lower), self.to_natural(self.upper))
        vector = np.where(self.is_logarithmic, np.log(np.where(self.is_logarithmic, within, 1.0)), within)
        clipped: np.ndarray = np.clip(vector, self.lower, self.upper)  # against rounding
        return clipped

    def candidate(self, vector: np.ndarray) -> Candidate:
        """The candidate of a vector (k,). A beta variable gets the largest std it can have where that is too large."""
        d = len(self.axes)
        mean, std = np.array(vector[:d]), np.exp(vector[d:2 * d])
        for axis, family in enumerate(self.families):
            if family == "beta":
                low, high = self.support[axis]
                std[axis] = min(std[axis], WIDEST_BETA * np.sqrt((mean[axis] - low) * (high - mean[axis])))
        correlation = correlation_from_partial(vector[2 * d + 1:], d) if self.correlated else None
        return Candidate(Inputs(mean, std, families=self.families, correlation=correlation, support=self.support),
                         float(np.exp(vector[2 * d])))

    def vector(self, candidate: Candidate) -> np.ndarray:
        """The vector (k,) of a candidate, within the bounds."""
        inputs = candidate.inputs
        partial = partial_from_factor(inputs.factor) if self.correlated else np.empty(0)
        with np.errstate(divide="ignore"):
            whole = np.concatenate([inputs.mean, np.log(inputs.marginal_std), [np.log(candidate.output_std)], partial])
        clipped: np.ndarray = np.clip(whole, self.lower, self.upper)
        return clipped

    def _correlation(self, first: int, second: int) -> str:
        name = f"correlation of {self.axes[first]} and {self.axes[second]}"
        return name if first == 0 else f"partial {name} given {' and '.join(self.axes[:first])}"


def correlation_from_partial(partial: np.ndarray, dimension: int) -> np.ndarray:
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


def partial_from_factor(factor: np.ndarray) -> np.ndarray:
    """The canonical partial correlations of the Cholesky factor (d, d) of a correlation matrix."""
    d = len(factor)
    table = np.zeros((d, d))
    for column in range(d):
        for row in range(column + 1, d):
            rest = 1.0 - np.sum(factor[row, :column] ** 2)
            table[column, row] = factor[row, column] / np.sqrt(rest)
    partial: np.ndarray = table[np.triu_indices(d, 1)]
    return partial
