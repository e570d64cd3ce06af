"""Profile-likelihood intervals against a closed form, open where nothing is known, and never about a false maximum."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit import FitSettings, fit, intervals
from slipstick.uncertainty.fit.intervals import (
    combinations,
    direction_of,
    drop_at_level,
    profile_drop,
    profile_interval,
)
from slipstick.uncertainty.fit.refine import constrained_maximum, refined_vector
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns, exact

Closed = Callable[[np.ndarray], float]
Case = tuple[InferenceProblem, Unknowns, Closed]
LEVEL = 0.9


@pytest.fixture(scope="module")
def found(ridge: Case) -> np.ndarray:
    problem, space, _ = ridge
    return refined_vector(problem, space, (space.lower + space.upper) / 2)


def closed_drop(case: Case, found: np.ndarray, direction: np.ndarray, value: float) -> float:
    """The drop of the profile in closed form, by scipy from several starts."""
    _, space, closed = case
    low, high, best = space.to_natural(space.lower), space.to_natural(space.upper), space.to_natural(found)
    random, ends = np.random.default_rng(1), []
    for share in (0.0, 0.3):
        start = (1 - share) * best + share * (low + random.random(len(low)) * (high - low))
        end = minimize(lambda plain: -closed(plain), start, method="SLSQP", bounds=list(zip(low, high, strict=True)),
                       constraints={"type": "eq", "fun": lambda plain: direction @ plain - value},
                       options={"maxiter": 300, "ftol": 1e-9})
        ends.append(end.fun if abs(direction @ end.x - value) < 1e-6 else np.inf)
    return closed(best) + float(min(ends))


def directions(case: Case, found: np.ndarray) -> list[np.ndarray]:
    problem, space, _ = case
    identified = [one.weights for one in combinations(problem, space, found) if one.identified]
    return [*np.eye(len(found)), *(direction_of(space, weights) for weights in identified)]


def test_ends_are_where_the_closed_form_drops(ridge: Case, found: np.ndarray) -> None:
    problem, space, _ = ridge
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    closed_ends = 0
    for direction in directions(ridge, found):
        one = profile_interval(problem, space, found, direction, LEVEL)
        assert one.unsettled == ()
        edges = np.sort([direction * low, direction * high], axis=0).sum(axis=1)
        for end, edge in zip((one.lower, one.upper), edges, strict=True):
            drop = closed_drop(ridge, found, direction, edge if end is None else end)
            if end is None:
                assert drop < drop_at_level(LEVEL)
            else:
                closed_ends += 1
                assert drop == pytest.approx(drop_at_level(LEVEL), rel=0.05)
        assert abs(one.curve[:, 1].min()) < 1e-12
        assert np.all(np.diff(one.curve[:, 0]) > 0)
        for value, drop in one.curve[::3]:
            assert drop > closed_drop(ridge, found, direction, value) - 0.01
    assert closed_ends > 8


def test_drop_to_the_truth(ridge: Case, found: np.ndarray) -> None:
    """All of it held together, against one unknown held: none can drop further than all."""
    problem, space, closed = ridge
    true = np.array([0.95, 1.05, 0.1, 0.08, 0.006])
    whole = closed(space.to_natural(found)) - closed(true)
    for direction in directions(ridge, found):
        drop = profile_drop(problem, space, found, direction, float(direction @ true))
        assert -0.001 < drop < whole + 0.001
        assert drop == pytest.approx(closed_drop(ridge, found, direction, float(direction @ true)), abs=0.01)


def test_what_moves_nothing_is_open(posed: Callable[[np.ndarray, Candidate], Case]) -> None:
    slope = np.random.default_rng(6).uniform(-0.3, 0.3, (2, 60)) * [[1.0], [0.0]]
    problem, space, _ = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
    for start in (problem, replace(problem, knots=None)):
        found = refined_vector(start, space, space.vector(Candidate(Inputs([1.0, 1.0], [0.05, 0.05]), 0.02)))
        for place in (1, 3):
            one = profile_interval(start, space, found, np.eye(5)[place], LEVEL)
            assert (one.lower, one.upper, one.unsettled) == (None, None, ())
            bounds = [space.to_natural(space.lower)[place], space.to_natural(space.upper)[place]]
            np.testing.assert_allclose(one.curve[[0, -1], 0], bounds)
        one = profile_interval(start, space, found, np.eye(5)[0], LEVEL)
        assert one.lower is not None
        assert one.upper is not None
        assert one.lower < 0.95 < one.upper


def test_polynomials_follow_as_far_as_the_model(ridge: Case, found: np.ndarray) -> None:
    """Far along a ridge the first polynomials end; quadrature anew they lead to the same ends as the model itself."""
    problem, space, _ = ridge
    near = replace(problem, knots=None)
    for place in (0, 3):
        expected = profile_interval(problem, space, found, np.eye(5)[place], LEVEL)
        one = profile_interval(near, space, found, np.eye(5)[place], LEVEL)
        assert one.unsettled == ()
        for end, other in ((one.lower, expected.lower), (one.upper, expected.upper)):
            assert end == (None if other is None else pytest.approx(other, abs=0.01))


def test_an_end_that_is_not_reached_is_not_called_open(ridge: Case, found: np.ndarray,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    problem, space, _ = ridge
    monkeypatch.setattr(intervals, "ROUNDS", 1)  # the first polynomials alone
    one = profile_interval(replace(problem, knots=None), space, found, np.eye(5)[0], LEVEL)
    assert one.unsettled
    for side in one.unsettled:
        assert getattr(one, side) is None
    assert one.curve[0, 0] > 0.5 or one.curve[-1, 0] < 1.5  # it says how far it came


def test_a_better_candidate_is_found_and_taken(ridge: Case, found: np.ndarray) -> None:
    """Intervals about a false maximum would be false: the fit starts again from the better one."""
    problem, space, closed = ridge
    false, height = constrained_maximum(problem, space, found + np.array([0.2, 0.0, 0.0, 0.0, 0.0]), np.eye(5)[0])
    top = closed(space.to_natural(found))
    assert height < top - 0.2
    one = profile_interval(problem, space, false, np.eye(5)[0], LEVEL)
    assert one.curve[:, 1].min() < -0.05
    assert closed(space.to_natural(one.highest)) > height + 0.05

    settings = FitSettings(std_bounds=((0.002, 0.5),))
    begun = {"found": false.tolist(), "combinations": [], "intervals": []}
    better = fit.with_next_interval(settings, problem, begun)
    assert better["intervals"] == []
    assert exact(problem, space.candidate(np.array(better["vector"]))).sum() == pytest.approx(top, abs=0.01)
    assert len(fit.with_next_interval(settings, problem, better)["intervals"]) == 1
    kept = fit.with_next_interval(replace(settings, refine=False), problem, begun)  # who asks for no refinement gets none
    assert kept["vector"] == begun["vector"]
    assert min(drop for _, drop in kept["intervals"][0]["curve"]) < -0.05


def test_combinations_are_as_well_known_as_their_intervals_are_narrow(
        posed: Callable[[np.ndarray, Candidate], Case]) -> None:
    random = np.random.default_rng(8)
    slope = random.uniform(0.1, 0.3, 160) * np.array([[1.0], [-0.8]]) + 0.1 * random.standard_normal((2, 160))
    problem, space, _ = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.01))
    found = refined_vector(problem, space, (space.lower + space.upper) / 2)
    runs = combinations(problem, space, found)
    weights, errors = np.array([one.weights for one in runs]), [one.std_error for one in runs]
    np.testing.assert_allclose(weights @ weights.T, np.eye(5), atol=1e-9)
    assert errors == sorted(errors)
    for one in runs[:3]:
        assert one.identified
        profile = profile_interval(problem, space, found, direction_of(space, one.weights), LEVEL)
        assert profile.lower is not None
        assert profile.upper is not None
        assert (profile.upper - profile.lower) / 2 / 1.645 == pytest.approx(one.std_error, rel=0.25)
    mean = next(one.weights for one in runs if abs(one.weights[0]) + abs(one.weights[1]) > 1.2)
    assert mean[0] * mean[1] < 0  # the slopes differ in sign: what is known is how the means move against each other
