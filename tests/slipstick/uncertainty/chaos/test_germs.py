"""Germs compared with OpenTURNS, SciPy and closed forms, and their limits for large shapes."""

import numpy as np
import openturns
import pytest
from scipy import stats

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty.chaos import Germ, germs_from_normals
from slipstick.uncertainty.chaos.polynomials import Polynomials
from slipstick.uncertainty.chaos.rules import gauss

FAMILIES = {
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
each_family = pytest.mark.parametrize("germ", FAMILIES, ids=lambda germ: f"{germ.name}{germ.shape}")


def up_to(germ: Germ, order: int) -> Polynomials:
    return Polynomials.of((germ,), np.arange(order + 1)[:, None])


@each_family
def test_polynomials_and_gauss_rules_agree_with_openturns(germ: Germ) -> None:
    distribution, frozen = FAMILIES[germ]
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


@each_family
def test_a_germ_has_the_quantiles_of_its_distribution(germ: Germ) -> None:
    frozen = FAMILIES[germ][1]
    expected = np.where(NORMALS < 0, frozen.ppf(stats.norm.cdf(NORMALS)), frozen.isf(stats.norm.sf(NORMALS)))
    np.testing.assert_allclose(germ.of_normal(NORMALS), (expected - frozen.mean()) / frozen.std(), atol=1e-9)


def test_germs_of_several_inputs_are_computed_column_by_column() -> None:
    germs = tuple(FAMILIES)[:3]
    normals = NORMALS.reshape(3, 3)
    columns = [germ.of_normal(normals[:, axis]) for axis, germ in enumerate(germs)]
    np.testing.assert_array_equal(germs_from_normals(germs, normals), np.column_stack(columns))


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
