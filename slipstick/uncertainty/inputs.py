"""Normal inputs x = mean + L theta, theta ~ N(0, I) (section III.A), and the share of them outside a box."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtr
from scipy.stats import qmc

from slipstick.errors import InvalidValue


@dataclass(frozen=True, eq=False)
class Inputs:
    """d normal inputs in multiples of nominal: `mean` (d,) and either `std` (d,) or `mixing` (d, d).

    L is diag(std), or `mixing` as it stands. Its entries mix germs: entry (1, 2) is the paper's sigma12, which
    is no covariance; the covariance is L L^T. A std of 0 holds an input fixed. Raises `InvalidValue`.
    """

    mean: np.ndarray
    std: np.ndarray | None = None
    mixing: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Take lists as well as arrays, and check shapes and signs once."""
        for name in ("mean", "std", "mixing"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        if (self.std is None) == (self.mixing is None):
            raise InvalidValue("Inputs need either the std or the mixing matrix",
                               "Give `std` for independent inputs, or `mixing` for the whole matrix L")
        if self.mean.ndim != 1 or self.dimension == 0:
            raise InvalidValue(f"The mean has shape {self.mean.shape}", "Give one number an input")
        shape = (self.dimension,) * self._spread.ndim
        if self._spread.shape != shape or self._spread.ndim != (1 if self.mixing is None else 2):
            raise InvalidValue(f"The std or mixing matrix has shape {self._spread.shape}",
                               f"Match it to the {self.dimension} means: std (d,), mixing (d, d)")
        if not (np.all(np.isfinite(self.mean)) and np.all(np.isfinite(self._spread))):
            raise InvalidValue("A mean, std or mixing entry is not finite", "Give finite numbers")
        if self.std is not None and np.any(self.std < 0):
            raise InvalidValue("A std is negative", "Give a std of 0 or more")

    @property
    def _spread(self) -> np.ndarray:
        spread = self.std if self.mixing is None else self.mixing
        assert spread is not None
        return spread

    @property
    def dimension(self) -> int:
        """Number of inputs, d."""
        return len(self.mean)

    @property
    def matrix(self) -> np.ndarray:
        """The matrix L, shape (d, d)."""
        return np.diag(self._spread) if self.mixing is None else self._spread

    @property
    def marginal_std(self) -> np.ndarray:
        """Standard deviation of each input, shape (d,): the root of the diagonal of L L^T."""
        std: np.ndarray = np.sqrt(np.sum(self.matrix**2, axis=1))
        return std

    def points(self, germs: np.ndarray) -> np.ndarray:
        """Inputs at the germs (m, d): shape (m, d)."""
        points: np.ndarray = self.mean + np.einsum("mj,ij->mi", germs, self.matrix)
        return points


@lru_cache(maxsize=8)
def normal_germs(dimension: int, count: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points of N(0, I), shape (count, dimension), read-only; the same for the same seed.

    Raises `InvalidValue` unless `count` is a power of two: other counts of Sobol points are out of balance.
    """
    if count < 1 or count & (count - 1):
        raise InvalidValue(f"{count} samples are no power of two", "Take 1024, 2048, 4096 and so on")
    germs: np.ndarray = qmc.MultivariateNormalQMC(np.zeros(dimension), rng=seed).random(count)
    germs.flags.writeable = False
    return germs


def axis_mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Probability that each input by itself lies outside [lower, upper] (d,): shape (d,), exact."""
    std = inputs.marginal_std
    mass: np.ndarray = _below(lower - inputs.mean, std) + _below(inputs.mean - upper, std)
    return mass


def mass_outside(inputs: Inputs, lower: np.ndarray, upper: np.ndarray, germs: np.ndarray) -> float:
    """Probability that the inputs lie outside the box [lower, upper] (d,).

    Exact where L is diagonal. Else the share of the samples at `germs` (m, d), but never less than what one
    input by itself leaves outside.
    """
    axes = axis_mass_outside(inputs, lower, upper)
    if np.array_equal(inputs.matrix, np.diag(np.diag(inputs.matrix))):
        with np.errstate(divide="ignore"):  # log 0 where an input lies wholly outside
            return abs(float(np.expm1(np.sum(np.log1p(-np.minimum(axes, 1.0))))))
    return max(count_outside(inputs.points(germs), lower, upper) / len(germs), float(axes.max()))


def count_outside(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> int:
    """How many of the points (m, d) lie outside the box [lower, upper] (d,)."""
    return int(np.count_nonzero(np.any((points < lower) | (points > upper), axis=1)))


def _below(gap: np.ndarray, std: np.ndarray) -> np.ndarray:
    """P(std N(0, 1) < gap), where a std of 0 leaves all the mass at 0."""
    fixed = std == 0
    mass: np.ndarray = np.where(fixed, gap > 0, ndtr(gap / np.where(fixed, 1.0, std)))
    return mass
