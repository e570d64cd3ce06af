"""Samples of the standard normals, and the probability outside a box compared with SciPy."""

import numpy as np
import pytest
from scipy.stats import beta, gamma, multivariate_normal, norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs, axis_mass_outside, count_outside, mass_outside, standard_normals

MIXING = np.array([[0.10, 0.04], [0.03, 0.05]])
LOWER, UPPER = np.array([0.8, 0.9]), np.array([1.1, 1.5])


def test_samples_depend_on_the_seed_and_are_standard_normal() -> None:
    normals = standard_normals(3, 4096, 7)
    np.testing.assert_array_equal(normals, standard_normals.__wrapped__(3, 4096, 7))
    assert not np.array_equal(normals, standard_normals(3, 4096, 8))
    np.testing.assert_allclose(normals.mean(axis=0), 0, atol=1e-3)
    np.testing.assert_allclose(np.cov(normals.T), np.eye(3), atol=5e-3)
    with pytest.raises(ValueError, match="read-only"):
        normals[0, 0] = 0.0
    with pytest.raises(InvalidValue, match="power of two"):
        standard_normals(2, 1000, 1)


@pytest.mark.parametrize("std", [[0.05, 0.05], [0.3, 0.02], [0.0, 0.1]])
def test_mass_outside_is_exact_for_independent_inputs(std: list[float]) -> None:
    inputs = Inputs([0.95, 1.2], std)
    inside = [norm.cdf(high, mean, max(s, 1e-12)) - norm.cdf(low, mean, max(s, 1e-12))
              for low, high, mean, s in zip(LOWER, UPPER, inputs.mean, std, strict=True)]
    np.testing.assert_allclose(axis_mass_outside(inputs, LOWER, UPPER), 1 - np.array(inside), atol=1e-15)
    mass = mass_outside(inputs, LOWER, UPPER, standard_normals(2, 2, 1))
    np.testing.assert_allclose(mass, 1 - np.prod(inside), rtol=1e-10)


def test_mass_outside_is_that_of_the_family() -> None:
    inputs = Inputs([1.0, 1.0], [0.25, 0.2], families=("gamma", "beta"), support=[[0.0, 9.0], [0.5, 1.5]])
    expected = [gamma.sf(1.1, 16, scale=1 / 16) + gamma.cdf(0.8, 16, scale=1 / 16), beta.cdf(0.4, 2.625, 2.625)]
    np.testing.assert_allclose(axis_mass_outside(inputs, LOWER, UPPER), expected, rtol=1e-10)
    normal = axis_mass_outside(Inputs([1.0, 1.0], [0.25, 0.2]), LOWER, UPPER)
    assert np.all(np.abs(normal - expected) > 0.01)


def test_mass_outside_is_accurate_in_the_tails_and_at_the_edges() -> None:
    normals, box = standard_normals(2, 2, 1), (np.full(2, 0.5), np.full(2, 1.5))
    far = Inputs([1.0, 1.0], [0.05, 0.05])  # edges at 10 std
    np.testing.assert_allclose(mass_outside(far, *box, normals), 4 * norm.sf(10.0), rtol=1e-12)
    assert mass_outside(Inputs([0.5, 1.5], [0.0, 0.0]), *box, normals) == 0.0
    assert mass_outside(Inputs([0.4, 1.0], [0.0, 0.1]), *box, normals) == 1.0


def test_mass_outside_of_mixed_inputs_agrees_with_the_integral() -> None:
    inputs = Inputs([0.95, 1.0], mixing=MIXING)
    joint = multivariate_normal(inputs.mean, MIXING @ MIXING.T)
    normals = standard_normals(2, 2**14, 1)
    expected = 1 - joint.cdf(UPPER, lower_limit=LOWER)
    np.testing.assert_allclose(mass_outside(inputs, LOWER, UPPER, normals), expected, atol=1e-3)
    independent = Inputs(inputs.mean, inputs.marginal_std)
    assert abs(mass_outside(independent, LOWER, UPPER, normals) - expected) > 5e-3  # the mixing has an effect here
    rare = mass_outside(Inputs([1.0, 1.0], mixing=MIXING), np.full(2, 0.5), np.full(2, 1.5), normals)
    np.testing.assert_allclose(rare, 2 * norm.sf(0.5 / np.hypot(0.10, 0.04)), rtol=1e-6)  # no sample lies outside


def test_points_outside_are_counted_once() -> None:
    points = np.array([[1.0, 1.0], [0.5, 2.0], [1.2, 1.0], [0.8, 1.5]])
    assert count_outside(points, LOWER, UPPER) == 2
