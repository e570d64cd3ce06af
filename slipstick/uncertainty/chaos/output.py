"""Moments, quantiles and density of an expansion with additive output noise (section III.B)."""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.expansion import Expansion
from slipstick.uncertainty.chaos.germs import germs_from_normals
from slipstick.uncertainty.sampling import log10_mean_density, standard_normals


@dataclass(frozen=True, eq=False)
class Output:
    """y(xi) + output_std N(0, 1) for n conditions; NaN where a condition has no expansion.

    `output_std` is in the unit of the output, s for shifting times; a value of 0 gives the polynomial without noise.
    Quantiles and density are estimated from `samples` (a power of two) seeded samples of the polynomial. With the
    default number the error of the 5 % quantile is below 2 % of the std. Raises `InvalidValue`.
    """

    expansion: Expansion
    output_std: float
    samples: int = 2**14
    seed: int = 1

    def __post_init__(self) -> None:
        """Check the noise."""
        if not (np.isfinite(self.output_std) and self.output_std >= 0):
            raise InvalidValue(f"The output std is {self.output_std}", "Give 0 or a positive number")

    @property
    def mean(self) -> np.ndarray:
        """Mean, shape (n,), s."""
        return self.expansion.mean

    @property
    def std(self) -> np.ndarray:
        """Standard deviation, noise included, shape (n,), s."""
        return np.asarray(np.hypot(self.expansion.std, self.output_std))

    def quantiles(self, probabilities: np.ndarray) -> np.ndarray:
        """Quantiles at the probabilities (p,), noise included: shape (p, n), s."""
        basis = self.expansion.basis
        normals = standard_normals(len(basis.germs) + 1, self.samples, self.seed)
        times = self.expansion.at(germs_from_normals(basis.germs, normals[:, :-1])) + self.output_std * normals[:, -1:]
        return np.asarray(np.quantile(times, probabilities, axis=0))

    def density(self, times: np.ndarray) -> np.ndarray:
        """Density per ms at the times (g, n) in s, one grid per condition: shape (g, n). Raises `InvalidValue`."""
        if self.output_std == 0:
            raise InvalidValue("Samples without noise have no density", "Give an output std, or compute quantiles")
        germs = self.expansion.basis.germs
        outputs = self.expansion.at(germs_from_normals(germs, standard_normals(len(germs), self.samples, self.seed)))
        density = np.power(10.0, [log10_mean_density(outputs, row, self.output_std) for row in times])
        return np.where(self.expansion.missing, np.nan, density)
