"""Fits of inputs to shifting times: 90 % intervals of the unknowns, and predictions of shifting times.

Sets are drawn from the table `nominal` at known inputs, and each is fitted from the default start. An interval contains
the true value if the drop of the profile there is smaller than at the ends of the interval. Predictions are calibrated
if the probability integral transforms (PIT) of held-out times are uniform (Dawid, J. R. Stat. Soc. A 147, 278, 1984).
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr
from scipy.stats import f

from evidence.calibration_coverage.table import Row
from slipstick.inference.problems import table_model
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

SETS = 200
"""Sets for intervals; half as many of each kind are predicted."""
SETTINGS = FitSettings(order=4, population=24, generations=20, patience=8)
TRUTH = Candidate(Inputs([0.95, 1.1], [0.06, 0.05]), 0.005)
BETA = Candidate(Inputs([0.95, 1.1], [0.3, 0.02], families=("beta", "beta"), support=[[0.6, 1.3], [0.9, 1.3]]), 0.005)
"""Inputs with a bimodal pressure bias, far from a normal distribution."""
UNIFORM = Candidate(Inputs([0.95, 1.1], [0.15, 0.02], families=("uniform", "uniform")), 0.005)
"""Inputs whose deviation from a normal distribution is significant in many sets only."""
PREDICTED = {"normal inputs, fitted as such": TRUTH, "U-shaped beta inputs, fitted as normal": BETA,
             "uniform inputs, fitted as normal": UNIFORM}
LEVEL = 0.9
BINS = 10
CENTRAL = slice(2, -2)
"""The bins of the central 60 % of a prediction."""
_WITH_ENDS = 40  # sets whose complete intervals are computed, which takes most of the time
_EVERY = 2  # step in the conditions of the table, to save time
_MANY = 20  # runs per condition for the information matrix that determines the combinations


def list_jobs(sets: int) -> list[tuple[str, int]]:
    """Return kind and seed of each fit."""
    return [("intervals", seed) for seed in range(1, sets + 1)] + [
        (kind, seed) for kind in PREDICTED for seed in range(1, sets // 2 + 1)]


def run_job(kind: str, seed: int) -> dict[str, Any]:
    """Return the PIT values of a predicted set, or what the intervals of a set are.

    `drop` is the drop of the profile in decades at the true value, for each unknown and combination. `open` contains
    for each unknown whether the lower and the upper end are open; None if the intervals were not computed.
    """
    if kind != "intervals":
        return {"kind": kind, "levels": predict_levels(draw_problem(PREDICTED[kind], seed)).tolist()}
    problem = draw_problem(TRUTH, seed)
    space, optimum = search_space(SETTINGS, problem), fit_vector(problem)
    ends = [profile_interval(problem, space, optimum, direction, LEVEL)
            for direction in (np.eye(len(optimum)) if seed <= _WITH_ENDS else ())]
    return {"kind": kind, "drop": compute_drops(problem, optimum),
            "open": [(interval.lower is None, interval.upper is None) for interval in ends] or None}


def make_rows(results: Sequence[dict[str, Any]]) -> list[Row]:
    """Return the rows of the unknowns, the identified combinations, and the predictions of each kind."""
    rows = _rate_intervals([result for result in results if result["kind"] == "intervals"])
    for kind in PREDICTED:
        levels = np.array([result["levels"] for result in results if result["kind"] == kind])
        p_value, frequencies = check_levels(levels)
        tenths = " ".join(f"{frequency:.3f}" for frequency in frequencies)
        rows.append(Row(f"central 60 % of predictions: {kind}", len(levels), levels.size,
                        round(frequencies[CENTRAL].sum() * levels.size),
                        f"p of uniform PIT {p_value:.2g}; in tenths: {tenths}"))
    return rows


def _rate_intervals(results: Sequence[dict[str, Any]]) -> list[Row]:
    space, rows = search_space(SETTINGS, draw_problem(TRUTH, 0)), []
    true = space.to_natural(space.vector(TRUTH))
    span = space.to_natural(space.upper) - space.to_natural(space.lower)
    ends = np.array([result["open"] for result in results if result["open"]])
    for index, direction in enumerate(np.concatenate([np.eye(len(true)), find_directions()])):
        if is_unknown := index < len(true):
            note = f"open below {ends[:, index, 0].sum()} of {len(ends)}, above {ends[:, index, 1].sum()}"
        else:
            terms = zip(direction * span, space.names, strict=True)
            note = " ".join(f"{weight:+.3f} {unknown}" for weight, unknown in terms)
        hits = sum(result["drop"][index] < drop_at_level(LEVEL) for result in results)
        rows.append(Row(space.names[index] if is_unknown else f"combination {index - len(true) + 1}", len(results),
                        len(results), hits, f"true value {direction @ true:.4g}; {note}"))
    return rows


def check_levels(levels: np.ndarray, bins: int = BINS) -> tuple[float, np.ndarray]:
    """Return the p value of uniform PIT values `levels` (sets, n), and their frequencies (bins,) in equal bins.

    The PIT values of one set are dependent, because they share a fit. The test is therefore Hotelling's test of the
    mean frequencies over the sets.
    """
    indices = np.minimum((levels * bins).astype(int), bins - 1)
    frequencies = np.array([np.bincount(row, minlength=bins) for row in indices]) / levels.shape[1]
    count, free = len(frequencies), bins - 1
    deviation = frequencies[:, :free].mean(axis=0) - 1 / bins
    squared = count * deviation @ np.linalg.solve(np.cov(frequencies[:, :free].T), deviation)
    p_value = float(f.sf(squared * (count - free) / (free * (count - 1)), free, count - free))
    return p_value, frequencies.mean(axis=0)


def compute_drops(problem: InferenceProblem, optimum: np.ndarray) -> list[float]:
    """Return the drop of the profile in decades at the true value, for each unknown and each identified combination."""
    space = search_space(SETTINGS, problem)
    true = space.to_natural(space.vector(TRUTH))
    return [profile_drop(problem, space, optimum, direction, float(direction @ true))
            for direction in np.concatenate([np.eye(len(optimum)), find_directions()])]


def predict_levels(problem: InferenceProblem) -> np.ndarray:
    """Fit one half of the conditions, and return the PIT values (n,) of the measured times of the other half."""
    indices = np.arange(len(problem.measured_time))
    halves = [replace(problem, conditions=problem.conditions.take(half), measured_time=problem.measured_time[half])
              for half in (indices[::2], indices[1::2])]
    candidate = search_space(SETTINGS, problem).candidate(fit_vector(halves[0]))
    times = halves[1].model(candidate.inputs.points(standard_normals(2, 1 << 13, 1)), halves[1].conditions)
    return np.asarray(ndtr((halves[1].measured_time - times) / candidate.output_std).mean(axis=0))


def fit_vector(problem: InferenceProblem) -> np.ndarray:
    """Return the vector of unknowns (k,) of a fit from the default start."""
    return np.array(fit.refined_estimate(SETTINGS, problem, fit.final_state(SETTINGS, problem))["vector"])


@cache
def find_directions() -> np.ndarray:
    """Return the combinations (c, k) that such sets identify, from the information matrix at the true inputs."""
    problem = draw_problem(TRUTH, 0, _MANY)
    space = search_space(SETTINGS, problem)
    candidates = combinations(problem, space, space.vector(TRUTH))
    return np.array([direction_of(space, combination.weights) for combination in candidates
                     if combination.std_error * np.sqrt(_MANY) < 0.25])


def draw_problem(truth: Candidate, seed: int, runs: int = 1, every: int = _EVERY) -> InferenceProblem:
    """Return every `every`-th condition of the table with `runs` times in s each, drawn from the candidate `truth`."""
    table = Library(Path(os.environ.get("SLIPSTICK_TABLES", "tables"))).table("nominal")
    model, random = table_model(table, "clip"), np.random.default_rng([2026, seed])
    conditions = table.conditions.take(np.tile(np.arange(0, len(table.conditions), every), runs))
    count = len(conditions)
    points = truth.inputs.points(random.standard_normal((count, truth.inputs.dimension)))
    times = np.diagonal(model(points, conditions)) + truth.output_std * random.standard_normal(count)
    return InferenceProblem(model, conditions, times, table.lower, table.upper, tuple(axis.name for axis in table.axes),
                            table.knots)
