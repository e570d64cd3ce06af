"""Properties of the random forms that hidden effects may have."""

import pickle
from collections import Counter
from functools import cache, partial

import numpy as np
import pytest

from evidence.generator.forms import (
    CURVES,
    DRIFTS,
    FRICTIONS,
    GRID,
    LAGS,
    LINEAR_LAGS,
    Curve,
    Lag,
    draw_curve,
    draw_drift,
    draw_friction,
    draw_lag,
    draw_memory,
    draw_size,
)

WIDE = np.linspace(-1.0, 2.0, 3001)
KINDS = {"curve": draw_curve, "smooth": partial(draw_curve, smooth=True), "drift": draw_drift}
SIZES = {"friction": draw_friction, "size": draw_size, "smooth size": partial(draw_size, smooth=True)}
NAMES = {"curve": CURVES, "smooth": CURVES, "drift": DRIFTS, "friction": FRICTIONS}


@cache
def draw_many(kind: str) -> list[Curve]:
    random = np.random.default_rng(1)
    return [(KINDS | SIZES)[kind](random) for _ in range(100 if kind == "smooth size" else 300)]


@cache
def draw_lags() -> list[Lag]:
    """Return 2 lags of each family, those that are drawn first."""
    random, lags = np.random.default_rng(2), {name: [] for name in LAGS}
    for _ in range(500):
        lag = draw_lag(random)
        lags[lag.family].append(lag)
    assert min(map(len, lags.values())) >= 10
    return [lag for family in lags.values() for lag in family[:2]]


@pytest.mark.parametrize("kind", KINDS)
def test_curves_go_from_0_to_1_and_stay_near(kind: str) -> None:
    for curve in draw_many(kind):
        values = curve(GRID)
        assert np.ptp(values) == pytest.approx(1.0, abs=1e-9), curve.family
        assert values.min() == pytest.approx(0.0, abs=1e-9), curve.family
        assert np.abs(curve(WIDE)).max() <= 3.0, curve.family
        assert np.isfinite(curve(np.array([-1e300, -np.inf, 1e300, np.inf]))).all(), curve.family


@pytest.mark.parametrize(("kind", "least"), [("friction", 0.2), ("size", 0.25), ("smooth size", 0.25)])
def test_sizes_are_positive_with_maximum_1(kind: str, least: float) -> None:
    lowest = []
    for curve in draw_many(kind):
        values = curve(GRID)
        assert values.max() == pytest.approx(1.0, abs=1e-9), curve.family
        assert curve(np.linspace(0.0, 1.0, 5001)).max() <= 1.01, curve.family
        assert curve(WIDE).min() >= (0.1 if kind == "smooth size" else least), curve.family
        lowest.append(values.min())
    assert least <= min(lowest) < least + 0.08
    assert max(lowest) > 0.8


@pytest.mark.parametrize("kind", KINDS | SIZES)
def test_curves_are_continuous(kind: str) -> None:
    for curve in draw_many(kind):
        assert np.abs(np.diff(curve(WIDE))).max() <= 0.21, curve.family
        assert np.abs(np.diff(curve(0.5 + 1e-7 * np.arange(3)))).max() < 1e-4, curve.family


@pytest.mark.parametrize("kind", NAMES)
def test_families_are_equally_likely(kind: str) -> None:
    counts = Counter(curve.family for curve in draw_many(kind))
    assert set(counts) == set(NAMES[kind])
    expected = 300 / len(NAMES[kind])
    assert max(counts.values()) < expected + 3.5 * expected**0.5
    assert min(counts.values()) > expected - 3.0 * expected**0.5


@pytest.mark.parametrize("kind", KINDS)
def test_every_trend_occurs(kind: str) -> None:
    counts = Counter(curve.trend for curve in draw_many(kind))
    assert set(counts) == {"falling", "rising", "neither"}
    assert 0.5 < counts["falling"] / counts["rising"] < 2.0
    assert min(counts.values()) > 45


@pytest.mark.parametrize(
    ("values", "trend"),
    [
        ([0.0, 0.3, 1.0], "rising"),
        ([1.0, 0.9, 0.0], "falling"),
        ([0.0, 1.0, 0.0], "neither"),
        ([0.0, 1.0, 0.92], "rising"),
        ([0.0, 1.0, 0.88], "neither"),
        ([0.08, 0.0, 1.0], "rising"),
        ([0.92, 1.0, 0.0], "falling"),
        ([0.88, 1.0, 0.0], "neither"),
        ([1.0, 1.0, 1.0], "neither"),
    ],
)
def test_trend_allows_a_tenth_of_the_change(values: list[float], trend: str) -> None:
    assert Curve("given", np.array([0.0, 0.5, 1.0]), np.array(values)).trend == trend


def is_smooth(curve: Curve) -> bool:
    """Return whether second difference quotients are bounded and change by little from point to point."""
    pitch = WIDE[1] - WIDE[0]
    bends = np.diff(curve(WIDE), 2) / pitch**2
    return bool(np.abs(bends).max() < 1600.0 and np.abs(np.diff(bends)).max() < 8e4 * pitch)


def test_smooth_curves_have_two_continuous_derivatives() -> None:
    assert [curve.family for curve in draw_many("smooth") if not is_smooth(curve)] == []
    assert [curve.family for curve in draw_many("smooth size") if not is_smooth(curve)] == []
    rough = Counter(curve.family for curve in draw_many("curve") if not is_smooth(curve))
    assert {"step", "clamp", "broken_line", "window", "line"} <= set(rough)


def test_steps_are_steep_but_not_abrupt() -> None:
    fine = np.linspace(0.0, 1.0, 20001)
    widths = []
    for curve in draw_many("curve"):
        if curve.family == "step":
            values = curve(fine)
            widths.append(np.count_nonzero((values > 1e-3) & (values < 1.0 - 1e-3)) / 20000)
    assert 0.009 < min(widths) < max(widths) < 0.051


def test_bumps_are_narrow_or_broad_and_of_either_sign() -> None:
    widths, rests = [], []
    for curve in draw_many("curve"):
        if curve.family == "bump":
            values = np.abs(curve(GRID) - np.median(curve(GRID)))
            widths.append(np.mean(values > 0.5 * values.max()))
            rests.append(np.median(curve(GRID)))
    assert min(widths) < 0.08
    assert max(widths) > 0.3
    assert min(rests) < 0.2 < 0.8 < max(rests)


@pytest.mark.parametrize("draw", [*KINDS.values(), *SIZES.values()])
def test_same_state_gives_same_curve(draw: partial) -> None:
    first, second, other = (draw(np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert first.family == second.family
    np.testing.assert_array_equal(first(WIDE), second(WIDE))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(first))(WIDE), second(WIDE))
    assert not np.array_equal(first(WIDE), other(WIDE))


def test_same_state_gives_same_lag_and_memory() -> None:
    assert draw_lag(np.random.default_rng(5)) == draw_lag(np.random.default_rng(5))
    assert len({repr(draw_lag(np.random.default_rng(seed))) for seed in range(20)}) > 15
    first, second = (draw_memory(np.random.default_rng(6)) for _ in range(2))
    np.testing.assert_array_equal(first.widths, second.widths)
    np.testing.assert_array_equal(first.weights, second.weights)
    assert first.asymmetry == second.asymmetry


def make_signals(count: int = 80) -> np.ndarray:
    random = np.random.default_rng(7)
    steps = np.cumsum(random.normal(size=(2, count)) * (random.random((2, count)) < 0.1), axis=1)
    return np.vstack([steps, random.normal(size=count), np.sin(0.2 * np.arange(count))])


def test_lags_keep_constants_and_offsets() -> None:
    signals = make_signals()
    for lag in draw_lags():
        np.testing.assert_allclose(lag(np.full((2, 30), 7.0), 0.1, 0.5), 7.0, rtol=1e-12, err_msg=lag.family)
        shifted = lag(signals + 100.0, 0.1, 0.5) - 100.0
        np.testing.assert_allclose(shifted, lag(signals, 0.1, 0.5), atol=1e-9, err_msg=lag.family)


def test_lags_have_static_gain_1() -> None:
    signal = np.r_[np.zeros(5), np.full(400, 2.0)][None]
    for lag in draw_lags():
        error = abs(lag(signal, 0.3, 1.0)[0, -1] - 2.0)
        assert error <= 2.0 * lag.traits.get("band", 0.0) + 2e-4, lag.family


def test_lags_delay_a_slow_ramp() -> None:
    for period in (0.237, 0.77):
        time = np.arange(round(100.0 / period)) * period
        for lag in draw_lags():
            late = np.mean((time - lag(time[None], period, 1.0)[0])[time > 80.0])
            low, high = (0.9, 1.1) if lag.family in LINEAR_LAGS else (0.3, 3.0)
            assert low < late < high, (lag, period)


def test_lags_are_causal() -> None:
    signals = make_signals()
    changed = signals.copy()
    changed[:, 40:] += np.random.default_rng(8).normal(size=(4, 40))
    for lag in draw_lags():
        for delay in (0.03, 0.55):
            before, after = lag(signals, 0.1, delay), lag(changed, 0.1, delay)
            np.testing.assert_array_equal(before[:, :40], after[:, :40], err_msg=lag.family)
            assert not np.allclose(before[:, 40:], after[:, 40:]), lag.family


def test_lags_vanish_with_the_delay() -> None:
    signals = make_signals()
    for lag in draw_lags():
        np.testing.assert_array_equal(lag(signals, 0.1, 0.0), signals)
        for delay in (1e-4, 1e-7, 1e-10):
            error = np.abs(lag(signals, 0.1, delay) - signals).max()
            assert error <= 20.0 * np.ptp(signals) * delay / 0.1 + 2e-3, (lag, delay)
        assert np.abs(lag(signals, 0.1, 0.5) - signals).max() > 0.05, lag


def test_lags_are_bounded_at_any_delay() -> None:
    signals = make_signals(40)
    for lag in draw_lags():
        for delay in (1e-12, 1e-3, 0.05, 0.1, 0.99, 1e3, 1e9):
            response = lag(signals, 0.1, delay)
            assert response.shape == signals.shape
            assert np.abs(response).max() <= 3.0 * np.ptp(signals), (lag, delay)
        np.testing.assert_array_equal(lag(signals[:, :1], 0.1, 0.5), signals[:, :1])


def test_lags_treat_rows_alike() -> None:
    signals = make_signals()
    for lag in draw_lags():
        together = lag(signals, 0.1, 0.4)
        np.testing.assert_allclose(lag(signals[::-1], 0.1, 0.4)[::-1], together, atol=1e-12, err_msg=lag.family)
        np.testing.assert_allclose(lag(signals[2:3], 0.1, 0.4), together[2:3], atol=1e-12, err_msg=lag.family)


def test_only_linear_lags_and_those_that_change_with_time_superpose() -> None:
    signals = make_signals()
    linear = {*LINEAR_LAGS, "warming_lag", "wavering_lag"}
    for lag in draw_lags():
        parts, whole = lag(signals, 0.1, 0.4), lag(signals.sum(axis=0)[None], 0.1, 0.4)[0]
        assert (np.abs(parts.sum(axis=0) - whole).max() < 1e-9) == (lag.family in linear), lag


def test_memory_is_a_mean_of_plays() -> None:
    random = np.random.default_rng(9)
    memories = [draw_memory(random) for _ in range(300)]
    for memory in memories:
        assert memory.widths.shape == memory.weights.shape
        assert memory.weights.sum() == pytest.approx(1.0, abs=1e-12)
        assert memory.weights @ memory.widths == pytest.approx(1.0, abs=1e-12)
        assert min(memory.widths.min(), memory.weights.min()) > 0.0
        assert -0.3 <= memory.asymmetry <= 0.3
    assert {memory.widths.size for memory in memories} == set(range(1, 8))
    assert max(memory.widths.max() / memory.widths.min() for memory in memories) > 5.0
    assert min(memory.asymmetry for memory in memories) < -0.2 < 0.2 < max(memory.asymmetry for memory in memories)
