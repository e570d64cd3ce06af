"""Local expansions: their error over the scatter of the inputs, and the bounds of the region of validity."""

from typing import Any

import numpy as np
import pytest

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact
from slipstick.uncertainty.likelihood.local import polynomial_problem


def curved(points: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """A nonlinear model with interactions, like shifting times."""
    times: np.ndarray = 0.3 + 0.4 * np.exp((points - 1.0) @ slope)
    return times


class Counted:
    def __init__(self) -> None:
        self.runs = 0

    def __call__(self, points: np.ndarray, conditions: Any) -> np.ndarray:
        self.runs += len(points)
        return curved(points, conditions)


def posed(dimension: int, model: Any = curved) -> InferenceProblem:
    random = np.random.default_rng(dimension)
    slope = random.uniform(-0.8, 0.8, (dimension, 40))
    times = curved(random.normal(1.02, 0.08, (1, dimension)), slope)[0] + 0.004 * random.standard_normal(40)
    names = tuple("abcdefghijklmnopqrst"[:dimension])
    return InferenceProblem(model, slope, times, np.full(dimension, 0.5), np.full(dimension, 1.5), names)


@pytest.mark.parametrize("dimension", [1, 2, 3, 7])
def test_the_expansion_approximates_the_model_near_the_candidate(dimension: int) -> None:
    counted = Counted()
    problem = posed(dimension, counted)
    space = search_space(FitSettings(), problem)
    mean, std = np.linspace(0.95, 1.1, dimension), np.linspace(0.05, 0.08, dimension)
    vector = space.vector(Candidate(Inputs(mean, std), 0.005))
    local, region = polynomial_problem(problem, space, vector)
    runs = counted.runs
    scatter = np.random.default_rng(1).standard_normal((500, dimension))
    points = mean + 2 * std * scatter / np.maximum(1, np.abs(scatter))
    error = np.abs(local.model(points, problem.conditions) - curved(points, problem.conditions))
    assert error.max() < 5e-4  # s, a tenth of the noise
    assert counted.runs == runs < 3000
    by_expansion, by_model = (exact(each, space.candidate(vector)).sum() for each in (local, problem))
    assert abs(by_expansion - by_model) < 0.02
    assert np.all(region.lower <= vector)
    assert np.all(vector <= region.upper)
    assert np.all(region.lower >= space.lower)
    assert np.all(region.upper <= space.upper)


def test_the_region_is_proportional_to_the_scatter() -> None:
    """The bounds of means and stds are those of the region; the bounds of the output std are unchanged."""
    problem = posed(2)
    space = search_space(FitSettings(), problem)
    wide, narrow = (space.vector(Candidate(Inputs([1.0, 1.0], [std, 0.05]), 0.005)) for std in (0.2, 0.02))
    regions = [polynomial_problem(problem, space, vector)[1] for vector in (wide, narrow)]
    spans = [region.upper - region.lower for region in regions]
    assert spans[0][0] > 5 * spans[1][0]
    for region in regions:
        assert np.all(region.upper[2:4] < space.upper[2:4])
        np.testing.assert_array_equal([region.lower[4], region.upper[4]], [space.lower[4], space.upper[4]])


def test_the_region_contains_a_candidate_at_the_bounds() -> None:
    problem = posed(2)
    space = search_space(FitSettings(), problem)
    for vector in (space.lower, space.upper):
        local, region = polynomial_problem(problem, space, vector)
        assert np.all((region.lower <= vector) & (vector <= region.upper))
        assert np.all(np.isfinite(local.model(vector[None, :2], problem.conditions)))


@pytest.mark.parametrize("dimension", [3, 7])
def test_runs_that_do_not_lock_are_imputed(dimension: int) -> None:
    weights = np.linspace(0.3, 0.5, dimension)

    def partial(points: np.ndarray, slope: np.ndarray) -> np.ndarray:
        times = 0.4 + (points - 1.0) ** 2 @ weights[:, None] * np.ones(slope.shape[1])
        return np.where(points[:, :1] > 1.35, np.nan, times)

    problem = posed(dimension, partial)
    space = search_space(FitSettings(), problem)
    vector = space.vector(Candidate(Inputs(np.ones(dimension), np.full(dimension, 0.1)), 0.005))
    local, _ = polynomial_problem(problem, space, vector)
    points = np.random.default_rng(1).normal(1.0, 0.06, (200, dimension))
    np.testing.assert_allclose(local.model(points, problem.conditions), partial(points, problem.conditions), atol=1e-9)


def test_twenty_inputs_can_be_expanded() -> None:
    problem = posed(20)
    space = search_space(FitSettings(), problem)
    local, _ = polynomial_problem(problem, space, (space.lower + space.upper) / 2)
    assert np.all(np.isfinite(local.model(np.ones((1, 20)), problem.conditions)))
