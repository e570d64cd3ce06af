"""Calibration of fits: coverage of the 90 % intervals, and probability integral transforms of the predictions.

Data sets are drawn from the table at known inputs, and each is fitted from the default start. An interval contains the
true value if the drop of the profile there is smaller than at the ends of the interval. Predictions are calibrated if
the probability integral transforms (PIT) of held-out times are uniform (Dawid, J. R. Stat. Soc. A 147, 278, 1984).
"""

import argparse
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.special import ndtr
from scipy.stats import binomtest, f

from benchmarks.results import write
from slipstick.inference import table_model
from slipstick.storage.library import Library
from slipstick.uncertainty import Inputs, fit, standard_normals
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.intervals import (
    combinations,
    direction_of,
    drop_at_level,
    profile_drop,
    profile_interval,
)
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem

SETTINGS = FitSettings(order=4, population=24, generations=20, patience=8)
TRUTH = Candidate(Inputs([0.95, 1.1], [0.06, 0.05]), 0.005)
BETA = Candidate(Inputs([0.95, 1.1], [0.3, 0.02], families=("beta", "beta"), support=[[0.6, 1.3], [0.9, 1.3]]), 0.005)
"""Inputs with a bimodal pressure bias, far from a normal distribution."""
UNIFORM = Candidate(Inputs([0.95, 1.1], [0.15, 0.02], families=("uniform", "uniform")), 0.005)
"""Inputs whose deviation from a normal distribution is significant in many data sets only."""
LEVEL = 0.9
BINS = 10
_WITH_ENDS = 40  # data sets whose complete intervals are computed, which takes most of the time
_EVERY = 2  # step in the conditions of the table, to save time
T = TypeVar("T")
_MANY = 20  # runs per condition for the information matrix that determines the combinations


@dataclass(frozen=True)
class SetResult:
    """The result of one data set.

    `drop` is the drop of the profile in decades at the true value, for each unknown and combination. `open` contains
    for each unknown whether the lower and the upper end are open; None if the intervals were not computed.
    """

    drop: list[float]
    open: list[tuple[bool, bool]] | None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200, help="number of data sets for the intervals")
    parser.add_argument("--predicted", type=int, default=100, help="number of data sets of each kind for predictions")
    arguments = parser.parse_args()
    command = f"python -m benchmarks.coverage --sets {arguments.sets} --predicted {arguments.predicted}"
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        write("coverage", ("of", "weights", "true value", "held", "data sets", "coverage", "95 % from", "95 % to",
                           "open below", "open above"), intervals(_map(pool, set_result, arguments.sets)), command)
        kinds = (("normal inputs, fitted as such", normal_levels),
                 ("U-shaped beta inputs, fitted as normal", beta_levels),
                 ("uniform inputs, fitted as normal", uniform_levels))
        rows = [(kind, *predictions(np.array(_map(pool, task, arguments.predicted)))) for kind, task in kinds]
        write("pit", ("data", "p of uniform", *(f"{k / BINS:g} to {(k + 1) / BINS:g}" for k in range(BINS))), rows,
              command)


def intervals(results: Sequence[SetResult]) -> list[tuple[object, ...]]:
    """Rows of coverage.csv: each unknown, then each identified combination."""
    space, rows = search_space(SETTINGS, drawn(TRUTH, 0)), []
    true = space.to_natural(space.vector(TRUTH))
    span = space.to_natural(space.upper) - space.to_natural(space.lower)
    for index, direction in enumerate(np.concatenate([np.eye(len(true)), directions()])):
        is_unknown = index < len(true)
        name = space.names[index] if is_unknown else f"combination {index - len(true) + 1}"
        terms = zip(direction * span, space.names, strict=True)
        weights = "" if is_unknown else " ".join(f"{weight:+.3f} {unknown}" for weight, unknown in terms)
        inside = sum(result.drop[index] < drop_at_level(LEVEL) for result in results)
        low, high = binomtest(inside, len(results)).proportion_ci(0.95, "exact")
        ends = [result.open for result in results if result.open is not None]
        counts = [f"{sum(is_open[index][side] for is_open in ends)} of {len(ends)}" if is_unknown else ""
                  for side in (0, 1)]
        rows.append((name, weights, float(direction @ true), inside, len(results), inside / len(results), low, high,
                     *counts))
    return rows


def predictions(levels: np.ndarray, bins: int = BINS) -> tuple[float, ...]:
    """p value of uniform PIT values `levels` (sets, n), and their relative frequency in each of `bins` equal bins.

    The PIT values of one set are dependent, because they share a fit. The test is therefore Hotelling's test of the
    mean frequencies over the sets.
    """
    indices = np.minimum((levels * bins).astype(int), bins - 1)
    frequencies = np.array([np.bincount(row, minlength=bins) for row in indices]) / levels.shape[1]
    count, free = len(frequencies), bins - 1
    deviation = frequencies[:, :free].mean(axis=0) - 1 / bins
    squared = count * deviation @ np.linalg.solve(np.cov(frequencies[:, :free].T), deviation)
    p_value = float(f.sf(squared * (count - free) / (free * (count - 1)), free, count - free))
    return p_value, *frequencies.mean(axis=0)


def set_result(seed: int) -> SetResult:
    """Fit one data set and compare its intervals with the true values."""
    problem = drawn(TRUTH, seed)
    space, optimum = search_space(SETTINGS, problem), fitted(problem)
    if seed > _WITH_ENDS:
        return SetResult(drops(problem, optimum), None)
    ends = [profile_interval(problem, space, optimum, direction, LEVEL) for direction in np.eye(len(optimum))]
    return SetResult(drops(problem, optimum), [(interval.lower is None, interval.upper is None) for interval in ends])


def drops(problem: InferenceProblem, optimum: np.ndarray) -> list[float]:
    """Drop of the profile in decades at the true value, for each unknown and each identified combination."""
    space = search_space(SETTINGS, problem)
    true = space.to_natural(space.vector(TRUTH))
    return [profile_drop(problem, space, optimum, direction, float(direction @ true))
            for direction in np.concatenate([np.eye(len(optimum)), directions()])]


def normal_levels(seed: int) -> np.ndarray:
    """PIT values of held-out times (n,) for data from normal inputs, the family of the fit."""
    return predicted_levels(drawn(TRUTH, seed))


def beta_levels(seed: int) -> np.ndarray:
    """PIT values of held-out times (n,) for data from U-shaped beta inputs."""
    return predicted_levels(drawn(BETA, seed))


def uniform_levels(seed: int) -> np.ndarray:
    """PIT values of held-out times (n,) for data from uniform inputs."""
    return predicted_levels(drawn(UNIFORM, seed))


def predicted_levels(problem: InferenceProblem) -> np.ndarray:
    """Fit one half of the conditions, and return the PIT values (n,) of the measured times of the other half."""
    indices = np.arange(len(problem.measured_time))
    halves = [replace(problem, conditions=problem.conditions.take(half), measured_time=problem.measured_time[half])
              for half in (indices[::2], indices[1::2])]
    candidate = search_space(SETTINGS, problem).candidate(fitted(halves[0]))
    times = halves[1].model(candidate.inputs.points(standard_normals(2, 1 << 13, 1)), halves[1].conditions)
    levels: np.ndarray = ndtr((halves[1].measured_time - times) / candidate.output_std).mean(axis=0)
    return levels


def fitted(problem: InferenceProblem) -> np.ndarray:
    """The vector of unknowns (k,) of a fit from the default start."""
    return np.array(fit.refined_estimate(SETTINGS, problem, fit.final_state(SETTINGS, problem))["vector"])


@cache
def directions() -> np.ndarray:
    """The combinations (c, k) that such data identify, from the information matrix at the true inputs."""
    problem = drawn(TRUTH, 0, _MANY)
    space = search_space(SETTINGS, problem)
    candidates = combinations(problem, space, space.vector(TRUTH))
    return np.array([direction_of(space, combination.weights) for combination in candidates
                     if combination.std_error * np.sqrt(_MANY) < 0.25])


def drawn(truth: Candidate, seed: int, runs: int = 1, every: int = _EVERY) -> InferenceProblem:
    """Every `every`-th condition of the default table, with `runs` measured times each, drawn from the candidate."""
    table = Library(Path(os.environ.get("SLIPSTICK_TABLES", "tables"))).table("nominal")
    model, random = table_model(table, "clip"), np.random.default_rng([2026, seed])
    conditions = table.conditions.take(np.tile(np.arange(0, len(table.conditions), every), runs))
    count = len(conditions)
    points = truth.inputs.points(random.standard_normal((count, truth.inputs.dimension)))
    times = np.diagonal(model(points, conditions)) + truth.output_std * random.standard_normal(count)
    return InferenceProblem(model, conditions, times, table.lower, table.upper, tuple(axis.name for axis in table.axes),
                   table.knots)


def _map(pool: ProcessPoolExecutor, task: Callable[[int], T], count: int) -> list[T]:
    results = []
    for seed, result in enumerate(pool.map(task, range(1, count + 1)), start=1):
        results.append(result)
        print(f"{task.__name__} {seed}/{count}", flush=True)
    return results


if __name__ == "__main__":
    main()
