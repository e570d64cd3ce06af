"""Bases of free laws, and the filters of columns against the integrators of SciPy, slow loops and a dense smoother."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from slipstick.naming.bases import (
    bent,
    between,
    between_knots,
    evenly,
    from_zero,
    gain_basis,
    late,
    later,
    supported,
)
from slipstick.naming.filters import first_order, smoothed_walk, valve_response, varying_response
from slipstick.numerics.piecewise import hats


def test_hats_add_up_to_one_and_interpolate() -> None:
    knots = np.array([-1.0, 0.0, 0.5, 3.0])
    x = np.random.default_rng(1).uniform(-4, 6, (5, 7))
    basis = hats(x, knots)
    assert basis.shape == (5, 4, 7)
    np.testing.assert_allclose(basis.sum(axis=1), 1)
    np.testing.assert_allclose(np.einsum("m,nmk->nk", knots, basis), np.clip(x, -1, 3), atol=1e-12)
    np.testing.assert_array_equal(hats(knots, knots), np.eye(4))
    assert hats(x[:, 0], knots).shape == (5, 4)


def test_knots_lie_over_what_is_seen_and_a_few_odd_samples_do_not_move_them() -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(2, 10, (40, 200))
    x.flat[:3] = 1e6
    seen = np.ones(x.shape, bool)
    seen[5] = False
    x[5] = -50
    for knots, first in ((from_zero(x, seen, 9), 0.0), (evenly(x, seen, 9), 2.0)):
        assert len(knots) == 9
        assert knots[0] == pytest.approx(first, abs=0.05)
        assert knots[-1] == pytest.approx(10, abs=0.05)
    np.testing.assert_allclose(np.diff(np.sqrt(from_zero(x, seen, 6))), np.sqrt(from_zero(x, seen, 9)[-1]) / 5)
    np.testing.assert_allclose(np.diff(evenly(x, seen, 4), 2), 0, atol=1e-12)


@pytest.mark.parametrize("place", [from_zero, evenly])
def test_no_knot_is_where_one_run_is_alone(place: Callable[..., np.ndarray]) -> None:
    """A coefficient that no other run tells is 0 in what the others expect of that run."""
    x = np.linspace(0, np.array([4.0, 5.0, 6.0, 9.0]), 200, axis=1)
    assert place(x, np.ones(x.shape, bool), 5)[-1] == pytest.approx(6)
    assert place(x[3:], np.ones((1, 200), bool), 5)[-1] == pytest.approx(9, rel=1e-2)


@pytest.mark.parametrize("place", [from_zero, evenly])
def test_knots_are_distinct_where_nothing_is_seen_or_changes(place) -> None:  # type: ignore[no-untyped-def]
    x = np.zeros((2, 5))
    for seen in (np.zeros(x.shape, bool), np.ones(x.shape, bool)):
        assert np.all(np.diff(place(x, seen, 9)) > 0)


def test_a_law_has_no_point_below_all_values() -> None:
    knots, x = np.array([0.0, 1.0, 4.0, 9.0]), np.array([[2.0, 3.0, 0.5]])
    seen = np.array([[True, True, False]])
    np.testing.assert_array_equal(supported(knots, x, seen), [2, 4, 9])
    np.testing.assert_array_equal(supported(knots, x - 3, seen), knots)
    np.testing.assert_array_equal(supported(knots, x, np.zeros(x.shape, bool)), knots)


def test_between_may_keep_the_mean_and_has_no_column_for_a_constant() -> None:
    values = np.array([3.0, 1.0, 1.0, 7.0])
    basis = between(values, 5, centred=False)
    np.testing.assert_allclose(basis @ np.array([2.0, 5.0, -1.0]), [5, 2, 2, -1])
    for centred in (False, True):
        assert between(np.full(4, 2.0), 5, centred).shape == (4, 0)


def test_between_has_a_mean_of_zero_and_any_levels() -> None:
    values = np.array([3.0, 1.0, 1.0, 7.0, 3.0, 1.0])
    basis = between(values, 5)
    np.testing.assert_allclose(basis.mean(axis=0), 0, atol=1e-15)
    wanted = np.array([0.3, -0.1, -0.1, 2.0, 0.3, -0.1])
    wanted = wanted - wanted.mean()
    found = np.linalg.lstsq(basis, wanted)[0]
    assert basis.shape == (6, 2)
    np.testing.assert_allclose(basis @ found, wanted, atol=1e-12)


@pytest.mark.parametrize(("count", "knots"), [(2, 2), (3, 2), (4, 3), (9, 8), (60, 60)])
def test_between_has_knots_of_any_number(count: int, knots: int) -> None:
    assert len(between_knots(np.arange(60.0), count)) == knots


def test_between_is_linear_over_many_values_and_empty_over_one() -> None:
    order = np.random.default_rng(3).permutation(60).astype(float)
    basis = between(order, 5)
    assert basis.shape == (60, 3)
    np.testing.assert_allclose(basis.mean(axis=0), 0, atol=1e-15)
    found = np.linalg.lstsq(basis, order - order.mean())[0]
    np.testing.assert_allclose(basis @ found, order - order.mean(), atol=1e-9)
    assert between(np.full(9, 2.5), 5).shape == (9, 0)
    assert np.all(np.isfinite(between(np.array([0.0] * 50 + [1, 2, 3, 4, 5, 6, 7]), 5)))


def test_a_gain_error_is_a_share_and_one_that_grows_with_the_signal() -> None:
    time = np.linspace(0, 1, 501)
    signal = 3 * np.stack([np.sin(6 * time) * time, np.minimum(1, 4 * time) - 0.5])
    gain = gain_basis(signal, 1.5)
    np.testing.assert_allclose(gain[:, 0], signal)
    np.testing.assert_allclose(gain[:, 1], signal * np.abs(signal) / 1.5)


def test_a_late_clock_reads_a_parabola_exactly() -> None:
    time = 0.004 * np.arange(50)
    def speed(at: np.ndarray) -> np.ndarray:
        return (3 - 40 * at + 900 * at**2)[None]

    inside = slice(1, -1)
    for clock in (0.0, 0.0013, -0.002, 0.0055):
        np.testing.assert_allclose((speed(time) + late(speed(time), time, clock))[:, inside],
                                   speed(time - clock)[:, inside], rtol=1e-10)
        step = 1e-6
        slope = (late(speed(time), time, clock + step) - late(speed(time), time, clock - step)) / (2 * step)
        np.testing.assert_allclose(later(speed(time), time, clock), slope, rtol=1e-6)


def test_a_sampled_torque_has_the_integral_of_the_bent_one() -> None:
    step = 0.3
    time = step * np.arange(80)
    torque = np.sin(time / 2) ** 2  # which does not change before the first sample
    errors = [np.abs(np.concatenate([[0.0], np.cumsum(0.5 * step * (one[1:] + one[:-1]))])
                     - 0.5 * (time - np.sin(time)))[:-1].max() for one in (torque, bent(torque[None])[0])]
    assert errors[1] < 0.15 * errors[0]


# Filters of columns against the integrators of SciPy, slow loops, and a dense smoother.


def pieces(seed: int, n: int, p: int, k: int) -> np.ndarray:
    """Random piecewise linear columns (n, p, k) that begin at 0."""
    values = np.random.default_rng(seed).normal(size=(n, p, k))
    values[:, :, 0] = 0
    return values


def test_first_order_is_exact_for_constant_pieces_with_rates_and_steps_that_change() -> None:
    rng, time = np.random.default_rng(1), np.cumsum([0, 0.1, 0.3, 0.05, 0.2, 0.2])
    forcing, rate = pieces(1, 2, 2, 6), rng.uniform(-1, 20, (2, 5))
    rate[0, 2] = 0.0
    alive = np.ones((2, 5), bool)
    alive[1, 1:3] = False
    found = first_order(time, forcing, rate, alive)
    for i in range(2):
        x = np.zeros(2)
        for t in range(5):
            drive = forcing[i, :, t:t + 2].mean(axis=1)
            if alive[i, t]:
                x = solve_ivp(lambda _, y, f, r: f - r * y, time[t:t + 2], x, args=(drive, rate[i, t]), rtol=1e-10,
                              atol=1e-12).y[:, -1]
            else:
                x = np.zeros(2)
            np.testing.assert_allclose(found[i, :, t + 1], x, rtol=1e-7, atol=1e-9)


def test_first_order_converges_to_linear_pieces_with_the_square_of_the_step() -> None:
    coarse, rate = np.linspace(0, 1, 21), 4.0
    forcing = pieces(2, 1, 1, 21)
    def error(parts: int) -> float:
        time = np.linspace(0, 1, 20 * parts + 1)
        fine = np.interp(time, coarse, forcing[0, 0])
        _, expected, _ = lsim(([1.0], [1.0, rate]), forcing[0, 0], coarse)
        found = first_order(time, fine[None, None], np.full((1, 20 * parts), rate))
        return float(np.abs(found[0, 0, ::parts] - expected).max())
    assert error(1) / error(2) == pytest.approx(4, rel=0.05)
    assert error(1) < 4.0 * 0.05**2 / 12 * np.abs(np.diff(forcing)).sum()  # what its docstring says
    assert error(16) < 1e-5


def test_a_rate_near_zero_integrates() -> None:
    time, forcing = np.linspace(0, 1, 11), pieces(3, 1, 1, 11)
    expected = np.concatenate([[0], np.cumsum(0.05 * (forcing[0, 0, 1:] + forcing[0, 0, :-1]))])
    for rate in (0.0, 1e-12, 9e-6, 1.1e-5):  # to either side of the switch to the series
        np.testing.assert_allclose(first_order(time, forcing, np.full((1, 10), rate))[0, 0], expected, atol=2e-5)


def test_the_valve_is_exact_for_linear_pieces() -> None:
    step, delays, demand = 0.01, np.array([0.004, 0.05, 0.3]), pieces(4, 3, 2, 60)
    found = valve_response(step, demand, delays)
    time = step * np.arange(60)
    for i, tau in enumerate(delays):
        for j in range(2):
            _, expected, _ = lsim(([-2 / tau, 6 / tau**2], [1.0, 4 / tau, 6 / tau**2]), demand[i, j], time)
            np.testing.assert_allclose(found[i, j], expected, atol=1e-9)


def test_a_delay_that_changes_is_that_of_the_equation() -> None:
    step, time = 0.002, np.arange(0.0, 0.8, 0.002)
    demand, delay = 3 * np.sin(5 * time) + time, 0.06 * (1 + 0.8 * np.sin(9 * time))

    def rate(t: float, x: np.ndarray) -> list[float]:
        tau, wanted = np.interp(t, time, delay), 3 * np.sin(5 * t) + t
        return [x[1], -6 / tau**2 * x[0] - 4 / tau * x[1] + 6 / tau**2 * wanted - 2 / tau * (15 * np.cos(5 * t) + 1)]

    exact = solve_ivp(rate, (0, time[-1]), [0.0, 0.0], "DOP853", t_eval=time, rtol=1e-10, atol=1e-12).y[0]
    found = varying_response(step, demand[None], delay[None])[0][0]
    constant = valve_response(step, demand[None, None], np.array([0.06]))[0, 0]
    assert np.abs(constant - exact).max() > 0.3
    np.testing.assert_allclose(found, exact, atol=2e-3)
    same = varying_response(step, demand[None], np.full((1, len(time)), 0.06))[0][0]
    np.testing.assert_allclose(same, constant, atol=1e-12)
    changes, h = np.array([[np.cos(7 * time), time**2]]), 1e-4
    _, columns = varying_response(step, demand[None], delay[None], changes)
    for change, column in zip(changes[0], columns[0], strict=True):
        ends = [varying_response(step, demand[None], (delay * (1 + its * change))[None])[0][0] for its in (h, -h)]
        expected = (ends[0] - ends[1]) / (2 * h)
        np.testing.assert_allclose(column, expected, atol=1e-3 * np.abs(expected).max())


def test_the_walk_is_that_of_the_dense_smoother_away_from_the_ends() -> None:
    residual, ratio = np.random.default_rng(6).normal(size=(3, 300)), np.array([0.02, 0.3, 5.0])
    found = smoothed_walk(residual, ratio)
    steps = np.minimum(*np.meshgrid(np.arange(300), np.arange(300)))
    for row, its, one in zip(residual, found, ratio, strict=True):
        walk = one * steps + 1e4  # it begins anywhere
        expected = walk @ np.linalg.solve(walk + np.eye(300), row)
        np.testing.assert_allclose(its[120:180], expected[120:180], atol=1e-6)
        assert np.abs(its - expected).max() < 2  # at the ends it is an average as well


def test_the_error_of_the_walk_is_uncorrelated_with_the_residuals() -> None:
    rng = np.random.default_rng(7)
    walk = np.cumsum(np.sqrt(0.1) * rng.normal(size=(2000, 120)), axis=1)
    residual = walk + rng.normal(size=walk.shape)
    def product(ratio: float) -> float:
        error = (walk - smoothed_walk(residual, np.full(2000, ratio)))[:, 60]
        return float((error * (residual[:, 60] - residual[:, 58])).mean())
    assert product(0.1) == pytest.approx(0, abs=0.05)  # four standard errors
    assert product(1.0) < -0.15


def test_a_constant_is_kept_and_no_walk_is_a_mean() -> None:
    np.testing.assert_allclose(smoothed_walk(np.full((2, 50), 3.0), np.array([0.1, 0.0])), 3.0)
    noise = np.random.default_rng(8).normal(size=(1, 50))
    np.testing.assert_allclose(smoothed_walk(noise, np.zeros(1)), noise.mean(), atol=2e-3)
