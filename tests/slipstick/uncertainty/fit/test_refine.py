"""The refinement: the global maximum of a closed form, bounds, and constrained maxima."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit.refine import constrained_maximum, refined_vector
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns

ClosedForm = Callable[[np.ndarray], float]
Posed = Callable[[np.ndarray, Candidate], tuple[InferenceProblem, Unknowns, ClosedForm]]


@pytest.fixture(scope="module")
def best(ridge: tuple[InferenceProblem, Unknowns, ClosedForm]) -> float:
    """The greatest log10 likelihood that scipy finds in closed form from many starts."""
    _, space, closed = ridge
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    starts = low + np.random.default_rng(2).random((8, 5)) * (high - low)
    results = [minimize(lambda natural: -closed(natural), start, method="L-BFGS-B",
                        bounds=list(zip(low, high, strict=True))) for start in starts]
    return max(-float(result.fun) for result in results)


@pytest.mark.slow
def test_the_global_maximum_is_reached_from_all_starts(ridge: tuple[InferenceProblem, Unknowns, ClosedForm],
                                                       best: float) -> None:
    problem, space, closed = ridge
    starts = space.lower + np.random.default_rng(7).random((2, 5)) * (space.upper - space.lower)
    for start in starts:
        optimum = refined_vector(problem, space, start)
        assert np.all((optimum >= space.lower) & (optimum <= space.upper))
        assert abs(closed(space.to_natural(optimum)) - best) < 0.002
    assert all(closed(space.to_natural(start)) < best - 1 for start in starts)


def test_a_start_with_the_smallest_stds_reaches_the_maximum(posed: Posed) -> None:
    """There the derivative with respect to a log std vanishes, and an optimizer in log stds would not move."""
    slope = np.random.default_rng(4).uniform(-0.3, 0.3, (2, 80))
    problem, space, closed = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
    scattered = space.from_natural(np.array([0.95, 1.05, 0.1, 0.08, 0.006]))
    unscattered = space.from_natural(np.array([0.95, 1.05, 0.0, 0.0, 0.03]))
    optimum, likelihood = constrained_maximum(problem, space, unscattered)
    assert likelihood > closed(space.to_natural(unscattered)) + 2
    assert abs(likelihood - constrained_maximum(problem, space, scattered)[1]) < 1e-4
    assert np.all(optimum[2:4] > unscattered[2:4] + 2)


@pytest.mark.parametrize("index", [0, 3, 4])
def test_a_constrained_maximum_keeps_the_fixed_value(ridge: tuple[InferenceProblem, Unknowns, ClosedForm],
                                                     index: int) -> None:
    """For a single unknown and for a random combination; the maximum is as high as that of SciPy."""
    problem, space, closed = ridge
    begin = space.from_natural(np.array([0.9, 1.1, 0.05, 0.1, 0.01]))
    single, single_likelihood = constrained_maximum(problem, space, begin, np.eye(5)[index])
    assert single[index] == pytest.approx(begin[index], abs=1e-12)
    direction = np.random.default_rng(index).standard_normal(5)
    mixed, mixed_likelihood = constrained_maximum(problem, space, begin, direction)
    np.testing.assert_allclose(direction @ space.to_natural(mixed), direction @ space.to_natural(begin), atol=1e-10)
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    for fixed, optimum, likelihood in ((np.eye(5)[index], single, single_likelihood),
                                       (direction, mixed, mixed_likelihood)):
        value = float(fixed @ space.to_natural(begin))
        oracle = minimize(lambda natural: -closed(natural), space.to_natural(optimum), method="SLSQP",
                          bounds=list(zip(low, high, strict=True)),
                          constraints={"type": "eq", "fun": lambda natural, f=fixed, v=value: f @ natural - v})
        assert likelihood > -oracle.fun - 0.002
        assert likelihood > closed(space.to_natural(begin))


def test_a_start_with_a_likelihood_of_zero_is_returned(ridge: tuple[InferenceProblem, Unknowns, ClosedForm]) -> None:
    problem, space, _ = ridge
    never = replace(problem, model=lambda points, conditions: np.full((len(points), 48), np.nan))
    begin = (space.lower + space.upper) / 2
    vector, likelihood = constrained_maximum(never, space, begin)
    assert likelihood == -np.inf
    np.testing.assert_array_equal(vector, begin)
