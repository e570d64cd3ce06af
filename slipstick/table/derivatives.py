"""Exact first and second derivatives of a table at one point."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Values (n,) of a table at a point, and their derivatives with respect to the d multipliers.

    `jacobian` has shape (n, d) and `hessian` (n, d, d), in the unit of the values. They are NaN where a derivative does
    not exist. At a grid point, those of the cell above it are given.
    """

    values: np.ndarray
    jacobian: np.ndarray
    hessian: np.ndarray

    def along(self, factors: np.ndarray) -> "Derivatives":
        """By the chain rule, with respect to multipliers of which each acts by its factor (d,)."""
        # 0 * NaN would spoil a direction that does not matter.
        pair = factors[:, None] * factors
        return Derivatives(self.values, np.where(factors == 0, 0.0, self.jacobian * factors),
                           np.where(pair == 0, 0.0, self.hessian * pair))
