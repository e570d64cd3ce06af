"""Errors of the methods for the log10 likelihood, on the interpolated table.

    python -m benchmarks.likelihood

The 216 conditions of the default table are used. The measured times are drawn from each candidate (the first column
uses the shipped recordings and their fit), except in the last column, where the candidate is far from the data. The
reference is the integral along lines with a much finer rule. Errors are in decades, from one seed for deterministic
methods and as the RMS over 8 seeds for sampling methods.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.results import write
from slipstick.inference.problems import table_problem
from slipstick.storage.library import Library
from slipstick.uncertainty import Inputs, log10_mean_density, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import (
    Candidate,
    InferenceProblem,
    by_expansion,
    by_sampling,
    converged,
    exact,
    line_rules,
    lines,
)
from slipstick.uncertainty.likelihood.likelihood import integration_lines, times_on_lines

LIBRARY = Library(Path("tables"))
SEEDS = range(1, 9)
FITTED = "shipped recordings at their fit"
CASES = {
    FITTED: Candidate(Inputs([0.5, 1.39], [0.002, 0.189]), 0.0194),
    "std 0.05 and 0.08, noise 10 ms": Candidate(Inputs([1.0, 1.0], [0.05, 0.08]), 0.010),
    "std 0.05 and 0.08, noise 3 ms": Candidate(Inputs([1.0, 1.0], [0.05, 0.08]), 0.003),
    "std 0.05 and 0.08, noise 1 ms": Candidate(Inputs([1.0, 1.0], [0.05, 0.08]), 0.001),
    "std 0.15 and 0.15, noise 3 ms": Candidate(Inputs([1.0, 1.0], [0.15, 0.15]), 0.003),
    "std 0.002 and 0.002, noise 3 ms": Candidate(Inputs([1.0, 1.0], [0.002, 0.002]), 0.003),
    "gamma and uniform, std 0.1, noise 3 ms": Candidate(
        Inputs([1.0, 1.0], [0.1, 0.1], families=("gamma", "uniform")), 0.003),
}
FAR = "fitted to other data: means off by 0.05, noise 1 ms"
CASES[FAR] = Candidate(Inputs([0.95, 1.05], [0.05, 0.08]), 0.001)
DRAWN_FROM = {FAR: CASES["std 0.05 and 0.08, noise 1 ms"]}


def main() -> None:
    """Run the benchmark and write the table."""
    shipped = table_problem(LIBRARY.table("nominal"), LIBRARY.recording("measured"), "clip")
    problems = {name: shipped if name == FITTED else draw_times(shipped, DRAWN_FROM.get(name, case))
                for name, case in CASES.items()}
    references = {name: reference(problems[name], case) for name, case in CASES.items()}
    rows = []
    for label, method, seeds in methods():
        row: list[object] = [label]
        for name, case in CASES.items():
            errors = [method(problems[name], case, seed) - references[name] for seed in seeds]
            row.append(float(np.sqrt(np.mean(np.square(errors)))))
        rows.append(row)
        print(*row, sep="\t", flush=True)
    write("likelihood", ["error in decades", *CASES], rows, "python -m benchmarks.likelihood")


def methods():
    """Label, function (problem, candidate, seed) -> log10 likelihood, and seeds of each method."""
    yield "auto", lambda p, c, seed: converged(p, c, seed)[0].sum(), SEEDS[:1]
    yield "auto, without knots", lambda p, c, seed: converged(replace(p, knots=None), c, seed)[0].sum(), SEEDS
    yield "exact", lambda p, c, seed: exact(p, c, seed=seed).sum(), SEEDS[:1]
    yield "exact, without knots", lambda p, c, seed: exact(replace(p, knots=None), c, seed=seed).sum(), SEEDS[:1]
    yield "exact, without knots, 256 lines", (
        lambda p, c, seed: exact(replace(p, knots=None), c, 256, seed).sum()), SEEDS[:1]
    for power in (10, 12, 14, 16):
        yield f"table, 2^{power} samples", lambda p, c, seed, m=power: sample_likelihood(p, c, 2**m, seed), SEEDS
    for order in (2, 4, 8, 12, 20):
        yield f"expansion of order {order}", (
            lambda p, c, seed, o=order: by_expansion(p, [c], ExpansionSettings(o, checks=0)).sum()), SEEDS[:1]
    for order, power in ((4, 12), (8, 8), (8, 10), (8, 12), (8, 14), (8, 16), (12, 12), (12, 16)):
        yield f"expansion of order {order}, 2^{power} samples", (
            lambda p, c, seed, o=order, m=power: by_sampling(
                p, [c], ExpansionSettings(o, checks=0), standard_normals(2, 2**m, seed)).sum()), SEEDS


def sample_likelihood(problem: InferenceProblem, candidate: Candidate, count: int, seed: int) -> float:
    times = problem.model(candidate.inputs.points(standard_normals(2, count, seed)), problem.conditions)
    return float(log10_mean_density(times, problem.measured_time, candidate.output_std).sum())


def draw_times(problem: InferenceProblem, case: Candidate) -> InferenceProblem:
    """The problem with one measured time per condition, drawn from the candidate with independent inputs and noise."""
    random = np.random.default_rng(20)
    count = len(problem.measured_time)
    times = np.diagonal(problem.model(case.inputs.points(random.standard_normal((count, 2))), problem.conditions))
    return replace(problem, measured_time=times + case.output_std * random.standard_normal(count))


def reference(problem: InferenceProblem, case: Candidate) -> float:
    """The log10 likelihood with many more nodes across the lines and breakpoints along them."""
    defaults = line_rules._NODES_PER_WIDTH, line_rules._MOST_NODES, line_rules._FEWEST_NODES, line_rules._SCORES
    line_rules._NODES_PER_WIDTH, line_rules._MOST_NODES, line_rules._FEWEST_NODES = 6.0, 24, 8
    line_rules._SCORES = np.arange(-line_rules.WINDOW, line_rules.WINDOW, 0.02)
    quadrature = integration_lines(problem, case)
    (line_rules._NODES_PER_WIDTH, line_rules._MOST_NODES, line_rules._FEWEST_NODES, line_rules._SCORES) = defaults
    times = times_on_lines(problem, case.inputs, quadrature)
    return float(lines.log10_density(quadrature, times, problem.measured_time, case.output_std).sum())


if __name__ == "__main__":
    main()
