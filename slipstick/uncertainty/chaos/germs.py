"""Germs: the standardised random variables in which expansions live, and their orthonormal polynomials (Table I).

A germ xi has mean 0 and variance 1, so that an input is mean + std xi whatever its family. Its polynomials follow

    sqrt(beta_{n+1}) P_{n+1} = (xi - alpha_n) P_n - sqrt(beta_n) P_{n-1},   P_0 = 1,

with alpha and beta from chaospy's distributions. Gamma and beta germs tend to the normal one as their shapes grow, and
their polynomials to Hermite's.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from chaospy import Beta, Distribution, Gamma, Normal, Uniform
from scipy.special import betainccinv, betaincinv, gammainccinv, gammaincinv, ndtr

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty.chaos import cornish_fisher

Orthogonal = Literal["hermite", "laguerre", "jacobi", "legendre"]

_SHAPES = {"hermite": (), "legendre": (), "laguerre": ("k",), "jacobi": ("a", "b")}
_LARGEST = 1e15  # the std is then lost in the rounding of the mean
_GAMMA_NORMAL, _BETA_NORMAL = 3e5, 1e6  # from here on scipy's inverses go wrong, by up to 0.2 std
_WIDE, _LOPSIDED = 1e5, 1e3  # as do those of a beta with a shape above the first and the other this many times smaller


@dataclass(frozen=True)
class Germ:
    """The standardised variable of one family, named by its polynomials.

    `hermite` is N(0, 1), `legendre` uniform, `laguerre` gamma of `shape` (k,), and `jacobi` beta of `shape` (a, b),
    of density x^(a-1) (1-x)^(b-1) before it is standardised. Raises `InvalidValue`, `UnknownName`.
    """

    name: Orthogonal
    shape: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the shape once."""
        if self.name not in _SHAPES:
            raise UnknownName.of("family of polynomials", self.name, get_args(Orthogonal))
        wanted = _SHAPES[self.name]
        if len(self.shape) != len(wanted) or not all(0 < value <= _LARGEST for value in self.shape):
            raise InvalidValue(f"The shape of {self.name} is {self.shape}",
                               f"Give ({', '.join(wanted)}), each positive and at most {_LARGEST:.0e}")
        lopsided = self.name == "jacobi" and max(self.shape) > max(_WIDE, _LOPSIDED * min(self.shape))
        if lopsided and self.nearly_normal is None:
            raise InvalidValue(f"A beta variable of shape {self.shape} is far narrower than its support",
                               "Narrow the support about the mean, or take a gamma or normal variable")

    @cached_property
    def _distribution(self) -> tuple[Distribution, float]:
        """The variable before it is standardised, which keeps the coefficients it has worked out, and its mean."""
        match self.name:
            case "hermite":
                return Normal(0, 1), 0.0
            case "legendre":
                return Uniform(-1, 1), 0.0
            case "laguerre":
                return Gamma(*self.shape), self.shape[0]
            case "jacobi":
                return Beta(*self.shape), self.shape[0] / sum(self.shape)

    def recurrence(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The first `count` coefficients alpha and beta of the recurrence, shape (count,) each; beta_0 is 0."""
        distribution, mean = self._distribution
        steps, squares = distribution.ttr(np.arange(max(count, 2)))
        alpha, beta = (steps - mean) / np.sqrt(squares[1]), squares / squares[1]
        alpha[0] = beta[0] = 0.0  # by the standardisation; chaospy's alpha_0 of a beta with a + b = 2 is wrong
        return alpha[:count], beta[:count]

    @cached_property
    def nearly_normal(self) -> tuple[float, float] | None:
        """Skewness and excess kurtosis of a gamma or beta germ whose shape is so large that they say all."""
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
        """The germ at the quantiles of standard normals (any shape): the same shape, rising with them.

        Each tail is measured from its own end: beyond eight stds 1 - p rounds to 1.
        """
        if self.nearly_normal is not None:
            return cornish_fisher.quantile(normals, *self.nearly_normal)
        germs: np.ndarray = normals
        tail = ndtr(-np.abs(normals))
        match self.name:
            case "legendre":
                germs = np.sqrt(3.0) * np.sign(normals) * (1.0 - 2.0 * tail)
            case "laguerre":
                (k,) = self.shape
                germs = (np.where(normals < 0, gammaincinv(k, tail), gammainccinv(k, tail)) - k) / np.sqrt(k)
            case "jacobi":
                a, b = self.shape
                n = a + b
                std = np.sqrt(a * b / (n + 1)) / n
                germs = (np.where(normals < 0, betaincinv(a, b, tail), betainccinv(a, b, tail)) - a / n) / std
        return germs


def germs_from_normals(germs: tuple[Germ, ...], normals: np.ndarray) -> np.ndarray:
    """The d germs at standard normals (m, d), one germ a column: shape (m, d)."""
    return np.column_stack([germ.of_normal(column) for germ, column in zip(germs, normals.T, strict=True)])
