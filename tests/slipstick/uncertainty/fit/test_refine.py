"""The climb: the maximum of a closed form, on either side of a saddle, within bounds and along what is held."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit.refine import constrained_maximum, natural_scores, refined_vector
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns

Closed = Callable[[np.ndarray], float]
Posed = Callable[[np.ndarray, Candidate], tuple[InferenceProblem, Unknowns, Closed]]


@pytest.fixture(scope="module")
def best(ridge: tuple[InferenceProblem, Unknowns, Closed]) -> float:
    """The greatest log10 likelihood that scipy finds in closed form from many starts."""
    _, space, closed = ridge
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    starts = low + np.random.default_rng(2).random((8, 5)) * (high - low)
    ends = [minimize(lambda plain: -closed(plain), start, method="L-BFGS-B", bounds=list(zip(low, high, strict=True)))
            for start in starts]
    return max(-float(end.fun) for end in ends)


def test_scores_are_the_derivatives_of_the_closed_form(ridge: tuple[InferenceProblem, Unknowns, Closed]) -> None:
    problem, space, closed = ridge
    plain = np.array([0.9, 1.1, 0.05, 0.1, 0.01])
    density, scores = natural_scores(problem, space, space.from_natural(plain))
    np.testing.assert_allclose(density.sum(), closed(plain), atol=1e-6)
    steps = 1e-5 * np.eye(5)
    slope = [(closed(plain + step) - closed(plain - step)) / 2e-5 * np.log(10) for step in steps]
    np.testing.assert_allclose(scores.sum(axis=0), slope, rtol=1e-4, atol=1e-3)


def test_all_starts_lead_to_the_greatest_maximum(ridge: tuple[InferenceProblem, Unknowns, Closed], best: float) -> None:
    problem, space, closed = ridge
    starts = space.lower + np.random.default_rng(7).random((3, 5)) * (space.upper - space.lower)
    for start in starts:
        reached = refined_vector(problem, space, start)
        assert np.all((reached >= space.lower) & (reached <= space.upper))
        assert abs(closed(space.to_natural(reached)) - best) < 0.002
    assert all(closed(space.to_natural(start)) < best - 1 for start in starts)


def test_leaves_the_floor_of_a_std(posed: Posed) -> None:
    """In the logarithm of a std the likelihood is flat there, and a climb would stay for want of a slope."""
    slope = np.random.default_rng(4).uniform(-0.3, 0.3, (2, 80))
    problem, space, closed = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
    scattered = space.from_natural(np.array([0.95, 1.05, 0.1, 0.08, 0.006]))
    still = space.from_natural(np.array([0.95, 1.05, 0.0, 0.0, 0.03]))
    reached, height = constrained_maximum(problem, space, still)
    assert height > closed(space.to_natural(still)) + 2
    assert abs(height - constrained_maximum(problem, space, scattered)[1]) < 1e-4
    assert np.all(reached[2:4] > still[2:4] + 2)


@pytest.mark.parametrize("place", range(5))
def test_what_is_held_stays(ridge: tuple[InferenceProblem, Unknowns, Closed], place: int) -> None:
    """One unknown to the last bit, and a combination to rounding; all else at its constrained maximum."""
    problem, space, closed = ridge
    begin = space.from_natural(np.array([0.9, 1.1, 0.05, 0.1, 0.01]))
    reached, height = constrained_maximum(problem, space, begin, np.eye(5)[place])
    assert reached[place] == pytest.approx(begin[place], abs=1e-12)
    direction = np.random.default_rng(place).standard_normal(5)
    mixed, lower = constrained_maximum(problem, space, begin, direction)
    np.testing.assert_allclose(direction @ space.to_natural(mixed), direction @ space.to_natural(begin), atol=1e-10)
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    for held, end, likelihood in ((np.eye(5)[place], reached, height), (direction, mixed, lower)):
        value = float(held @ space.to_natural(begin))
        peer = minimize(lambda plain: -closed(plain), space.to_natural(end), method="SLSQP",
                        bounds=list(zip(low, high, strict=True)),
                        constraints={"type": "eq", "fun": lambda plain, h=held, v=value: h @ plain - v})
        assert likelihood > -peer.fun - 0.002
        assert likelihood > closed(space.to_natural(begin))


def test_a_likelihood_of_zero_is_no_place_to_climb(ridge: tuple[InferenceProblem, Unknowns, Closed]) -> None:
    problem, space, _ = ridge
    nowhere = InferenceProblem(lambda points, conditions: np.full((len(points), 48), np.nan), problem.conditions,
                      problem.measured_time, problem.lower, problem.upper, problem.axes, problem.knots)
    begin = (space.lower + space.upper) / 2
    vector, height = constrained_maximum(nowhere, space, begin)
    assert height == -np.inf
    np.testing.assert_array_equal(vector, begin)
