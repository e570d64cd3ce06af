"""Stand-ins for the clutch: closed forms of the shifting time, with slopes and kinks like those of its surfaces."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood import Candidate, Problem


@dataclass(frozen=True)
class Surfaces:
    """n surfaces t = base + slope . (x - 1) + bend max(0, (1, -1) . (x - 1) - kink): what stands for conditions."""

    base: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    kink: np.ndarray


def kinked(points: np.ndarray, surfaces: Surfaces) -> np.ndarray:
    away = points - 1.0
    beyond = (away[:, :1] - away[:, 1:2]) - surfaces.kink
    return surfaces.base + away @ surfaces.slope.T + surfaces.bend * np.maximum(0.0, beyond)


def linear(points: np.ndarray, surfaces: Surfaces) -> np.ndarray:
    return surfaces.base + (points - 1.0) @ surfaces.slope.T


def surfaces(count: int) -> Surfaces:
    """Later for more bias, earlier for a piston further on, by 0.05 to 0.25 s a unit."""
    random = np.random.default_rng(count)
    slope = np.column_stack([random.uniform(0.05, 0.25, count), -random.uniform(0.05, 0.25, count)])
    return Surfaces(random.uniform(0.3, 0.9, count), slope, random.uniform(0.0, 0.2, count),
                    random.uniform(-0.1, 0.2, count))


def measure(model: Callable[[np.ndarray, Surfaces], np.ndarray], conditions: Surfaces, truth: Candidate) -> np.ndarray:
    """One measured time a condition, each with inputs and noise of its own."""
    random = np.random.default_rng(5)
    count = len(conditions.base)
    times = model(truth.inputs.points(random.standard_normal((count, 2))), conditions)
    return np.diagonal(times) + truth.output_std * random.standard_normal(count)


def pose(model: Callable[[np.ndarray, Surfaces], np.ndarray], count: int, truth: Candidate) -> Problem:
    conditions = surfaces(count)
    return Problem(model, conditions, measure(model, conditions, truth), np.full(2, 0.5), np.full(2, 1.5),
                   ("pressure_bias", "initial_position"))


@pytest.fixture(scope="session")
def truth() -> Candidate:
    return Candidate(Inputs([1.04, 0.97], [0.03, 0.05]), 0.004)


@pytest.fixture(scope="session")
def problem_measured_at() -> Callable[[Candidate], Problem]:
    """Makes 72 kinked conditions, measured at a truth, in the box of the default table."""
    return lambda truth: pose(kinked, 72, truth)


@pytest.fixture(scope="session")
def problem(truth: Candidate) -> Problem:
    return pose(kinked, 72, truth)


@pytest.fixture(scope="session")
def mixed() -> Candidate:
    """A candidate whose mixing matrix is full and not symmetric."""
    return Candidate(Inputs([1.02, 0.96], mixing=[[0.05, 0.04], [0.01, 0.03]]), 0.004)


@pytest.fixture(scope="session")
def linear_problem(mixed: Candidate) -> Problem:
    """24 linear conditions, whose times are exactly normal, measured at `mixed`."""
    return pose(linear, 24, mixed)
