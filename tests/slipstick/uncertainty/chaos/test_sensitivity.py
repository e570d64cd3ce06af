"""Moments and Sobol indices of functions with closed-form values."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest

from slipstick.uncertainty.chaos import ExpansionSettings, Germ, expand, make_basis, sensitivity


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
