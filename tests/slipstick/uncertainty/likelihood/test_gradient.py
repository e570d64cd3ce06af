"""The likelihood on natural scale and its gradient, compared with closed forms and with differences."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns, exact
from slipstick.uncertainty.likelihood.gradient import density_and_gradient
from slipstick.uncertainty.likelihood.local import polynomial_problem
from slipstick.uncertainty.likelihood.natural import NaturalLikelihood

KNOTS = (np.linspace(0.5, 1.5, 11), np.array([0.5, 0.8, 0.95, 1.0, 1.1, 1.5]))
WEIGHTS = np.random.default_rng(6).uniform(0.05, 0.2, (3, 20)) * np.array([[1.0], [-1.0], [0.3]])
FAR = (np.linspace(-19.0, 21.0, 41),) * 2
"""Knots that cover all scores of a linear model."""


def linear(dimension: int) -> InferenceProblem:
    return posed(dimension, lambda points, conditions: 0.5 + (points - 1.0) @ WEIGHTS[:dimension])


def smooth(dimension: int) -> InferenceProblem:
    return posed(dimension, lambda points, conditions: 0.5 + np.expm1((points - 1.0) @ WEIGHTS[:dimension]))


def knotted() -> InferenceProblem:
    first, second = np.meshgrid(*KNOTS, indexing="ij")
    random = np.random.default_rng(3)
    times = 0.5 + np.multiply.outer(first - 1, WEIGHTS[0]) + np.multiply.outer(second - 1, WEIGHTS[1])
    table = RegularGridInterpolator(KNOTS, times + random.uniform(-0.005, 0.005, times.shape))
    return replace(posed(2, lambda points, conditions: table(np.clip(points, 0.5, 1.5))), knots=KNOTS)


def posed(dimension: int, model: Any) -> InferenceProblem:
    """Twenty conditions with measured times of 0.5 s and a scatter of 20 ms."""
    times = 0.5 + 0.02 * np.random.default_rng(1).standard_normal(20)
    return InferenceProblem(model, None, times, np.full(dimension, 0.5), np.full(dimension, 1.5),
                            tuple("abc"[:dimension]))


def at(problem: InferenceProblem, partial: float = 0.0, **changes: Any) -> tuple[Unknowns, np.ndarray]:
    """A search space, and a vector in its interior."""
    d = len(problem.axes)
    space = search_space(FitSettings(**changes), problem)
    vector = [*np.array([1.02, 0.97, 1.05])[:d], *np.log([0.06, 0.09, 0.05])[:d], np.log(0.008)]
    return space, np.array(vector + [partial] * (len(space.lower) - len(vector)))


def by_differences(density: Callable[[np.ndarray], np.ndarray], vector: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """Central differences of fourth order."""
    columns = []
    for unit in np.eye(len(vector)):
        near, far = ([density(vector + side * reach * step * unit) for side in (1, -1)] for reach in (1, 2))
        columns.append((8 * (near[0] - near[1]) - (far[0] - far[1])) / (12 * step))
    return np.column_stack(columns)


@pytest.mark.parametrize(("dimension", "partial", "knots", "tolerance"), [
    (1, None, True, 1e-6), (2, None, False, 1e-5), (2, 0.6, True, 1e-6), (2, -0.6, False, 1e-5), (3, 0.3, False, 0.04)])
def test_a_linear_model_has_the_gradient_of_a_normal_density(dimension: int, partial: float | None, knots: bool,
                                                             tolerance: float) -> None:
    """The variance is slope . covariance . slope + noise^2. For three inputs the tolerance is that of sampling."""
    problem = replace(linear(dimension), knots=FAR[:dimension] if knots else None)
    space, vector = at(problem, partial or 0.0, correlated=partial is not None)

    def normal(vector: np.ndarray) -> np.ndarray:
        candidate = space.candidate(vector)
        mixing = candidate.inputs.marginal_std[:, None] * candidate.inputs.factor
        scaled = mixing.T @ WEIGHTS[:dimension]
        std = np.sqrt(np.sum(scaled**2, axis=0) + candidate.output_std**2)
        mean = problem.model(candidate.inputs.mean[None], None)[0]
        density: np.ndarray = norm.logpdf(1e3 * problem.measured_time, 1e3 * mean, 1e3 * std) / np.log(10)
        return density

    density, gradient = density_and_gradient(problem, space, vector)
    np.testing.assert_allclose(density, normal(vector), atol=tolerance)
    expected = by_differences(normal, vector)
    np.testing.assert_allclose(gradient, expected, atol=tolerance * np.abs(expected).max())


CASES: dict[str, tuple[InferenceProblem, dict[str, Any]]] = {
    "table": (knotted(), {}),
    "table, correlated": (knotted(), {"correlated": True, "partial": -0.5}),
    "smooth": (smooth(2), {}),
    "smooth, correlated": (smooth(2), {"correlated": True, "partial": 0.7}),
    "table, lognormal and gamma": (knotted(), {"families": ("lognormal", "gamma")}),
    "uniform and beta": (smooth(2), {"families": ("uniform", "beta")}),
    "copula": (smooth(2), {"families": ("gamma", "beta"), "correlated": True, "partial": 0.4}),
    "one input": (smooth(1), {}),
}


@pytest.mark.parametrize("case", CASES)
def test_the_gradient_agrees_with_differences_of_the_likelihood(case: str) -> None:
    """Up to rounding if the lines have breakpoints at the knots, and otherwise up to the integration error."""
    problem, changes = CASES[case]
    space, vector = at(problem, **changes)
    density, gradient = density_and_gradient(problem, space, vector)
    np.testing.assert_array_equal(density, exact(problem, space.candidate(vector)))
    expected = by_differences(lambda moved: exact(problem, space.candidate(moved), 256), vector)
    is_exact = problem.knots is not None and "families" not in changes
    np.testing.assert_allclose(gradient, expected, atol=(1e-7 if is_exact else 5e-3) * np.abs(expected).max())


@pytest.mark.parametrize(("families", "partial"), [
    (("normal",), None), (("normal",), 0.3), (("gamma", "uniform", "lognormal"), None),
    (("beta", "normal", "gamma"), 0.2)])
def test_the_gradient_of_a_local_expansion_is_exact_for_the_computed_integral(families: tuple[str, ...],
                                                                              partial: float | None) -> None:
    """Also with 64 lines, although the integral itself has a sampling error."""
    space, vector = at(problem := smooth(3), partial or 0.0, families=families, correlated=partial is not None)
    local, _ = polynomial_problem(problem, space, vector)
    density, gradient = density_and_gradient(local, space, vector)
    np.testing.assert_array_equal(density, exact(local, space.candidate(vector)))
    expected = by_differences(lambda moved: exact(local, space.candidate(moved)), vector, 1e-4)
    np.testing.assert_allclose(gradient, expected, atol=2e-5 * np.abs(expected).max())


def test_the_gradient_at_a_bound_is_a_one_sided_difference() -> None:
    space, vector = at(problem := knotted(), families=("gamma", "lognormal"), mean_bounds=((0.5, 1.2),))
    vector[0], vector[2:4] = space.upper[0], space.upper[2:4]
    gradient = density_and_gradient(problem, space, vector)[1]
    inside = density_and_gradient(problem, space, vector - 1e-4 * np.array([1, 0, 1, 1, 0]))[1]
    np.testing.assert_allclose(gradient, inside, atol=1e-3 * np.abs(gradient).max())


def test_the_gradient_is_nan_for_a_density_of_zero() -> None:
    problem = knotted()
    partial = replace(problem, model=lambda points, conditions: np.where(
        np.arange(20) == 7, np.nan, problem.model(points, conditions)))
    for families in (("normal",), ("gamma",)):
        space, vector = at(problem, families=families)
        density, gradient = density_and_gradient(partial, space, vector)
        expected, expected_gradient = density_and_gradient(problem, space, vector)
        assert density[7] == -np.inf
        assert np.isnan(gradient[7]).all()
        np.testing.assert_allclose(np.delete(density, 7), np.delete(expected, 7), atol=1e-9)
        np.testing.assert_allclose(np.delete(gradient, 7, axis=0), np.delete(expected_gradient, 7, axis=0), atol=1e-6)


# The likelihood on natural scale, with its derivatives compared with differences of it.


NATURAL_CASES = {"table of 2 inputs": knotted(), "linear, 1 input": linear(1), "smooth, 3 inputs": smooth(3)}


def vector(problem: InferenceProblem) -> np.ndarray:
    d = len(problem.axes)
    return np.array([*[1.02, 0.97, 1.05][:d], *[0.06, 0.09, 0.05][:d], 0.008])


@pytest.mark.parametrize("case", NATURAL_CASES)
def test_values_and_derivatives_agree_with_the_likelihood(case: str) -> None:
    likelihood = NaturalLikelihood(NATURAL_CASES[case])
    point, d = vector(NATURAL_CASES[case]), len(NATURAL_CASES[case].axes)
    candidate = Candidate(Inputs(point[:d], point[d:2 * d]), point[-1])
    assert likelihood.value(point) == exact(NATURAL_CASES[case], candidate).sum()
    step = 1e-2 * point[-1]  # the output std is the smallest scale
    gradient = by_differences(lambda moved: np.array([likelihood.value(moved)]), point, step)[0]
    tolerance = 1e-4 if d < 3 else 5e-3
    np.testing.assert_allclose(likelihood.gradient(point), gradient, atol=tolerance * np.abs(gradient).max())
    hessian = by_differences(likelihood.gradient, point, step)
    for direction in np.random.default_rng(1).normal(size=(2, len(point))) * point:
        expected = hessian @ direction
        np.testing.assert_allclose(likelihood.apply_hessian(point, direction), expected,
                                   atol=tolerance * np.abs(expected).max())
    assert not likelihood.apply_hessian(point, np.zeros(len(point))).any()


def test_where_the_likelihood_is_zero_it_has_no_derivatives() -> None:
    likelihood = NaturalLikelihood(linear(2))
    for change in ((2, -0.01), (4, 0.0), (4, -0.1)):
        point = vector(linear(2))
        point[change[0]] = change[1]
        assert likelihood.value(point) == -np.inf
        with pytest.raises(InvalidValue, match="no derivatives"):
            likelihood.gradient(point)
    fixed = vector(linear(2)) * np.array([1, 1, 0, 1, 1])
    assert np.isfinite(likelihood.value(fixed))  # an input without scatter is possible
    for act in (likelihood.gradient, lambda point: likelihood.apply_hessian(point, np.ones(5))):
        with pytest.raises(InvalidValue, match="no derivatives"):
            act(fixed)
