"""Uncertain inputs as functions of independent standard normals u (section III.A, Table I).

    z = C u,    x_i = Q_i(z_i)

z are the normal scores of the inputs, C is the Cholesky factor of their correlation, and Q_i maps the score of input i
to its value according to the family of the input. This is a Gaussian copula (Nataf 1962). For normal inputs it reduces
to x = mean + L u of the paper, with L = diag(std) C.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.families import (
    FAMILIES,
    HERMITE,
    LARGEST,
    POSITIVE,
    Family,
    beta_shape,
    from_score,
    germ_of,
    to_score,
)
from slipstick.uncertainty.chaos.germs import Germ


@dataclass(frozen=True, eq=False)
class Inputs:
    """d inputs in multiples of nominal, given by `mean` (d,) and either `std` (d,) or `mixing` (d, d).

    `families` has one entry per input; the default is normal. `support` (d, 2) holds the bounds of beta inputs.
    `correlation` (d, d) is the correlation of the normal scores, and thus of the inputs if these are normal. `mixing`
    is the matrix L itself, for normal inputs only. Its entry (1, 2) is sigma12 of the paper, which is not a
    covariance: the covariance is L L^T. An input with a std of 0 is fixed. Raises `InvalidValue`.
    """

    mean: np.ndarray
    std: np.ndarray | None = None
    mixing: np.ndarray | None = None
    families: tuple[Family, ...] = ()
    correlation: np.ndarray | None = None
    support: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Convert lists to arrays, and check shapes, signs and families."""
        for name in ("mean", "std", "mixing", "correlation", "support"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        object.__setattr__(self, "families", tuple(self.families) or ("normal",) * self.mean.size)
        self._check_shapes()
        if self.correlation is not None:
            self._check_correlation()
        for index, family in enumerate(self.families):
            self._check_family(index, family)

    @property
    def dimension(self) -> int:
        """Number of inputs, d."""
        return len(self.mean)

    @cached_property
    def marginal_std(self) -> np.ndarray:
        """Standard deviation of each input, shape (d,)."""
        if self.mixing is None:
            assert self.std is not None
            return self.std
        return split_mixing(self.mixing)[0]

    @cached_property
    def factor(self) -> np.ndarray:
        """The matrix C of z = C u, shape (d, d)."""
        if self.mixing is not None:
            return split_mixing(self.mixing)[1]
        return np.eye(self.dimension) if self.correlation is None else np.linalg.cholesky(self.correlation)

    @cached_property
    def independent(self) -> bool:
        """Whether the inputs are mutually independent."""
        return bool(np.array_equal(self.factor, np.diag(np.diag(self.factor))))

    @cached_property
    def germs(self) -> tuple[Germ, ...]:
        """The germ of each input; dependent inputs have standard normal germs."""
        if not self.independent:
            return (HERMITE,) * self.dimension
        return tuple(germ_of(family, *self._moments(index)) for index, family in enumerate(self.families))

    def points(self, normals: np.ndarray) -> np.ndarray:
        """Inputs at the standard normals (m, d): shape (m, d)."""
        has_unit_factor = self.independent and self.mixing is None
        return self.at_scores(normals if has_unit_factor else np.einsum("mj,ij->mi", normals, self.factor))

    def at_scores(self, scores: np.ndarray) -> np.ndarray:
        """Inputs at their normal scores (m, d): shape (m, d)."""
        if set(self.families) == {"normal"}:
            return np.asarray(self.mean + self.marginal_std * scores)
        return np.column_stack([from_score(family, scores[:, index], *self._moments(index))
                                for index, family in enumerate(self.families)])

    def germs_of(self, normals: np.ndarray) -> np.ndarray:
        """The germs at the standard normals (m, d): shape (m, d)."""
        return np.column_stack([germ.of_normal(normals[:, index]) for index, germ in enumerate(self.germs)])

    def at_germs(self, germs: np.ndarray) -> np.ndarray:
        """Inputs at the germs (m, d): shape (m, d)."""
        is_linear = np.array([germ != HERMITE for germ in self.germs])  # x = mean + std xi
        points: np.ndarray = self.mean + self.marginal_std * germs
        return points if np.all(is_linear) else np.where(is_linear, points,
                                                         self.points(np.where(is_linear, 0.0, germs)))

    def scores(self, index: int, values: np.ndarray) -> np.ndarray:
        """Normal scores of values (m,) of the input `index`, whose std is positive: shape (m,)."""
        return to_score(self.families[index], values, *self._moments(index))

    def _moments(self, index: int) -> tuple[float, float, np.ndarray]:
        support = np.array([-np.inf, np.inf]) if self.support is None else self.support[index]
        return float(self.mean[index]), float(self.marginal_std[index]), support

    def _check_shapes(self) -> None:
        if (self.std is None) == (self.mixing is None):
            raise InvalidValue("Inputs need either the std or the mixing matrix",
                               "Give `std` for independent inputs, or `mixing` for the full matrix L")
        if self.mean.ndim != 1 or self.dimension == 0:
            raise InvalidValue(f"The mean has shape {self.mean.shape}", "Give one number per input")
        d = self.dimension
        for name, shape in (("std", (d,)), ("mixing", (d, d)), ("correlation", (d, d)), ("support", (d, 2))):
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise InvalidValue(f"The {name} has shape {array.shape}, not {shape}", f"Match it to the {d} means")
            if array is not None and not np.all(np.isfinite(array)):
                raise InvalidValue(f"An entry of the {name} is not finite", "Give finite numbers")
        if not np.all(np.isfinite(self.mean)):
            raise InvalidValue("A mean is not finite", "Give finite numbers")
        for name in ("mean", "std", "mixing"):
            array = getattr(self, name)
            if array is not None and np.any(np.abs(array) > LARGEST):
                raise InvalidValue(f"An entry of the {name} is {np.abs(array).max():g} multiples of nominal",
                                   f"Give numbers up to {LARGEST:g}")
        if self.std is not None and np.any(self.std < 0):
            index = int(np.argmax(self.std < 0))
            raise InvalidValue(f"The std of input {index} is {self.std[index]:g}, which is negative",
                               "Give a std of 0 or more; inputs are numbered from 0")
        if len(self.families) != d:
            raise InvalidValue(f"There are {len(self.families)} families for {d} inputs",
                               "Give one family per input, or none")

    def _check_correlation(self) -> None:
        if self.mixing is not None:
            raise InvalidValue("The mixing matrix already contains the correlation", "Give `std` and `correlation`")
        assert self.correlation is not None
        symmetric = np.allclose(self.correlation, self.correlation.T, atol=1e-12)
        if not (symmetric and np.allclose(np.diag(self.correlation), 1.0, atol=1e-12)):
            raise InvalidValue("The correlation is not symmetric with ones on its diagonal",
                               "Give the correlation of the normal scores, not a covariance")
        if np.linalg.eigvalsh(self.correlation)[0] <= 0:
            raise InvalidValue("The correlation matrix is not positive definite",
                               "Give correlations that are possible together, each between -1 and 1")

    def _check_family(self, index: int, family: Family) -> None:
        mean, std = self.mean[index], self.marginal_std[index]
        if family not in FAMILIES:
            raise InvalidValue(f"There is no family '{family}'", f"Choose among {', '.join(FAMILIES)}")
        if family != "normal" and self.mixing is not None:
            raise InvalidValue(f"A mixing matrix describes normal inputs, not {family} inputs",
                               "Give `std`, and `correlation` if the inputs are dependent")
        if family in POSITIVE and mean <= 0:
            raise InvalidValue(f"The mean of a {family} input is {mean:g}", "Give a positive mean")
        if family in POSITIVE and std > LARGEST * mean:
            raise InvalidValue(f"The std of a {family} input is {std / mean:g} times its mean",
                               f"Give a std of up to {LARGEST:g} times the mean")
        if family != "beta":
            return
        *_, support = self._moments(index)
        low, high = support
        if not (np.isfinite([low, high]).all() and low < mean < high):
            raise InvalidValue(f"A beta input with mean {mean:g} cannot have the support {low:g} to {high:g}",
                               "Give a `support` (lower, upper) around the mean")
        if std > 0 and min(beta_shape(mean, std, support)) <= 0:
            largest = np.sqrt((mean - low) * (high - mean))
            raise InvalidValue(f"No beta input from {low:g} to {high:g} with mean {mean:g} has the std {std:g}",
                               f"Give a std below {largest:.4g}, or a wider support")


def split_mixing(mixing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split L = diag(std) C: standard deviations (d,) of the inputs, and C (d, d), whose correlation is C C^T."""
    std: np.ndarray = np.sqrt(np.sum(mixing**2, axis=1))
    return std, mixing / np.where(std == 0, 1.0, std)[:, None]
