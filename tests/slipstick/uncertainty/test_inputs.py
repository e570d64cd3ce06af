"""Normal inputs, their samples, and the mass outside a box against scipy's distributions."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.sampling import axis_mass_outside, count_outside, mass_outside, normal_germs

MIXING = np.array([[0.10, 0.04], [0.03, 0.05]])
LOWER, UPPER = np.array([0.8, 0.9]), np.array([1.1, 1.5])


def test_mixing_mixes_germs() -> None:
    inputs = Inputs([1.0, 0.9], mixing=MIXING)
    germs = normal_germs(2, 4096, 1)
    points = inputs.points(germs)
    np.testing.assert_allclose(points[:, 0], 1.0 + 0.10 * germs[:, 0] + 0.04 * germs[:, 1], rtol=1e-14)
    np.testing.assert_allclose(points[:, 1], 0.9 + 0.03 * germs[:, 0] + 0.05 * germs[:, 1], rtol=1e-14)
    np.testing.assert_allclose(np.cov(points.T), MIXING @ MIXING.T, rtol=5e-3)
    # The transposed matrix mixes inputs, not germs: another covariance.
    assert np.abs(np.cov(points.T) - MIXING.T @ MIXING).max() > 5e-4
    np.testing.assert_allclose(inputs.marginal_std, np.sqrt(np.diag(MIXING @ MIXING.T)))


def test_std_is_a_diagonal_mixing() -> None:
    germs = normal_germs(2, 64, 1)
    by_std, by_mixing = Inputs([1.0, 1.0], [0.1, 0.2]), Inputs([1.0, 1.0], mixing=np.diag([0.1, 0.2]))
    np.testing.assert_array_equal(by_std.points(germs), by_mixing.points(germs))


def test_samples_follow_their_seed_and_the_standard_normal() -> None:
    germs = normal_germs(3, 4096, 7)
    np.testing.assert_array_equal(germs, normal_germs.__wrapped__(3, 4096, 7))
    assert not np.array_equal(germs, normal_germs(3, 4096, 8))
    np.testing.assert_allclose(germs.mean(axis=0), 0, atol=1e-3)
    np.testing.assert_allclose(np.cov(germs.T), np.eye(3), atol=5e-3)
    with pytest.raises(ValueError, match="read-only"):
        germs[0, 0] = 0.0
    with pytest.raises(InvalidValue, match="power of two"):
        normal_germs(2, 1000, 1)


@pytest.mark.parametrize("std", [[0.05, 0.05], [0.3, 0.02], [0.0, 0.1]])
def test_mass_outside_is_exact_for_independent_inputs(std: list[float]) -> None:
    inputs = Inputs([0.95, 1.2], std)
    inside = [norm.cdf(high, mean, max(s, 1e-12)) - norm.cdf(low, mean, max(s, 1e-12))
              for low, high, mean, s in zip(LOWER, UPPER, inputs.mean, std, strict=True)]
    np.testing.assert_allclose(axis_mass_outside(inputs, LOWER, UPPER), 1 - np.array(inside), atol=1e-15)
    mass = mass_outside(inputs, LOWER, UPPER, normal_germs(2, 2, 1))
    np.testing.assert_allclose(mass, 1 - np.prod(inside), rtol=1e-10)


def test_mass_outside_keeps_its_digits_and_its_ends() -> None:
    germs, box = normal_germs(2, 2, 1), (np.full(2, 0.5), np.full(2, 1.5))
    far = Inputs([1.0, 1.0], [0.05, 0.05])  # both edges at 10 std
    np.testing.assert_allclose(mass_outside(far, *box, germs), 4 * norm.sf(10.0), rtol=1e-12)
    assert mass_outside(Inputs([0.5, 1.5], [0.0, 0.0]), *box, germs) == 0.0
    assert mass_outside(Inputs([0.4, 1.0], [0.0, 0.1]), *box, germs) == 1.0


def test_mass_outside_of_mixed_inputs_against_the_integral() -> None:
    inputs = Inputs([0.95, 1.0], mixing=MIXING)
    joint = multivariate_normal(inputs.mean, MIXING @ MIXING.T)
    germs = normal_germs(2, 2**14, 1)
    expected = 1 - joint.cdf(UPPER, lower_limit=LOWER)
    np.testing.assert_allclose(mass_outside(inputs, LOWER, UPPER, germs), expected, atol=1e-3)
    independent = Inputs(inputs.mean, inputs.marginal_std)
    assert abs(mass_outside(independent, LOWER, UPPER, germs) - expected) > 5e-3  # the mixing matters here
    np.testing.assert_allclose(mass_outside(Inputs([1.0, 1.0], mixing=MIXING), np.full(2, 0.5), np.full(2, 1.5), germs),
                               2 * norm.sf(0.5 / np.hypot(0.10, 0.04)), rtol=1e-6)  # too rare for the samples


def test_points_outside_are_counted_once() -> None:
    points = np.array([[1.0, 1.0], [0.5, 2.0], [1.2, 1.0], [0.8, 1.5]])
    assert count_outside(points, LOWER, UPPER) == 2


@pytest.mark.parametrize(("arguments", "cause"), [
    (([1.0, 1.0],), "either the std or the mixing"),
    (([1.0, 1.0], [0.1, 0.1], np.eye(2)), "either the std or the mixing"),
    (([1.0, 1.0], [0.1]), "shape \\(1,\\)"),
    (([1.0, 1.0], None, np.eye(3)), "shape \\(3, 3\\)"),
    (([1.0, 1.0], None, [0.1, 0.1]), "shape \\(2,\\)"),
    (([[1.0]], [0.1]), "mean has shape"),
    (([1.0, np.nan], [0.1, 0.1]), "not finite"),
    (([1.0, 1.0], [0.1, -0.1]), "negative"),
])
def test_inputs_that_make_no_sense_are_refused(arguments: tuple[object, ...], cause: str) -> None:
    with pytest.raises(InvalidValue, match=cause):
        Inputs(*arguments)  # type: ignore[arg-type]
