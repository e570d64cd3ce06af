"""Germs, the standardised random variables of an expansion, and their orthonormal polynomials (Table I).

A germ xi has mean 0 and variance 1. Its polynomials obey the three-term recurrence

    sqrt(beta_{n+1}) P_{n+1} = (xi - alpha_n) P_n - sqrt(beta_n) P_{n-1},   P_0 = 1,

with alpha and beta from the distributions of chaospy. As their shapes grow, gamma and beta germs converge to the
normal germ, and their polynomials to the Hermite polynomials.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import scipy

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty.chaos import cornish_fisher

Orthogonal = Literal["hermite", "laguerre", "jacobi", "legendre"]

_SHAPES = {"hermite": (), "legendre": (), "laguerre": ("k",), "jacobi": ("a", "b")}
_LARGEST = 1e15  # largest shape parameter: above it the std is below the rounding error of the mean
_GAMMA_NORMAL, _BETA_NORMAL = 3e5, 1e6  # shapes above which the inverse functions of scipy err by up to 0.2 std
_LARGE, _ASYMMETRIC = 1e5, 1e3  # a beta shape above the first whose ratio to the other shape exceeds the second: ditto


@dataclass(frozen=True)
class Germ:
    """The standardised variable of one family, named after its polynomials.

    `hermite` is N(0, 1), `legendre` is uniform, `laguerre` is gamma with `shape` (k,), and `jacobi` is beta with
    `shape` (a, b), whose density before standardisation is x^(a-1) (1-x)^(b-1). Raises `InvalidValue`, `UnknownName`.
    """

    name: Orthogonal
    shape: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the name and the shape."""
        if self.name not in _SHAPES:
            raise UnknownName.of("family of polynomials", self.name, get_args(Orthogonal))
        symbols = _SHAPES[self.name]
        if len(self.shape) != len(symbols) or not all(0 < value <= _LARGEST for value in self.shape):
            raise InvalidValue(f"The shape of {self.name} is {self.shape}",
                               f"Give ({', '.join(symbols)}), each positive and at most {_LARGEST:.0e}")
        is_asymmetric = self.name == "jacobi" and max(self.shape) > max(_LARGE, _ASYMMETRIC * min(self.shape))
        if is_asymmetric and self.cornish_fisher_moments is None:
            raise InvalidValue(f"A beta variable of shape {self.shape} is far narrower than its support",
                               "Narrow the support about the mean, or take a gamma or normal variable")

    @cached_property
    def _distribution(self) -> tuple[Any, float]:
        """The variable before standardisation, and its mean; cached because chaospy caches its coefficients there."""
        import chaospy  # half a second, which the start of the service need not wait for

        match self.name:
            case "hermite":
                return chaospy.Normal(0, 1), 0.0
            case "legendre":
                return chaospy.Uniform(-1, 1), 0.0
            case "laguerre":
                return chaospy.Gamma(*self.shape), self.shape[0]
            case "jacobi":
                return chaospy.Beta(*self.shape), self.shape[0] / sum(self.shape)

    def recurrence(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The first `count` coefficients alpha and beta of the recurrence, shape (count,) each; beta_0 is 0."""
        distribution, mean = self._distribution
        raw_alpha, raw_beta = distribution.ttr(np.arange(max(count, 2)))
        alpha, beta = (raw_alpha - mean) / np.sqrt(raw_beta[1]), raw_beta / raw_beta[1]
        alpha[0] = beta[0] = 0.0  # exact for a standardised variable; chaospy errs in alpha_0 of a beta with a + b = 2
        return alpha[:count], beta[:count]

    @cached_property
    def cornish_fisher_moments(self) -> tuple[float, float] | None:
        """Skewness and excess kurtosis of a nearly normal germ, a gamma or beta germ of large shape; otherwise None."""
        match self.shape:
            case (k,) if k > _GAMMA_NORMAL:
                return 2 / np.sqrt(k), 6 / k
            case (a, b) if min(a, b) > _BETA_NORMAL:
                n = a + b
                skewness = 2 * (b - a) * np.sqrt(n + 1) / ((n + 2) * np.sqrt(a * b))
                excess = 6 * ((a - b) ** 2 * (n + 1) - a * b * (n + 2)) / (a * b * (n + 2) * (n + 3))
                return skewness, excess
        return None

    def of_normal(self, normals: np.ndarray) -> np.ndarray:
        """The increasing map from standard normals (any shape) to the germ, same shape.

        Each tail probability is computed from its own side, because 1 - p rounds to 1 beyond eight stds.
        """
        if self.cornish_fisher_moments is not None:
            return cornish_fisher.quantile(normals, *self.cornish_fisher_moments)
        germs: np.ndarray = normals
        special, below = scipy.special, normals < 0
        tail = special.ndtr(-np.abs(normals))
        match self.name:
            case "legendre":
                germs = np.sqrt(3.0) * np.sign(normals) * (1.0 - 2.0 * tail)
            case "laguerre":
                (k,) = self.shape
                germs = (np.where(below, special.gammaincinv(k, tail), special.gammainccinv(k, tail)) - k) / np.sqrt(k)
            case "jacobi":
                a, b = self.shape
                n = a + b
                std = np.sqrt(a * b / (n + 1)) / n
                germs = (np.where(below, special.betaincinv(a, b, tail), special.betainccinv(a, b, tail)) - a / n) / std
        return germs


def germs_from_normals(germs: tuple[Germ, ...], normals: np.ndarray) -> np.ndarray:
    """The d germs at standard normals (m, d), one germ per column: shape (m, d)."""
    return np.column_stack([germ.of_normal(column) for germ, column in zip(germs, normals.T, strict=True)])
