"""Inputs of all families, independent or correlated, as functions of standard normals and of germs."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy import stats

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs, standard_normals
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


def test_each_input_has_its_mean_and_std() -> None:
    inputs = Inputs(**EVERY)
    points = inputs.points(NORMALS[5])
    np.testing.assert_allclose(points.mean(axis=0), inputs.mean, atol=1e-3)
    np.testing.assert_allclose(points.std(axis=0), inputs.marginal_std, rtol=0.01)


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
    ({"std": None, "mixing": np.eye(3)}, r"mixing has shape \(3, 3\)", "2 means"),
    ({"correlation": np.eye(3)}, r"correlation has shape \(3, 3\)", "2 means"),
    ({"support": [0.5, 1.5]}, r"support has shape \(2,\)", "2 means"),
    ({"mean": [[1.0]]}, "mean has shape", "one number per input"),
    ({"mean": [], "std": []}, "mean has shape", "one number per input"),
    ({"mean": [1.0, np.nan]}, "mean is not finite", "finite numbers"),
    ({"std": [0.1, np.inf]}, "std is not finite", "finite numbers"),
    ({"std": [0.1, -0.1]}, "negative", "0 or more"),
    ({"families": ("normal",)}, "1 families for 2", "one family per input"),
    ({"std": [1e155, 0.1]}, r"An entry of the std is 1e\+155 multiples of nominal", "Give numbers up to 1e+06"),
    ({"mean": [1.0, -1e9]}, r"An entry of the mean is 1e\+09 multiples of nominal", "Give numbers up to 1e+06"),
    ({"families": ("gamma", "normal"), "mean": [1e-3, 1.0], "std": [1e5, 0.1]}, r"is 1e\+08 times its mean",
     "up to 1e+06 times the mean"),
    ({"families": ("normal", "cauchy")}, "no family 'cauchy'", "normal, lognormal, gamma, beta, uniform"),
    ({"families": ("gamma", "normal"), "mean": [0.0, 1.0]}, "mean of a gamma input is 0", "positive mean"),
    ({"families": ("normal", "lognormal"), "mean": [1.0, -1.0]}, "mean of a lognormal input is -1", "positive mean"),
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
