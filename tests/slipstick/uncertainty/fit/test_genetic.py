"""The genetic algorithm: bit-identical resumption, bounds, and comparison with random search."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from slipstick.uncertainty.fit.genetic import Population, Search, ask, empty, tell

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
