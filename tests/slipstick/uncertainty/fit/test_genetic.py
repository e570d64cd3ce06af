"""The genetic algorithm by itself: bit-exact resume, bounds, and better than guessing."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from slipstick.uncertainty.fit.genetic import Population, Search, ask, empty, tell

SEARCH = Search(np.array([-2.0, 0.0, 1.0]), np.array([1.0, 1.0, 5.0]), 20, seed=3)


def ridge(points: np.ndarray) -> np.ndarray:
    """A maximum of 0 at (-1, 0.5, 2) on a ridge across the axes, 10 times as long as wide."""
    away = points - [-1.0, 0.5, 2.0]
    along = away @ np.ones(3) / 3
    return -np.sum((away - along[:, None]) ** 2, axis=1) - along**2 / 10**2


def run(search: Search, population: Population, generations: int,
        fitness: Callable[[np.ndarray], np.ndarray]) -> Population:
    for _ in range(generations):
        candidates = ask(search, population)
        population = tell(search, population, candidates, fitness(candidates))
    return population


def same(one: Population, other: Population) -> bool:
    return bool(np.array_equal(one.points, other.points) and np.array_equal(one.fitness, other.fitness)
                and one.generation == other.generation)


def test_resumes_bit_for_bit_after_json() -> None:
    straight = run(SEARCH, empty(), 20, ridge)
    half = run(SEARCH, empty(), 10, ridge)
    revived = Population.from_dict(json.loads(json.dumps(half.to_dict(), allow_nan=False)))
    assert same(run(SEARCH, revived, 10, ridge), straight)
    # Control: one bit of one number changes what follows.
    revived.points[0, 0] = np.nextafter(revived.points[0, 0], 0.0)
    assert not same(run(SEARCH, revived, 10, ridge), straight)


def test_asks_the_same_until_told() -> None:
    population = run(SEARCH, empty(), 3, ridge)
    np.testing.assert_array_equal(ask(SEARCH, population), ask(SEARCH, population))
    assert not np.array_equal(ask(SEARCH, population), ask(replace(SEARCH, seed=4), population))
    assert not np.array_equal(ask(SEARCH, empty()), ask(replace(SEARCH, seed=4), empty()))


def test_stays_in_its_bounds_and_reaches_them() -> None:
    """The maximum lies outside: the best ends on the corner, and no candidate ever beyond it."""
    population = empty()
    for _ in range(40):
        candidates = ask(SEARCH, population)
        assert np.all((candidates >= SEARCH.lower) & (candidates <= SEARCH.upper))
        population = tell(SEARCH, population, candidates, candidates.sum(axis=1))
    np.testing.assert_array_equal(population.points[0], SEARCH.upper)


def test_never_forgets_the_best_and_never_keeps_what_failed() -> None:
    def fragile(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 0.0, np.nan, ridge(points))

    population, best = empty(), -np.inf
    for _ in range(15):
        population = run(SEARCH, population, 1, fragile)
        assert population.fitness[0] >= best
        assert np.all(population.fitness[:-1] >= population.fitness[1:])
        best = population.fitness[0]
    assert np.all(population.points[:, 0] <= 0.0)


def test_beats_guessing_on_a_ridge() -> None:
    """Latin hypercubes of as many points fall short of the maximum by more for each seed, fivefold on the whole."""
    gains = []
    for seed in range(6):
        search = replace(SEARCH, seed=seed)
        guesses = search.lower + (search.upper - search.lower) * qmc.LatinHypercube(3, rng=seed).random(800)
        gains.append(np.log10(ridge(guesses).max() / run(search, empty(), 40, ridge).fitness[0]))
    assert min(gains) > 0
    assert np.mean(gains) > np.log10(5)
