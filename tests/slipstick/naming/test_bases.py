"""Bases of free laws: what they add up to, where their knots lie, and what they can represent."""

import numpy as np
import pytest

from slipstick.naming.bases import (
    bent,
    between,
    between_knots,
    evenly,
    from_zero,
    gain_basis,
    hats,
    late,
    later,
    supported,
)


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
