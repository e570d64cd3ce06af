"""The linear mixed model on engagements drawn from it, and the noise on autoregressive series."""

import numpy as np
import pytest
from scipy.linalg import block_diag, toeplitz

from slipstick.calibration import noise, random_effects
from slipstick.calibration.linearised import neighbouring
from slipstick.calibration.random_effects import Engagements

MEAN, SCATTER = np.array([1.0, 0.9, 1.1]), np.array([0.02, 0.0, 0.05])


def engagements(seed: int, n: int = 60, scatter: np.ndarray = SCATTER) -> Engagements:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, 3, 3)) * [50.0, 100.0, 20.0]
    information = root @ root.transpose(0, 2, 1)
    own = MEAN + scatter * rng.normal(size=(n, 3))
    pull = (information @ own[..., None])[..., 0] + (root @ rng.normal(size=(n, 3, 1)))[..., 0]
    return Engagements(information, pull, np.full(3, 0.5), np.full(3, 1.5))


def test_likelihood_and_estimates_equal_those_of_the_stacked_regression() -> None:
    some, variance = engagements(1, n=4), np.array([4e-4, 0.0, 1e-3])
    root = np.linalg.cholesky(some.information)
    z = np.concatenate([np.linalg.solve(root[i], some.pull[i]) for i in range(4)])
    design = np.concatenate([root[i].T for i in range(4)])
    covariance = np.eye(12) + block_diag(*[root[i].T @ np.diag(variance) @ root[i] for i in range(4)])
    inverse = np.linalg.inv(covariance)
    expected = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ z)
    found = random_effects.predicted(some, variance)
    np.testing.assert_allclose(found.mean, expected, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(design.T @ inverse @ design), rtol=1e-9)
    left = z - design @ expected
    best = np.diag(variance) @ root[0] @ (inverse @ left)[:3]
    np.testing.assert_allclose(found.each[0], expected + best, rtol=1e-9)


def test_scatter_is_recovered_and_none_is_found_where_there_is_none() -> None:
    found = [random_effects.estimate(engagements(seed), np.full(3, 1e-3)) for seed in range(40)]
    scatter, errors = (np.array([getattr(one, name) for one in found]) for name in ("scatter", "scatter_error"))
    np.testing.assert_allclose(np.median(scatter, axis=0), SCATTER, atol=2e-3)
    assert 0.3 < np.mean(scatter[:, 1] < 1e-3) < 0.8  # half of the estimates of a variance of zero are at the boundary
    assert np.all(scatter[:, 1] < 5 * np.median(errors[:, 1]))
    inside = [np.abs(one.mean - MEAN) <= np.diff(one.intervals(0.9))[:, 0] / 2 for one in found]
    assert 0.8 < np.mean(inside) < 0.97  # of 120


def test_intervals_are_wider_with_fewer_runs_and_wider_than_normal_ones() -> None:
    many, few = (random_effects.estimate(engagements(2, n), np.full(3, 1e-3)) for n in (200, 12))
    assert np.all(few.intervals(0.9)[:, 1] - few.mean > 2 * (many.intervals(0.9)[:, 1] - many.mean))
    assert few.degrees_of_freedom[2] == pytest.approx(11, rel=0.5)
    assert np.all(few.intervals(0.9)[:, 1] - few.mean > 1.6449 * few.standard_error)


def test_the_three_products_give_the_inverse_covariance_of_autoregressive_noise() -> None:
    rng, rho = np.random.default_rng(5), 0.6
    rows, counted = rng.normal(size=(1, 2, 30)), np.ones((1, 30), bool)
    counted[0, 11:16] = False  # a gap: the two parts are independent
    products, counts = neighbouring(rows, counted)
    weights = noise.Noise(np.array([0.3]), np.array([rho])).weights[0]
    covariance = 0.09 * block_diag(toeplitz(rho ** np.arange(11)), toeplitz(rho ** np.arange(14)))
    kept = rows[0][:, counted[0]]
    np.testing.assert_allclose(np.tensordot(weights, products, 1)[0], kept @ np.linalg.inv(covariance) @ kept.T)
    assert counts[:, 0].tolist() == [25, 23]


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.5])
def test_noise_and_its_correlation_are_estimated_also_through_a_coarse_resolution(rho: float) -> None:
    rng = np.random.default_rng(6)
    series = rng.normal(size=(60, 1000))
    for k in range(1, 1000):
        series[:, k] = rho * series[:, k - 1] + np.sqrt(1 - rho**2) * series[:, k]
    products, counts = neighbouring(series[:, None], np.ones((60, 1000), bool))
    fitted = noise.most_likely(products[:, :, 0, 0].sum(axis=1)[None], counts.sum(axis=1)[None])
    assert fitted.std[0] == pytest.approx(1, rel=0.02)
    assert fitted.correlation[0] == pytest.approx(rho, abs=0.02)
    smooth = 50 * np.sin(np.arange(1000) / 100)
    std, correlation = noise.sensor_noise("pressure", np.round((series + smooth) / 0.2) * 0.2)
    assert std == pytest.approx(1, rel=0.06)
    assert correlation == pytest.approx(rho, abs=0.06)
