"""Profile-likelihood intervals compared with a closed form, open ends, and estimates that are not the maximum."""

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
    profile_interval,
)
from slipstick.uncertainty.fit.refine import constrained_maximum, local_problem, refined_vector
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns, exact, likelihood

ClosedForm = Callable[[np.ndarray], float]
Case = tuple[InferenceProblem, Unknowns, ClosedForm]
LEVEL = 0.9


@pytest.fixture(scope="module")
def optimum(ridge: Case) -> np.ndarray:
    problem, space, _ = ridge
    return refined_vector(problem, space, (space.lower + space.upper) / 2)


def closed_drop(case: Case, optimum: np.ndarray, direction: np.ndarray, value: float) -> float:
    """The drop of the profile of the closed form, by SciPy from several starts."""
    _, space, closed = case
    low, high, best = space.to_natural(space.lower), space.to_natural(space.upper), space.to_natural(optimum)
    random, losses = np.random.default_rng(1), []
    for share in (0.0, 0.3, 0.3, 0.3, 0.3):
        start = (1 - share) * best + share * (low + random.random(len(low)) * (high - low))
        result = minimize(lambda natural: -closed(natural), start, method="SLSQP",
                          bounds=list(zip(low, high, strict=True)),
                          constraints={"type": "eq", "fun": lambda natural: direction @ natural - value},
                          options={"maxiter": 300, "ftol": 1e-9})
        losses.append(result.fun if abs(direction @ result.x - value) < 1e-6 else np.inf)
    return closed(best) + float(min(losses))


def directions(case: Case, optimum: np.ndarray) -> list[np.ndarray]:
    problem, space, _ = case
    identified = [combination.weights for combination in combinations(problem, space, optimum)
                  if combination.identified]
    return [*np.eye(len(optimum)), *(direction_of(space, weights) for weights in identified)]


@pytest.mark.slow
def test_ends_are_where_the_closed_form_drops(ridge: Case, optimum: np.ndarray) -> None:
    problem, space, _ = ridge
    low, high = space.to_natural(space.lower), space.to_natural(space.upper)
    closed_ends = 0
    for direction in directions(ridge, optimum):
        interval = profile_interval(problem, space, optimum, direction, LEVEL)
        assert interval.unsettled == ()
        edges = np.sort([direction * low, direction * high], axis=0).sum(axis=1)
        for end, edge in zip((interval.lower, interval.upper), edges, strict=True):
            drop = closed_drop(ridge, optimum, direction, edge if end is None else end)
            if end is None:
                assert drop < drop_at_level(LEVEL)
            else:
                closed_ends += 1
                assert drop == pytest.approx(drop_at_level(LEVEL), rel=0.05)
        assert abs(interval.curve[:, 1].min()) < 1e-12
        assert np.all(np.diff(interval.curve[:, 0]) > 0)
        for value, drop in interval.curve[::6]:
            assert drop > closed_drop(ridge, optimum, direction, value) - 0.01
    assert closed_ends > 8


@pytest.mark.parametrize("index", [0, 4])
def test_intervals_on_lattices_are_those_along_lines(ridge: Case, optimum: np.ndarray, monkeypatch: pytest.MonkeyPatch,
                                                     index: int) -> None:
    problem, space, _ = ridge
    assert local_problem(problem, space, optimum)[0].lattice is not None
    on_lattices = profile_interval(problem, space, optimum, np.eye(5)[index], LEVEL)
    monkeypatch.setattr(likelihood, "by_lattice", lambda *_: None)
    assert local_problem(problem, space, optimum)[0].lattice is None
    along_lines = profile_interval(problem, space, optimum, np.eye(5)[index], LEVEL)
    for end in ("lower", "upper"):
        expected = getattr(along_lines, end)
        assert getattr(on_lattices, end) == (None if expected is None else pytest.approx(expected, abs=5e-4))


@pytest.mark.slow
def test_the_scatter_may_move_to_the_other_input_along_a_profile(
        posed: Callable[[np.ndarray, Candidate], Case], monkeypatch: pytest.MonkeyPatch) -> None:
    """The maxima on the two sides of a profile have the scatter in different inputs, and none leads to the other."""
    random = np.random.default_rng(8)
    slope = random.uniform(0.1, 0.3, 48) * np.array([[1.0], [-0.8]]) + 0.02 * random.standard_normal((2, 48))
    case = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
    problem, space, _ = case
    best = refined_vector(problem, space, (space.lower + space.upper) / 2)
    direction = directions(case, best)[6]
    end = profile_interval(problem, space, best, direction, LEVEL).lower
    assert end is not None
    assert closed_drop(case, best, direction, end) == pytest.approx(drop_at_level(LEVEL), rel=0.05)
    monkeypatch.setattr(intervals, "_BRANCHES", 0)
    nearer = profile_interval(problem, space, best, direction, LEVEL).lower
    assert nearer is not None
    assert closed_drop(case, best, direction, nearer) < 0.8 * drop_at_level(LEVEL)


def test_intervals_of_an_input_without_influence_are_open(posed: Callable[[np.ndarray, Candidate], Case]) -> None:
    slope = np.random.default_rng(6).uniform(-0.3, 0.3, (2, 60)) * [[1.0], [0.0]]
    knotted, space, _ = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.006))
    for problem in (knotted, replace(knotted, knots=None)):
        optimum = refined_vector(problem, space, space.vector(Candidate(Inputs([1.0, 1.0], [0.05, 0.05]), 0.02)))
        for index in (1, 3):
            interval = profile_interval(problem, space, optimum, np.eye(5)[index], LEVEL)
            assert (interval.lower, interval.upper, interval.unsettled) == (None, None, ())
            bounds = [space.to_natural(space.lower)[index], space.to_natural(space.upper)[index]]
            np.testing.assert_allclose(interval.curve[[0, -1], 0], bounds)
        interval = profile_interval(problem, space, optimum, np.eye(5)[0], LEVEL)
        assert interval.lower is not None
        assert interval.upper is not None
        assert interval.lower < 0.95 < interval.upper


def test_intervals_with_local_expansions_agree_with_those_of_the_model(ridge: Case, optimum: np.ndarray) -> None:
    """The intervals extend along a ridge beyond the region of the first local expansion, which is renewed."""
    problem, space, _ = ridge
    without_knots, closed_ends = replace(problem, knots=None), 0
    for index in (0, 3):
        expected = profile_interval(problem, space, optimum, np.eye(5)[index], LEVEL)
        interval = profile_interval(without_knots, space, optimum, np.eye(5)[index], LEVEL)
        assert interval.unsettled == ()
        for end, other in ((interval.lower, expected.lower), (interval.upper, expected.upper)):
            assert end == (None if other is None else pytest.approx(other, abs=0.01))
            closed_ends += end is not None
    assert closed_ends


def test_an_end_that_is_not_found_is_unsettled(ridge: Case, optimum: np.ndarray,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    problem, space, _ = ridge
    monkeypatch.setattr(intervals, "ROUNDS", 1)  # the local expansion is not renewed
    interval = profile_interval(replace(problem, knots=None), space, optimum, np.eye(5)[0], LEVEL)
    assert interval.unsettled
    for side in interval.unsettled:
        assert getattr(interval, side) is None
    assert interval.curve[0, 0] > 0.5 or interval.curve[-1, 0] < 1.5  # the curve ends before a bound


def test_a_better_candidate_on_a_profile_replaces_the_estimate(ridge: Case, optimum: np.ndarray) -> None:
    """The intervals of the previous estimate are discarded."""
    problem, space, closed = ridge
    start = optimum + np.array([0.2, 0.0, 0.0, 0.0, 0.0])
    worse, likelihood = constrained_maximum(problem, space, start, np.eye(5)[0])
    highest = closed(space.to_natural(optimum))
    assert likelihood < highest - 0.2
    interval = profile_interval(problem, space, worse, np.eye(5)[0], LEVEL)
    assert interval.curve[:, 1].min() < -0.05
    assert closed(space.to_natural(interval.highest)) > likelihood + 0.05

    settings = FitSettings(std_bounds=((0.002, 0.5),))
    estimate = {"vector": worse.tolist(), "combinations": [], "intervals": []}
    better = fit.with_next_interval(settings, problem, estimate)
    assert better["intervals"] == []
    assert exact(problem, space.candidate(np.array(better["vector"]))).sum() == pytest.approx(highest, abs=0.01)
    assert len(fit.with_next_interval(settings, problem, better)["intervals"]) == 1
    unrefined = fit.with_next_interval(replace(settings, refine=False), problem, estimate)
    assert unrefined["vector"] == estimate["vector"]
    assert min(drop for _, drop in unrefined["intervals"][0]["curve"]) < -0.05


def test_standard_errors_of_combinations_agree_with_their_intervals(
        posed: Callable[[np.ndarray, Candidate], Case]) -> None:
    random = np.random.default_rng(8)
    slope = random.uniform(0.1, 0.3, 160) * np.array([[1.0], [-0.8]]) + 0.1 * random.standard_normal((2, 160))
    problem, space, _ = posed(slope, Candidate(Inputs([0.95, 1.05], [0.1, 0.08]), 0.01))
    optimum = refined_vector(problem, space, (space.lower + space.upper) / 2)
    all_combinations = combinations(problem, space, optimum)
    weights = np.array([combination.weights for combination in all_combinations])
    errors = [combination.std_error for combination in all_combinations]
    np.testing.assert_allclose(weights @ weights.T, np.eye(5), atol=1e-9)
    assert errors == sorted(errors)
    for combination in all_combinations[:3]:
        assert combination.identified
        interval = profile_interval(problem, space, optimum, direction_of(space, combination.weights), LEVEL)
        assert interval.lower is not None
        assert interval.upper is not None
        assert (interval.upper - interval.lower) / 2 / 1.645 == pytest.approx(combination.std_error, rel=0.25)
    of_means = next(row for row in weights if abs(row[0]) + abs(row[1]) > 1.2)
    assert of_means[0] * of_means[1] < 0  # the slopes have opposite signs, so a difference of the means is identified
