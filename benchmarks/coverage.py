"""Whether fits are calibrated: 90 % intervals that hold the truth in 90 % of the fits, and predictions that come true.

Data are drawn from the table at known inputs, and each set is fitted from the default start, as a user would. An
interval holds the truth where the profile there has dropped by less than at its ends. A prediction comes true where
held-out times are uniform on the scale of their predicted distribution (Dawid, J. R. Stat. Soc. A 147, 278, 1984).
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
PARTED = Candidate(Inputs([0.95, 1.1], [0.3, 0.02], families=("beta", "beta"), support=[[0.6, 1.3], [0.9, 1.3]]), 0.005)
"""A pressure bias that is mostly either low or high, as no normal input is."""
FLAT = Candidate(Inputs([0.95, 1.1], [0.15, 0.02], families=("uniform", "uniform")), 0.005)
"""Another family too, but so near to normal that it takes many sets to tell."""
LEVEL = 0.9
BINS = 10
_ENDED = 40  # sets whose intervals are followed to their ends: that takes most of the time
_EVERY = 2  # condition of the table: enough to tell, at half the time
T = TypeVar("T")
_MANY = 20  # runs of each condition for the information that the combinations are chosen by


@dataclass(frozen=True)
class Held:
    """Of one data set: the `drop` in decades to the truth in each direction, and which ends of each unknown are `open`.

    Only the first sets have their ends looked for: the others have None.
    """

    drop: list[float]
    open: list[tuple[bool, bool]] | None


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--sets", type=int, default=200, help="data sets for the intervals")
    arguments.add_argument("--predicted", type=int, default=100, help="data sets for the predictions, of each kind")
    given = arguments.parse_args()
    command = f"python -m benchmarks.coverage --sets {given.sets} --predicted {given.predicted}"
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        write("coverage", ("of", "weights", "true value", "held", "data sets", "coverage", "95 % from", "95 % to",
                           "open below", "open above"), intervals(_each(pool, held, given.sets)), command)
        kinds = (("normal inputs, fitted as such", right), ("U-shaped beta inputs, fitted as normal", wrong),
                 ("uniform inputs, fitted as normal", slightly_wrong))
        rows = [(kind, *predictions(np.array(_each(pool, task, given.predicted)))) for kind, task in kinds]
        write("pit", ("data", "p of uniform", *(f"{k / BINS:g} to {(k + 1) / BINS:g}" for k in range(BINS))), rows,
              command)


def intervals(sets: Sequence[Held]) -> list[tuple[object, ...]]:
    """Rows of coverage.csv: each unknown, then each identified combination."""
    space, rows = search_space(SETTINGS, drawn(TRUTH, 0)), []
    plain, span = space.to_natural(space.vector(TRUTH)), space.to_natural(space.upper) - space.to_natural(space.lower)
    for place, direction in enumerate(np.concatenate([np.eye(len(plain)), directions()])):
        own = place < len(plain)
        name = space.names[place] if own else f"combination {place - len(plain) + 1}"
        shares = zip(direction * span, space.names, strict=True)
        weights = "" if own else " ".join(f"{share:+.3f} {one}" for share, one in shares)
        inside = sum(one.drop[place] < drop_at_level(LEVEL) for one in sets)
        low, high = binomtest(inside, len(sets)).proportion_ci(0.95, "exact")
        looked = [one.open for one in sets if one.open is not None]
        ends = [f"{sum(one[place][side] for one in looked)} of {len(looked)}" if own else "" for side in (0, 1)]
        rows.append((name, weights, float(direction @ plain), inside, len(sets), inside / len(sets), low, high, *ends))
    return rows


def predictions(levels: np.ndarray, parts: int = BINS) -> tuple[float, ...]:
    """p of uniform levels (sets, n), and the share of each of `parts` equal parts.

    Levels of one set share its fit, so it is the sets that count: Hotelling's test of their mean shares.
    """
    places = np.minimum((levels * parts).astype(int), parts - 1)
    shares = np.array([np.bincount(row, minlength=parts) for row in places]) / levels.shape[1]
    count, free = len(shares), parts - 1
    away = shares[:, :free].mean(axis=0) - 1 / parts
    squared = count * away @ np.linalg.solve(np.cov(shares[:, :free].T), away)
    return float(f.sf(squared * (count - free) / (free * (count - 1)), free, count - free)), *shares.mean(axis=0)


def held(seed: int) -> Held:
    """Fit a data set and hold its intervals against the truth."""
    problem = drawn(TRUTH, seed)
    space, found = search_space(SETTINGS, problem), fitted(problem)
    if seed > _ENDED:
        return Held(drops(problem, found), None)
    ends = [profile_interval(problem, space, found, direction, LEVEL) for direction in np.eye(len(found))]
    return Held(drops(problem, found), [(one.lower is None, one.upper is None) for one in ends])


def drops(problem: InferenceProblem, found: np.ndarray) -> list[float]:
    """Decades from a fit down to the truth, for each unknown and each identified combination."""
    space = search_space(SETTINGS, problem)
    true = space.to_natural(space.vector(TRUTH))
    return [profile_drop(problem, space, found, direction, float(direction @ true))
            for direction in np.concatenate([np.eye(len(found)), directions()])]


def right(seed: int) -> np.ndarray:
    """Levels of held-out times (n,) for data of the family that is fitted."""
    return predicted(drawn(TRUTH, seed))


def wrong(seed: int) -> np.ndarray:
    """The same for data of another family."""
    return predicted(drawn(PARTED, seed))


def slightly_wrong(seed: int) -> np.ndarray:
    """The same for data of a family that is nearly the fitted one."""
    return predicted(drawn(FLAT, seed))


def predicted(problem: InferenceProblem) -> np.ndarray:
    """Fit one half of the conditions, and return where the others' times lie in their predicted distributions."""
    places = np.arange(len(problem.measured_time))
    halves = [replace(problem, conditions=problem.conditions.take(half), measured_time=problem.measured_time[half])
              for half in (places[::2], places[1::2])]
    candidate = search_space(SETTINGS, problem).candidate(fitted(halves[0]))
    times = halves[1].model(candidate.inputs.points(standard_normals(2, 1 << 13, 1)), halves[1].conditions)
    levels: np.ndarray = ndtr((halves[1].measured_time - times) / candidate.output_std).mean(axis=0)
    return levels


def fitted(problem: InferenceProblem) -> np.ndarray:
    """The vector of unknowns that a fit finds, without knowing the truth."""
    return np.array(fit.refined_estimate(SETTINGS, problem, fit.final_state(SETTINGS, problem))["vector"])


@cache
def directions() -> np.ndarray:
    """The combinations (c, k) that data such as these identify, by the information at the truth."""
    problem = drawn(TRUTH, 0, _MANY)
    space = search_space(SETTINGS, problem)
    runs = combinations(problem, space, space.vector(TRUTH))
    return np.array([direction_of(space, one.weights) for one in runs if one.std_error * np.sqrt(_MANY) < 0.25])


def drawn(truth: Candidate, seed: int, runs: int = 1, every: int = _EVERY) -> InferenceProblem:
    """Some conditions of the default table, each measured `runs` times under the truth."""
    table = Library(Path(os.environ.get("SLIPSTICK_TABLES", "tables"))).table("nominal")
    model, random = table_model(table, "clip"), np.random.default_rng([2026, seed])
    conditions = table.conditions.take(np.tile(np.arange(0, len(table.conditions), every), runs))
    count = len(conditions)
    points = truth.inputs.points(random.standard_normal((count, truth.inputs.dimension)))
    times = np.diagonal(model(points, conditions)) + truth.output_std * random.standard_normal(count)
    return InferenceProblem(model, conditions, times, table.lower, table.upper, tuple(axis.name for axis in table.axes),
                   table.knots)


def _each(pool: ProcessPoolExecutor, task: Callable[[int], T], count: int) -> list[T]:
    done = []
    for seed, one in enumerate(pool.map(task, range(1, count + 1)), start=1):
        done.append(one)
        print(f"{task.__name__} {seed}/{count}", flush=True)
    return done


if __name__ == "__main__":
    main()
