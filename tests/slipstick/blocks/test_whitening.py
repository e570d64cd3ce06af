"""The whitening filter against the dense covariance of the noise, and on noise that is simulated."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz

from slipstick.blocks.whitening import BlockNoise, whitened

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
