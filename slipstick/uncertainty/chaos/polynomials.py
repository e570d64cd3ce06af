"""Products of the orthonormal polynomials of several germs, evaluated by the numerically stable recurrence."""

from dataclasses import dataclass

import numba
import numpy as np

from slipstick.uncertainty.chaos.germs import Germ

_BLOCK = 64  # germs that are evaluated together


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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(germs: np.ndarray, degrees: np.ndarray, alpha: np.ndarray, root_beta: np.ndarray,
              values: np.ndarray) -> None:
    """Blocks of germs are innermost, so that the loops over them are compiled to vector instructions."""
    dimension, count = alpha.shape
    single = np.ones((dimension, count, _BLOCK))
    product = np.empty((degrees.shape[0], _BLOCK))
    for start in range(0, germs.shape[0], _BLOCK):
        size = min(_BLOCK, germs.shape[0] - start)
        for axis in range(dimension):
            if count > 1:
                single[axis, 1, :size] = germs[start:start + size, axis]
            for degree in range(1, count - 1):
                shift, below, above = alpha[axis, degree], root_beta[axis, degree], root_beta[axis, degree + 1]
                first, one, two, new = single[axis, 1], single[axis, degree], single[axis, degree - 1], single[
                    axis, degree + 1]
                for point in range(_BLOCK):
                    new[point] = ((first[point] - shift) * one[point] - below * two[point]) / above
        for term in range(degrees.shape[0]):
            into, factor = product[term], single[0, degrees[term, 0]]
            for point in range(_BLOCK):
                into[point] = factor[point]
            for axis in range(1, dimension):
                factor = single[axis, degrees[term, axis]]
                for point in range(_BLOCK):
                    into[point] *= factor[point]
        for point in range(size):
            for term in range(degrees.shape[0]):
                values[start + point, term] = product[term, point]
