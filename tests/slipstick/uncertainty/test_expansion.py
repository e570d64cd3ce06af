"""Expansions against chaospy, against closed forms, and where they must fail."""

from math import comb, prod

import chaospy
import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.uncertainty.expansion import Expansion, expand, hermite_basis
from slipstick.uncertainty.inputs import Inputs, normal_germs
from slipstick.uncertainty.product import product

MIXING = np.array([[0.10, 0.04], [0.03, 0.05]])


def expansion_of(model: object, inputs: Inputs, order: int = 8) -> Expansion:
    basis = hermite_basis(inputs.dimension, order, order + 1)
    return expand(basis, model(inputs.points(basis.nodes)))  # type: ignore[operator]


def wavy(points: np.ndarray) -> np.ndarray:
    """Three conditions that no polynomial holds."""
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([np.exp(2 * x - y), np.abs(x - 1.02) + y, 1 / (1 + x**2 * y**2)])


@pytest.mark.parametrize(("dimension", "order", "nodes"),
                         [(1, 20, 21), (2, 0, 1), (2, 8, 9), (2, 5, 12), (3, 4, 5), (7, 2, 3)])
def test_basis_is_complete_and_orthonormal(dimension: int, order: int, nodes: int) -> None:
    basis = hermite_basis(dimension, order, nodes)
    assert basis.degrees.shape == (comb(order + dimension, dimension), dimension)
    assert len(np.unique(basis.degrees, axis=0)) == len(basis.degrees)
    assert basis.degrees.sum(axis=1).max() == order
    assert not basis.degrees[0].any()
    assert basis.nodes.shape == (nodes**dimension, dimension)
    np.testing.assert_allclose(basis.projection @ basis.at(basis.nodes), np.eye(len(basis.degrees)), atol=1e-11)


def test_terms_are_the_hermite_polynomials_of_their_degrees() -> None:
    basis, germs = hermite_basis(2, 8, 9), normal_germs(2, 64, 1)
    single = [np.polynomial.hermite_e.HermiteE.basis(n) / np.sqrt(prod(range(1, n + 1))) for n in range(9)]
    expected = np.column_stack([single[i](germs[:, 0]) * single[j](germs[:, 1]) for i, j in basis.degrees])
    np.testing.assert_allclose(basis.at(germs), expected, atol=1e-10)


def test_agrees_with_chaospy() -> None:
    inputs = Inputs([1.05, 0.95], mixing=MIXING)
    germ = chaospy.Iid(chaospy.Normal(0, 1), 2)
    polynomials = chaospy.generate_expansion(8, germ, normed=True)
    nodes, weights = chaospy.generate_quadrature(8, germ, rule="gaussian")
    oracle, coefficients = chaospy.fit_quadrature(polynomials, nodes, weights, wavy(inputs.points(nodes.T)), retall=1)
    expansion, germs = expansion_of(wavy, inputs), normal_germs(2, 256, 1)
    np.testing.assert_allclose(expansion.coefficients, coefficients, atol=1e-12)
    np.testing.assert_allclose(expansion.mean, chaospy.E(oracle, germ), rtol=1e-12)
    np.testing.assert_allclose(expansion.std, chaospy.Std(oracle, germ), rtol=1e-9)
    np.testing.assert_allclose(expansion.at(germs), oracle(*germs.T).T, rtol=1e-9)


def test_polynomials_up_to_the_order_come_back_exactly() -> None:
    def quartic(points: np.ndarray) -> np.ndarray:
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([0.3 + x * y - 2 * x**2 * y**2, y**4])

    germs, inputs = normal_germs(2, 256, 1), Inputs([1.05, 0.95], mixing=MIXING)
    exact = quartic(inputs.points(germs))
    np.testing.assert_allclose(expansion_of(quartic, inputs, 4).at(germs), exact, rtol=1e-11)
    # Controls: one order less, and the transposed mixing, must not reproduce it.
    assert np.abs(expansion_of(quartic, inputs, 3).at(germs) - exact).max() > 1e-5
    transposed = Inputs(inputs.mean, mixing=MIXING.T)
    assert np.abs(expansion_of(quartic, transposed, 4).at(germs) - exact).max() > 1e-2


@pytest.mark.parametrize("std", [0.003, 0.01, 0.03, 0.1])
def test_moments_stay_right_for_a_small_std(std: float) -> None:
    """exp(slope . x) of normal x is lognormal; expanded in x itself this goes wrong below a std of 0.05."""
    slope, mixing = np.array([1.5, -0.7]), std * MIXING / 0.1
    expansion = expansion_of(lambda points: np.exp(points @ slope)[:, None], Inputs([1.0, 1.0], mixing=mixing))
    variance = slope @ mixing @ mixing.T @ slope
    mean = np.exp(slope.sum() + variance / 2)
    np.testing.assert_allclose(expansion.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(expansion.std, mean * np.sqrt(np.expm1(variance)), rtol=1e-9)


def test_a_node_without_a_time_leaves_only_its_condition_without_an_expansion() -> None:
    basis, inputs = hermite_basis(2), Inputs([1.0, 1.0], [0.05, 0.05])
    times = wavy(inputs.points(basis.nodes))
    whole = expand(basis, times)
    times[40, 1] = np.nan
    expansion = expand(basis, times)
    assert expansion.missing.tolist() == [False, True, False]
    np.testing.assert_array_equal(expansion.coefficients[:, [0, 2]], whole.coefficients[:, [0, 2]])
    assert np.isnan([expansion.mean[1], expansion.std[1]]).all()


def test_rules_that_cannot_work_are_refused() -> None:
    with pytest.raises(InvalidValue, match="at least 9 nodes"):
        hermite_basis(2, 8, 8)
    with pytest.raises(InvalidValue, match="vary fewer inputs"):
        hermite_basis(7, 8, 9)
    with pytest.raises(InvalidValue, match="order from 0 to"):
        hermite_basis(1, 25, 26)


def test_product_against_its_readable_twin() -> None:
    random = np.random.default_rng(1)
    left, right = random.standard_normal((101, 45)), random.standard_normal((45, 33))
    np.testing.assert_allclose(product(left, right), left @ right, atol=1e-12)
    np.testing.assert_allclose(product(left.T[:45, :45], right), left.T[:45, :45] @ right, atol=1e-12)
