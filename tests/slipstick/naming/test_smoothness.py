"""The prior of measured laws: what it leaves as it is, what it removes, and the coverage of the bands."""

import numpy as np
import pytest

from slipstick.naming.smoothness import between_points, smoothed, widened

PRECISION = 1 / 9
M = 17


def given(told: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and covariance of measurements of all values with the precisions `told` and the prior of a law."""
    covariance = np.linalg.inv(np.diag(told) + PRECISION * np.eye(len(told)))
    return covariance @ (told * values), covariance


@pytest.mark.parametrize("size", [1.0, 50.0])
def test_the_prior_of_a_strong_law_is_as_wide_as_the_law(size: float) -> None:
    """Its mean is hardly determined, and that of a narrow prior is 0."""
    values, of_mean = size * (1 + np.sin(np.arange(M))), 0.01
    told = 1e4 * (np.eye(M) - 1 / M) + of_mean / M
    covariance = np.linalg.inv(told + PRECISION * np.eye(M))
    coefficients = covariance @ told @ values
    found, errors, factor = widened(coefficients, covariance, np.full(M, PRECISION))
    own = min(PRECISION, 1 / (values**2).mean())
    assert factor * PRECISION == pytest.approx(own, rel=0.1)
    assert (values - found).mean() / values.mean() == pytest.approx(own / (own + of_mean), rel=0.1)
    assert errors.sum() / M == pytest.approx(1 / (own + of_mean), rel=0.1)
    assert (values - coefficients).mean() > 0.9 * values.mean()


def test_what_a_fit_has_not_settled_does_not_widen_the_prior() -> None:
    """A fit that ended early is off where the recordings tell nothing (0) and next to nothing (1)."""
    told = np.array([0.0, 0.0003, 1.0, *[1e5] * (M - 3)])
    values = np.array([0.0, 0.0, 12.0, *np.linspace(8, 15, M - 3)])
    precision = np.full(M, 1 / 9)
    covariance = np.diag(1 / (told + precision))
    off = covariance @ (told * values) + np.array([2.5, 6.0, *[0.0] * (M - 2)])
    change, spread, factor = widened(off, covariance, precision, unsettled=0.3)
    assert 0.01 < factor < 0.2
    assert np.all(np.abs(change[:2]) < 0.5 * np.sqrt(np.diag(spread)[:2]))
    np.testing.assert_allclose(change[3:], values[3:], rtol=1e-3)
    assert widened(off, covariance, precision)[2] < 1e-4  # far wider than the law


def test_a_coefficient_without_a_prior_follows_those_with_one() -> None:
    random = np.random.default_rng(5)
    rows = random.normal(size=(3 * M, M))
    told, precision = rows.T @ rows, np.array([0.0, *[1 / 9] * (M - 1)])
    covariance = np.linalg.inv(told + np.diag(precision))
    values = 40 * random.normal(size=M)
    change, spread, factor = widened(covariance @ (told @ values), covariance, precision)
    wide = np.linalg.inv(told + factor * np.diag(precision))
    assert factor < 0.1
    np.testing.assert_allclose(spread, wide, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(change, wide @ told @ values, rtol=1e-3)


def test_a_law_of_which_one_direction_is_hardly_told_is_smoothed() -> None:
    told = 1e7 * np.eye(M) - 1e7 / M  # all but the mean
    covariance = np.linalg.inv(told + 1e-6 * np.eye(M))
    change, spread = smoothed(np.eye(M), np.sin(np.linspace(0, 3, M)), covariance)
    assert np.ptp(change - np.sin(np.linspace(0, 3, M))) < 1e-3
    assert np.all(np.diff(np.eye(M), axis=0) @ spread @ np.diff(np.eye(M), axis=0).T < 1e-6)


def test_what_the_recordings_tell_well_stays() -> None:
    values = np.sin(np.arange(M))
    change, covariance = smoothed(np.eye(M), *given(np.full(M, 1e6), values))
    np.testing.assert_allclose(change, values, atol=1e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), 1e-3, rtol=0.01)


def test_neighbours_tell_what_the_recordings_do_not() -> None:
    x = np.linspace(0, 1, M)
    told = np.where((x > 0.3) & (x < 0.6), 1e-3, 1e4)
    noise = np.random.default_rng(3).normal(size=M) / np.sqrt(told)
    coefficients, before = given(told, 2 * x + noise)
    change, covariance = smoothed(np.eye(M), coefficients, before)
    unknown = told < 1
    assert np.abs(change - 2 * x)[unknown].max() < 0.3 < np.abs(coefficients - 2 * x)[unknown].max()
    assert np.sqrt(np.diag(covariance))[unknown].max() < 0.3 < np.sqrt(np.diag(before))[unknown].min()


def test_a_law_known_up_to_a_constant_has_differences_only() -> None:
    values = np.cumsum(np.random.default_rng(5).normal(size=M))
    onto = np.eye(M) - 1 / M
    covariance = np.linalg.inv(1e4 * onto.T @ onto + PRECISION * np.eye(M))
    change, spread = smoothed(onto, covariance @ (1e4 * onto @ values), covariance)
    np.testing.assert_allclose(onto @ change, values - values.mean(), atol=0.05)
    np.testing.assert_allclose(np.sqrt(np.diag(onto @ spread @ onto.T)), 0.01, rtol=0.1)


def test_a_random_walk_is_as_far_from_its_chords_as_stated() -> None:
    """That of 200 fine steps between two points; errors of the values are no bends."""
    rng = np.random.default_rng(11)
    fine = np.cumsum(rng.normal(size=200 * 400))
    at = fine[::200]
    chords = np.interp(np.arange(len(fine)), np.arange(len(at)) * 200, at)
    off = np.sqrt(np.mean((fine - chords)[: 200 * (len(at) - 1)] ** 2))
    np.testing.assert_allclose(between_points(at, np.zeros((len(at), len(at)))), off, rtol=0.15)
    noisy = at + 5 * rng.normal(size=len(at))
    np.testing.assert_allclose(between_points(noisy, 25 * np.eye(len(at))), off, rtol=0.15)
    assert between_points(3 - 2 * np.arange(9.0), np.zeros((9, 9))) < 1e-12
    assert between_points(np.array([1.0, 5.0]), np.zeros((2, 2))) == 0.0


def test_bands_contain_curves_of_any_kind_as_often_as_they_state() -> None:
    """Smooth curves, steps and a straight line, measured at each of 401 places with noise: 90 % bands of 17 points.

    Without the error between points, the bands of steps contain far less.
    """
    rng = np.random.default_rng(17)
    x, knots = np.linspace(0, 1, 401), np.linspace(0, 1, M)
    hats = np.stack([np.interp(x, knots, row) for row in np.eye(M)], axis=1)
    curves = {"sine": np.sin(7 * x), "steps": np.floor(4.3 * x), "line": x, "bump": np.exp(-((x - 0.4) / 0.05) ** 2)}
    held, narrow = {}, {}
    for name, curve in curves.items():
        shares = []
        for _ in range(40):
            noisy = curve + 0.3 * rng.normal(size=len(x))
            covariance = np.linalg.inv(hats.T @ hats / 0.09 + PRECISION * np.eye(M))
            change, spread = smoothed(np.eye(M), covariance @ (hats.T @ noisy / 0.09), covariance)
            both = [np.interp(x, knots, np.sqrt(np.diag(spread) + extra**2))
                    for extra in (between_points(change, spread), 0.0)]
            shares.append([np.mean(np.abs(hats @ change - curve) < 1.645 * std) for std in both])
        held[name], narrow[name] = np.mean(shares, axis=0)
    assert all(share > 0.85 for share in held.values())
    assert narrow["steps"] < 0.85
