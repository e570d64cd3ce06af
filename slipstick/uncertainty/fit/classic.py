"""The paper's benchmark (section III): all candidates of a grid, each by quasi-Monte-Carlo samples of the model.

What candidates share is computed once: all output stds of one choice of inputs look at the same samples. Means lie
evenly between their bounds, stds evenly in their logarithms. The best node is where a refinement starts, not the
answer.
"""

from itertools import product as every

import numpy as np

from slipstick.uncertainty.fit.settings import FitSettings
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns
from slipstick.uncertainty.sampling import log10_mean_density, standard_normals

MOST_CANDIDATES = 2 * 10**9
"""Of a whole grid: a week on one core, with a table."""


def block_count(settings: FitSettings, space: Unknowns) -> int:
    """Number of blocks that the grid falls into: one for each choice of the means."""
    return int(settings.grid ** len(space.axes))


def candidate_count(settings: FitSettings, space: Unknowns) -> int:
    """Number of candidates in the whole grid."""
    return int(settings.grid ** len(space.lower))


def best_of_block(settings: FitSettings, problem: InferenceProblem, space: Unknowns, block: int) -> tuple[np.ndarray, float]:
    """The best candidate of one block as a vector (k,), and its log10 likelihood; -inf where none has any."""
    d = len(space.axes)
    grid = [np.linspace(low, high, settings.grid) for low, high in zip(space.lower, space.upper, strict=True)]
    means = [axis[place] for axis, place in zip(grid, np.unravel_index(block, (settings.grid,) * d), strict=False)]
    normals = standard_normals(d, settings.samples, settings.seed)
    best, highest = space.lower, -np.inf
    for stds in every(*grid[d:2 * d]):
        for partial in every(*grid[2 * d + 1:]):
            vector = np.array([*means, *stds, 0.0, *partial])
            times = problem.model(space.candidate(vector).inputs.points(normals), problem.conditions)
            for noise in grid[2 * d]:
                whole = float(log10_mean_density(times, problem.measured_time, float(np.exp(noise))).sum())
                if whole > highest:
                    highest, best = whole, vector.copy()
                    best[2 * d] = noise
    return best, highest
