"""The genetic algorithm and the classic grid: resumption, bounds, and comparison with random search and plain loops."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm, qmc

from slipstick.uncertainty.fit import FitSettings, classic, fit
from slipstick.uncertainty.fit.genetic import Population, Search, ask, empty, tell
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem

SEARCH = Search(np.array([-2.0, 0.0, 1.0]), np.array([1.0, 1.0, 5.0]), 20, seed=3)


def ridge(points: np.ndarray) -> np.ndarray:
    """A maximum of 0 at (-1, 0.5, 2) on a ridge across the axes, 10 times as long as wide."""
    offset = points - [-1.0, 0.5, 2.0]
    along = offset @ np.ones(3) / 3
    return -np.sum((offset - along[:, None]) ** 2, axis=1) - along**2 / 10**2


def run(search: Search, population: Population, generations: int,
        fitness: Callable[[np.ndarray], np.ndarray]) -> Population:
    for _ in range(generations):
        candidates = ask(search, population)
        population = tell(search, population, candidates, fitness(candidates))
    return population


def are_equal(first: Population, second: Population) -> bool:
    return bool(np.array_equal(first.points, second.points) and np.array_equal(first.fitness, second.fitness)
                and first.generation == second.generation)


def test_a_resumed_search_is_bit_identical() -> None:
    uninterrupted = run(SEARCH, empty(), 20, ridge)
    half = run(SEARCH, empty(), 10, ridge)
    resumed = Population.from_dict(json.loads(json.dumps(half.to_dict(), allow_nan=False)))
    assert are_equal(run(SEARCH, resumed, 10, ridge), uninterrupted)
    # Negative control: a change of one bit changes the result.
    resumed.points[0, 0] = np.nextafter(resumed.points[0, 0], 0.0)
    assert not are_equal(run(SEARCH, resumed, 10, ridge), uninterrupted)


def test_candidates_depend_on_population_and_seed_only() -> None:
    population = run(SEARCH, empty(), 3, ridge)
    np.testing.assert_array_equal(ask(SEARCH, population), ask(SEARCH, population))
    assert not np.array_equal(ask(SEARCH, population), ask(replace(SEARCH, seed=4), population))
    assert not np.array_equal(ask(SEARCH, empty()), ask(replace(SEARCH, seed=4), empty()))


def test_candidates_are_within_the_bounds_and_reach_them() -> None:
    """The maximum lies outside the bounds, so the best candidate is a corner."""
    population = empty()
    for _ in range(40):
        candidates = ask(SEARCH, population)
        assert np.all((candidates >= SEARCH.lower) & (candidates <= SEARCH.upper))
        population = tell(SEARCH, population, candidates, candidates.sum(axis=1))
    np.testing.assert_array_equal(population.points[0], SEARCH.upper)


def test_the_best_candidate_is_kept_and_nan_is_rejected() -> None:
    def partial(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 0.0, np.nan, ridge(points))

    population, best = empty(), -np.inf
    for _ in range(15):
        population = run(SEARCH, population, 1, partial)
        assert population.fitness[0] >= best
        assert np.all(population.fitness[:-1] >= population.fitness[1:])
        best = population.fitness[0]
    assert np.all(population.points[:, 0] <= 0.0)


def test_is_better_than_random_search_on_a_ridge() -> None:
    """The distance from the maximum is smaller than for a Latin hypercube with as many points, by five on average."""
    ratios = []
    for seed in range(6):
        search = replace(SEARCH, seed=seed)
        samples = search.lower + (search.upper - search.lower) * qmc.LatinHypercube(3, rng=seed).random(800)
        ratios.append(np.log10(ridge(samples).max() / run(search, empty(), 40, ridge).fitness[0]))
    assert min(ratios) > 0
    assert np.mean(ratios) > np.log10(5)


# The classic grid compared with a straightforward loop over all candidates and samples.


TINY = FitSettings(method="classic", grid=3, samples=32, seed=5, refine=False, intervals=False,
                   mean_bounds=((0.9, 1.1),), std_bounds=((0.01, 0.1),), output_std_bounds=(0.002, 0.02))


@pytest.fixture(scope="module")
def small() -> InferenceProblem:
    """Six conditions of a nonlinear model, one of which does not lock at large values of the first input."""
    slopes = np.random.default_rng(3).uniform(-0.2, 0.2, (2, 6))

    def model(points: np.ndarray, conditions: Any) -> np.ndarray:
        times = 0.5 + np.sinh((points - 1.0) @ slopes)
        times[points[:, 0] > 1.15, 0] = np.nan
        return times

    measured = 0.5 + 0.02 * np.random.default_rng(4).standard_normal(6)
    return InferenceProblem(model, None, measured, np.full(2, 0.5), np.full(2, 1.5), ("a", "b"))


def by_loop(settings: FitSettings, problem: InferenceProblem) -> tuple[list[float], float, int]:
    """The best candidate on natural scale, its log10 likelihood, and the number of candidates."""
    levels = [np.linspace(*settings.mean_bounds[0], settings.grid)] * 2
    levels += [np.geomspace(*settings.std_bounds[0], settings.grid)] * 2
    levels += [np.geomspace(*settings.output_std_bounds, settings.grid)]
    levels += [np.linspace(-0.98, 0.98, settings.grid)] * settings.correlated
    normals = qmc.MultivariateNormalQMC(np.zeros(2), rng=settings.seed).random(settings.samples)
    best, highest, count = [], -np.inf, 0
    for values in product(*levels):
        count += 1
        first, second, std_1, std_2, noise = values[:5]
        rho = values[5] if settings.correlated else 0.0
        logs = np.full((settings.samples, 6), -np.inf)
        for row, (u, v) in enumerate(normals):
            point = [first + std_1 * u, second + std_2 * (rho * u + np.sqrt(1 - rho**2) * v)]
            logs[row] = norm.logpdf(1e3 * problem.measured_time, 1e3 * problem.model(np.array([point]), None)[0],
                                    1e3 * noise)
        likelihood = float(np.sum(logsumexp(np.where(np.isnan(logs), -np.inf, logs), axis=0)
                                  - np.log(settings.samples)) / np.log(10))
        if likelihood > highest:
            best, highest = list(values), likelihood
    return best, highest, count


@pytest.mark.parametrize("changes", [{}, {"correlated": True, "grid": 2}])
def test_the_best_node_is_the_best_of_all_candidates(small: InferenceProblem, changes: dict[str, Any]) -> None:
    settings = replace(TINY, **changes)
    space = search_space(settings, small)
    expected, highest, count = by_loop(settings, small)
    assert classic.candidate_count(settings, space) == count
    results = [classic.best_of_block(settings, small, space, block)
               for block in range(classic.block_count(settings, space))]
    vector, likelihood = max(results, key=lambda result: result[1])
    np.testing.assert_allclose(likelihood, highest, rtol=1e-12)
    np.testing.assert_allclose([*vector[:2], *np.exp(vector[2:5]), *vector[5:]], expected, rtol=1e-12)
    assert len({tuple(best[:2]) for best, _ in results}) == settings.grid**2  # the means differ between blocks


def test_a_resumed_grid_search_is_identical(small: InferenceProblem) -> None:
    uninterrupted = state = fit.initial_state(TINY, small)
    assert state["generations"] == 9
    while not fit.is_finished(TINY, uninterrupted):
        uninterrupted = fit.next_state(TINY, small, uninterrupted)
    for _ in range(4):
        state = fit.next_state(TINY, small, state)
    resumed = json.loads(json.dumps(state, allow_nan=False))
    while not fit.is_finished(TINY, resumed):
        resumed = fit.next_state(TINY, small, resumed)
    assert resumed == uninterrupted
    assert uninterrupted["history"] == sorted(uninterrupted["history"])
    np.testing.assert_allclose(uninterrupted["history"][-1], by_loop(TINY, small)[1], rtol=1e-12)


def test_the_likelihood_is_zero_if_no_engagement_locks(small: InferenceProblem) -> None:
    never = InferenceProblem(lambda points, conditions: np.full((len(points), 6), np.nan), None, small.measured_time,
                             small.lower, small.upper, small.axes)
    vector, highest = classic.best_of_block(TINY, never, search_space(TINY, never), 0)
    assert highest == -np.inf
    assert np.isfinite(vector).all()
