"""Products of the orthonormal polynomials of several germs, evaluated by the numerically stable recurrence."""

from dataclasses import dataclass

import numba
import numpy as np

from slipstick.uncertainty.chaos.germs import Germ


@dataclass(frozen=True, eq=False)
class Polynomials:
    """t products of the polynomials of d germs, given by their `degrees` (t, d).

    `alpha` and `root_beta` (d, highest degree + 1) are the coefficients of the recurrence, the latter as sqrt(beta).
    """

    germs: tuple[Germ, ...]
    degrees: np.ndarray
    alpha: np.ndarray
    root_beta: np.ndarray

    @classmethod
    def of(cls, germs: tuple[Germ, ...], degrees: np.ndarray) -> "Polynomials":
        """The products of the given `degrees` (t, d)."""
        coefficients = {germ: germ.recurrence(int(degrees.max()) + 1) for germ in germs}
        alpha, beta = (np.stack([coefficients[germ][which] for germ in germs]) for which in (0, 1))
        return cls(germs, degrees, alpha, np.sqrt(beta))

    def at(self, germs: np.ndarray) -> np.ndarray:
        """Values of all products at the germs (m, d): shape (m, t)."""
        values = np.empty((len(germs), len(self.degrees)))
        _evaluate(np.ascontiguousarray(germs, float), self.degrees, self.alpha, self.root_beta, values)
        return values


@numba.njit(cache=True, nogil=True)
def _evaluate(germs: np.ndarray, degrees: np.ndarray, alpha: np.ndarray, root_beta: np.ndarray,
              values: np.ndarray) -> None:
    dimension, count = alpha.shape
    single = np.ones((dimension, count))
    for row in range(germs.shape[0]):
        for axis in range(dimension):
            germ = germs[row, axis]
            if count > 1:
                single[axis, 1] = germ
            for degree in range(1, count - 1):
                lower = root_beta[axis, degree] * single[axis, degree - 1]
                single[axis, degree + 1] = (((germ - alpha[axis, degree]) * single[axis, degree] - lower)
                                            / root_beta[axis, degree + 1])
        for term in range(degrees.shape[0]):
            value = 1.0
            for axis in range(dimension):
                value *= single[axis, degrees[term, axis]]
            values[row, term] = value
