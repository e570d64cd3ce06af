"""Likelihoods by lines with replicates: exact for linear models, and with an error that holds for others."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import (
    Candidate,
    InferenceProblem,
    compared,
    converged,
    expanded_with_lines,
    with_lines,
)
from slipstick.uncertainty.likelihood.replicates import Target, integrate


def linear(d: int, distance: float, seed: int = 1) -> tuple[InferenceProblem, Candidate, np.ndarray]:
    """A linear model of normal inputs with measured times `distance` stds off, and log10 p (n,) in closed form."""
    random = np.random.default_rng(seed)
    gains = random.uniform(0.2, 1.0, (d, 40)) * random.choice([-1, 1], (d, 40))
    std = random.uniform(0.02, 0.1, d)
    noise = 0.02
    spread = np.sqrt(noise**2 + np.sum((gains * std[:, None]) ** 2, axis=0))
    measured = gains.sum(axis=0) + distance * spread * random.choice([-1, 1], 40)
    problem = InferenceProblem(lambda points, conditions: points @ gains, None, measured, np.zeros(d), np.full(d, 2.0),
                               tuple("abcdefg"[:d]))
    return problem, Candidate(Inputs(np.ones(d), std), noise), \
        norm.logpdf(measured, gains.sum(axis=0), spread) / np.log(10) - 3


@pytest.mark.parametrize("d", [1, 2, 3, 5, 7])
@pytest.mark.parametrize("distance", [0, 5, 8])
def test_a_linear_model_is_integrated_however_far_its_measured_times_are(d: int, distance: float) -> None:
    problem, candidate, exact = linear(d, distance)
    density, error = converged(problem, candidate)
    assert abs(density.sum() - exact.sum()) < error < 0.05
    np.testing.assert_allclose(density, exact, atol=2e-3)


def test_without_samples_about_the_measured_times_they_are_out_of_reach() -> None:
    """Negative control: samples about the mean alone, as if all measured times were the predicted ones."""
    problem, candidate, exact = linear(5, 8)
    inputs = candidate.inputs
    gains = problem.model(np.eye(5), None)
    centre = problem.model(np.ones((1, 5)), None)[0]
    target = Target(lambda normals: problem.model(inputs.points(normals), None), centre,
                    gains * inputs.marginal_std[:, None], problem.measured_time, candidate.output_std)
    assert abs(integrate(target, 64, 1).density.sum() - exact.sum()) < 0.05
    curved = replace(target, times_at=lambda normals: target.times_at(normals) + 0.02 * normals[:, :1] ** 2)
    blind = replace(curved, slopes=1e-3 * target.slopes)  # the most likely normals are then near 0, or found from there
    with_slopes, without = integrate(curved, 256, 1), integrate(blind, 256, 1)
    assert without.error > 2 * with_slopes.error


def test_errors_of_conditions_do_not_cancel_in_the_stated_error() -> None:
    """A curved model of three inputs, 5 stds off, 20 seeds: true and stated error agree in size."""
    problem, candidate, _ = linear(3, 5)
    plain = problem.model
    curved = replace(problem, model=lambda points, conditions: plain(points, conditions) + 2 * (points[:, :1] - 1) ** 2)
    reference = np.mean([with_lines(curved, candidate, 1024, 100 + seed).density.sum() for seed in range(3)])
    estimates = [with_lines(curved, candidate, 64, seed) for seed in range(20)]
    off = np.array([abs(estimate.density.sum() - reference) for estimate in estimates])
    stated = np.array([estimate.error for estimate in estimates])
    assert np.mean(off <= stated) > 0.85
    assert 0.5 < np.median(stated) / np.median(off) < 12


def test_the_error_of_an_expansion_is_its_difference_to_the_model() -> None:
    """Five to eight stds off, an expansion of a bent model is decades off, and says so."""
    problem, candidate, _ = linear(2, 6)
    plain = problem.model
    bent = replace(problem, model=lambda points, conditions: plain(points, conditions) + np.maximum(
        points[:, :1] - 1.02, 0))
    settings = ExpansionSettings(8, checks=0)
    estimate, = compared(bent, [candidate], expanded_with_lines(bent, [candidate], settings))
    reference = converged(bent, candidate)
    assert reference.error < 0.05
    off = abs(estimate.density.sum() - reference.density.sum())
    assert off > 0.5
    assert off <= estimate.error < off + 0.1


def test_an_expansion_of_a_linear_model_is_integrated_however_far_its_measured_times_are() -> None:
    problem, candidate, exact = linear(2, 8)
    density = expanded_with_lines(problem, [candidate], ExpansionSettings(8, checks=0))
    np.testing.assert_allclose(density[0], exact, atol=2e-3)


def test_a_condition_without_times_has_a_density_of_zero_and_no_error() -> None:
    problem, candidate, exact = linear(3, 1)
    plain = problem.model

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        times = plain(points, conditions)
        times[:, 0] = np.nan
        return times

    density, error = with_lines(replace(problem, model=model), candidate)
    assert density[0] == -np.inf
    assert error == np.inf
    np.testing.assert_allclose(density[1:], exact[1:], atol=0.02)
