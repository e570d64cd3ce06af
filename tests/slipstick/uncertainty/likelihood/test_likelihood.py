"""The likelihood compared with closed forms, a SciPy implementation and direct Monte Carlo, and extreme values."""

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm

from slipstick.errors import InvalidValue
from slipstick.uncertainty import Inputs, log10_mean_density, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import (
    SAMPLES,
    Candidate,
    InferenceProblem,
    by_expansion,
    by_sampling,
    converged,
    exact,
)
from slipstick.uncertainty.likelihood.natural import NaturalLikelihood

NORMALS = standard_normals(2, SAMPLES, 1)
DEFAULT = ExpansionSettings(checks=0)


def by_scipy(outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 of the mean normal density, per ms."""
    logs = norm.logpdf(1e3 * times, 1e3 * outputs, 1e3 * output_std)
    return logsumexp(logs, axis=0, b=1 / len(outputs)) / np.log(10)


def direct(problem: InferenceProblem, candidate: Candidate, blocks: int = 32) -> np.ndarray:
    """Monte Carlo with 8192 pseudo-random runs per block."""
    random = np.random.default_rng(11)
    logs = [sampled(problem, candidate, random.standard_normal((8192, 2))) for _ in range(blocks)]
    return np.log10(np.mean(np.power(10.0, logs), axis=0))


def sampled(problem: InferenceProblem, candidate: Candidate, normals: np.ndarray) -> np.ndarray:
    outputs = problem.model(candidate.inputs.points(normals), problem.conditions)
    return log10_mean_density(outputs, problem.measured_time, candidate.output_std)


def test_density_agrees_with_scipy() -> None:
    random = np.random.default_rng(1)
    outputs, times = random.normal(0.5, 0.01, (500, 7)), random.normal(0.5, 0.05, 7)
    for output_std in (1e-5, 1e-3, 0.1):
        np.testing.assert_allclose(log10_mean_density(outputs, times, output_std), by_scipy(outputs, times, output_std),
                                   rtol=1e-12)


def test_a_linear_model_has_a_normal_density(linear_problem: InferenceProblem, mixed: Candidate) -> None:
    candidate, surfaces = mixed, linear_problem.conditions
    spread = np.sum((surfaces.slope @ mixed.inputs.mixing) ** 2, axis=1)
    mean = surfaces.base + surfaces.slope @ (candidate.inputs.mean - 1)
    expected = norm.logpdf(1e3 * linear_problem.measured_time, 1e3 * mean,
                           1e3 * np.sqrt(spread + candidate.output_std**2)) / np.log(10)
    first = ExpansionSettings(1, checks=0)
    np.testing.assert_allclose(by_sampling(linear_problem, [candidate], first, NORMALS)[0], expected, atol=5e-3)
    np.testing.assert_allclose(by_expansion(linear_problem, [candidate], first)[0], expected, atol=1e-5)
    np.testing.assert_allclose(exact(linear_problem, candidate), expected, atol=1e-6)
    knotted = replace(linear_problem, knots=(np.linspace(-9.0, 11.0, 9),) * 2)
    np.testing.assert_allclose(exact(knotted, candidate), expected, atol=1e-6)
    # Negative control: the transposed mixing matrix gives another distribution.
    transposed = Candidate(Inputs(mixed.inputs.mean, mixing=mixed.inputs.mixing.T), mixed.output_std)
    assert np.abs(exact(linear_problem, transposed) - expected).max() > 0.1


@pytest.mark.parametrize("std", [0.01, 0.03, 0.1])
def test_agrees_with_direct_monte_carlo(problem_measured_at: Callable[[Candidate], InferenceProblem],
                                        std: float) -> None:
    candidate = Candidate(Inputs([1.04, 0.97], [std, 1.5 * std]), 0.004)
    problem = problem_measured_at(candidate)
    reference = direct(problem, candidate)
    expanded = by_expansion(problem, [candidate], DEFAULT)[0]
    assert abs(exact(problem, candidate, 256).sum() - reference.sum()) < 0.15
    assert abs(sampled(problem, candidate, NORMALS).sum() - reference.sum()) < 0.15
    # The error of the expansion at kinks is a few hundredths of a decade per condition.
    assert np.abs(expanded - reference).max() < 0.12
    assert abs(expanded.sum() - reference.sum()) < 1.0


def test_the_error_of_the_default_samples_is_a_few_hundredths_of_a_decade(problem: InferenceProblem,
                                                                          truth: Candidate) -> None:
    """Negative control: a sixteenth of the samples has a larger error."""
    reference = sampled(problem, truth, standard_normals(2, 2**17, 99)).sum()

    def error(count: int) -> float:
        sums = [sampled(problem, truth, standard_normals(2, count, seed)).sum() for seed in range(1, 9)]
        return float(np.sqrt(np.mean((np.array(sums) - reference) ** 2)))

    assert error(SAMPLES) < 0.03
    assert error(SAMPLES // 16) > 0.05


def test_extreme_densities_neither_underflow_nor_overflow(linear_problem: InferenceProblem) -> None:
    """Without scatter the density is a single normal density, thousands of decades below or above 1."""
    inputs = Inputs([1.0, 1.0], [0.0, 0.0])
    base = linear_problem.conditions.base
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for distance, output_std in ((0.0, 1e-12), (3.0, 1e-3), (1e4, 1e-4), (0.5, 1e-9)):
            far = replace(linear_problem, measured_time=base + distance)
            expected = norm.logpdf(1e3 * far.measured_time, 1e3 * base, 1e3 * output_std) / np.log(10)
            candidate = Candidate(inputs, output_std)
            np.testing.assert_allclose(exact(far, candidate), expected, rtol=1e-9, atol=1e-7)
            np.testing.assert_allclose(sampled(far, candidate, NORMALS[:8]), expected, rtol=1e-9)
            assert np.isfinite(by_expansion(far, [candidate], DEFAULT)).all()


def test_many_candidates_have_the_same_likelihoods_as_single_ones(problem: InferenceProblem) -> None:
    random, settings = np.random.default_rng(3), ExpansionSettings(4, checks=0)
    candidates = [Candidate(Inputs(random.uniform(0.8, 1.2, 2), random.uniform(0.01, 0.1, 2)), 0.005)
                  for _ in range(70)]
    together = by_expansion(problem, candidates, settings)
    single = np.concatenate([by_expansion(problem, [candidate], settings) for candidate in candidates])
    np.testing.assert_array_equal(together, single)
    assert len(np.unique(together.sum(axis=1))) == 70


def test_engagements_that_never_lock(linear_problem: InferenceProblem) -> None:
    def half(points: np.ndarray, conditions: object) -> np.ndarray:
        times = linear_problem.model(points, conditions)
        times[points[:, 0] > 1.0, 3] = np.nan
        return times

    candidate, partial = Candidate(Inputs([1.0, 1.0], [0.03, 0.03]), 10.0), replace(linear_problem, model=half)
    expected, by_partial = (by_expansion(p, [candidate], DEFAULT)[0] for p in (linear_problem, partial))
    assert by_partial[3] == -np.inf
    np.testing.assert_allclose(np.delete(by_partial, 3), np.delete(expected, 3), rtol=1e-12)
    # With the model itself, the half of the runs that never locks has a density of 0, and the noise dominates.
    difference = sampled(partial, candidate, NORMALS) - sampled(linear_problem, candidate, NORMALS)
    np.testing.assert_allclose(difference[3], np.log10(0.5), atol=1e-3)
    assert np.count_nonzero(difference) == 1


@pytest.mark.parametrize("output_std", [0.0, -1.0, np.nan, np.inf])
def test_invalid_noise_raises(output_std: float) -> None:
    with pytest.raises(InvalidValue, match="output std"):
        Candidate(Inputs([1.0], [0.1]), output_std)


def in_unit(problem: InferenceProblem, factor: float) -> InferenceProblem:
    """The same problem with times in a unit of which `factor` are a second."""
    return replace(problem, model=lambda points, conditions: factor * problem.model(points, conditions),
                   measured_time=factor * problem.measured_time)


@pytest.mark.parametrize("factor", [1e-20, 1e9, 1e20])
def test_the_likelihood_is_the_same_in_any_unit(problem: InferenceProblem, factor: float) -> None:
    candidate = Candidate(Inputs([1.04, 0.97], [0.03, 0.05]), 0.004)
    scaled, other = replace(candidate, output_std=factor * 0.004), in_unit(problem, factor)
    other.require_output_std(scaled.output_std)
    for density in (exact, lambda posed, given: converged(posed, given).density,
                    lambda posed, given: by_expansion(posed, [given], DEFAULT)[0]):
        np.testing.assert_allclose(density(other, scaled) + np.log10(factor), density(problem, candidate), atol=1e-6)
    vector = np.array([1.04, 0.97, 0.03, 0.05, factor * 0.004])
    np.testing.assert_allclose(NaturalLikelihood(other).value(vector), exact(other, scaled).sum())
    vector[-1] = factor * 1e-17
    assert NaturalLikelihood(other).value(vector) == -np.inf
    with pytest.raises(InvalidValue, match="rounding errors"):
        NaturalLikelihood(other).gradient(vector)


def test_invalid_problems_raise(problem: InferenceProblem) -> None:
    with pytest.raises(InvalidValue, match="one finite number"):
        replace(problem, measured_time=np.append(problem.measured_time[:-1], np.nan))
    with pytest.raises(InvalidValue, match="1 axes"):
        replace(problem, axes=("pressure_bias",))
