"""The linear mixed model on engagements drawn from it, and the noise on autoregressive series."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag, toeplitz

from slipstick.blocks.sensor_noise import sensor_noise
from slipstick.calibration import noise, random_effects
from slipstick.calibration.identification import find_undetermined
from slipstick.calibration.linearised import neighbour_products
from slipstick.calibration.random_effects import Engagements

MEAN, SCATTER = np.array([1.0, 0.9, 1.1]), np.array([0.02, 0.0, 0.05])


def engagements(seed: int, n: int = 60, scatter: np.ndarray = SCATTER) -> Engagements:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, 3, 3)) * [50.0, 100.0, 20.0]
    information = root @ root.transpose(0, 2, 1)
    own = MEAN + scatter * rng.normal(size=(n, 3))
    pull = (information @ own[..., None])[..., 0] + (root @ rng.normal(size=(n, 3, 1)))[..., 0]
    return Engagements(information, pull, np.full(3, 0.5), np.full(3, 1.5), np.ones(3), np.zeros((3, 0)))


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
    products, counts = neighbour_products(rows, counted)
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
    products, counts = neighbour_products(series[:, None], np.ones((60, 1000), bool))
    fitted = noise.fit_noise(products[:, :, 0, 0].sum(axis=1)[None], counts.sum(axis=1)[None])
    assert fitted.std[0] == pytest.approx(1, rel=0.02)
    assert fitted.correlation[0] == pytest.approx(rho, abs=0.02)
    smooth = 50 * np.sin(np.arange(1000) / 100)
    std, correlation = sensor_noise("pressure", np.round((series + smooth) / 0.2) * 0.2)
    assert std == pytest.approx(1, rel=0.06)
    assert correlation == pytest.approx(rho, abs=0.06)


def test_a_direction_without_information_is_held_and_has_the_variance_of_the_bounds() -> None:
    some, along = engagements(3), np.array([0.6, 0.8, 0.0])
    off = np.eye(3) - np.outer(along, along)
    blind = replace(some, information=off @ some.information @ off, pull=some.pull @ off)
    variance = np.array([4e-4, 4e-4, 1e-3])
    held = find_undetermined(random_effects.marginals(blind, variance)[0].sum(axis=0), blind.known)
    assert held.shape == (3, 1)
    np.testing.assert_allclose(held[:, 0] / np.linalg.norm(held), np.sign(held[0, 0]) * along, atol=1e-6)
    found = random_effects.predicted(replace(blind, held=held), variance)
    assert found.undetermined.tolist() == [True, True, False]
    assert (found.mean - blind.start) @ along == pytest.approx(0, abs=1e-9)  # all bounds are equal
    assert along @ found.covariance @ along == pytest.approx(1 / 12)
    basis = np.linalg.qr(np.column_stack([along, np.eye(3)[:, 1:]]))[0][:, 1:]
    marginal, pull, *_ = random_effects.marginals(blind, variance)
    left = pull.sum(axis=0) - marginal.sum(axis=0) @ blind.start
    within = np.linalg.inv(basis.T @ marginal.sum(axis=0) @ basis)
    np.testing.assert_allclose(found.mean, blind.start + basis @ within @ basis.T @ left, rtol=1e-9)
    np.testing.assert_allclose(basis.T @ found.covariance @ basis, within, rtol=1e-6)


def test_every_direction_is_determined_where_the_engagements_say_more_than_the_bounds() -> None:
    some, variance = engagements(3), np.full(3, 1e-3)
    total = random_effects.marginals(some, variance)[0].sum(axis=0)
    assert find_undetermined(total, some.known).shape == (3, 0)
    assert find_undetermined(total * 1e-9, some.known).shape == (3, 3)


def test_a_variance_of_which_nothing_is_told_stays_and_has_the_error_of_its_range() -> None:
    some, off = engagements(4), np.diag([1.0, 1.0, 0.0])
    blind = replace(some, information=off @ some.information @ off, pull=some.pull @ off,
                    held=np.eye(3)[:, 2:] / 12**0.5)
    found = random_effects.estimate(blind, np.full(3, 1e-3))
    assert found.variance[2] == pytest.approx(1e-3)
    assert found.uncertainty[2, 2] == pytest.approx((1 / 36) ** 2 / 12)
    assert found.mean[2] == pytest.approx(1)
    seen = random_effects.estimate(some, np.full(3, 1e-3))
    assert seen.uncertainty[2, 2] < 0.1 * found.uncertainty[2, 2]
