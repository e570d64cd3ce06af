"""The unknowns of a fit as one vector: d means, d log stds, the log of the output std, and partial correlations.

Stds are searched on a log scale because they span decades. On a linear scale the search ended at a much lower
likelihood if a true std was small. Dependent inputs add d (d - 1) / 2 canonical partial correlations, each of which may
take any value between -1 and 1 independently of the others (Joe, J. Multivariate Anal. 97, 2177, 2006).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from slipstick.uncertainty.chaos.families import Family
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.problem import Candidate

WIDEST_BETA = 0.9
"""Largest std of a beta input, relative to the upper limit for a beta variable with its mean and support."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The k unknowns of the inputs `axes`, with the bounds `lower`, `upper` (k,) of the vector."""

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
        """Mask of the unknowns that the vector contains as logarithms, shape (k,)."""
        index, d = np.arange(len(self.lower)), len(self.axes)
        return (index >= d) & (index <= 2 * d)

    def to_natural(self, vector: np.ndarray) -> np.ndarray:
        """The vector (k,) converted to natural scale, on which stds are not logarithms."""
        return np.asarray(np.where(self.is_logarithmic, np.exp(np.where(self.is_logarithmic, vector, 0.0)), vector))

    def from_natural(self, natural: np.ndarray) -> np.ndarray:
        """The inverse of `to_natural`, shape (k,), clipped to the bounds."""
        inside = np.clip(natural, self.to_natural(self.lower), self.to_natural(self.upper))
        vector = np.where(self.is_logarithmic, np.log(np.where(self.is_logarithmic, inside, 1.0)), inside)
        clipped: np.ndarray = np.clip(vector, self.lower, self.upper)  # removes rounding errors of the logarithm
        return clipped

    def candidate(self, vector: np.ndarray) -> Candidate:
        """The candidate of a vector (k,). The std of a beta input is limited to the share `WIDEST_BETA`."""
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
        """The vector (k,) of a candidate, clipped to the bounds."""
        inputs = candidate.inputs
        partial = partial_from_factor(inputs.factor) if self.correlated else np.empty(0)
        with np.errstate(divide="ignore"):
            vector = np.concatenate([inputs.mean, np.log(inputs.marginal_std), [np.log(candidate.output_std)], partial])
        return np.asarray(np.clip(vector, self.lower, self.upper))

    def _correlation(self, first: int, second: int) -> str:
        name = f"correlation of {self.axes[first]} and {self.axes[second]}"
        return name if first == 0 else f"partial {name} given {' and '.join(self.axes[:first])}"


def correlation_from_partial(partial: np.ndarray, dimension: int) -> np.ndarray:
    """The correlation matrix (d, d) of canonical partial correlations (d (d - 1) / 2,) in row-major order."""
    factor = np.zeros((dimension, dimension))
    rest = np.ones(dimension)  # squared norm of the remaining columns of each row, whose total norm is 1
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
    return np.asarray(table[np.triu_indices(d, 1)])
