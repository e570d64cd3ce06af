"""Families and germs of an input against SciPy, OpenTURNS and closed forms, including the tails and the limits."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import openturns
import pytest
from scipy import stats
from scipy.integrate import quad

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty.chaos import FAMILIES, Family, Germ
from slipstick.uncertainty.chaos.cornish_fisher import FARTHEST, quantile, score
from slipstick.uncertainty.chaos.families import HERMITE, beta_shape, from_score, germ_of, to_score
from slipstick.uncertainty.chaos.polynomials import Polynomials
from slipstick.uncertainty.chaos.rules import gauss

SUPPORT = np.array([0.5, 1.5])


@dataclass(frozen=True)
class Case:
    """A family with its mean and std, the same distribution in SciPy, and the range of scores that can be recovered.

    Near an end of its support the values of a bounded variable are too close together to recover the score, in
    particular if the density has a maximum there.
    """

    family: Family
    mean: float
    std: float
    frozen: Any
    reach: tuple[float, float] = (-8.0, 8.0)

    def from_score(self, score: Any) -> np.ndarray:
        return from_score(self.family, np.asarray(score, float), self.mean, self.std, SUPPORT)

    def to_score(self, values: Any) -> np.ndarray:
        return to_score(self.family, np.asarray(values, float), self.mean, self.std, SUPPORT)


def lognormal(mean: float, std: float) -> Any:
    width = np.sqrt(np.log(1 + (std / mean) ** 2))
    return stats.lognorm(width, scale=mean * np.exp(-width**2 / 2))


CASES = [
    Case("normal", 1.1, 0.2, stats.norm(1.1, 0.2)),
    Case("lognormal", 1.1, 0.05, lognormal(1.1, 0.05)),
    Case("lognormal", 0.8, 1.2, lognormal(0.8, 1.2)),
    Case("gamma", 1.1, 0.1, stats.gamma(121, scale=1.1 / 121)),
    Case("gamma", 1.0, 1.25, stats.gamma(0.64, scale=1 / 0.64), (-3.0, 8.0)),
    Case("beta", 0.9, 0.1, stats.beta(9.2, 13.8, 0.5, 1.0), (-5.0, 5.0)),
    Case("beta", 1.0, 0.4, stats.beta(0.28125, 0.28125, 0.5, 1.0), (-2.0, 2.0)),
    Case("uniform", 1.1, 0.2, stats.uniform(1.1 - 0.2 * np.sqrt(3), 0.4 * np.sqrt(3)), (-4.0, 4.0)),
]
each_case = pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.family}-{case.std}")


@each_case
def test_mean_and_std_are_the_given_ones(case: Case) -> None:
    def moment(power: int) -> float:
        return float(quad(lambda z: (case.from_score(z) - case.mean) ** power * stats.norm.pdf(z), -37, 37,
                          points=[-5, 0, 5], limit=400, epsabs=1e-11)[0])

    assert moment(1) == pytest.approx(0, abs=1e-8)
    assert np.sqrt(moment(2)) == pytest.approx(case.std, rel=1e-7)


@each_case
def test_quantiles_are_those_of_scipy_in_either_tail(case: Case) -> None:
    z = np.linspace(0, 8, 33)
    np.testing.assert_allclose(case.from_score(z), case.frozen.isf(stats.norm.sf(z)), rtol=1e-10)
    np.testing.assert_allclose(case.from_score(-z), case.frozen.ppf(stats.norm.cdf(-z)), rtol=1e-10, atol=1e-15)


@each_case
def test_to_score_is_the_inverse_of_from_score(case: Case) -> None:
    z = np.linspace(*case.reach, 65)
    np.testing.assert_allclose(case.to_score(case.from_score(z)), z, atol=1e-9)


@each_case
def test_values_outside_the_support_have_extreme_scores(case: Case) -> None:
    low, high = case.frozen.support()
    outside = case.to_score([low - 0.1 if np.isfinite(low) else -1e60, high + 0.1 if np.isfinite(high) else 1e60])
    assert outside[0] <= -30
    assert outside[1] >= 30


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("std", [1e-5, 1e-7, 1e-9, 1e-14])
def test_families_converge_to_the_normal_as_the_std_approaches_zero(family: Family, std: float) -> None:
    """Except for the uniform family, whose shape does not depend on the std."""
    z = np.linspace(-3, 3, 13)
    values = from_score(family, z, 1.1, std, SUPPORT)
    assert np.all(np.abs(values - 1.1) < 4 * std + 1e-15)
    if std >= 1e-9:  # smaller stds are lost in the rounding of the mean
        germ = np.sqrt(3) * (2 * stats.norm.cdf(z) - 1) if family == "uniform" else z
        np.testing.assert_allclose((values - 1.1) / std, germ, atol=20 * std + 1e-15 / std)
        np.testing.assert_allclose(to_score(family, values, 1.1, std, SUPPORT), z, atol=1e-3)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("mean", [0.52, 0.8, 1.48])
def test_scores_of_narrow_variables_are_accurate_to_the_rounding_of_the_values(family: Family, mean: float) -> None:
    """The inverse functions of SciPy err at five stds, by 0.001 for a gamma std of 0.001 and by 0.5 for one of 1e-6."""
    z = np.linspace(-5, 5, 41) * (0.6 if family == "uniform" else 1.0)
    for std in 10.0 ** -np.arange(2.5, 9.5, 0.25):
        values = from_score(family, z, mean, std, SUPPORT)
        assert np.all(np.diff(values) > 0)
        np.testing.assert_allclose(to_score(family, values, mean, std, SUPPORT), z, atol=5e-9 + 2e-14 / std)


@pytest.mark.parametrize("mean", [0.52, 0.8, 1.48])
def test_values_are_continuous_at_the_transitions_to_nearly_normal_and_normal_variables(mean: float) -> None:
    z, distances = np.linspace(-8, 8, 17), (mean - 0.5, 1.5 - mean)
    transition = np.sqrt(np.prod(distances) / (1 + 1e6 / min(distances)))  # std at a smaller beta shape of 1e6
    for family, stds in (("gamma", (mean / np.sqrt(3e5), 1e-7 * mean)), ("beta", (transition, 1e-7))):
        germs: list[Germ] = []
        for std in stds:
            below, above = std * (1 - 1e-6), std * (1 + 1e-6)
            germs += [germ_of(family, mean, below, SUPPORT), germ_of(family, mean, above, SUPPORT)]
            from_below, from_above = (from_score(family, z, mean, side, SUPPORT) for side in (below, above))
            np.testing.assert_allclose(from_above - from_below, 2e-6 * std * z, atol=1e-9)
        assert [germ.cornish_fisher_moments is None for germ in germs] == [False, True, True, False]
        assert [germ == HERMITE for germ in germs] == [False, False, True, False]


@pytest.mark.parametrize("family", FAMILIES)
def test_values_equal_the_mean_for_a_std_of_zero(family: Family) -> None:
    np.testing.assert_array_equal(from_score(family, np.array([-8.0, 0.0, 8.0]), 1.1, 0.0, SUPPORT), [1.1] * 3)


@pytest.mark.parametrize(("family", "germ"), [
    ("normal", HERMITE), ("lognormal", HERMITE), ("gamma", Germ("laguerre", (25.0,))), ("uniform", Germ("legendre")),
    ("beta", Germ("jacobi", (2.625, 2.625)))])
def test_every_family_has_the_polynomials_of_table_1(family: Family, germ: Germ) -> None:
    actual = germ_of(family, 1.0, 0.2, SUPPORT)
    assert actual.name == germ.name
    assert actual.shape == pytest.approx(germ.shape)


def test_the_std_of_a_beta_variable_is_limited_by_its_support() -> None:
    assert min(beta_shape(0.9, 0.99 * np.sqrt(0.4 * 0.6), SUPPORT)) > 0
    assert min(beta_shape(0.9, 1.01 * np.sqrt(0.4 * 0.6), SUPPORT)) < 0


# Germs compared with OpenTURNS, SciPy and closed forms, and their limits for large shapes.


GERMS = {
    Germ("hermite"): (openturns.Normal(0, 1), stats.norm()),
    Germ("legendre"): (openturns.Uniform(-1, 1), stats.uniform(-1, 2)),
    Germ("laguerre", (0.6,)): (openturns.Gamma(0.6, 1, 0), stats.gamma(0.6)),
    Germ("laguerre", (3.7,)): (openturns.Gamma(3.7, 1, 0), stats.gamma(3.7)),
    Germ("laguerre", (400.0,)): (openturns.Gamma(400, 1, 0), stats.gamma(400)),
    Germ("jacobi", (2.3, 4.1)): (openturns.Beta(2.3, 4.1, -1, 1), stats.beta(2.3, 4.1, -1, 2)),
    Germ("jacobi", (0.5, 1.5)): (openturns.Beta(0.5, 1.5, -1, 1), stats.beta(0.5, 1.5, -1, 2)),
    Germ("jacobi", (90.0, 30.0)): (openturns.Beta(90, 30, -1, 1), stats.beta(90, 30, -1, 2)),
}
NORMALS = np.array([-6.0, -3.0, -1.2, -0.1, 0.0, 0.4, 1.0, 2.5, 5.0])
each_family = pytest.mark.parametrize("germ", GERMS, ids=lambda germ: f"{germ.name}{germ.shape}")


def up_to(germ: Germ, order: int) -> Polynomials:
    return Polynomials.of((germ,), np.arange(order + 1)[:, None])


@each_family
def test_polynomials_and_gauss_rules_agree_with_openturns(germ: Germ) -> None:
    distribution, frozen = GERMS[germ]
    factory = openturns.StandardDistributionPolynomialFactory(distribution)
    nodes, weights = gauss(germ, 10)
    expected_nodes, expected_weights = factory.getNodesAndWeights(10)
    np.testing.assert_allclose(nodes, (np.array(expected_nodes) - frozen.mean()) / frozen.std(), atol=1e-10)
    np.testing.assert_allclose(weights, expected_weights, rtol=1e-9, atol=1e-14)
    expected = np.column_stack([[factory.build(n)(frozen.mean() + frozen.std() * node) for node in nodes]
                                for n in range(13)])
    np.testing.assert_allclose(up_to(germ, 12).at(nodes[:, None]), expected, atol=1e-11 * np.abs(expected).max())


@each_family
def test_polynomials_are_orthonormal_up_to_order_40(germ: Germ) -> None:
    nodes, weights = gauss(germ, 60)
    values = up_to(germ, 40).at(nodes[:, None])
    np.testing.assert_allclose((values * weights[:, None]).T @ values, np.eye(41), atol=1e-10)


@pytest.mark.parametrize("shape", [1e4, 1e6, 1e9, 1e14])
def test_gamma_and_symmetric_beta_converge_to_the_normal(shape: float) -> None:
    for germ, deviation in ((Germ("laguerre", (shape,)), shape**-0.5), (Germ("jacobi", (shape, shape)), 1 / shape)):
        alpha, beta = germ.recurrence(10)
        np.testing.assert_allclose(alpha, 0, atol=20 * deviation)
        np.testing.assert_allclose(beta, np.arange(10), atol=150 / shape + 1e-12)
        np.testing.assert_allclose(germ.of_normal(NORMALS), NORMALS, atol=30 * deviation + 1e-12)
    if shape < 1e6:  # negative control
        assert np.abs(Germ("laguerre", (shape,)).of_normal(NORMALS) - NORMALS).max() > 0.1


@pytest.mark.parametrize("shape", [1e3, 1e6, 1e12])
def test_coefficients_of_a_narrow_gamma_are_accurate(shape: float) -> None:
    n = np.arange(20)
    alpha, beta = Germ("laguerre", (shape,)).recurrence(20)
    np.testing.assert_allclose(alpha, 2 * n / np.sqrt(shape), atol=1e-15 * np.sqrt(shape))
    np.testing.assert_allclose(beta, n * (1 + (n - 1) / shape), rtol=1e-13)


@pytest.mark.parametrize(("name", "edge"), [("laguerre", (3e5,)), ("jacobi", (1e6, 1e6)), ("jacobi", (1e6, 3e7))])
def test_quantiles_are_continuous_at_the_transition_to_cornish_fisher(name: str, edge: tuple[float, ...]) -> None:
    below, above = (Germ(name, tuple(factor * value for value in edge))  # type: ignore[arg-type]
                    for factor in (1 - 1e-9, 1 + 1e-9))
    np.testing.assert_allclose(below.of_normal(NORMALS), above.of_normal(NORMALS), atol=1e-7)


@pytest.mark.parametrize("shape", [(), (1.0, 2.0), (0.0,), (-1.0,), (np.inf,), (np.nan,), (1e20,)])
def test_invalid_shapes_raise(shape: tuple[float, ...]) -> None:
    with pytest.raises(InvalidValue, match="Give \\(k\\)"):
        Germ("laguerre", shape)


def test_shapes_that_scipy_cannot_invert_and_unknown_names_raise() -> None:
    with pytest.raises(InvalidValue, match="Narrow the support"):
        Germ("jacobi", (1e3, 1e7))
    with pytest.raises(UnknownName, match="Did you mean 'hermite'"):
        Germ("hermit")  # type: ignore[arg-type]


# Nearly normal variables compared with the gamma and beta distributions of SciPy, and the inverse of the quantiles.


@pytest.mark.parametrize("frozen", [stats.gamma(2e5), stats.beta(9e5, 9e5), stats.beta(9e5, 2e5)],
                         ids=["gamma", "beta", "asymmetric beta"])
def test_quantiles_are_those_of_scipy(frozen: Any) -> None:
    mean, variance, *shape = (float(moment) for moment in frozen.stats("mvsk"))
    z = np.linspace(0, 8, 17)
    for side, of_tail in ((-1, frozen.ppf), (1, frozen.isf)):
        expected = (of_tail(stats.norm.sf(z)) - mean) / np.sqrt(variance)
        np.testing.assert_allclose(quantile(side * z, *shape), expected, atol=3e-7)
        assert np.abs(expected - side * z).max() > 1e-6  # negative control: not the quantiles of a normal variable


@pytest.mark.parametrize("skewness", [0.0, 1e-9, 4e-3, -4e-3])
def test_the_score_is_the_inverse_of_the_quantile(skewness: float) -> None:
    z, shape = np.linspace(-FARTHEST, FARTHEST, 371), (skewness, 1.5 * skewness**2)
    np.testing.assert_allclose(score(quantile(z, *shape), *shape), z, atol=1e-12)
    np.testing.assert_array_equal(score(np.array([-1e9, 1e9]), *shape), [-FARTHEST, FARTHEST])
