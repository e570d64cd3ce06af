"""A whole fit of the shipped recordings, refined and with intervals, and a classic grid at the same likelihood.

The grid is as fine as it must be for its best node to be within 0.05 decades of the maximum, as in `table_two.py`. Its
time is that of some blocks of a coarse grid, scaled to the number of its nodes. Times are processor times of all
threads. Errors are decades below the maximum, which is found by refining the known fit.
"""

import time
from itertools import count

import numpy as np

from benchmarks.likelihood import CASES, FITTED
from benchmarks.peers import Code, Work
from benchmarks.table_two import COARSE, grid_needed, log10_likelihood, samples_needed
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings, classic
from slipstick.uncertainty.fit.refine import refined_vector
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem, Unknowns, converged

BLOCKS = range(0, COARSE**2, COARSE + 1)  # every ninth of the 64 blocks, which meets each mean of both inputs
ROUNDS = 3


def whole_fit(problem: InferenceProblem) -> Work:
    """Fits with the seeds 1, 2 and so on, and the grid."""
    space = search_space(FitSettings(), problem)
    optimum = refined_vector(problem, space, space.vector(CASES[FITTED]))
    maximum, ours = log10_likelihood(problem, space, optimum), Fits(problem)
    needed, loss = grid_needed(problem, space, optimum, maximum, _fast_log10_likelihood)
    grid = FitSettings(method="classic", grid=COARSE, samples=samples_needed(problem, optimum))
    candidates = len(BLOCKS) * classic.candidate_count(grid, space) // classic.block_count(grid, space)

    def blocks() -> None:
        for block in BLOCKS:
            classic.best_of_block(grid, problem, space, block)

    return Work(
        f"whole fit of {len(optimum)} unknowns, refined, with intervals; processor time",
        Code(ours.run, lambda: max(maximum - log10_likelihood(problem, space, vector) for vector in ours.vectors),
             warm_up=ours.first_generation),
        {f"classic grid of {needed}^{len(optimum)}, {grid.samples} samples ({candidates} candidates, scaled)":
         Code(blocks, lambda: loss, scale=needed ** len(optimum) / candidates)},
        "decades", {}, limit=2000.0, repeats=1, rounds=ROUNDS, clock=time.process_time)


class Fits:
    """Fits with one seed after the other, and the `vectors` of unknowns that they find."""

    def __init__(self, problem: InferenceProblem) -> None:
        self.problem, self.seeds = problem, count(1)
        self.vectors: list[np.ndarray] = []

    def first_generation(self) -> None:
        fit.next_state(FitSettings(), self.problem, fit.initial_state(FitSettings(), self.problem))

    def run(self) -> None:
        settings = FitSettings(seed=next(self.seeds))
        estimate = fit.refined_estimate(settings, self.problem, fit.final_state(settings, self.problem))
        while not fit.has_all_intervals(settings, estimate):
            estimate = fit.with_next_interval(settings, self.problem, estimate)
        self.vectors.append(np.array(estimate["vector"]))


def _fast_log10_likelihood(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> float:
    return float(converged(problem, space.candidate(vector))[0].sum())
