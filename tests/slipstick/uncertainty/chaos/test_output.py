"""Moments, quantiles, density and Sobol indices of outputs, compared with closed forms."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos import ExpansionSettings, Germ, Output, expand, make_basis, sensitivity
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem


@pytest.fixture(scope="module")
def output(linear_problem: InferenceProblem, mixed: Candidate) -> Output:
    basis = make_basis(mixed.inputs.germs, ExpansionSettings(checks=0))
    times = linear_problem.model(mixed.inputs.points(basis.nodes), linear_problem.conditions)
    times[0, 5] = np.nan
    return Output(expand(basis, times), mixed.output_std)


@pytest.fixture(scope="module")
def normal(linear_problem: InferenceProblem, mixed: Candidate) -> tuple[np.ndarray, np.ndarray]:
    surfaces = linear_problem.conditions
    mean = surfaces.base + surfaces.slope @ (mixed.inputs.mean - 1)
    std = np.sqrt(np.sum((surfaces.slope @ mixed.inputs.mixing) ** 2, axis=1) + mixed.output_std**2)
    mean[5] = std[5] = np.nan
    return mean, std


def test_moments_quantiles_and_density_of_a_linear_model(
    output: Output, normal: tuple[np.ndarray, np.ndarray]
) -> None:
    mean, std = normal
    np.testing.assert_allclose(output.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(output.std, std, rtol=1e-9)
    levels = np.array([0.05, 0.5, 0.95])
    error = (output.quantiles(levels) - (mean + np.outer(norm.ppf(levels), std))) / std
    assert np.nanmax(np.abs(error)) < 0.02
    grid = mean + np.linspace(-6, 6, 61)[:, None] * std
    density = output.density(grid)
    np.testing.assert_allclose(density, norm.pdf(grid, mean, std) / 1e3, atol=2e-2 * np.nanmax(density))
    np.testing.assert_allclose(np.delete(density.sum(axis=0) * 0.2 * std * 1e3, 5), 1.0, atol=1e-3)


def test_results_are_nan_for_a_condition_without_an_expansion(output: Output) -> None:
    grid = np.full((2, 24), 0.5)
    for values in (output.mean, output.std, output.quantiles(np.array([0.5]))[0], output.density(grid)[0]):
        assert np.flatnonzero(np.isnan(values)).tolist() == [5]


def test_noise_is_optional_except_for_a_density(output: Output) -> None:
    noiseless = Output(output.expansion, 0.0)
    np.testing.assert_array_equal(noiseless.std, output.expansion.std)
    assert np.nanmax(np.diff(noiseless.quantiles(np.array([0.05, 0.95])), axis=0)
                     / np.diff(output.quantiles(np.array([0.05, 0.95])), axis=0)) < 1.0
    with pytest.raises(InvalidValue, match="no density"):
        noiseless.density(np.full((1, 24), 0.5))
    with pytest.raises(InvalidValue, match=r"output std is -1\.0\. Give 0 or a positive number\.$"):
        Output(output.expansion, -1.0)


def test_quantiles_depend_on_the_seed_only(output: Output) -> None:
    levels = np.array([0.1])
    first, repeated, other = (
        Output(output.expansion, output.output_std, seed=seed).quantiles(levels) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, repeated)
    assert not np.array_equal(first, other)


# Moments and Sobol indices of functions with closed-form values.


@dataclass(frozen=True)
class Known:
    """A function of uniform germs with its moments and indices, and the tolerance of its expansion."""

    function: Callable[[np.ndarray], np.ndarray]
    mean: float
    variance: float
    first_order: list[float]
    total: list[float]
    settings: ExpansionSettings
    tolerance: float


def ishigami() -> Known:
    """Ishigami and Homma (1990): sin x1 + a sin^2 x2 + b x3^4 sin x1 on [-pi, pi]^3."""
    a, b = 7.0, 0.1
    first = (1 + b * np.pi**4 / 5) ** 2 / 2
    second = a**2 / 8
    interaction = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    variance = first + second + interaction

    def function(germs: np.ndarray) -> np.ndarray:
        x = germs * np.pi / np.sqrt(3)
        return np.sin(x[:, 0]) * (1 + b * x[:, 2] ** 4) + a * np.sin(x[:, 1]) ** 2

    return Known(function, a / 2, variance, [first / variance, second / variance, 0.0],
                 [(first + interaction) / variance, second / variance, interaction / variance],
                 ExpansionSettings(14), 1e-4)


def sobol_g() -> Known:
    """Sobol (1993): the product of (|4 u - 2| + a) / (1 + a) on [0, 1]^3, each factor with a kink."""
    a = np.array([0.0, 1.0, 4.5])
    partial = 1 / (3 * (1 + a) ** 2)
    variance = float(np.prod(1 + partial) - 1)

    def function(germs: np.ndarray) -> np.ndarray:
        u = (germs / np.sqrt(3) + 1) / 2
        return np.prod((np.abs(4 * u - 2) + a) / (1 + a), axis=1)

    total = [partial[i] * np.prod(np.delete(1 + partial, i)) / variance for i in range(3)]
    return Known(function, 1.0, variance, (partial / variance).tolist(), total, ExpansionSettings(16), 1e-2)


@pytest.mark.parametrize("known", [ishigami(), sobol_g()], ids=["Ishigami", "Sobol's g"])
def test_moments_and_indices_of_known_functions(known: Known) -> None:
    basis = make_basis((Germ("legendre"),) * 3, known.settings)
    expansion = expand(basis, known.function(basis.nodes)[:, None])
    np.testing.assert_allclose(expansion.mean, known.mean, rtol=known.tolerance)
    np.testing.assert_allclose(expansion.std**2, known.variance, rtol=4 * known.tolerance)
    np.testing.assert_allclose(sensitivity.first_order(expansion)[0], known.first_order, atol=known.tolerance)
    np.testing.assert_allclose(sensitivity.total(expansion)[0], known.total, atol=known.tolerance)


def test_indices_of_a_sum_of_interactions() -> None:
    """With unit coefficients for all pairs of four germs, the total indices are 0.5 and the first-order indices 0."""
    basis = make_basis((Germ("hermite"),) * 4, ExpansionSettings(2))
    times = sum(basis.nodes[:, i] * basis.nodes[:, j] for i, j in combinations(range(4), 2))
    expansion = expand(basis, np.column_stack([times, np.ones(len(basis.nodes))]))
    np.testing.assert_allclose(sensitivity.first_order(expansion)[0], 0, atol=1e-12)
    np.testing.assert_allclose(sensitivity.total(expansion)[0], 0.5, atol=1e-12)


def test_indices_are_nan_for_zero_variance() -> None:
    basis = make_basis((Germ("hermite"),) * 2, ExpansionSettings(2))
    expansion = expand(basis, np.zeros((len(basis.nodes), 1)))
    assert np.isnan(sensitivity.first_order(expansion)).all()
    assert np.isnan(sensitivity.total(expansion)).all()
