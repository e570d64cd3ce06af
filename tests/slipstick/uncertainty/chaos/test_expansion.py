"""Expansions compared with OpenTURNS, chaospy, NumPy and closed forms; their terms, and invalid settings."""

from itertools import product
from math import comb

import numpy as np
import openturns
import pytest

from slipstick.errors import InvalidValue
from slipstick.numerics.matrix_product import matrix_product
from slipstick.uncertainty.chaos import (
    Basis,
    Expansion,
    ExpansionSettings,
    Germ,
    default_order,
    expand,
    make_basis,
    sensitivity,
)
from slipstick.uncertainty.chaos.least_squares import projection
from slipstick.uncertainty.chaos.truncation import degrees

HERMITE = Germ("hermite")
FAMILIES = {
    HERMITE: openturns.Normal(0, 1),
    Germ("laguerre", (3.7,)): openturns.Gamma(3.7, 1, 0),
    Germ("jacobi", (2.3, 4.1)): openturns.Beta(2.3, 4.1, -1, 1),
    Germ("legendre"): openturns.Uniform(-1, 1),
}
MIXED = tuple(FAMILIES)
RULES = [ExpansionSettings(5, rule="tensor"), ExpansionSettings(5, rule="tensor", nodes=9),
         ExpansionSettings(5, rule="regression"), ExpansionSettings(7, 0.6, rule="regression")]


def wavy(germs: np.ndarray) -> np.ndarray:
    """Three conditions that are not polynomials."""
    x, y = 1.05 + 0.1 * germs[:, 0], 0.95 + 0.1 * germs[:, -1]
    return np.column_stack([np.exp(2 * x - y), np.abs(x - 1.02) + y, 1 / (1 + x**2 * y**2)])


def weights_of(basis: Basis) -> np.ndarray:
    """The weights of the least squares, or of the Gauss rule, which are the row of the constant term."""
    if basis.settings.rule == "tensor":
        return basis.projection[0]
    return 1 / np.sum(basis.at(basis.nodes) ** 2, axis=1)


def by_openturns(basis: Basis, times: np.ndarray) -> openturns.FunctionalChaosResult:
    """The regression of OpenTURNS with the weights and nodes of `basis`."""
    distributions = [FAMILIES[germ] for germ in basis.germs]
    nodes = basis.nodes * [d.getStandardDeviation()[0] for d in distributions] + [d.getMean()[0] for d in distributions]
    used = weights_of(basis) > 0
    if basis.settings.norm == 1:
        enumerate_ = openturns.LinearEnumerateFunction(len(distributions))
    else:
        enumerate_ = openturns.HyperbolicAnisotropicEnumerateFunction(len(distributions), basis.settings.norm)
    products = openturns.OrthogonalProductPolynomialFactory(
        [openturns.StandardDistributionPolynomialFactory(d) for d in distributions], enumerate_)
    algorithm = openturns.FunctionalChaosAlgorithm(
        nodes[used], weights_of(basis)[used], times[used], products.getMeasure(),
        openturns.FixedStrategy(products, len(basis.degrees)), openturns.LeastSquaresStrategy())
    algorithm.run()
    return algorithm.getResult()


@pytest.mark.parametrize("settings", RULES, ids=str)
@pytest.mark.parametrize("germs", [*((germ,) * 2 for germ in MIXED), MIXED[:3], MIXED[1:]],
                         ids=lambda germs: "-".join(germ.name for germ in germs))
def test_agrees_with_openturns_on_the_same_nodes(germs: tuple[Germ, ...], settings: ExpansionSettings) -> None:
    basis = make_basis(germs, settings)
    expansion = expand(basis, wavy(basis.nodes))
    oracle = by_openturns(basis, expansion.times)
    row_of = {tuple(term): row for row, term in enumerate(basis.degrees.tolist())}
    enumerate_ = oracle.getOrthogonalBasis().getEnumerateFunction()
    coefficients = expansion.coefficients[[row_of[tuple(enumerate_(index))] for index in oracle.getIndices()]]
    np.testing.assert_allclose(coefficients, np.array(oracle.getCoefficients()), atol=1e-10)
    vector = openturns.FunctionalChaosRandomVector(oracle)
    np.testing.assert_allclose(expansion.mean, vector.getMean(), atol=1e-10)
    np.testing.assert_allclose(expansion.std**2, np.diag(np.array(vector.getCovariance())), atol=1e-10)
    indices = openturns.FunctionalChaosSobolIndices(oracle)
    for axis in range(len(germs)):
        for condition in range(3):
            assert sensitivity.first_order(expansion)[condition, axis] == pytest.approx(
                indices.getSobolIndex(axis, condition), abs=1e-10)
            assert sensitivity.total(expansion)[condition, axis] == pytest.approx(
                indices.getSobolTotalIndex(axis, condition), abs=1e-10)


@pytest.mark.parametrize("settings", RULES, ids=str)
def test_polynomials_up_to_the_order_are_reproduced(settings: ExpansionSettings) -> None:
    basis = make_basis(MIXED, settings)
    truth = np.random.default_rng(1).standard_normal((len(basis.degrees), 3))
    expansion = expand(basis, basis.at(basis.nodes) @ truth)
    np.testing.assert_allclose(expansion.coefficients, truth, atol=1e-10)
    np.testing.assert_allclose(expansion.error, 0, atol=1e-10)
    # Negative control: a term above the order is not reproduced, and the error estimate is large.
    higher = make_basis(MIXED, ExpansionSettings(basis.order + 1, settings.norm, samples=2000))
    beyond = expand(basis, higher.at(basis.nodes)[:, -1:])
    assert beyond.error > 0.2
    assert np.abs(beyond.at(higher.nodes) - higher.at(higher.nodes)[:, -1:]).max() > 0.5


@pytest.mark.parametrize("rule", ["tensor", "regression"])
@pytest.mark.parametrize("spread", [1e-6, 0.003, 0.1, 0.3])
def test_moments_are_accurate_for_a_small_std(rule: str, spread: float) -> None:
    """exp(slope . x) of normal x is lognormal. An expansion in x itself would be inaccurate below a std of 0.05."""
    slope = spread * np.array([1.5, -0.7])
    basis = make_basis((HERMITE,) * 2, ExpansionSettings(10, rule=rule))  # type: ignore[arg-type]
    expansion = expand(basis, np.exp(basis.nodes @ slope)[:, None])
    variance = slope @ slope
    np.testing.assert_allclose(expansion.mean, np.exp(variance / 2), rtol=1e-8)
    np.testing.assert_allclose(expansion.std, np.exp(variance / 2) * np.sqrt(np.expm1(variance)), rtol=1e-7)


@pytest.mark.parametrize("rule", ["tensor", "regression"])
def test_nan_at_a_node_affects_its_condition_only(rule: str) -> None:
    basis = make_basis((HERMITE,) * 2, ExpansionSettings(rule=rule))  # type: ignore[arg-type]
    times = wavy(basis.nodes)
    complete = expand(basis, times)
    times[40, 1] = np.nan
    expansion = expand(basis, times)
    assert expansion.missing.tolist() == [False, True, False]
    np.testing.assert_array_equal(expansion.coefficients[:, [0, 2]], complete.coefficients[:, [0, 2]])
    for values in (expansion.mean, expansion.std, expansion.error, *sensitivity.total(expansion).T):
        assert np.flatnonzero(np.isnan(values)).tolist() == [1]


def test_the_default_rule_depends_on_the_number_of_inputs() -> None:
    assert len(make_basis((HERMITE,) * 2, ExpansionSettings(4, checks=3)).nodes) == 28
    regression = make_basis((HERMITE,) * 5, ExpansionSettings(3))
    assert len(regression.nodes) == 2 * len(regression.degrees) == 112
    assert len(make_basis((HERMITE,) * 5, ExpansionSettings(3, samples=80)).nodes) == 80


def test_samples_depend_on_the_seed_only() -> None:
    first, other = (make_basis((HERMITE,) * 3, ExpansionSettings(3, seed=seed)) for seed in (1, 2))
    make_basis.cache_clear()
    repeated = make_basis((HERMITE,) * 3, ExpansionSettings(3))
    np.testing.assert_array_equal(first.projection, repeated.projection)
    assert not np.array_equal(first.nodes, other.nodes)


def test_without_checks_the_tensor_rule_has_no_error_estimate() -> None:
    basis = make_basis((HERMITE,), ExpansionSettings(3, checks=0))
    expansion: Expansion = expand(basis, wavy(basis.nodes))
    assert np.isnan(expansion.error).all()
    assert np.isfinite(expansion.std).all()


@pytest.mark.parametrize("dimension", [2, 7])
def test_the_default_order_is_that_of_so_many_inputs(dimension: int) -> None:
    germs = (HERMITE,) * dimension
    assert make_basis(germs, ExpansionSettings()).order == default_order(dimension)
    assert make_basis(germs, ExpansionSettings(norm=0.5)).order == default_order(dimension, 0.5)


def test_invalid_settings_raise() -> None:
    with pytest.raises(InvalidValue, match="at least 9 nodes"):
        ExpansionSettings(8, nodes=8)
    with pytest.raises(InvalidValue, match="at least 9 nodes"):
        make_basis((HERMITE,) * 2, ExpansionSettings(nodes=8))
    with pytest.raises(InvalidValue, match="Choose tensor or regression"):
        ExpansionSettings(rule="smolyak")  # type: ignore[arg-type]
    with pytest.raises(InvalidValue, match="checks"):
        ExpansionSettings(checks=-1)
    with pytest.raises(InvalidValue, match=r"`runs` is 100, but the rule is tensor by default. Omit `runs`, or choose"):
        make_basis((HERMITE,) * 2, ExpansionSettings(4, samples=100))
    with pytest.raises(InvalidValue, match=r"`nodes` is 9, but the rule is regression. .* choose the rule tensor"):
        make_basis((HERMITE,) * 2, ExpansionSettings(4, rule="regression", nodes=9))
    with pytest.raises(InvalidValue, match="Take 70 samples"):
        make_basis((HERMITE,) * 3, ExpansionSettings(4, samples=35))
    with pytest.raises(InvalidValue, match="Take the regression"):
        make_basis((HERMITE,) * 6, ExpansionSettings(6, rule="tensor"))
    with pytest.raises(InvalidValue, match="vary fewer inputs"):
        make_basis((HERMITE,) * 7, ExpansionSettings(8))


@pytest.mark.parametrize("order", [0, 1, 8])
@pytest.mark.parametrize("count", [1, 7, 95, 96, 105, 300])
def test_the_sum_of_the_polynomials_is_the_product_with_the_coefficients(order: int, count: int) -> None:
    """Block by block, and bit for bit."""
    basis = make_basis((HERMITE, Germ("legendre")), ExpansionSettings(order))
    random = np.random.default_rng(1)
    germs, coefficients = random.uniform(-1, 1, (count, 2)), random.standard_normal((len(basis.degrees), 33))
    sums = basis.polynomials.sum(np.asfortranarray(coefficients), np.asfortranarray(germs))
    np.testing.assert_array_equal(sums, matrix_product(basis.at(germs), coefficients))
    np.testing.assert_allclose(sums, basis.at(germs) @ coefficients, atol=1e-12)


# Size and elements of the sets of multi-indices.


@pytest.mark.parametrize(("dimension", "order"), [(1, 20), (2, 0), (2, 8), (3, 4), (7, 3)])
def test_the_total_degree_is_complete(dimension: int, order: int) -> None:
    terms = degrees(dimension, order)
    assert terms.shape == (comb(order + dimension, dimension), dimension)
    assert len(np.unique(terms, axis=0)) == len(terms)
    assert np.all(np.diff(terms.sum(axis=1)) >= 0)
    assert terms[-1].sum() == order
    assert not terms[0].any()


@pytest.mark.parametrize("norm", [0.4, 0.5, 0.75, 1.0])
@pytest.mark.parametrize(("dimension", "order"), [(2, 8), (3, 9), (4, 4)])
def test_the_hyperbolic_set_agrees_with_its_definition(dimension: int, order: int, norm: float) -> None:
    expected = {index for index in product(range(order + 1), repeat=dimension)
                if sum(i**norm for i in index) <= order**norm * (1 + 1e-12)}
    assert {tuple(row) for row in degrees(dimension, order, norm).tolist()} == expected


def test_invalid_truncations_raise() -> None:
    for arguments in ((0, 2), (2, -1), (2, 41)):
        with pytest.raises(InvalidValue, match="order from 0 to 40"):
            degrees(*arguments)
    for norm in (0.0, 1.5, np.nan):
        with pytest.raises(InvalidValue, match="norm of the truncation"):
            degrees(2, 3, norm)
    with pytest.raises(InvalidValue, match="vary fewer inputs"):
        degrees(7, 8)


# The regression compared with NumPy, and linearly dependent terms.


def test_agrees_with_numpy() -> None:
    random = np.random.default_rng(1)
    values, weights = random.standard_normal((40, 12)), random.uniform(0.1, 3.0, 40)
    observed = random.standard_normal((40, 5))
    root = np.sqrt(weights)[:, None]
    expected = np.linalg.lstsq(root * values, root * observed)[0]
    np.testing.assert_allclose(projection(values, weights) @ observed, expected, atol=1e-12)


def test_linearly_dependent_terms_raise() -> None:
    values = np.random.default_rng(1).standard_normal((40, 12))
    values[:, 7] = values[:, 3] - 2 * values[:, 5]
    with pytest.raises(InvalidValue, match="Take more samples"):
        projection(values, np.ones(40))
