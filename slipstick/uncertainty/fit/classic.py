"""The classic grid search of the paper (section III): the likelihood at each node by quasi-Monte Carlo on the model.

Candidates that differ only in the output std share their samples. The grid is uniform in the means and in the
logarithms of the stds. The best node is the starting point of a refinement, not the result.
"""

from itertools import product

import numpy as np

from slipstick.uncertainty.fit.settings import FitSettings
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns
from slipstick.uncertainty.sampling import log10_mean_density, standard_normals

MOST_CANDIDATES = 2 * 10**9
"""Largest number of nodes of a grid, about a week on one core with a table."""


def block_count(settings: FitSettings, space: Unknowns) -> int:
    """Number of blocks of the grid: one for each combination of means."""
    return int(settings.grid ** len(space.axes))


def candidate_count(settings: FitSettings, space: Unknowns) -> int:
    """Number of candidates in the grid."""
    return int(settings.grid ** len(space.lower))


def best_of_block(settings: FitSettings, problem: InferenceProblem, space: Unknowns,
                  block: int) -> tuple[np.ndarray, float]:
    """The best candidate of one block as a vector (k,), and its log10 likelihood; -inf if all likelihoods are 0."""
    d = len(space.axes)
    grid = [np.linspace(low, high, settings.grid) for low, high in zip(space.lower, space.upper, strict=True)]
    means = [axis[index] for axis, index in zip(grid, np.unravel_index(block, (settings.grid,) * d), strict=False)]
    normals = standard_normals(d, settings.samples, settings.seed)
    best, highest = space.lower, -np.inf
    for stds in product(*grid[d:2 * d]):
        for partial in product(*grid[2 * d + 1:]):
            vector = np.array([*means, *stds, 0.0, *partial])
            times = problem.model(space.candidate(vector).inputs.points(normals), problem.conditions)
            for noise in grid[2 * d]:
                likelihood = float(log10_mean_density(times, problem.measured_time, float(np.exp(noise))).sum())
                if likelihood > highest:
                    highest, best = likelihood, vector.copy()
                    best[2 * d] = noise
    return best, highest
