"""Table II of the paper with our numbers: the classic grid beside the genetic fit, on the shipped recordings.

    python -m benchmarks.table_two

The classic way takes as few quasi-Monte-Carlo samples as keep its likelihood within 0.05 decades at the fit, and shares
the model's times among all output stds. A coarse grid is run whole, and its best node refined: that is the best optimum
known. What a grid costs that comes within 0.05 decades by itself is extrapolated from the time of a candidate. How many
values of each unknown that takes is measured on grids quadrature at random offsets about the optimum. The genetic fit is run
for 20 seeds. Times are processor times of all threads, in one process.
"""

import time
from itertools import product as every
from pathlib import Path

import numpy as np

from benchmarks.results import write
from slipstick.inference import table_problem
from slipstick.storage.library import Library
from slipstick.uncertainty import log10_mean_density, standard_normals
from slipstick.uncertainty.fit import FitSettings, classic, fit
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import TOLERANCE, InferenceProblem, Unknowns, exact

SEEDS = range(1, 21)
COARSE = 8
OFFSETS = 12
HOURS = 3600.0
PAPER = (("paper: classic", -269.0, 277 * HOURS), ("paper: expansions + genetic algorithm", -273.0, 1.65 * HOURS))


def main() -> None:
    """Measure and write."""
    library = Library(Path("tables"))
    problem = table_problem(library.table("nominal"), library.recording("measured"), "clip")
    space = search_space(FitSettings(), problem)
    coarse, node, optimum, spent = whole_grid(problem)
    best = height(problem, space, optimum)
    samples = coarse.samples
    each = spent["search"] / classic.candidate_count(coarse, space)
    needed = grid_needed(problem, space, optimum, best)
    fits = [genetic(problem, space, seed) for seed in SEEDS]
    found = np.array([entry[0] for entry in fits])
    seconds = np.array([entry[1] for entry in fits])
    refined = best if best > found.max() else float(found.max())
    extrapolated = each * float(needed) ** len(space.lower)
    rows: list[list[object]] = [
        [f"classic, {COARSE}^5 grid, {samples} samples", f"{height(problem, space, node):.4f}",
         spent["search"], "measured"],
        ["the same, its best node refined", f"{best:.4f}", spent["search"] + spent["refine"], "measured"],
        [f"classic, {needed}^5 grid, {samples} samples", f"{refined - TOLERANCE:.2f}", extrapolated,
         f"extrapolated from {1e6 * each:.0f} us a candidate"],
        ["genetic fit, refined: median of 20 seeds", f"{np.median(found):.4f}", float(np.median(seconds)), "measured"],
        ["genetic fit, refined: worst of 20 seeds", f"{found.min():.4f}", float(seconds.max()), "measured"],
        *([name, value, taken, "their recordings, 8 cores"] for name, value, taken in PAPER),
    ]
    within = int(np.sum(found > refined - TOLERANCE))
    rows.append([f"seeds within {TOLERANCE} decades of the best known", f"{within} of {len(fits)}", "", "measured"])
    rows.append(["processor time of the extrapolated grid over that of a fit",
                 f"{extrapolated / np.median(seconds):.3g}", "", f"least {extrapolated / seconds.max():.3g}"])
    write("table_two", ["method", "log10 likelihood", "processor time [s]", "how known"], rows,
          "python -m benchmarks.table_two")


def whole_grid(problem: InferenceProblem) -> tuple[FitSettings, np.ndarray, np.ndarray, dict[str, float]]:
    """The coarse grid at the fewest samples that do: settings, best node, refined optimum, processor times."""
    spent = {}
    draft = FitSettings(method="classic", grid=COARSE, samples=1024, intervals=False)
    for _ in range(2):  # the optimum that sets the number of samples, then the run that counts
        begun = time.process_time()
        state = fit.final_state(draft, problem)
        spent["search"] = time.process_time() - begun
        begun = time.process_time()
        optimum = np.array(fit.refined_estimate(draft, problem, state)["vector"])
        spent["refine"] = time.process_time() - begun
        used = draft
        draft = FitSettings(method="classic", grid=COARSE, samples=samples_needed(problem, optimum), intervals=False)
        if draft.samples == used.samples:
            break
    return used, np.array(state["points"][0]), optimum, spent


def samples_needed(problem: InferenceProblem, optimum: np.ndarray) -> int:
    """Fewest samples, a power of two, with a root mean square error below the tolerance at the optimum."""
    candidate = search_space(FitSettings(), problem).candidate(optimum)
    reference = exact(problem, candidate).sum()
    for power in range(4, 16):
        errors = []
        for seed in range(1, 9):
            points = candidate.inputs.points(standard_normals(len(problem.axes), 2**power, seed))
            times = problem.model(points, problem.conditions)
            whole = log10_mean_density(times, problem.measured_time, candidate.output_std).sum()
            errors.append(whole - reference)
        if np.sqrt(np.mean(np.square(errors))) < TOLERANCE:
            return 2**power
    raise RuntimeError("no number of samples was enough")


def grid_needed(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, best: float) -> int:
    """Values of each unknown at which the best node of a grid, wherever it lies, is within the tolerance on average."""
    random = np.random.default_rng(1)
    span = space.upper - space.lower
    for count in (8, 12, 16, 24, 32, 48, 64, 96, 128):
        step, losses = span / (count - 1), []
        for _ in range(OFFSETS):
            below = random.random(len(span))
            nodes = [np.clip(optimum + (corner - below) * step, space.lower, space.upper)
                     for corner in (np.array(corner) for corner in every((0, 1), repeat=len(span)))]
            losses.append(best - max(height(problem, space, node) for node in nodes))
        print(f"grid of {count} values: {np.mean(losses):.3f} decades below", flush=True)
        if np.mean(losses) < TOLERANCE:
            return count
    raise RuntimeError("no grid was fine enough")


def genetic(problem: InferenceProblem, space: Unknowns, seed: int) -> tuple[float, float]:
    """log10 likelihood and processor time of one fit."""
    settings, begun = FitSettings(seed=seed, intervals=False), time.process_time()
    found = np.array(fit.refined_estimate(settings, problem, fit.final_state(settings, problem))["vector"])
    spent = time.process_time() - begun
    print(f"seed {seed}: {height(problem, space, found):.4f} in {spent:.1f} s", flush=True)
    return height(problem, space, found), spent


def height(problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> float:
    return float(exact(problem, space.candidate(vector)).sum())


if __name__ == "__main__":
    main()
