"""Models with closed-form shifting times, whose slopes and kinks resemble those of the clutch."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import norm

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns

ClosedForm = Callable[[np.ndarray], float]


@dataclass(frozen=True)
class Surfaces:
    """n surfaces t = base + slope . (x - 1) + bend max(0, (1, -1) . (x - 1) - kink), one per condition."""

    base: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    kink: np.ndarray


def kinked(points: np.ndarray, surfaces: Surfaces) -> np.ndarray:
    offset = points - 1.0
    beyond = (offset[:, :1] - offset[:, 1:2]) - surfaces.kink
    return surfaces.base + offset @ surfaces.slope.T + surfaces.bend * np.maximum(0.0, beyond)


def linear(points: np.ndarray, surfaces: Surfaces) -> np.ndarray:
    return surfaces.base + (points - 1.0) @ surfaces.slope.T


def surfaces(count: int) -> Surfaces:
    """Surfaces whose times increase with the first input and decrease with the second, by 0.05 to 0.25 s per unit."""
    random = np.random.default_rng(count)
    slope = np.column_stack([random.uniform(0.05, 0.25, count), -random.uniform(0.05, 0.25, count)])
    return Surfaces(random.uniform(0.3, 0.9, count), slope, random.uniform(0.0, 0.2, count),
                    random.uniform(-0.1, 0.2, count))


def measure(model: Callable[[np.ndarray, Surfaces], np.ndarray], conditions: Surfaces, truth: Candidate) -> np.ndarray:
    """One measured time per condition, with independent inputs and noise."""
    random = np.random.default_rng(5)
    count = len(conditions.base)
    times = model(truth.inputs.points(random.standard_normal((count, 2))), conditions)
    return np.diagonal(times) + truth.output_std * random.standard_normal(count)


def pose(model: Callable[[np.ndarray, Surfaces], np.ndarray], count: int, truth: Candidate) -> InferenceProblem:
    conditions = surfaces(count)
    return InferenceProblem(model, conditions, measure(model, conditions, truth), np.full(2, 0.5), np.full(2, 1.5),
                            ("pressure_bias", "initial_position"))


@pytest.fixture(scope="session")
def truth() -> Candidate:
    return Candidate(Inputs([1.04, 0.97], [0.03, 0.05]), 0.004)


@pytest.fixture(scope="session")
def problem_measured_at() -> Callable[[Candidate], InferenceProblem]:
    """Builds a problem of 72 kinked conditions, measured at given inputs, on the box of the default table."""
    return lambda truth: pose(kinked, 72, truth)


@pytest.fixture(scope="session")
def problem(truth: Candidate) -> InferenceProblem:
    return pose(kinked, 72, truth)


@pytest.fixture(scope="session")
def mixed() -> Candidate:
    """A candidate with a full, nonsymmetric mixing matrix."""
    return Candidate(Inputs([1.02, 0.96], mixing=[[0.05, 0.04], [0.01, 0.03]]), 0.004)


@pytest.fixture(scope="session")
def linear_problem(mixed: Candidate) -> InferenceProblem:
    """24 linear conditions, whose times are normal, measured at `mixed`."""
    return pose(linear, 24, mixed)


@pytest.fixture(scope="session")
def posed() -> Callable[[np.ndarray, Candidate], tuple[InferenceProblem, Unknowns, ClosedForm]]:
    """Builds a linear problem with slopes (d, n), measured at given inputs.

    Its times are normal, so the log10 likelihood has a closed form, a function of the unknowns on natural scale (k,).
    """
    def make(slope: np.ndarray, truth: Candidate) -> tuple[InferenceProblem, Unknowns, ClosedForm]:
        random, (d, n) = np.random.default_rng(3), slope.shape
        points = truth.inputs.points(random.standard_normal((n, d)))
        times = 1.0 + np.sum((points - 1.0) * slope.T, axis=1) + truth.output_std * random.standard_normal(n)
        knots = tuple(np.linspace(0.0, 2.0, 9) for _ in range(d))
        problem = InferenceProblem(lambda points, conditions: 1.0 + (points - 1.0) @ slope, None, times, np.zeros(d),
                                   np.full(d, 2.0), tuple("abcdefg"[:d]), knots)

        def closed(natural: np.ndarray) -> float:
            mean = 1.0 + (natural[:d] - 1.0) @ slope
            std = np.sqrt(natural[2 * d]**2 + natural[d:2 * d]**2 @ slope**2)
            return float(np.sum(norm.logpdf(times, mean, std)) / np.log(10) - 3 * n)

        return problem, search_space(FitSettings(std_bounds=((0.002, 0.5),)), problem), closed

    return make


@pytest.fixture(scope="session")
def ridge(posed: Callable[[np.ndarray, Candidate], tuple[InferenceProblem, Unknowns, ClosedForm]],
          ) -> tuple[InferenceProblem, Unknowns, ClosedForm]:
    """Two inputs with nearly proportional slopes, whose scatter can hardly be separated."""
    random = np.random.default_rng(1)
    slope = random.uniform(0.1, 0.3, 48) * np.array([[1.0], [-0.8]]) + 0.02 * random.standard_normal((2, 48))
    return posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
