"""Integrals along the lines, compared with quadrature of the model times the density of the inputs."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.special import logsumexp, roots_hermitenorm, roots_legendre
from scipy.stats import multivariate_normal, norm

from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood.line_rules import WINDOW, along, knotted_lines
from slipstick.uncertainty.likelihood.lines import Lines, log10_density

KNOTS = (np.array([0.5, 0.7, 0.9, 0.96, 1.0, 1.05, 1.2, 1.5]), np.array([0.5, 0.8, 1.0, 1.1, 1.3, 1.5]))
SUPPORT = np.array([[0.4, 1.6]] * 2)
Model = Callable[[np.ndarray], np.ndarray]


def table(conditions: int = 3) -> Model:
    """A table with kinks at the knots, steeper along the second input, and clipped at the edges."""
    random = np.random.default_rng(4)
    first, second = np.meshgrid(*KNOTS, indexing="ij")
    times = 0.5 + np.multiply.outer(0.1 * first - 0.15 * second, random.uniform(0.5, 1.5, conditions))
    times += random.uniform(-0.01, 0.01, times.shape)
    interpolator = RegularGridInterpolator(KNOTS, times)
    return lambda points: interpolator(np.clip(points, 0.5, 1.5))


def curved(points: np.ndarray) -> np.ndarray:
    """A smooth model of up to three inputs."""
    weights = np.array([[0.10, -0.15, 0.05], [0.05, 0.20, 0.10]])[:, :points.shape[1]]
    return 0.5 + np.expm1((points - 1.0) @ weights.T) + 0.2 * ((points - 1.0) ** 2 @ weights.T)


def pieces(low: float, high: float, knots: np.ndarray, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights between the knots, on pieces of at most the width `widest`."""
    roots, root_weights = roots_legendre(8)
    nodes, weights = [], []
    for left, right in pairwise(np.concatenate([[low], knots[(knots > low) & (knots < high)], [high]])):
        edges = np.linspace(left, right, int(np.ceil((right - left) / widest)) + 1)
        half = np.diff(edges) / 2
        nodes.append((edges[:-1, None] + half[:, None] * (1 + roots)).ravel())
        weights.append((half[:, None] * root_weights).ravel())
    return np.concatenate(nodes), np.concatenate(weights)


def by_quadrature(inputs: Inputs, model: Model, times: np.ndarray, noise: float) -> np.ndarray:
    """log10 p per ms by composite quadrature over the plane of normal scores, with breakpoints at the knots."""
    rules = [pieces(-8.0, 8.0, inputs.scores(axis, KNOTS[axis]), 0.25) for axis in range(2)]
    values = [inputs.at_scores(np.column_stack([nodes, nodes]))[:, axis] for axis, (nodes, _) in enumerate(rules)]
    points, scores = (np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
                      for axes in (values, [nodes for nodes, _ in rules]))
    log_weight = np.log(np.outer(rules[0][1], rules[1][1])).ravel()
    log_weight += multivariate_normal(np.zeros(2), inputs.factor @ inputs.factor.T).logpdf(scores)
    logs = norm.logpdf(1e3 * times, 1e3 * model(points), 1e3 * noise)
    expected: np.ndarray = logsumexp(logs + log_weight[:, None], axis=0) / np.log(10)
    return expected


def by_lines(quadrature: Lines, inputs: Inputs, model: Model, times: np.ndarray, noise: float) -> np.ndarray:
    return log10_density(quadrature, model(inputs.at_scores(quadrature.scores)), times, noise)


def slopes(inputs: Inputs, model: Model) -> np.ndarray:
    steps = np.eye(inputs.dimension)
    return (model(inputs.at_scores(steps)) - model(inputs.at_scores(-steps))) / 2


def measured(inputs: Inputs, model: Model) -> np.ndarray:
    """Times at the scores 0, 1.5 and -3."""
    scores = np.array([0.0, 1.5, -3.0])[:, None] * np.ones(inputs.dimension)
    return np.diagonal(model(inputs.at_scores(scores)))


PAIRS: dict[str, dict[str, Any]] = {
    "independent": {"std": [0.04, 0.06]},
    "narrow": {"std": [0.002, 0.004]},
    "wider than the table": {"std": [0.3, 0.3]},
    "unequal stds": {"std": [0.002, 0.3]},
    "correlated": {"std": [0.05, 0.04], "correlation": [[1.0, 0.8], [0.8, 1.0]]},
    "other families": {"std": [0.08, 0.1], "families": ("gamma", "beta"), "support": SUPPORT},
    "copula": {"std": [0.08, 0.1], "families": ("lognormal", "uniform"), "correlation": [[1.0, -0.7], [-0.7, 1.0]]},
}


@pytest.mark.parametrize("pair", PAIRS)
def test_knotted_lines_integrate_the_table_itself(pair: str) -> None:
    """The error is about 10^-4 decades for inputs that are not normal, because they are not linear in their scores."""
    inputs, model, noise = Inputs([1.01, 1.03], **PAIRS[pair]), table(), 0.005
    times = measured(inputs, model)
    quadrature = knotted_lines(inputs, KNOTS, slopes(inputs, model), noise, 8.0)
    tolerance = 3e-4 if "families" in PAIRS[pair] else 1e-5
    np.testing.assert_allclose(by_lines(quadrature, inputs, model, times, noise),
                               by_quadrature(inputs, model, times, noise), atol=tolerance)


def test_knotted_lines_of_one_input() -> None:
    inputs, noise = Inputs([1.02], [0.06]), 0.003
    values = np.random.default_rng(2).uniform(0.4, 0.6, len(KNOTS[0]))
    times = np.array([0.45, 0.5, 0.62])

    def model(points: np.ndarray) -> np.ndarray:
        return np.interp(points, KNOTS[0], values) * np.ones(len(times))

    quadrature = knotted_lines(inputs, KNOTS[:1], slopes(inputs, model), noise, 8.0)
    nodes, weights = pieces(-9.0, 9.0, inputs.scores(0, KNOTS[0]), 0.02)
    logs = norm.logpdf(1e3 * times, 1e3 * model(inputs.at_scores(nodes[:, None])), 1e3 * noise)
    expected = logsumexp(logs + (norm.logpdf(nodes) + np.log(weights))[:, None], axis=0) / np.log(10)
    np.testing.assert_allclose(by_lines(quadrature, inputs, model, times, noise), expected, atol=1e-8)


def test_an_input_with_a_std_of_zero_is_the_limit_of_a_small_std() -> None:
    model, times = table(), np.array([0.45, 0.5, 0.52])
    for std in ([0.05, 0.0], [0.0, 0.05]):
        fixed, narrow = (
            by_lines(knotted_lines(inputs, KNOTS, slopes(inputs, model), 0.004, 8.0), inputs, model, times, 0.004)
            for inputs in (Inputs([1.01, 1.03], std), Inputs([1.01, 1.03], np.maximum(std, 1e-9))))
        np.testing.assert_allclose(fixed, narrow, atol=1e-6)


@pytest.mark.parametrize("pair", PAIRS)
def test_the_weights_of_knotted_lines_sum_to_one(pair: str) -> None:
    """For constant times and a residual of 0, the integral is the peak of the noise density."""
    inputs = Inputs([1.01, 1.03], **PAIRS[pair])
    quadrature = knotted_lines(inputs, KNOTS, slopes(inputs, table()), 0.01, 8.0)
    flat = np.zeros((quadrature.breakpoints.size, 1))
    peak = norm.logpdf(0.0, scale=10.0) / np.log(10)
    np.testing.assert_allclose(log10_density(quadrature, flat, np.zeros(1), 0.01), peak, atol=1e-7)


@pytest.mark.parametrize("count", [64, 1024])
@pytest.mark.parametrize("dimension", [1, 2, 3, 7])
def test_lines_along_a_direction_have_unit_weight_and_the_given_correlation(dimension: int, count: int) -> None:
    random = np.random.default_rng(dimension)
    direction, factor = random.standard_normal(dimension), np.tril(random.uniform(0.2, 1.0, (dimension, dimension)))
    direction /= np.linalg.norm(direction)
    quadrature = along(direction, factor, count=count)
    np.testing.assert_allclose(quadrature.factor @ quadrature.factor.T, factor @ factor.T, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.linalg.solve(factor, quadrature.factor)[:, 0]), np.abs(direction), atol=1e-12)
    flat, peak = np.zeros((quadrature.breakpoints.size, 1)), norm.logpdf(0.0, scale=10.0) / np.log(10)
    np.testing.assert_allclose(log10_density(quadrature, flat, np.zeros(1), 0.01), peak, atol=1e-7)
    assert -quadrature.breakpoints[0, 0] == quadrature.breakpoints[0, -1] == WINDOW
    assert along(direction, factor, 7.2, count).breakpoints[0, -1] >= 7.2


@pytest.mark.parametrize(("dimension", "coarse", "fine"), [(1, 2e-4, 1e-5), (2, 2e-4, 1e-5), (3, 3e-3, 3e-4)])
def test_lines_along_a_direction_converge_for_a_smooth_model(dimension: int, coarse: float, fine: float) -> None:
    """The reference is a Gauss rule of 60 nodes per axis, which resolves the noise."""
    inputs, noise = Inputs(np.full(dimension, 1.05), np.array([0.08, 0.06, 0.10])[:dimension]), 0.02
    roots, root_weights = roots_hermitenorm(60)
    nodes, weights = (np.stack(np.meshgrid(*[axis] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
                      for axis in (roots, root_weights / root_weights.sum()))
    times = np.array([0.52, 0.50])
    logs = norm.logpdf(1e3 * times, 1e3 * curved(inputs.at_scores(nodes)), 1e3 * noise)
    expected = logsumexp(logs, axis=0, b=weights.prod(axis=1)[:, None]) / np.log(10)
    slope = slopes(inputs, curved).sum(axis=1)
    for count, tolerance in ((64, coarse), (1024, fine)):
        quadrature = along(slope / np.linalg.norm(slope), inputs.factor, count=count)
        np.testing.assert_allclose(by_lines(quadrature, inputs, curved, times, noise), expected, atol=tolerance)
