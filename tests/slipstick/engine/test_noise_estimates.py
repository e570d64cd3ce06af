"""Estimates of noise against what was drawn: of a signal, and of what a fit leaves of it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from slipstick.engine.noise import (
    CORRELATIONS,
    HIGHEST,
    LAGS,
    LONGER,
    Carried,
    Differences,
    Noise,
    SecondDifferences,
    bound_noise,
    draw_noise,
    estimate_loudness,
    estimate_residual_noise,
    estimate_sensor_noise,
    second_variances,
)
from slipstick.errors import InvalidValue

RUNS, SAMPLES = 40, 1000
EVERY = np.ones((RUNS, SAMPLES), bool)
ASSUMED = Noise(3.0, 0.5)
stds = pytest.mark.parametrize("std", [1e-3, 0.2, 50.0])


def draw(std: float, correlation: float, seed: int = 1) -> np.ndarray:
    return draw_noise(Noise(std, correlation), (RUNS, SAMPLES), np.random.default_rng(seed))


def draw_smooth(std: float) -> np.ndarray:
    """A signal that is far larger than its noise, and changes within hundreds of samples."""
    time = np.linspace(0, 1, SAMPLES)
    return np.asarray(20 * std * np.sin(18 * time) * np.linspace(1, 2, RUNS)[:, None] + 100 * std * time)


def jump(std: float) -> np.ndarray:
    """Two jumps in each run."""
    places = np.random.default_rng(2).integers(10, SAMPLES - 10, (RUNS, 2, 1))
    return np.asarray(30 * std * (np.arange(SAMPLES) > places).sum(axis=1))


def estimate(left: np.ndarray, counted: np.ndarray = EVERY, carried: np.ndarray | None = None,
             assumed: Noise = ASSUMED) -> Noise:
    """The noise of one sensor of whose signal a fit leaves `left` (n, k)."""
    shown = SecondDifferences.of(left[:, None], counted[:, None], LAGS, None if carried is None else carried[:, None])
    return estimate_residual_noise(shown, [assumed])[0][0]


@pytest.mark.parametrize("correlation", [-0.5, 0.0, 0.6, 0.95])
def test_drawn_noise_has_its_std_and_correlation_from_the_first_sample_on(correlation: float) -> None:
    noise = draw_noise(Noise(2.0, correlation), (40_000, 12), np.random.default_rng(3))
    lags = np.abs(np.subtract.outer(np.arange(12), np.arange(12)))
    np.testing.assert_allclose(np.cov(noise.T), 4 * np.power(correlation, lags), atol=0.12)


@pytest.mark.parametrize("correlation", [-0.5, 0.0, 0.6])
def test_power_is_the_sum_of_all_autocovariances_and_what_is_fresh_is_not_foreseen(correlation: float) -> None:
    noise, exact = Noise(2.0, correlation), 4 * np.power(correlation, np.abs(np.arange(-200, 201.0))).sum()
    assert noise.power == pytest.approx(exact)
    drawn = draw(2.0, correlation)
    assert np.std(drawn[:, 1:] - correlation * drawn[:, :-1]) == pytest.approx(noise.fresh, rel=0.02)


@stds
@pytest.mark.parametrize(("correlation", "close"), [(-0.5, 0.02), (0.0, 0.03), (0.3, 0.06), (0.6, 0.12)])
@pytest.mark.parametrize("jumps", [False, True])
def test_a_smooth_signal_shows_the_noise_of_its_sensor(std: float, correlation: float, close: float,
                                                       jumps: bool) -> None:
    values = draw(std, correlation) + draw_smooth(std) + (jump(std) if jumps else 0)
    noise = estimate_sensor_noise("speed", values)
    assert noise.correlation == pytest.approx(correlation, abs=close)
    assert noise.std == pytest.approx(std, rel=close + 0.02)


@stds
@pytest.mark.parametrize("correlation", [-0.5, 0.0, 0.3, 0.6, 0.8, 0.9])
@pytest.mark.parametrize("leaves", ["noise", "slow", "jumps"])
def test_what_a_fit_leaves_shows_the_noise_of_its_sensor(std: float, correlation: float, leaves: str) -> None:
    """Whatever the model lacks, slowly or in jumps that reach a few percent of the second differences."""
    lacking = {"noise": 0.0, "slow": draw_smooth(std) / 10, "jumps": jump(std)}[leaves]
    noise = estimate(draw(std, correlation) + lacking)
    close = (2 if leaves == "jumps" else 1) * (0.04 if correlation < 0.5 else 0.15)
    assert noise.correlation == pytest.approx(correlation, abs=0.04)
    assert noise.std == pytest.approx(std, rel=close)


@pytest.mark.parametrize("assumed", [Noise(1e-6, -0.99), Noise(0.2, 0.3), Noise(1e6, HIGHEST)])
def test_the_assumed_noise_does_not_matter_where_samples_count(assumed: Noise) -> None:
    noise = estimate(draw(0.2, 0.3), assumed=assumed)
    assert (noise.std, noise.correlation) == (pytest.approx(0.2, rel=0.02), pytest.approx(0.3, abs=0.02))


def test_samples_that_do_not_count_say_nothing() -> None:
    counted = np.random.default_rng(4).uniform(size=EVERY.shape) < 0.7
    counted[:, 300:500] = False
    noise = estimate(np.where(counted, draw(0.2, 0.6), 1e6), counted)
    assert (noise.std, noise.correlation) == (pytest.approx(0.2, rel=0.06), pytest.approx(0.6, abs=0.03))


@pytest.mark.parametrize("kept", [0, 12])
def test_the_assumed_noise_stays_where_too_few_samples_count(kept: int) -> None:
    counted = np.zeros_like(EVERY)
    counted[:, :kept] = True
    assert estimate(draw(0.2, 0.6), counted) is ASSUMED
    assert estimate(np.zeros(EVERY.shape)) is ASSUMED


@pytest.mark.parametrize("own", [Noise(0.2, 0.0), Noise(0.2, 0.6), Noise(0.1, -0.3)])
@pytest.mark.parametrize("drawn", [8, RUNS])
def test_noise_that_inputs_carry_is_taken_off(own: Noise, drawn: int) -> None:
    def carry(seed: int) -> np.ndarray:
        return np.asarray(lfilter([0.2], [1, -0.8], draw(0.5, 0.3, seed), axis=1))

    left = draw(own.std, own.correlation) + carry(10)
    noise = estimate(left, carried=carry(11)[:drawn])
    assert noise.std == pytest.approx(own.std, rel=0.08)
    assert noise.correlation == pytest.approx(own.correlation, abs=0.06)
    assert estimate(left).std > 1.2 * own.std


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8, 0.95])
@pytest.mark.parametrize("shift", [-0.3, 0.3])
def test_what_is_integrated_shows_the_correlation_of_the_noise_of_an_input(correlation: float, shift: float) -> None:
    """Its own differences hardly do: the correlation to begin with is another one."""
    def carry(noise: Noise, seed: int) -> np.ndarray:
        drawn = draw_noise(noise, EVERY.shape, np.random.default_rng(seed))
        return np.asarray(lfilter([0.2], [1, -0.99], drawn, axis=1))[:, None]

    read, own, every = Noise(3.0, correlation), Noise(0.5, 0.2), EVERY[:, None]
    signal = draw_noise(read, EVERY.shape, np.random.default_rng(20)) + draw_smooth(3.0)
    left = carry(read, 20) + draw(own.std, own.correlation)[:, None]
    shows = Differences.of(signal)
    carried = Carried(shows, CORRELATIONS, np.array([
        second_variances(carry(shows.noise(rho), 21), every, LONGER) for rho in CORRELATIONS.tolist()]))
    assumed = shows.noise(float(np.clip(correlation + shift, -0.4, 0.97)))
    (sensor,), (noise,) = estimate_residual_noise(SecondDifferences.of(left, every, LONGER), [ASSUMED],
                                                  [(assumed, carried)])
    assert noise.power == pytest.approx(read.power, rel=0.15)
    assert sensor.std == pytest.approx(own.std, rel=0.15)


@pytest.mark.parametrize("values", [np.zeros((3, 100)), np.full((3, 100), 7.0), np.arange(300.0).reshape(3, 100)],
                         ids=["zeros", "constant", "ramp"])
def test_a_signal_without_noise_is_refused(values: np.ndarray) -> None:
    with pytest.raises(InvalidValue, match="speed shows no noise") as refused:
        estimate_sensor_noise("speed", values)
    assert "Record it with a finer resolution" in refused.value.remedy


def test_louder_runs_are_louder_and_equal_ones_are_equal() -> None:
    factors = np.exp(np.linspace(-0.7, 0.7, RUNS))
    loud = estimate_loudness(draw(0.2, 0.3) * factors[:, None], EVERY)
    np.testing.assert_allclose(loud, factors, rtol=0.12)
    assert np.std(np.log(loud / factors)) < 0.05
    equal = estimate_loudness(draw(0.2, 0.0), EVERY)
    np.testing.assert_allclose(equal, 1, atol=0.05)
    assert estimate_loudness(np.zeros(EVERY.shape), EVERY).tolist() == [1.0] * RUNS


@pytest.mark.parametrize("lacking", [0.0, 3.0])
def test_noise_is_no_larger_than_what_the_signal_shows(lacking: float) -> None:
    """What a fit leaves of a fast movement that its model lacks is no noise."""
    own = draw(0.2, 0.6)
    left = own + lacking * 0.2 * np.random.default_rng(4).standard_normal(EVERY.shape)
    noise = bound_noise(estimate(left), own + draw_smooth(0.2))
    third = np.diff(draw_noise(noise, (RUNS, SAMPLES), np.random.default_rng(5)), 3, axis=1).std()
    assert third < 1.02 * np.diff(own, 3, axis=1).std()
    assert lacking or noise.std == pytest.approx(0.2, rel=0.03)


def test_slow_noise_of_an_input_that_is_larger_by_far_is_no_noise_of_the_sensor() -> None:
    """A loud torque turns a shaft: over eight samples, what it adds to the speed is more than a hundred times the noise
    of that, and both what is left and what is drawn of it are known to some per cent only."""
    every = np.ones((36, 1, 300), bool)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        carried, drawn = (lfilter([4.0, 4.0], [1, -0.99], draw_noise(Noise(0.5, 0.9), (36, 300), rng))[:, None]
                          for _ in range(2))
        left = draw_noise(Noise(0.5, 0.0), (36, 300), rng)[:, None] + carried
        (estimated,), _ = estimate_residual_noise(SecondDifferences.of(left, every, LAGS, drawn, drawn), [ASSUMED])
        assert estimated.std == pytest.approx(0.5, rel=0.35)
        assert abs(estimated.correlation) < 0.35
