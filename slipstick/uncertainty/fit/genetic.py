"""A real-coded genetic algorithm: tournament selection, blend crossover, polynomial mutation, elitism.

The interface is ask and tell: `ask` returns candidates, `tell` takes their fitness, which is maximised. Each generation
has its own random generator, seeded by the seed and the generation number. The state is therefore the population alone,
and a resumed search is bit-identical to an uninterrupted one.
Sources: Eshelman and Schaffer 1993 (blend crossover), Deb and Goyal 1996 (polynomial mutation).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

REACH = 0.5  # alpha of the blend crossover: largest distance beyond a parent, relative to that between the parents
TOGETHER = 0.5  # fraction of children on the line through their parents, for likelihood ridges oblique to the axes
MUTATION = 20.0  # distribution index of the polynomial mutation; a higher index gives smaller mutations


@dataclass(frozen=True, eq=False)
class Search:
    """The bounds `lower`, `upper` (k,), the number of candidates per generation `size`, and the seed."""

    lower: np.ndarray
    upper: np.ndarray
    size: int
    seed: int


@dataclass(frozen=True, eq=False)
class Population:
    """The best `points` (size, k) so far, best first, their `fitness` (size,), and the number of generations."""

    points: np.ndarray
    fitness: np.ndarray
    generation: int

    def to_dict(self) -> dict[str, Any]:
        """The population as JSON without loss of precision; a fitness of -inf is None, because JSON has no infinity."""
        fitness = [value if np.isfinite(value) else None for value in self.fitness.tolist()]
        return {"points": self.points.tolist(), "fitness": fitness, "generation": self.generation}

    @classmethod
    def from_dict(cls, state: Mapping[str, Any]) -> "Population":
        """The inverse of `to_dict`."""
        fitness = [-np.inf if value is None else value for value in state["fitness"]]
        return cls(np.array(state["points"]), np.array(fitness), int(state["generation"]))


def empty() -> Population:
    """The population before the first generation."""
    return Population(np.empty((0, 0)), np.empty(0), 0)


def ask(search: Search, population: Population) -> np.ndarray:
    """Candidates of the next generation, shape (size, k); deterministic for a given population."""
    random = np.random.default_rng([search.seed, population.generation])
    count, span = (search.size, len(search.lower)), search.upper - search.lower
    if population.generation == 0:
        hypercube = scipy.stats.qmc.LatinHypercube(len(span), rng=random)
        return np.asarray(search.lower + span * hypercube.random(search.size))
    # Each child has two parents, each the winner of a tournament of two. Rows are sorted, so the lower index wins.
    first, second = population.points[random.integers(len(population.points), size=(2, 2, search.size)).min(axis=1)]
    blend = np.where(random.random((search.size, 1)) < TOGETHER,
                     random.uniform(-REACH, 1 + REACH, (search.size, 1)), random.uniform(-REACH, 1 + REACH, count))
    children = first + blend * (second - first)
    draw = random.random(count)
    step = np.where(draw < 0.5, (2 * draw) ** (1 / (MUTATION + 1)) - 1, 1 - (2 - 2 * draw) ** (1 / (MUTATION + 1)))
    mutated = random.random(count) < 1 / len(span)
    return np.asarray(np.clip(children + mutated * step * span, search.lower, search.upper))


def tell(search: Search, population: Population, candidates: np.ndarray, fitness: np.ndarray) -> Population:
    """The population with the `size` fittest of its points and the candidates (c, k); NaN fitness counts as -inf."""
    points = np.concatenate([population.points.reshape(-1, candidates.shape[1]), candidates])
    merged = np.concatenate([population.fitness, np.where(np.isnan(fitness), -np.inf, fitness)])
    best = np.argsort(-merged, kind="stable")[:search.size]
    return Population(points[best], merged[best], population.generation + 1)
