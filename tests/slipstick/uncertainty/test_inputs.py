"""Inputs of all families, independent or correlated; their samples, and the probability outside a box."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.stats import beta, gamma, multivariate_normal, norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs, axis_mass_outside, mass_outside, standard_normals
from slipstick.uncertainty.chaos import Germ

MIXING = np.array([[0.10, 0.04], [0.03, 0.05]])
CORRELATION = np.array([[1.0, -0.6, 0.3], [-0.6, 1.0, 0.2], [0.3, 0.2, 1.0]])
SUPPORT = np.array([[0.5, 1.5]] * 5)
EVERY: dict[str, Any] = {"mean": [1.0, 1.1, 0.9, 1.0, 1.2], "std": [0.1, 0.2, 0.05, 0.15, 0.1], "support": SUPPORT,
                         "families": ("normal", "lognormal", "gamma", "beta", "uniform")}
COPULA: dict[str, Any] = {"mean": [1.0, 1.1, 0.9], "std": [0.2, 0.3, 0.05], "correlation": CORRELATION,
                          "families": ("gamma", "lognormal", "uniform")}
NORMALS = {d: standard_normals(d, 4096, 1) for d in (2, 3, 5)}


def test_mixing_mixes_germs() -> None:
    inputs, normals = Inputs([1.0, 0.9], mixing=MIXING), NORMALS[2]
    points = inputs.points(normals)
    np.testing.assert_allclose(points[:, 0], 1.0 + 0.10 * normals[:, 0] + 0.04 * normals[:, 1], rtol=1e-14)
    np.testing.assert_allclose(points[:, 1], 0.9 + 0.03 * normals[:, 0] + 0.05 * normals[:, 1], rtol=1e-14)
    np.testing.assert_allclose(np.cov(points.T), MIXING @ MIXING.T, rtol=5e-3)
    # Negative control: the transposed matrix has another covariance.
    assert np.abs(np.cov(points.T) - MIXING.T @ MIXING).max() > 5e-4
    np.testing.assert_allclose(inputs.marginal_std, np.sqrt(np.diag(MIXING @ MIXING.T)))


def test_std_is_equivalent_to_a_diagonal_mixing() -> None:
    by_std, by_mixing = Inputs([1.0, 1.0], [0.1, 0.2]), Inputs([1.0, 1.0], mixing=np.diag([0.1, 0.2]))
    np.testing.assert_array_equal(by_std.points(NORMALS[2]), by_mixing.points(NORMALS[2]))


def test_correlation_of_normal_inputs_is_that_of_the_inputs() -> None:
    std = np.array([0.1, 0.2, 0.05])
    inputs = Inputs([1.0, 1.1, 0.9], std, correlation=CORRELATION)
    covariance = std[:, None] * CORRELATION * std
    np.testing.assert_allclose(inputs.factor @ inputs.factor.T, CORRELATION, atol=1e-15)
    np.testing.assert_allclose(np.cov(inputs.points(NORMALS[3]).T), covariance, atol=2e-4)
    assert not inputs.independent


def test_rank_correlation_is_that_of_a_gaussian_copula() -> None:
    """A Gaussian copula has the rank correlation 6/pi asin(r/2), regardless of the families."""
    points = Inputs(**COPULA).points(NORMALS[3])
    ranks = stats.spearmanr(points).statistic
    np.testing.assert_allclose(ranks, 6 / np.pi * np.arcsin(CORRELATION / 2), atol=5e-3)
    # Negative control: the Pearson correlation of skewed inputs differs from that of the scores.
    assert abs(np.corrcoef(points.T)[0, 1] - CORRELATION[0, 1]) > 0.01


def test_correlation_does_not_change_the_marginal_distributions() -> None:
    correlated, independent = (Inputs(**{**COPULA, "correlation": matrix}) for matrix in (CORRELATION, None))
    levels = np.linspace(0.01, 0.99, 50)
    np.testing.assert_allclose(np.quantile(correlated.points(NORMALS[3]), levels, axis=0),
                               np.quantile(independent.points(NORMALS[3]), levels, axis=0), atol=0.02)


@pytest.mark.parametrize("arguments", [
    EVERY, {**EVERY, "std": [0.1, 0.0, 0.0, 0.0, 0.0]}, {**EVERY, "std": [1e-12] * 5}, COPULA,
    {"mean": [1.0, 0.9], "mixing": MIXING}, {"mean": [1.0, 0.9], "mixing": np.diag([-0.1, 0.2])},
    {"mean": [1.0] * 3, "std": [0.1, 0.0, 0.2], "correlation": CORRELATION},
    {"mean": [1.0] * 3, "std": [0.1, 0.1, 0.2], "families": ("gamma", "gamma", "uniform")},
], ids=["every family", "std 0", "std 1e-12", "copula", "mixing", "mirrored", "correlated, std 0", "independent germs"])
def test_standard_normals_and_germs_give_the_same_inputs(arguments: Mapping[str, Any]) -> None:
    inputs = Inputs(**arguments)
    normals = NORMALS[inputs.dimension]
    germs = inputs.germs_of(normals)
    np.testing.assert_allclose(inputs.at_germs(germs), inputs.points(normals), rtol=1e-12)
    np.testing.assert_allclose(germs.mean(axis=0), 0, atol=5e-3)
    np.testing.assert_allclose(germs.std(axis=0), 1, atol=5e-3)


def test_germs_follow_table_1_unless_inputs_are_dependent() -> None:
    assert [germ.name for germ in Inputs(**EVERY).germs] == ["hermite", "hermite", "laguerre", "jacobi", "legendre"]
    assert Inputs(**COPULA).germs == (Germ("hermite"),) * 3
    assert Inputs(**{**COPULA, "correlation": np.eye(3)}).germs[0].name == "laguerre"


def test_scores_of_independent_inputs_are_the_standard_normals() -> None:
    inputs, normals = Inputs(**EVERY), NORMALS[5][:64]
    for index, values in enumerate(inputs.points(normals).T):
        np.testing.assert_allclose(inputs.scores(index, values), normals[:, index], atol=1e-9)


PAIR: dict[str, Any] = {"mean": [1.0, 1.0], "std": [0.1, 0.1]}


@pytest.mark.parametrize(("change", "cause", "remedy"), [
    ({"std": None}, "either the std or the mixing", "Give `std`"),
    ({"mixing": np.eye(2)}, "either the std or the mixing", "Give `std`"),
    ({"std": [0.1]}, r"std has shape \(1,\)", "2 means"),
    ({"support": [0.5, 1.5]}, r"support has shape \(2,\)", "2 means"),
    ({"mean": [[1.0]]}, "mean has shape", "one number per input"),
    ({"mean": [1.0, np.nan]}, "mean is not finite", "finite numbers"),
    ({"std": [0.1, -0.1]}, "negative", "0 or more"),
    ({"families": ("normal",)}, "1 families for 2", "one family per input"),
    ({"std": [1e155, 0.1]}, r"An entry of the std is 1e\+155 multiples of nominal", "Give numbers up to 1e+06"),
    ({"families": ("gamma", "normal"), "mean": [1e-3, 1.0], "std": [1e5, 0.1]}, r"is 1e\+08 times its mean",
     "up to 1e+06 times the mean"),
    ({"families": ("normal", "cauchy")}, "no family 'cauchy'", "normal, lognormal, gamma, beta, uniform"),
    ({"families": ("gamma", "normal"), "mean": [0.0, 1.0]}, "mean of a gamma input is 0", "positive mean"),
    ({"families": ("normal", "gamma"), "std": None, "mixing": MIXING}, "not gamma inputs", "and `correlation`"),
    ({"families": ("beta", "normal")}, "cannot have the support -inf to inf", "`support`"),
    ({"families": ("beta", "normal"), "support": [[1.1, 1.5], [0.0, 2.0]]}, "support 1.1 to 1.5", "around the mean"),
    ({"families": ("beta", "normal"), "support": [[0.5, 1.5]] * 2, "std": [0.6, 0.1]}, "has the std 0.6", "below 0.5"),
    ({"correlation": [[1.0, 0.5], [0.4, 1.0]]}, "not symmetric", "not a covariance"),
    ({"correlation": [[0.5, 0.1], [0.1, 0.5]]}, "ones on its diagonal", "not a covariance"),
    ({"correlation": [[1.0, 1.0], [1.0, 1.0]]}, "not positive definite", "possible together"),
    ({"correlation": np.eye(2), "std": None, "mixing": MIXING}, "already contains the correlation", "`correlation`"),
])
def test_invalid_inputs_raise_an_error_with_a_remedy(change: dict[str, Any], cause: str, remedy: str) -> None:
    with pytest.raises(InvalidValue, match=cause) as raised:
        Inputs(**{**PAIR, **change})
    assert remedy in raised.value.remedy


# Samples of the standard normals, and the probability outside a box compared with SciPy.


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


@pytest.mark.parametrize("family", ["uniform", "beta", "gamma", "lognormal"])
def test_no_mass_is_outside_of_a_box_that_contains_the_support(family: Any) -> None:
    inputs = Inputs([1.0], [0.1], families=(family,), support=[[0.5, 1.5]])
    assert axis_mass_outside(inputs, np.array([0.0]), np.array([1e9])) == 0.0
    assert axis_mass_outside(inputs, np.array([-2.0]), np.array([-1.0])) == 1.0


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
