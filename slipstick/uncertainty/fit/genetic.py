"""A genetic algorithm on real numbers: tournament, blend crossover, polynomial mutation, elitism.

Ask it for candidates, tell it their fitness, which it maximises. Each generation draws from a generator of its own,
seeded by the seed and its number: a population is all there is to keep, and a search resumes from it bit for bit.
Sources: Eshelman and Schaffer 1993 (blend crossover), Deb and Goyal 1996 (polynomial mutation).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

REACH = 0.5  # a child lies up to half the distance of its parents beyond either
TOGETHER = 0.5  # share of children on the line through their parents: a ridge across the axes is climbed along it
MUTATION = 20.0  # exponent of the polynomial mutation: the higher, the nearer the child


@dataclass(frozen=True, eq=False)
class Search:
    """The box `lower`, `upper` (k,), the number of candidates a generation, and the seed."""

    lower: np.ndarray
    upper: np.ndarray
    size: int
    seed: int


@dataclass(frozen=True, eq=False)
class Population:
    """The best `points` (size, k) so far, best first, their `fitness` (size,), and the generations told."""

    points: np.ndarray
    fitness: np.ndarray
    generation: int

    def to_dict(self) -> dict[str, Any]:
        """The population as JSON that keeps every bit; a fitness of -inf, which JSON lacks, is None."""
        fitness = [value if np.isfinite(value) else None for value in self.fitness.tolist()]
        return {"points": self.points.tolist(), "fitness": fitness, "generation": self.generation}

    @classmethod
    def from_dict(cls, state: Mapping[str, Any]) -> "Population":
        """Rebuild what `to_dict` wrote."""
        fitness = [-np.inf if value is None else value for value in state["fitness"]]
        return cls(np.array(state["points"]), np.array(fitness), int(state["generation"]))


def empty() -> Population:
    """The population before the first generation."""
    return Population(np.empty((0, 0)), np.empty(0), 0)


def ask(search: Search, population: Population) -> np.ndarray:
    """Candidates of the next generation, shape (size, k): the same for the same population."""
    random = np.random.default_rng([search.seed, population.generation])
    count, span = (search.size, len(search.lower)), search.upper - search.lower
    if population.generation == 0:
        first_of_all: np.ndarray = search.lower + span * qmc.LatinHypercube(len(span), rng=random).random(search.size)
        return first_of_all
    # Two tournaments of two a child: rows are sorted, so the lower number wins.
    first, second = population.points[random.integers(len(population.points), size=(2, 2, search.size)).min(axis=1)]
    blend = np.where(random.random((search.size, 1)) < TOGETHER,
                     random.uniform(-REACH, 1 + REACH, (search.size, 1)), random.uniform(-REACH, 1 + REACH, count))
    children = first + blend * (second - first)
    draw = random.random(count)
    step = np.where(draw < 0.5, (2 * draw) ** (1 / (MUTATION + 1)) - 1, 1 - (2 - 2 * draw) ** (1 / (MUTATION + 1)))
    mutated = random.random(count) < 1 / len(span)
    candidates: np.ndarray = np.clip(children + mutated * step * span, search.lower, search.upper)
    return candidates


def tell(search: Search, population: Population, candidates: np.ndarray, fitness: np.ndarray) -> Population:
    """Keep the fittest `size` of the population and the candidates (c, k); a NaN fitness counts as -inf."""
    points = np.concatenate([population.points.reshape(-1, candidates.shape[1]), candidates])
    merged = np.concatenate([population.fitness, np.where(np.isnan(fitness), -np.inf, fitness)])
    best = np.argsort(-merged, kind="stable")[:search.size]
    return Population(points[best], merged[best], population.generation + 1)
