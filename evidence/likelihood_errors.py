"""Whether the errors that the service states for its likelihoods hold, on drawn models whose likelihood is known.

    python -m evidence.likelihood_errors            # replaces evidence/likelihood_errors.csv, some minutes

A model is a function of one input, a line, a parabola or a line with a bend, plus the normal scores of the others.
Given the first score, its output is normal, so that its density is a sum over a fine grid of that score. Inputs are of
all families, one in three models has dependent ones. Measured outputs are drawn from the model, or lie a given number
of standard deviations off: all on one side, or on either. Tables of one or two inputs are linear between knots.

A row is a method with a group of models: how many, in how many the true error of the log likelihood is within the
stated one, the median of both, and in how many no error is stated ("refused"). All methods have the same models.
"""

import argparse
import csv
import platform
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import logsumexp

from evidence.kept import PROCESSES, read_count
from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import (
    SAMPLES,
    Candidate,
    InferenceProblem,
    LikelihoodEstimate,
    by_sampling,
    compared,
    converged,
    expanded_with_lines,
    with_lines,
)
from slipstick.uncertainty.likelihood.line_rules import ACROSS

TABLE = Path(__file__).with_suffix(".csv")
COLUMNS = ("method", "inputs", "standard deviations off", "cases", "within the stated error", "refused",
           "median true error [decades]", "median stated error [decades]", "made by")
DISTANCES = (0, 2, 4, 6, 8)
"""Standard deviations by which measured outputs are off; 0: drawn from the model."""
GROUPS = {"table of 1 or 2": (1, 2), "1 or 2": (1, 2), "3 to 7": (3, 4, 5, 6, 7)}
METHODS: dict[str, Callable[[InferenceProblem, Candidate], LikelihoodEstimate]] = {
    "auto": converged, "exact": with_lines,
    "expansion": lambda problem, candidate: compared(problem, [candidate], expanded_with_lines(
        problem, [candidate], _settings(candidate), ACROSS))[0],
    "sampling": lambda problem, candidate: compared(problem, [candidate], by_sampling(
        problem, [candidate], _settings(candidate), standard_normals(candidate.inputs.dimension, SAMPLES, 1)))[0]}
FAMILIES = ("normal", "lognormal", "gamma", "beta", "uniform")
_ORDERS = (8, 8, 6, 5, 4, 3, 3)  # of expansions, by the number of inputs
_STEP = 0.002
_SCORES = np.arange(-16, 16 + _STEP, _STEP)


@dataclass(frozen=True, eq=False)
class Model:
    """Outputs (m, n) at points (m, d): `centre` + `gains` of the first input + `slopes` (d - 1, n) of other scores.

    The first input acts as its standard deviations from the mean, plus `bend` times those above `corner`, plus `square`
    times their square, or linearly between `knots` (k,) of such values.
    """

    inputs: Inputs
    centre: np.ndarray
    gains: np.ndarray
    slopes: np.ndarray
    bend: float
    corner: float
    square: float
    knots: np.ndarray | None

    def __call__(self, points: np.ndarray, conditions: Any = None) -> np.ndarray:
        """Outputs (m, n) at points (m, d)."""
        scores = [self.inputs.scores(axis, points[:, axis]) for axis in range(1, self.inputs.dimension)]
        others = np.column_stack([*scores, np.zeros(len(points))])[:, :len(self.slopes)] @ self.slopes
        return self.centre + self.first(points[:, 0])[:, None] * self.gains + others

    def first(self, values: np.ndarray) -> np.ndarray:
        """The effect (m,) of values (m,) of the first input, in units of the gains."""
        def smooth(deviations: np.ndarray) -> np.ndarray:
            return deviations + self.bend * np.maximum(deviations - self.corner, 0) + self.square * deviations**2

        deviations = (values - self.inputs.mean[0]) / self.inputs.marginal_std[0]
        return smooth(deviations) if self.knots is None else np.interp(deviations, self.knots, smooth(self.knots))


def draw_case(group: str, distance: int, seed: int) -> tuple[InferenceProblem, Candidate, np.ndarray]:
    """Draw a model with measured outputs, the candidate, and the log10 densities (n,) per ms that are right."""
    random = np.random.default_rng([seed, distance, list(GROUPS).index(group)])
    d, is_table = int(random.choice(GROUPS[group])), group.startswith("table")
    n = int(random.choice([4, 20, 100]))
    # The scores of bounded inputs are not known near their bounds, so that only the first input may be one.
    families = ("normal",) * d
    if not is_table:
        families = str(random.choice(FAMILIES)), *map(str, random.choice(FAMILIES[:2], d - 1))
    correlation = None
    if d > 1 and random.random() < 1 / 3:
        factor = np.eye(d) + 0.5 * random.standard_normal((d, d))
        correlation = factor @ factor.T
        correlation /= np.sqrt(np.outer(np.diag(correlation), np.diag(correlation)))
    std = random.uniform(0.02, 0.15, d)
    support = np.array([[1 - 3 * each, 1 + 3 * each] for each in std]) if "beta" in families else None
    inputs = Inputs(np.ones(d), std, families=families, correlation=correlation, support=support)
    slopes = (random.standard_normal((d, 1)) + random.uniform(0, 1) * random.standard_normal((d, n))) * 0.02
    knots = np.sort(random.uniform(-20, 20, 80)) if is_table else None
    model = Model(inputs, random.uniform(0.3, 1, n), slopes[0], slopes[1:], random.choice([0, random.uniform(-0.7, 2)]),
                  random.uniform(-1.5, 1.5), random.choice([0, random.uniform(-0.1, 0.1)]), knots)
    noise = float(np.median(np.linalg.norm(slopes, axis=0)) * 10 ** random.uniform(-1, 0.5))
    first = model.first(inputs.at_scores(np.column_stack([_SCORES] * d))[:, 0])
    together = slopes[1:].T @ inputs.factor[1:]  # (n, d)
    variance = noise**2 + np.sum(together[:, 1:] ** 2, axis=1)
    output = model.centre + np.outer(first, model.gains) + np.outer(_SCORES, together[:, 0])
    weight = np.exp(-0.5 * _SCORES**2) / np.sum(np.exp(-0.5 * _SCORES**2))
    mean = weight @ output
    spread = np.sqrt(weight @ (output - mean) ** 2 + variance)
    sides = random.choice([-1, 1]) * np.ones(n) if random.random() < 0.5 else random.choice([-1, 1], n)
    if distance:
        measured = mean + distance * spread * sides
    else:
        measured = np.diagonal(model(inputs.points(random.standard_normal((n, d))))) + noise * random.normal(size=n)
    right = logsumexp(-0.5 * _SCORES[:, None] ** 2 - 0.5 * (measured - output) ** 2 / variance, axis=0)
    right = (right + np.log(_STEP) - np.log(2 * np.pi) - 0.5 * np.log(variance)) / np.log(10) - 3
    edge = 30 * std
    axes = None if knots is None else (1 + std[0] * knots, *(np.linspace(1 - 15 * s, 1 + 15 * s, 61) for s in std[1:]))
    problem = InferenceProblem(model, None, measured, 1 - edge, 1 + edge, tuple("abcdefg"[:d]), axes)
    return problem, Candidate(inputs, noise), right


def run_case(group: str, distance: int, seed: int) -> list[tuple[float, float]]:
    """True and stated error of each method, in decades; the stated one is infinite where none is stated."""
    problem, candidate, right = draw_case(group, distance, seed)
    errors = []
    for method in METHODS.values():
        try:
            estimate = method(problem, candidate)
            errors.append((abs(float(estimate.density.sum() - right.sum())), estimate.error))
        except InvalidValue:
            errors.append((np.inf, np.inf))
    return errors


def _settings(candidate: Candidate) -> ExpansionSettings:
    return ExpansionSettings(_ORDERS[candidate.inputs.dimension - 1], checks=0)


def summarise(results: dict[tuple[str, int], list[list[tuple[float, float]]]]) -> Iterator[list[object]]:
    """Rows of the table, without their last column."""
    for place, method in enumerate(METHODS):
        for group in GROUPS:
            for distance in DISTANCES:
                errors = np.array([case[place] for case in results[group, distance]])
                stated = errors[np.isfinite(errors[:, 1])]
                medians = [f"{value:.2g}" for value in np.median(stated, axis=0)] if len(stated) else ["", ""]
                yield [method, group, distance or "drawn", len(errors), int(np.sum(stated[:, 0] <= stated[:, 1])),
                       len(errors) - len(stated), *medians]


def main() -> None:
    """Draw the models, and replace the table."""
    parser = argparse.ArgumentParser(prog="python -m evidence.likelihood_errors", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=read_count, default=40, help="models for each group and distance")
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    arguments = parser.parse_args()
    jobs = [(group, distance, seed) for group in GROUPS for distance in DISTANCES
            for seed in range(arguments.seed, arguments.seed + arguments.cases)]
    results = defaultdict(list)
    with ProcessPoolExecutor(PROCESSES) as pool:
        for (group, distance, _), errors in zip(jobs, pool.map(run_case, *zip(*jobs, strict=True), chunksize=4),
                                                strict=True):
            results[group, distance].append(errors)
    made_by = f"`python -m evidence.likelihood_errors`: {platform.machine()}, Python {platform.python_version()}"
    rows = [[*row, made_by] for row in summarise(results)]
    with TABLE.open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    for row in rows:
        print(*row[:-1], sep="\t")


if __name__ == "__main__":
    main()
