"""Conversion of candidates to vectors and back, and validity of all vectors of a search space."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.chaos import FAMILIES, make_basis
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.search_space import nominal_candidate, search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns
from slipstick.uncertainty.likelihood.unknowns import correlation_from_partial, partial_from_factor

DIMENSIONS = pytest.mark.parametrize("dimension", [1, 2, 3, 7])


def pose(dimension: int, lower: float = 0.5, upper: float = 1.5) -> InferenceProblem:
    """Five conditions with a time of 0.5 s at nominal inputs, which increases by 0.25 s per unit of their mean."""
    def model(points: np.ndarray, conditions: np.ndarray) -> np.ndarray:
        return 0.25 + 0.25 * points.mean(axis=1, keepdims=True) + 0 * conditions

    return InferenceProblem(model, np.zeros(5), np.linspace(0.48, 0.56, 5), np.full(dimension, lower),
                            np.full(dimension, upper), tuple("abcdefg"[:dimension]))


def space_of(dimension: int, **changes: Any) -> Unknowns:
    return search_space(FitSettings(**changes), pose(dimension))


def vectors(space: Unknowns, count: int, seed: int = 1) -> np.ndarray:
    """Random vectors in the bounds, with half of their entries at a bound, and the two bounds."""
    random = np.random.default_rng(seed)
    inner = random.uniform(space.lower, space.upper, (count, len(space.lower)))
    corner = np.where(random.random(inner.shape) < 0.5, space.lower, space.upper)
    mixed = np.where(random.random(inner.shape) < 0.5, inner, corner)
    return np.concatenate([mixed, [space.lower, space.upper]])


def partial_by_regression(correlation: np.ndarray, first: int, second: int) -> float:
    """Partial correlation of two variables given all variables before the first."""
    pair, controls = [first, second], list(range(first))
    residual = correlation[np.ix_(pair, pair)]
    if controls:
        cross = correlation[np.ix_(pair, controls)]
        residual = residual - cross @ np.linalg.solve(correlation[np.ix_(controls, controls)], cross.T)
    return float(residual[0, 1] / np.sqrt(residual[0, 0] * residual[1, 1]))


@DIMENSIONS
@pytest.mark.parametrize("correlated", [False, True])
def test_vectors_are_converted_to_candidates_and_back(dimension: int, correlated: bool) -> None:
    space = space_of(dimension, correlated=correlated)
    pairs = dimension * (dimension - 1) // 2 if correlated else 0
    assert len(space.names) == len(set(space.names)) == len(space.lower) == 2 * dimension + 1 + pairs
    for vector in vectors(space, 50):
        candidate = space.candidate(vector)
        np.testing.assert_array_equal(candidate.inputs.mean, vector[:dimension])
        np.testing.assert_allclose(np.log(candidate.inputs.marginal_std), vector[dimension:2 * dimension], atol=1e-14)
        assert np.log(candidate.output_std) == pytest.approx(vector[2 * dimension], abs=1e-14)
        # If all partial correlations are 0.98, the squared norm left for the last of seven columns is about 1e-8.
        np.testing.assert_allclose(space.vector(candidate), vector, atol=1e-6 if dimension == 7 else 1e-11)


@DIMENSIONS
def test_natural_unknowns_are_those_of_the_candidate(dimension: int) -> None:
    space = space_of(dimension, correlated=True)
    for vector in vectors(space, 20):
        candidate, natural = space.candidate(vector), space.to_natural(vector)
        expected = [*candidate.inputs.mean, *candidate.inputs.marginal_std, candidate.output_std]
        np.testing.assert_array_equal(natural[:2 * dimension + 1], expected)
        np.testing.assert_array_equal(natural[2 * dimension + 1:], vector[2 * dimension + 1:])
        np.testing.assert_allclose(space.from_natural(natural), vector, atol=1e-14)
    np.testing.assert_array_equal(space.from_natural(0 * space.lower - 9), space.lower)
    np.testing.assert_array_equal(space.from_natural(0 * space.lower + 9), space.upper)


@pytest.mark.parametrize("dimension", [2, 3, 7])
def test_every_vector_has_a_positive_definite_correlation_matrix(dimension: int) -> None:
    space = space_of(dimension, correlated=True)
    for vector in vectors(space, 200):
        correlation = space.candidate(vector).inputs.correlation
        assert correlation is not None
        np.testing.assert_array_equal(np.diag(correlation), 1.0)
        np.testing.assert_allclose(correlation, correlation.T, atol=1e-15)
        assert np.linalg.eigvalsh(correlation)[0] > 0


@pytest.mark.parametrize("dimension", [2, 3, 5])
def test_partial_correlations_agree_with_regression(dimension: int) -> None:
    partial = np.random.default_rng(dimension).uniform(-0.9, 0.9, dimension * (dimension - 1) // 2)
    correlation = correlation_from_partial(partial, dimension)
    expected = [partial_by_regression(correlation, *pair) for pair in zip(*np.triu_indices(dimension, 1), strict=True)]
    np.testing.assert_allclose(partial, expected, atol=1e-9)
    np.testing.assert_allclose(partial_from_factor(np.linalg.cholesky(correlation)), partial, atol=1e-9)
    np.testing.assert_array_equal(correlation_from_partial(0 * partial, dimension), np.eye(dimension))


def test_a_candidate_outside_the_bounds_is_clipped() -> None:
    space = space_of(2, correlated=True)
    outside = Candidate(Inputs([0.2, 1.0], [0.0, 0.9], correlation=[[1.0, 0.999], [0.999, 1.0]]), 7.0)
    vector = space.vector(outside)
    np.testing.assert_array_equal(vector[[0, 2, 3, 4, 5]], [0.5, *np.log([0.002, 0.3, 0.1]), 0.98])
    assert vector[1] == 1.0


@pytest.mark.parametrize("families", [*((family,) for family in FAMILIES), FAMILIES[:2] + FAMILIES[3:]])
@pytest.mark.parametrize("box", [(0.5, 1.5), (0.1, 3.0), (0.99, 1.02), (0.0, 20.0)])
def test_every_vector_of_a_default_search_is_valid(families: Sequence[str], box: tuple[float, float]) -> None:
    """For all families, including beta inputs far narrower than their support, or as wide as it allows."""
    problem = pose(len(families), *box)
    for correlated in (False, True):
        settings = FitSettings(families=tuple(families), correlated=correlated)
        space, normals = search_space(settings, problem), np.linspace(-8, 8, 9)[:, None] * np.ones(len(families))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for vector in vectors(space, 40):
                inputs = space.candidate(vector).inputs
                points, basis = inputs.points(normals), make_basis(inputs.germs, settings.expansion(len(families)))
                assert np.isfinite(points).all()
                assert np.isfinite(inputs.at_germs(basis.nodes)).all()
                if not correlated:
                    assert np.all(np.diff(points, axis=0) >= 0)
                converted = space.candidate(space.vector(Candidate(inputs, 0.01))).inputs
                np.testing.assert_allclose(converted.points(normals), points, rtol=1e-6)


def test_the_std_of_a_beta_input_is_limited() -> None:
    space = space_of(2, families=("beta", "normal"))
    vector = np.array([0.6, 0.6, np.log(0.3), np.log(0.3), np.log(0.01)])
    inputs = space.candidate(vector).inputs
    np.testing.assert_allclose(inputs.marginal_std, [0.9 * np.sqrt(0.1 * 0.9), 0.3])
    np.testing.assert_array_equal(inputs.support, [[0.5, 1.5]] * 2)


def test_means_are_bounded_by_the_box_and_by_their_family() -> None:
    settings = FitSettings(families=("normal", "gamma", "beta"), mean_bounds=((-1.0, 3.0),))
    space = search_space(settings, pose(3, -0.5, 2.0))
    np.testing.assert_allclose(space.lower[:3], [-0.5, 1e-6, -0.45])
    np.testing.assert_allclose(space.upper[:3], [2.0, 2.0, 1.95])
    np.testing.assert_allclose(space.lower[3:], np.log([0.002] * 3 + [0.0005]))
    np.testing.assert_allclose(space.upper[3:], np.log([0.3] * 3 + [0.1]))
    settings = FitSettings(mean_bounds=((0.6, 0.7), (0.8, 0.9)), std_bounds=((0.01, 0.02), (0.03, 0.04)))
    space = search_space(settings, pose(2))
    np.testing.assert_allclose(space.lower, [0.6, 0.8, *np.log([0.01, 0.03, 0.0005])])
    np.testing.assert_allclose(space.upper, [0.7, 0.9, *np.log([0.02, 0.04, 0.1])])


@pytest.mark.parametrize(("change", "cause"), [
    ({"mean_bounds": ((1.6, 2.0),)}, r"outside the domain of the model. Choose mean_bounds within 0\.5 to 1\.5 \("),
    ({"mean_bounds": ((0.5, 1.5),) * 3}, "3 pairs of bounds for 2 inputs"),
    ({"families": ("gamma",) * 3}, "3 families for 2 inputs"),
    ({"families": ("beta",), "mean_bounds": ((0.3, 0.51),)}, "outside the domain of the model"),
])
def test_invalid_bounds_and_families_raise(change: dict[str, Any], cause: str) -> None:
    with pytest.raises(InvalidValue, match=cause):
        space_of(2, **change)


def test_the_output_std_of_the_nominal_candidate_is_the_rms_residual() -> None:
    for correlated in (False, True):
        space, problem = space_of(3, correlated=correlated), pose(3)
        nominal = nominal_candidate(problem, space)
        np.testing.assert_array_equal(nominal.inputs.mean, 1.0)
        np.testing.assert_allclose(nominal.inputs.marginal_std, 0.002)
        assert nominal.output_std == pytest.approx(np.sqrt(np.mean((problem.measured_time - 0.5) ** 2)))
        if correlated:
            np.testing.assert_array_equal(nominal.inputs.correlation, np.eye(3))


def test_the_nominal_candidate_is_clipped_and_ignores_conditions_that_never_lock() -> None:
    problem = pose(2)
    narrow = search_space(FitSettings(mean_bounds=((1.1, 1.2),), output_std_bounds=(0.0005, 0.001)), problem)
    clipped = nominal_candidate(problem, narrow)
    np.testing.assert_allclose([*clipped.inputs.mean, clipped.output_std], [1.1, 1.1, 0.001])
    partial = replace(problem, model=lambda points, conditions: np.where(
        np.arange(5) == 4, np.nan, problem.model(points, conditions)))
    expected = np.sqrt(np.mean((problem.measured_time[:4] - 0.5) ** 2))
    assert nominal_candidate(partial, space_of(2)).output_std == pytest.approx(expected)
    never = replace(problem, model=lambda points, conditions: np.full((len(points), 5), np.nan))
    assert nominal_candidate(never, space_of(2)).output_std == pytest.approx(0.0005)
