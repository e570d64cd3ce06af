"""The integral along lines and its functions compared with closed forms and with SciPy, and their machine code."""

import platform
import re
import warnings
from collections.abc import Callable
from itertools import pairwise

import numba
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erfcx
from scipy.stats import norm

from slipstick.uncertainty.likelihood import pieces
from slipstick.uncertainty.likelihood.exponential import exponential
from slipstick.uncertainty.likelihood.lines import (
    Lines,
    Moments,
    density_and_derivatives,
    density_and_moments,
    log10_density,
)

STRAIGHT = Lines(np.array([[-2e4, 2e4]]), np.zeros((1, 0)), np.zeros(1), np.eye(1))
"""A line with a single piece that covers all scores."""


def kinked(count: int = 3, conditions: int = 5) -> tuple[Lines, np.ndarray, np.ndarray]:
    """Lines in three dimensions with random breakpoints, the times on them, and measured times."""
    random = np.random.default_rng(1)
    breakpoints = np.sort(random.uniform(-4, 4, (count, 7)), axis=1)
    across, weight = random.standard_normal((count, 2)), random.dirichlet(np.ones(count))
    outputs = random.normal(0.5, 0.05, (count * 7, conditions))
    return Lines(breakpoints, across, np.log(weight), np.eye(3)), outputs, random.normal(0.5, 0.05, conditions)


def by_quadrature(quadrature: Lines, outputs: np.ndarray, time: float, noise: float, condition: int,
                  function: Callable[[np.ndarray, float], float] = lambda u, residual: 1.0) -> float:
    """The integral of function(u, residual) times the density, per ms, by adaptive quadrature along the lines."""
    total = 0.0
    for row, (points, across, log_weight) in enumerate(zip(quadrature.breakpoints, quadrature.across,
                                                           quadrature.log_weight, strict=True)):
        values = outputs.reshape(*quadrature.breakpoints.shape, -1)[row, :, condition]

        def density(z: float, points: np.ndarray = points, across: np.ndarray = across,
                    values: np.ndarray = values) -> float:
            y = np.interp(z, points, values)
            return float(norm.pdf(z) * norm.pdf(time, y, noise) / 1e3 * function(np.array([z, *across]), time - y))

        pieces = [quad(density, low, high, epsabs=0, epsrel=1e-9, limit=200)[0]
                  for low, high in pairwise(points)]
        total += float(np.exp(log_weight)) * sum(pieces)
    return total


@pytest.mark.parametrize("noise", [1e-12, 1e-6, 1e-3, 0.05, 10.0])
@pytest.mark.parametrize("distance", [0.0, 1.0, 30.0, 1e4])
def test_a_straight_line_has_a_normal_density(noise: float, distance: float) -> None:
    """For very small noise, and up to ten thousand stds from the mean, where the density is 10^-20,000,000."""
    slope = np.array([0.0, 1e-6, 1e-3, -0.2, 5.0])
    std = np.hypot(slope, noise)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        density = log10_density(STRAIGHT, STRAIGHT.breakpoints.T * slope, distance * std, noise)
    expected = norm.logpdf(distance) / np.log(10) - np.log10(1e3 * std)
    np.testing.assert_allclose(density, expected, rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_kinked_lines_agree_with_quadrature(noise: float) -> None:
    quadrature, outputs, times = kinked()
    expected = [np.log10(by_quadrature(quadrature, outputs, time, noise, i)) for i, time in enumerate(times)]
    np.testing.assert_allclose(log10_density(quadrature, outputs, times, noise), expected, atol=1e-9)


def test_moments_agree_with_quadrature() -> None:
    quadrature, outputs, times = kinked()
    noise = 0.03
    density, moments = density_and_moments(quadrature, outputs, times, noise)
    np.testing.assert_array_equal(density, log10_density(quadrature, outputs, times, noise))
    for i, time in enumerate(times[:2]):
        total = by_quadrature(quadrature, outputs, time, noise, i)

        def conditional_mean(function: Callable[[np.ndarray, float], float], i: int = i, time: float = time,
                             total: float = total) -> float:
            return by_quadrature(quadrature, outputs, time, noise, i, function) / total

        np.testing.assert_allclose(moments.residual[i], conditional_mean(lambda u, residual: residual**2), rtol=1e-8)
        for a in range(3):
            np.testing.assert_allclose(moments.first[i, a], conditional_mean(lambda u, _, a=a: u[a]), atol=1e-8)
            for b in range(a, 3):
                expected = conditional_mean(lambda u, _, a=a, b=b: u[a] * u[b])
                np.testing.assert_allclose(moments.second[i, [a, b], [b, a]], expected, atol=1e-8)


@pytest.mark.parametrize("noise", [1e-9, 1e-3, 0.3])
@pytest.mark.parametrize("distance", [0.0, 5.0, 300.0])
def test_moments_of_a_straight_line_are_those_of_a_normal_variable(noise: float, distance: float) -> None:
    """Given the time t of the line y = b z, z is normal with mean b t / (s^2 + b^2) and variance s^2 / (s^2 + b^2)."""
    slope = np.array([0.3, -0.01])
    total = slope**2 + noise**2
    times = distance * np.sqrt(total)
    moments: Moments = density_and_moments(STRAIGHT, STRAIGHT.breakpoints.T * slope, times, noise)[1]
    mean, variance = slope * times / total, noise**2 / total
    np.testing.assert_allclose(moments.first[:, 0], mean, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(moments.second[:, 0, 0], mean**2 + variance, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(moments.residual, (times - slope * mean) ** 2 + slope**2 * variance, rtol=1e-4,
                               atol=1e-12)


def test_derivatives_agree_with_differences() -> None:
    """With respect to each time on the lines and to the noise; the derivative with respect to NaN is 0."""
    quadrature, outputs, times = kinked()
    outputs[4, 1] = np.nan
    for noise in (0.05, 0.002):
        density, derivatives, by_noise = density_and_derivatives(quadrature, outputs, times, noise)
        np.testing.assert_array_equal(density, log10_density(quadrature, outputs, times, noise))
        step = 1e-4 * noise
        ends = [log10_density(quadrature, outputs, times, noise * np.exp(side * 1e-4)) for side in (1, -1)]
        np.testing.assert_allclose(by_noise, (ends[0] - ends[1]) * np.log(10) / 2e-4, rtol=1e-5, atol=1e-5)
        for row in range(len(outputs)):
            moved = np.zeros(outputs.shape)
            moved[row] = step
            ends = [log10_density(quadrature, outputs + side * moved, times, noise) for side in (1, -1)]
            expected = (ends[0] - ends[1]) * np.log(10) / (2 * step)
            np.testing.assert_allclose(derivatives[row], expected, rtol=1e-4, atol=1e-4 * np.abs(derivatives).max())


def test_additional_breakpoints_do_not_change_a_straight_line() -> None:
    random = np.random.default_rng(2)
    inner = np.sort(np.concatenate([random.uniform(-2e4, 2e4, 100), random.normal(0, 2, 100), [0.0, 0.0, 1e-15]]))
    breakpoints = np.concatenate([[-2e4], inner, [2e4]])[None]
    cut = Lines(breakpoints, np.zeros((1, 0)), np.zeros(1), np.eye(1))
    slope, times = np.array([0.0, 0.1, -2.0]), np.array([0.3, 3.0, -0.5])
    for noise in (1e-3, 1.0):
        expected = density_and_moments(STRAIGHT, STRAIGHT.breakpoints.T * slope, times, noise)
        pieces = density_and_moments(cut, breakpoints.T * slope, times, noise)
        np.testing.assert_allclose(pieces[0], expected[0], rtol=1e-9)
        np.testing.assert_allclose(pieces[1].first, expected[1].first, rtol=1e-7, atol=1e-11)


def test_a_piece_with_nan_at_either_end_has_a_density_of_zero() -> None:
    quadrature = Lines(np.array([[-9.0, -1.0, 1.0, 9.0]]), np.zeros((1, 0)), np.zeros(1), np.eye(1))
    outputs = np.array([[0.5, 0.5, np.nan], [0.5, np.nan, np.nan], [0.5, 0.5, np.nan], [0.5, 0.5, np.nan]])
    density, moments = density_and_moments(quadrature, outputs, np.full(3, 0.5), 0.01)
    np.testing.assert_allclose(density[1] - density[0], np.log10(norm.sf(1.0)), rtol=1e-12)
    assert density[2] == -np.inf
    assert np.isnan(moments.first[2]).all()
    assert np.isfinite(moments.first[:2]).all()


def test_conditions_are_independent() -> None:
    """The result of a condition does not depend on the other conditions or on the threads."""
    quadrature, outputs, times = kinked(conditions=300)
    together = density_and_moments(quadrature, outputs, times, 0.02)
    for i in (0, 63, 64, 299):
        single = density_and_moments(quadrature, outputs[:, [i]], times[[i]], 0.02)
        assert single[0] == together[0][i]
        np.testing.assert_array_equal(single[1].second[0], together[1].second[i])


def test_scores_are_listed_line_by_line() -> None:
    factor = np.array([[1.0, 2.0], [3.0, 4.0]])
    quadrature = Lines(np.array([[10.0, 20.0], [30.0, 40.0]]), np.array([[1.0], [2.0]]), np.zeros(2), factor)
    np.testing.assert_array_equal(quadrature.scores, [[12, 34], [22, 64], [34, 98], [44, 128]])


# The functions of the compiled integrals over pieces compared with SciPy, and their machine code.


def test_the_exponential_is_that_of_numpy() -> None:
    x = np.concatenate([np.linspace(-500.0, 0.0, 20001), -np.logspace(-20, 0, 101)])
    np.testing.assert_allclose([exponential(value) for value in x], np.exp(x), rtol=4e-16)
    assert exponential(1e-3) == 1.0
    assert exponential(-1e300) == exponential(np.nan) == exponential(-500.0) > 0


def test_the_mills_ratio_is_that_of_scipy() -> None:
    x = np.concatenate([np.linspace(0.0, 40.0, 4001), np.logspace(-9, 12, 400)])
    ratios = [pieces._mills(pieces._SCALE / (pieces._SCALE + value)) for value in x]
    np.testing.assert_allclose(ratios, np.sqrt(np.pi / 2) * erfcx(x / np.sqrt(2)), rtol=1e-13)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 assembly")
@pytest.mark.parametrize("name", ["_place", "_integrate", "_moments", "_differentiate"])
def test_the_loops_are_compiled_to_vector_instructions(name: str) -> None:
    """A loss of vectorization is silent, and costs a factor of about eight."""
    arguments = {"_place": (0.1, 0.6, 0.0, 1e-4), "_integrate": (0.1, 0.6, 1e-4), "_moments": (0.1, 0.6),
                 "_differentiate": (0.1, 0.6, 1.0)}[name]
    function = numba.njit(error_model="numpy", fastmath={"contract"})(getattr(pieces, name).py_func)
    function(np.ones(pieces.WORK), *arguments)
    assert re.search(r"v?mulpd\s", "".join(function.inspect_asm().values()))
