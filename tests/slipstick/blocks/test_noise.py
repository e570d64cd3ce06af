"""The noise of a sensor: from what a block leaves of its signal, and the filter that whitens it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from slipstick.blocks import sensor_noise
from slipstick.blocks.sensor_noise import added, in_common, noise_of, power
from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.clutch.model import Model
from slipstick.naming.start import _left, begin
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

STD, SHAPE = 0.3, (40, 800)
EVERY = np.ones(SHAPE, bool)
ASSUMED = BlockNoise(10 * STD, 0.999)


def noise(rho: float, seed: int = 2) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal((SHAPE[0], SHAPE[1] + 100)) * STD * np.sqrt(1 - rho**2)
    return np.asarray(lfilter([1], [1, -rho], white)[:, 100:])


@pytest.mark.parametrize("rho", [-0.3, 0.0, 0.5, 0.85, 0.95])
def test_the_noise_of_white_and_of_correlated_sensors_is_found(rho: float) -> None:
    std, found = noise_of(noise(rho), EVERY, ASSUMED)
    assert std == pytest.approx(STD, rel=0.1)
    assert found == pytest.approx(rho, abs=0.02)


def test_samples_that_do_not_count_say_nothing() -> None:
    counted = EVERY.copy()
    counted[:, 300:500] = False
    assert noise_of(np.where(counted, noise(0.85), 1e6), counted, ASSUMED) == pytest.approx((STD, 0.85), rel=0.1)
    assert noise_of(noise(0.85), np.zeros(SHAPE, bool), ASSUMED) == (ASSUMED.std, ASSUMED.correlation)


def test_what_a_block_lacks_hardly_changes_the_noise() -> None:
    slow = 10 * STD * np.sin(np.linspace(0, 6, SHAPE[1]))
    jump = np.where(np.arange(SHAPE[1]) < 400, 0.0, 30 * STD)
    assert noise_of(noise(0.7) + slow + jump, EVERY, ASSUMED) == pytest.approx((STD, 0.7), rel=0.08)


def test_the_integrated_noise_of_the_input_is_not_that_of_the_output() -> None:
    steps = 0.5 * noise(0.6, seed=3)
    walk = np.concatenate([np.zeros((SHAPE[0], 1)), np.cumsum(steps, axis=1)[:, :-1]], axis=1)
    shape = SHAPE[0], SHAPE[1] - 1
    assumed = BlockNoise(10 * STD, 0.0, STD, 0.6, np.ones(shape), np.full(shape, 0.5))
    assert noise_of(noise(0.5) + walk, EVERY, assumed) == pytest.approx((STD, 0.5), rel=0.1)
    alone = noise_of(noise(0.5) + walk, EVERY, replace(assumed, onto=None, decay=None))
    assert alone[1] > 0.7  # the walk would be taken for a correlation


def test_a_sensor_keeps_some_noise_where_that_of_the_input_could_explain_all() -> None:
    shape = SHAPE[0], SHAPE[1] - 1
    std, rho = noise_of(noise(0.5), EVERY, BlockNoise(STD, 0.5, 100.0, 0.9, np.ones(shape), np.ones(shape)))
    assert 0.01 * STD < std < STD
    assert abs(rho) < 1


def test_the_blocks_of_an_engagement_start_with_the_noise_that_they_leave() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), 30, seed=1)
    true = {name: HEAVY.sensors[name].noise for name in scene.noise}
    scene = replace(scene, noise={name: (2 * std, 0.9) for name, (std, _) in scene.noise.items()})
    found = begin(scene, lambda _: None)
    for name, (std, rho) in found.noise.items():
        assert std == pytest.approx(true[name], rel=0.1)
        assert abs(rho) < 0.1
    for name in ("load", "input", "lock", "contact"):
        assert found.fits[name].chi2.mean() == pytest.approx(1, abs=0.07)


@pytest.mark.parametrize("begun", [(44.2, 0.999), (3.0, 0.5), (0.1, 0.0), (20.0, -0.5)])
def test_the_noise_does_not_depend_on_that_which_was_assumed(monkeypatch: pytest.MonkeyPatch,
                                                             begun: tuple[float, float]) -> None:
    # What 27 engagements of a drawn bench left: their noise had a correlation of 0.77.
    observed = dict(zip(sensor_noise.LAGS, (6.9388, 12.9666, 22.0196, 37.9074), strict=True))
    monkeypatch.setattr(sensor_noise, "second_variance", lambda left, counted, lag: observed[lag])
    assert noise_of(np.zeros(SHAPE), EVERY, BlockNoise(*begun)) == pytest.approx((2.84, 0.81), rel=0.01)


def block(left: np.ndarray, first: int, last: int) -> Any:
    counted = np.zeros(SHAPE, bool)
    counted[:, first:last] = True
    return SimpleNamespace(block=SimpleNamespace(measured=left, counted=counted), predicted=np.zeros(SHAPE))


def test_a_jump_from_one_block_of_a_signal_to_the_next_is_no_noise() -> None:
    own = 6 * STD * np.random.default_rng(4).standard_normal((SHAPE[0], 1))  # as each block has its own parameters
    before, after = noise(0.8), noise(0.8) + own
    apart = [block(before, first, first + 20) for first in range(0, 800, 40)]
    apart += [block(after, first, first + 20) for first in range(20, 800, 40)]
    assert noise_of(*_left(apart), ASSUMED) == pytest.approx((STD, 0.8), rel=0.1)
    joined = np.where(np.arange(SHAPE[1]) // 20 % 2, after, before)
    assert power(noise_of(joined, EVERY, ASSUMED)) > 2 * power((STD, 0.8))


def test_what_rows_leave_in_common_is_found_far_below_the_noise() -> None:
    groups = np.repeat(np.arange(4), 10)
    wave = 0.2 * STD * np.array([np.sin(np.linspace(0, 20, SHAPE[1]) + phase) for phase in range(4)])[groups]
    std, rho = in_common(noise(0.5) + wave, groups)
    assert std == pytest.approx(wave.std(), rel=0.1)
    assert rho > 0.99
    assert in_common(noise(0.5), groups)[0] < 0.05 * STD  # nothing in common
    assert in_common(noise(0.5), np.arange(SHAPE[0])) == (0.0, 0.0)  # nothing to compare


def test_the_sum_of_two_noises_has_the_variance_and_the_covariance_of_both() -> None:
    std, rho = added((3.0, 0.5), (4.0, 0.9))
    assert std == 5.0
    assert rho * std**2 == pytest.approx(0.5 * 9 + 0.9 * 16)
    assert added((3.0, 0.5), (0.0, 0.0)) == (3.0, 0.5)


# The whitening filter against the dense covariance of the noise, and on noise that is simulated.


K = 25


def covariance(noise: BlockNoise, i: int) -> np.ndarray:
    """Covariance (k, k) of the noise of an engagement, from its definition."""
    steps = np.arange(K)
    sensor = noise.std**2 * toeplitz(noise.correlation**steps)
    if noise.modes is not None:
        sensor = sensor + noise.modes[i].T @ noise.modes[i]
    if noise.decay is None or noise.onto is None:
        return sensor
    reach = np.zeros((K, K))  # what the integral is at each sample of an input that is 1 at one sample
    for t in range(K - 1):
        reach[t + 1] = noise.decay[i, t] * reach[t]
        reach[t + 1, t] += noise.onto[i, t]
    return np.asarray(sensor + noise.input_std**2 * reach @ toeplitz(noise.input_correlation**steps) @ reach.T)


def driven(n: int) -> BlockNoise:
    rng = np.random.default_rng(7)
    onto = np.broadcast_to(rng.uniform(-1, 1, (n, 1)), (n, K - 1))
    return BlockNoise(0.3, 0.4, 0.5, 0.6, rng.uniform(0.7, 1.0, (n, K - 1)), onto)


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize("integrated", [False, True])
@pytest.mark.parametrize("modes", [False, True])
def test_products_are_those_under_the_inverse_covariance(n: int, missing: bool, integrated: bool, modes: bool) -> None:
    rng = np.random.default_rng(1)
    columns, counted = rng.normal(size=(n, 4, K)), np.ones((n, K), bool)
    if missing:
        counted = rng.random((n, K)) < 0.6
        counted[0, :3] = False
    noise = driven(n) if integrated else BlockNoise(0.3, 0.7)
    if modes:
        noise = replace(noise, modes=rng.normal(size=(n, 2, K)))
    found = whitened(columns, counted, noise)
    for i in range(n):
        kept = columns[i][:, counted[i]]
        dense = covariance(noise, i)[np.ix_(counted[i], counted[i])]
        np.testing.assert_allclose(found[i] @ found[i].T, kept @ np.linalg.solve(dense, kept.T), rtol=1e-9, atol=1e-9)
        if not modes:  # in the order of time the innovations are those of the Cholesky factor
            independent = np.linalg.solve(np.linalg.cholesky(dense), kept.T).T
            np.testing.assert_allclose(found[i][:, counted[i]], independent, rtol=1e-9, atol=1e-9)
    assert not np.any(found[np.broadcast_to(~counted[:, None], found.shape)])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_modes_of_any_size_leave_independent_samples_of_unit_variance(size: float) -> None:
    rng = np.random.default_rng(4)
    noise = BlockNoise(0.3, 0.7, modes=size * rng.normal(size=(1, 2, K)))
    root = whitened(np.eye(K)[None], np.ones((1, K), bool), noise)[0]  # what it multiplies series with
    np.testing.assert_allclose(root.T @ covariance(noise, 0) @ root, np.eye(K), atol=1e-6)


def autoregressive(rng: np.random.Generator, n: int, std: float, rho: float) -> np.ndarray:
    series = rng.normal(size=(n, K))
    for t in range(1, K):
        series[:, t] = rho * series[:, t - 1] + np.sqrt(1 - rho**2) * series[:, t]
    return std * series


def test_simulated_noise_is_independent_with_unit_variance_and_a_wrong_correlation_is_seen() -> None:
    series, counted = autoregressive(np.random.default_rng(2), 4000, 0.2, 0.5), np.ones((4000, K), bool)
    def moments(noise: BlockNoise) -> tuple[float, float]:
        left = whitened(series[:, None], counted, noise)[:, 0]
        return float((left[:, 1:] ** 2).mean()), float((left[:, 2:] * left[:, 1:-1]).mean())
    assert moments(BlockNoise(0.2, 0.5)) == pytest.approx((1, 0), abs=0.02)  # four standard errors
    assert moments(BlockNoise(0.2, 0.0)) == pytest.approx((1, 0.5), abs=0.02)
    assert moments(BlockNoise(0.2, 0.8))[0] == pytest.approx((1 + 0.8**2 - 2 * 0.8 * 0.5) / (1 - 0.8**2), abs=0.05)


def test_integrated_noise_has_unit_variance_and_does_not_if_it_is_left_out() -> None:
    rng, n = np.random.default_rng(3), 4000
    noise = driven(n)
    assert noise.decay is not None
    assert noise.onto is not None
    series, u, x = autoregressive(rng, n, noise.std, noise.correlation), autoregressive(rng, n, 0.5, 0.6), np.zeros(n)
    for t in range(K - 1):
        x = noise.decay[:, t] * x + noise.onto[:, t] * u[:, t]
        series[:, t + 1] += x
    counted = np.ones((n, K), bool)
    left = whitened(series[:, None], counted, noise)[:, 0]
    np.testing.assert_allclose((left**2).mean(axis=0), 1, atol=0.1)  # four standard errors, at every sample
    assert abs((left[:, 1:] * left[:, :-1]).mean()) < 0.015
    assert (whitened(series[:, None], counted, BlockNoise(noise.std, noise.correlation)) ** 2).mean() > 1.5
