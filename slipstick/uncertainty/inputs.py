"""Uncertain inputs as functions of independent standard normals normals (section III.A, Table I).

    z = C normals,    x_i = Q_i(z_i)

Q_i is the family of input i as a map from a normal score, C the Cholesky factor of the scores' correlation: a
Gaussian copula (Nataf 1962), and for normal inputs the paper's x = mean + L normals with L = diag(std) C.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.families import (
    FAMILIES,
    HERMITE,
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
    """d inputs in multiples of nominal: `mean` (d,) and either `std` (d,) or `mixing` (d, d), L as it stands.

    `families`, one an input, are normal unless said otherwise; `support` (d, 2) is that of beta inputs.
    `correlation` (d, d) is that of the normal scores, and of the inputs where they are normal. The entries of
    `mixing`, for normal inputs only, mix germs: entry (1, 2) is the paper's sigma12, which is no covariance; the
    covariance is L L^T. A std of 0 holds an input fixed. Raises `InvalidValue`.
    """

    mean: np.ndarray
    std: np.ndarray | None = None
    mixing: np.ndarray | None = None
    families: tuple[Family, ...] = ()
    correlation: np.ndarray | None = None
    support: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Take lists as well as arrays, and check shapes, signs and families once."""
        for name in ("mean", "std", "mixing", "correlation", "support"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        object.__setattr__(self, "families", tuple(self.families) or ("normal",) * self.mean.size)
        self._check_shapes()
        if self.correlation is not None:
            self._check_correlation()
        for number, family in enumerate(self.families):
            self._check_family(number, family)

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
        std: np.ndarray = np.sqrt(np.sum(self.mixing**2, axis=1))
        return std

    @cached_property
    def factor(self) -> np.ndarray:
        """The matrix C of z = C normals, shape (d, d)."""
        if self.mixing is not None:
            std = np.where(self.marginal_std == 0, 1.0, self.marginal_std)
            factor: np.ndarray = self.mixing / std[:, None]
            return factor
        return np.eye(self.dimension) if self.correlation is None else np.linalg.cholesky(self.correlation)

    @cached_property
    def independent(self) -> bool:
        """Whether each input has a germ of its own."""
        return bool(np.array_equal(self.factor, np.diag(np.diag(self.factor))))

    @cached_property
    def germs(self) -> tuple[Germ, ...]:
        """The germ of each input; standard normals where the inputs depend on one another."""
        if not self.independent:
            return (HERMITE,) * self.dimension
        return tuple(germ_of(family, *self._moments(number)) for number, family in enumerate(self.families))

    def points(self, normals: np.ndarray) -> np.ndarray:
        """Inputs at the standard normals (m, d): shape (m, d)."""
        own = self.independent and self.mixing is None
        return self.at_scores(normals if own else np.einsum("mj,ij->mi", normals, self.factor))

    def at_scores(self, scores: np.ndarray) -> np.ndarray:
        """Inputs at their normal scores (m, d): shape (m, d)."""
        if set(self.families) == {"normal"}:
            points: np.ndarray = self.mean + self.marginal_std * scores
            return points
        return np.column_stack([from_score(family, scores[:, number], *self._moments(number))
                                for number, family in enumerate(self.families)])

    def germs_of(self, normals: np.ndarray) -> np.ndarray:
        """The germs at the standard normals (m, d): shape (m, d)."""
        return np.column_stack([germ.of_normal(normals[:, number]) for number, germ in enumerate(self.germs)])

    def at_germs(self, germs: np.ndarray) -> np.ndarray:
        """Inputs at the germs (m, d): shape (m, d)."""
        own = np.array([germ != HERMITE for germ in self.germs])  # of these, x = mean + std xi
        points: np.ndarray = self.mean + self.marginal_std * germs
        return points if np.all(own) else np.where(own, points, self.points(np.where(own, 0.0, germs)))

    def scores(self, number: int, values: np.ndarray) -> np.ndarray:
        """Normal scores of values (m,) of one input with a positive std: shape (m,)."""
        return to_score(self.families[number], values, *self._moments(number))

    def _moments(self, number: int) -> tuple[float, float, np.ndarray]:
        support = np.array([-np.inf, np.inf]) if self.support is None else self.support[number]
        return float(self.mean[number]), float(self.marginal_std[number]), support

    def _check_shapes(self) -> None:
        if (self.std is None) == (self.mixing is None):
            raise InvalidValue("Inputs need either the std or the mixing matrix",
                               "Give `std` for independent inputs, or `mixing` for the whole matrix L")
        if self.mean.ndim != 1 or self.dimension == 0:
            raise InvalidValue(f"The mean has shape {self.mean.shape}", "Give one number an input")
        d = self.dimension
        for name, shape in (("std", (d,)), ("mixing", (d, d)), ("correlation", (d, d)), ("support", (d, 2))):
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise InvalidValue(f"The {name} has shape {array.shape}, not {shape}", f"Match it to the {d} means")
            if array is not None and not np.all(np.isfinite(array)):
                raise InvalidValue(f"An entry of the {name} is not finite", "Give finite numbers")
        if not np.all(np.isfinite(self.mean)):
            raise InvalidValue("A mean is not finite", "Give finite numbers")
        if self.std is not None and np.any(self.std < 0):
            raise InvalidValue("A std is negative", "Give a std of 0 or more")
        if len(self.families) != d:
            raise InvalidValue(f"There are {len(self.families)} families for {d} inputs", "Give one an input, or none")

    def _check_correlation(self) -> None:
        if self.mixing is not None:
            raise InvalidValue("The mixing matrix holds the correlation already", "Give `std` and `correlation`")
        assert self.correlation is not None
        symmetric = np.allclose(self.correlation, self.correlation.T, atol=1e-12)
        if not (symmetric and np.allclose(np.diag(self.correlation), 1.0, atol=1e-12)):
            raise InvalidValue("The correlation is not symmetric with ones on its diagonal",
                               "Give the correlation of the normal scores, not a covariance")
        if np.linalg.eigvalsh(self.correlation)[0] <= 0:
            raise InvalidValue("The correlation is not positive definite: no inputs have it",
                               "Choose correlations that are possible together, each between -1 and 1")

    def _check_family(self, number: int, family: Family) -> None:
        mean, std = self.mean[number], self.marginal_std[number]
        if family not in FAMILIES:
            raise InvalidValue(f"There is no family '{family}'", f"Choose among {', '.join(FAMILIES)}")
        if family != "normal" and self.mixing is not None:
            raise InvalidValue(f"A mixing matrix makes normal inputs, not {family} ones",
                               "Give `std`, and `correlation` where they depend on one another")
        if family in POSITIVE and mean <= 0:
            raise InvalidValue(f"The mean of a {family} input is {mean:g}", "Give a positive mean")
        if family != "beta":
            return
        *_, support = self._moments(number)
        low, high = support
        if not (np.isfinite([low, high]).all() and low < mean < high):
            raise InvalidValue(f"A beta input with mean {mean:g} cannot have the support {low:g} to {high:g}",
                               "Give a `support` (lower, upper) around the mean")
        if std > 0 and min(beta_shape(mean, std, support)) <= 0:
            most = np.sqrt((mean - low) * (high - mean))
            raise InvalidValue(f"No beta input from {low:g} to {high:g} with mean {mean:g} has the std {std:g}",
                               f"Give a std below {most:.4g}, or a wider support")
