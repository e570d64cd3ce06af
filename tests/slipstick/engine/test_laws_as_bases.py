"""Laws as bases: hats, plays and lags against slow loops, and the prior of an integrated random walk."""

import numpy as np
import pytest
import scipy

from slipstick.engine.bases import (
    COARSE,
    DELAYS,
    MOST,
    OUTERMOST,
    PLACES,
    RELAXATIONS,
    TIMES,
    WALKS,
    WIDTHS,
    Variable,
    curve,
    flat_forms,
    form_root,
    lag,
    lags,
    late,
    own_variable,
    past,
    place_knots,
    smooth_root,
)
from slipstick.engine.equations import EDGE, OwnLaw
from slipstick.numerics.memory import play
from slipstick.numerics.piecewise import hats

KNOTS = [np.array([-1.0, 0.0, 0.5, 3.0]), np.array([2.0, 2.5]), np.linspace(-3, 3, 30),
         np.array([-2.0, -1e-9, 1e-9, 2.0])]


@pytest.mark.parametrize("knots", KNOTS, ids=["uneven", "two", "many", "jump"])
@pytest.mark.parametrize("order", ["random", "rising", "falling"])
def test_hats_add_up_to_one_and_interpolate(knots: np.ndarray, order: str) -> None:
    x = np.random.default_rng(1).uniform(knots[0] - 1, knots[-1] + 1, (3, 200))
    x[:, :len(knots)] = knots
    x = {"random": x, "rising": np.sort(x), "falling": -np.sort(-x)}[order]
    basis, values = hats(x, knots), np.random.default_rng(2).standard_normal(len(knots))
    assert basis.shape == (3, len(knots), 200)
    assert np.all(basis >= 0)
    assert (basis > 0).sum(axis=1).max() <= 2
    np.testing.assert_allclose(basis.sum(axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.einsum("m,nmk->nk", values, basis), np.interp(x, knots, values), atol=1e-7)
    np.testing.assert_array_equal(hats(knots[None], knots)[0], np.eye(len(knots)))


def test_a_single_hat_is_a_constant() -> None:
    np.testing.assert_array_equal(hats(np.array([[-5.0, 0.0, 7.0]]), np.zeros(1)), np.ones((1, 1, 3)))


def played(signal: np.ndarray, width: float) -> list[float]:
    """What follows a signal with a play: it moves where the signal takes it along on either side."""
    follower, out = signal[0], []
    for value in signal:
        if value - follower > width:
            follower = value - width
        elif follower - value > width:
            follower = value + width
        out.append(follower)
    return out


def wander(n: int = 3, k: int = 300) -> np.ndarray:
    return np.cumsum(np.random.default_rng(3).standard_normal((n, k)), axis=1)


@pytest.mark.parametrize("width", [0.0, 0.5, 3.0, 1e3])
def test_a_play_follows_as_a_loop_does(width: float) -> None:
    signal = wander()
    np.testing.assert_allclose(play(signal, width), [played(row, width) for row in signal], atol=1e-12)


@pytest.mark.parametrize("time", [0.5, 4.0, 64.0])
def test_a_lag_begins_at_rest_and_is_that_of_scipy_with_lines_between_samples(time: float) -> None:
    signal = wander() + 5
    system, instants = scipy.signal.lti([1], [time, 1]), np.arange(signal.shape[1])
    exact = [row[0] + scipy.signal.lsim(system, row - row[0], instants)[1] for row in signal]
    np.testing.assert_allclose(lag(signal, time), exact, atol=1e-10)


@pytest.mark.parametrize("fine", [1, 4])
def test_the_past_of_a_signal_is_what_plays_and_lags_take_from_it(fine: int) -> None:
    signal = wander()
    variable = past("force", "N", signal, fine)
    basis = variable.basis()
    assert variable.families[:2] == (len(WIDTHS), len(TIMES))
    assert basis.shape == (3, sum(variable.families), 300)
    excess = signal - lag(signal, fine * RELAXATIONS[1])
    bend = len(WIDTHS) + len(TIMES) + len(PLACES) + 3  # the fourth place of the second time
    np.testing.assert_allclose(basis[:, bend], np.maximum(excess - PLACES[3] * np.ptp(signal), 0), atol=1e-12)
    still = past("force", "N", np.full((2, 50), 3.0), fine).basis()
    np.testing.assert_allclose(still, 0, atol=1e-12)  # what does not change has no past
    for place, width in enumerate(WIDTHS):
        exact = [np.subtract(played(row, width * np.ptp(signal)), row) for row in signal]
        np.testing.assert_allclose(basis[:, place], exact, atol=1e-10)
    for place, time in enumerate(TIMES, len(WIDTHS)):
        np.testing.assert_allclose(basis[:, place], lag(signal, time * fine) - signal, atol=1e-12)
    assert variable.coarse() is variable


def test_lags_are_those_of_a_signal_or_of_what_a_part_gives() -> None:
    signal = wander()
    given, own = lags("force", signal, 2, 3.0), lags("force", None, 2, 3.0)
    assert given.families[:2] == (len(DELAYS), len(TIMES))
    basis = given.basis()
    np.testing.assert_array_equal(basis, own.basis(signal))
    np.testing.assert_allclose(basis[:, len(DELAYS) + 3], lag(signal, 2 * TIMES[3]) - signal, atol=1e-12)
    late_by_4 = np.pad(signal, ((0, 0), (4, 0)), mode="edge")[:, :300]
    np.testing.assert_allclose(late(signal, 2 * DELAYS[2], 1), basis[:, 2] + signal, atol=1e-12)
    np.testing.assert_allclose(late(signal, 4.0, 1), late_by_4, atol=1e-12)


@pytest.mark.parametrize("kind", ["lags", "own", "jump"])
def test_a_law_changes_with_its_own_signal_as_its_differences_do(kind: str) -> None:
    signal = wander()
    variable = lags("force", None, 2, 3.0) if kind == "lags" else own_variable("force", "N", signal, kind == "jump")
    random = np.random.default_rng(9)
    c, change = random.standard_normal(len(variable.knots)), random.standard_normal((len(signal), 11, 300))
    exact = variable.differentiate(c, signal, change)
    ahead, behind = (np.stack([variable.weigh(c, signal + by * change[:, place]) for place in range(11)], axis=1)
                     for by in (1e-7, -1e-7))
    off = np.abs(exact - (ahead - behind) / 2e-7) / np.abs(exact).max()
    assert np.quantile(off, 0.99) < 1e-5  # but where a law bends between both
    assert np.abs(exact).max() > 0.1


@pytest.mark.parametrize("kind", ["lags", "past", "curve", "between"])
def test_a_law_is_its_weighted_basis(kind: str) -> None:
    signal = wander()
    variable = {"lags": lags("force", signal, 2, 3.0), "past": past("force", "N", signal, 2),
                "curve": curve("force", "N", signal), "between": curve("day", "", np.arange(3.0))}[kind]
    c = np.random.default_rng(8).standard_normal(len(variable.knots))
    np.testing.assert_allclose(variable.weigh(c), np.einsum("m,nmk->nk", c, variable.basis()), atol=1e-9)


def bent_covariance(count: int) -> np.ndarray:
    """Covariance of an integrated random walk without its constant and line, with a mean variance of 1."""
    walk = np.zeros((count, count - 2))
    for source in range(count - 2):  # an impulse in a second difference
        slope = value = 0.0
        for place in range(2, count):
            slope += float(place == source + 2)
            value += slope
            walk[place, source] = value
    flat = np.vander(np.arange(count), 2).astype(float)
    left = (np.eye(count) - flat @ np.linalg.pinv(flat)) @ walk
    covariance = left @ left.T
    return np.asarray(covariance / np.diag(covariance).mean())


@pytest.mark.parametrize("known_up_to", [0, 1, 2])
@pytest.mark.parametrize("walk", WALKS)
@pytest.mark.parametrize("count", [3, 8, 30])
def test_the_prior_is_a_constant_a_line_and_an_integrated_walk(count: int, walk: float, known_up_to: int) -> None:
    root = form_root((count,), walk, known_up_to)
    constant, line = np.ones(count), np.linspace(-1, 1, count)
    exact = walk**2 * bent_covariance(count)
    for form in (constant, line)[known_up_to:]:
        exact = exact + np.outer(form, form)
    np.testing.assert_allclose(root @ root.T, exact, atol=1e-10 * max(1, walk**2))


def test_second_differences_of_the_walk_are_independent() -> None:
    root = form_root((20,), 1.0, 2)
    second = np.diff(root, 2, axis=0)
    covariance = second @ second.T
    np.testing.assert_allclose(covariance, covariance[0, 0] * np.eye(18), atol=1e-10)
    np.testing.assert_allclose(np.linspace(0, 3, 20) @ root, 0, atol=1e-10)


@pytest.mark.parametrize(("count", "known_up_to", "rank"), [(1, 0, 1), (1, 1, 0), (2, 0, 2), (2, 1, 1), (2, 2, 0)])
def test_few_coefficients_have_no_walk(count: int, known_up_to: int, rank: int) -> None:
    root = form_root((count,), 3.0, known_up_to)
    assert root.shape == (count, rank)
    np.testing.assert_array_equal(root, flat_forms(count)[:, known_up_to:])


def test_families_are_independent() -> None:
    root, first = form_root((5, 7), 1.0), form_root((5,), 1.0)
    covariance = root @ root.T
    np.testing.assert_allclose(covariance[:5, :5], first @ first.T)
    np.testing.assert_array_equal(covariance[:5, 5:], 0)
    np.testing.assert_allclose(covariance[5:, 5:], form_root((7,), 1.0) @ form_root((7,), 1.0).T)


@pytest.mark.parametrize("length", [1.0, 5.0])
def test_a_smooth_curve_has_a_gaussian_correlation(length: float) -> None:
    root = smooth_root(40, length)
    exact = [[np.exp(-0.5 * ((a - b) / length) ** 2) for a in range(40)] for b in range(40)]
    np.testing.assert_allclose(root @ root.T, exact, atol=1e-6)


def test_levels_are_knots_where_there_are_few() -> None:
    levels = np.array([1.0, 2.0, 5.0])
    np.testing.assert_array_equal(place_knots(np.random.default_rng(4).choice(levels, (5, 40))), levels)
    np.testing.assert_array_equal(place_knots(np.repeat(levels, 4)), levels)
    np.testing.assert_array_equal(place_knots(np.full((3, 9), 2.0)), [2.0])


@pytest.mark.parametrize("runs", [4, 20, 200])
def test_a_law_between_runs_has_no_more_knots_than_half_the_runs(runs: int) -> None:
    values = np.random.default_rng(5).uniform(1, 2, runs)
    knots = place_knots(values)
    assert len(knots) == max(3, min(MOST, runs // 2))
    assert (knots[0], knots[-1]) == (values.min(), values.max())


def test_knots_lie_half_way_between_quantiles_and_equal_distances() -> None:
    values = np.random.default_rng(6).exponential(1, (20, 500))
    knots = place_knots(values)
    assert len(knots) == MOST
    ends = OUTERMOST, 1 - OUTERMOST
    even, quantiles = np.linspace(*np.quantile(values, ends), MOST), np.quantile(values, np.linspace(*ends, MOST))
    np.testing.assert_allclose(knots, 0.5 * (even + quantiles), rtol=1e-10)
    values[0, :2] = 1e6, -1e6  # a few odd samples do not move them
    assert np.abs(place_knots(values) - knots).max() < 2
    assert np.all(np.diff(knots) > 0)


def test_knots_reach_over_all_values_of_many_samples() -> None:
    knots = place_knots(np.broadcast_to(np.arange(1000.0), (1000, 1000)))
    assert len(knots) == MOST
    assert (knots[0], knots[-1]) == pytest.approx((0, 999), abs=3)


def test_curves_are_within_runs_or_between_them() -> None:
    signal, constant = wander(), np.array([1.0, 2.0, 1.0, 2.0])
    within, between = curve("force", "N", signal), curve("load", "N", constant)
    assert (within.kind, between.kind) == ("curve", "between")
    assert within.families == (MOST,)
    np.testing.assert_array_equal(within.basis(), hats(signal, place_knots(signal)))
    np.testing.assert_array_equal(between.basis()[:, :, 0], [[1, 0], [0, 1], [1, 0], [0, 1]])


def test_an_own_variable_has_the_values_of_the_system() -> None:
    variable = own_variable("speed", "m/s", wander(), jumps=False)
    np.testing.assert_array_equal(variable.knots, place_knots(wander()))
    np.testing.assert_array_equal(variable.basis(wander(2, 50)), hats(wander(2, 50), variable.knots))


def jumping() -> Variable:
    return own_variable("speed", "m/s", np.linspace(-2, 3, 2000).reshape(2, 1000), jumps=True)


def test_a_law_over_a_switching_state_may_jump_at_0() -> None:
    variable, edge = jumping(), 5 * EDGE
    near = np.abs(variable.knots) < 0.01
    np.testing.assert_allclose(variable.knots[near], [-edge, edge], rtol=5e-3)
    assert np.all(np.diff(variable.knots) > 0)
    coefficients = np.where(variable.knots < 0, variable.knots - 1, variable.knots + 2)
    x = np.array([[-1.5, -1e-13, 0.0, 1e-13, 2.5]])
    law = np.einsum("m,nmk->nk", coefficients, variable.basis(x))
    np.testing.assert_allclose(law, [[-2.5, -1, 0.5, 2, 4.5]], atol=1e-7)
    inside = OwnLaw("quantity", "pull", "speed", variable.knots, coefficients, 0).at(x, np.sign(x))
    np.testing.assert_allclose(inside, law, atol=1e-12)  # as in the equations
    assert own_variable("speed", "m/s", np.linspace(0, 3, 2000)[None], jumps=True).knots[1] > 0.01  # never below 0
    levels = own_variable("speed", "m/s", np.array([[-2.0, 0.0, 3.0], [-2.0, 1e-4, 3.0]]), jumps=True)
    np.testing.assert_allclose(levels.knots, [-2, -edge, edge, 3], rtol=1e-9)  # and none at 0, or next to it


@pytest.mark.parametrize("jumps", [False, True])
def test_a_coarse_law_keeps_the_ends_and_the_jump(jumps: bool) -> None:
    whole = own_variable("speed", "m/s", np.linspace(-2, 3, 2000).reshape(2, 1000), jumps)
    coarse = whole.coarse()
    assert len(whole.knots) >= MOST
    assert COARSE <= len(coarse.knots) <= COARSE + 2 * jumps
    assert np.isin(coarse.knots, whole.knots).all()
    assert (coarse.knots[0], coarse.knots[-1]) == (whole.knots[0], whole.knots[-1]) == pytest.approx((-2, 3), abs=0.02)
    assert (np.abs(coarse.knots) < 1e-6).sum() == 2 * jumps
    assert np.diff(coarse.knots[np.abs(coarse.knots) > 1e-6]).max() < 1.3
    assert coarse.coarse() is coarse or jumps


@pytest.mark.parametrize("variable", [curve("load", "N", np.arange(40.0)), curve("level", "", np.eye(4)),
                                      lags("force", None, 1, 3.0)], ids=lambda variable: variable.name)
def test_what_has_few_knots_or_no_curve_is_coarse(variable: Variable) -> None:
    assert variable.coarse() is variable
