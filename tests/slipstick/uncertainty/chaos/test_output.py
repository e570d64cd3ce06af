"""Moments, quantiles and density of the output of a linear model, compared with the normal distribution."""

import numpy as np
import pytest
from scipy.stats import norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos import ExpansionSettings, Output, expand, make_basis
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
    with pytest.raises(InvalidValue, match="output std"):
        Output(output.expansion, -1.0)


def test_quantiles_depend_on_the_seed_only(output: Output) -> None:
    levels = np.array([0.1])
    first, repeated, other = (
        Output(output.expansion, output.output_std, seed=seed).quantiles(levels) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, repeated)
    assert not np.array_equal(first, other)
