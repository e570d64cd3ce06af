"""The families of an input against scipy's distributions, into their tails and down to a std of zero."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from slipstick.uncertainty.chaos import FAMILIES, Family, Germ
from slipstick.uncertainty.chaos.families import HERMITE, beta_shape, from_score, germ_of, to_score

SUPPORT = np.array([0.5, 1.5])


@dataclass(frozen=True)
class Case:
    """A family with its mean and std, the same in scipy's parameters, and the scores between which values keep digits.

    Towards an end of its range a bounded variable has ever fewer, the fewest where its density is greatest there.
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
each = pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.family}-{case.std}")


@each
def test_mean_and_std_are_those_asked_for(case: Case) -> None:
    def moment(power: int) -> float:
        return float(quad(lambda z: (case.from_score(z) - case.mean) ** power * stats.norm.pdf(z), -37, 37,
                          points=[-5, 0, 5], limit=400, epsabs=1e-11)[0])

    assert moment(1) == pytest.approx(0, abs=1e-8)
    assert np.sqrt(moment(2)) == pytest.approx(case.std, rel=1e-7)


@each
def test_quantiles_are_those_of_scipy_in_either_tail(case: Case) -> None:
    z = np.linspace(0, 8, 33)
    np.testing.assert_allclose(case.from_score(z), case.frozen.isf(stats.norm.sf(z)), rtol=1e-10)
    np.testing.assert_allclose(case.from_score(-z), case.frozen.ppf(stats.norm.cdf(-z)), rtol=1e-10, atol=1e-15)


@each
def test_a_value_has_the_score_it_was_made_from(case: Case) -> None:
    z = np.linspace(*case.reach, 65)
    np.testing.assert_allclose(case.to_score(case.from_score(z)), z, atol=1e-9)


@each
def test_a_value_beyond_the_family_is_further_out_than_any_sample(case: Case) -> None:
    low, high = case.frozen.support()
    beyond = case.to_score([low - 0.1 if np.isfinite(low) else -1e60, high + 0.1 if np.isfinite(high) else 1e60])
    assert beyond[0] <= -30
    assert beyond[1] >= 30


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("std", [1e-5, 1e-7, 1e-9, 1e-14])
def test_every_family_becomes_normal_as_its_std_goes_to_zero(family: Family, std: float) -> None:
    """All but the uniform one, which stays what it is however narrow."""
    z = np.linspace(-3, 3, 13)
    values = from_score(family, z, 1.1, std, SUPPORT)
    assert np.all(np.abs(values - 1.1) < 4 * std + 1e-15)
    if std >= 1e-9:  # further down the digits of the mean end
        germ = np.sqrt(3) * (2 * stats.norm.cdf(z) - 1) if family == "uniform" else z
        np.testing.assert_allclose((values - 1.1) / std, germ, atol=20 * std + 1e-15 / std)
        np.testing.assert_allclose(to_score(family, values, 1.1, std, SUPPORT), z, atol=1e-3)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("mean", [0.52, 0.8, 1.48])
def test_narrow_variables_keep_the_digits_that_a_value_has(family: Family, mean: float) -> None:
    """Scipy's own inverses lose them: 0.001 of a score at five stds for a gamma std of 0.001, half of one for 1e-6."""
    z = np.linspace(-5, 5, 41) * (0.6 if family == "uniform" else 1.0)
    for std in 10.0 ** -np.arange(2.5, 9.5, 0.25):
        values = from_score(family, z, mean, std, SUPPORT)
        assert np.all(np.diff(values) > 0)
        np.testing.assert_allclose(to_score(family, values, mean, std, SUPPORT), z, atol=5e-9 + 2e-14 / std)


@pytest.mark.parametrize("mean", [0.52, 0.8, 1.48])
def test_values_do_not_jump_where_a_narrow_variable_is_taken_as_a_cornish_fisher_moments_or_normal_one(mean: float) -> None:
    z, shares = np.linspace(-8, 8, 17), (mean - 0.5, 1.5 - mean)
    nearly = np.sqrt(np.prod(shares) / (1 + 1e6 / min(shares)))  # the lesser shape of the beta variable is then 1e6
    for family, stds in (("gamma", (mean / np.sqrt(3e5), 1e-7 * mean)), ("beta", (nearly, 1e-7))):
        germs: list[Germ] = []
        for std in stds:
            below, above = std * (1 - 1e-6), std * (1 + 1e-6)
            germs += [germ_of(family, mean, below, SUPPORT), germ_of(family, mean, above, SUPPORT)]
            from_below, from_above = (from_score(family, z, mean, one, SUPPORT) for one in (below, above))
            np.testing.assert_allclose(from_above - from_below, 2e-6 * std * z, atol=1e-9)
        assert [germ.cornish_fisher_moments is None for germ in germs] == [False, True, True, False]
        assert [germ == HERMITE for germ in germs] == [False, False, True, False]


@pytest.mark.parametrize("family", FAMILIES)
def test_a_std_of_zero_is_the_mean(family: Family) -> None:
    np.testing.assert_array_equal(from_score(family, np.array([-8.0, 0.0, 8.0]), 1.1, 0.0, SUPPORT), [1.1] * 3)


@pytest.mark.parametrize(("family", "germ"), [
    ("normal", HERMITE), ("lognormal", HERMITE), ("gamma", Germ("laguerre", (25.0,))), ("uniform", Germ("legendre")),
    ("beta", Germ("jacobi", (2.625, 2.625)))])
def test_every_family_has_the_polynomials_of_table_1(family: Family, germ: Germ) -> None:
    found = germ_of(family, 1.0, 0.2, SUPPORT)
    assert found.name == germ.name
    assert found.shape == pytest.approx(germ.shape)


def test_no_beta_variable_scatters_more_than_its_two_ends() -> None:
    assert min(beta_shape(0.9, 0.99 * np.sqrt(0.4 * 0.6), SUPPORT)) > 0
    assert min(beta_shape(0.9, 1.01 * np.sqrt(0.4 * 0.6), SUPPORT)) < 0
