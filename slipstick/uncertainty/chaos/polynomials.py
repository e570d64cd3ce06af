"""Products of the orthonormal polynomials of several germs, evaluated by the numerically stable recurrence."""

from dataclasses import dataclass

import numba
import numpy as np

from slipstick.numerics.matrix_product import multiply
from slipstick.uncertainty.chaos.germs import Germ

_BLOCK = 96  # germs that are evaluated together; their 45 polynomials of order 8 fit into the first cache of a core


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

    def sum(self, coefficients: np.ndarray, germs: np.ndarray) -> np.ndarray:
        """The sums of the products times coefficients (t, n) at the germs (m, d): shape (m, n).

        They are `at(germs) @ coefficients`, without the memory of all products.
        """
        sums = np.empty((len(germs), coefficients.shape[1]))
        _sum(np.ascontiguousarray(germs, float), self.degrees, self.alpha, self.root_beta,
             np.ascontiguousarray(coefficients, float), sums)
        return sums


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(germs: np.ndarray, degrees: np.ndarray, alpha: np.ndarray, root_beta: np.ndarray,
              values: np.ndarray) -> None:
    single, products = np.ones((*alpha.shape, _BLOCK)), np.empty((len(degrees), _BLOCK))
    for start in range(0, len(germs), _BLOCK):
        block = germs[start:start + _BLOCK]
        _evaluate_block(block, degrees, alpha, root_beta, single, products)
        for point in range(len(block)):
            for term in range(len(degrees)):
                values[start + point, term] = products[term, point]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _sum(germs: np.ndarray, degrees: np.ndarray, alpha: np.ndarray, root_beta: np.ndarray, coefficients: np.ndarray,
         sums: np.ndarray) -> None:
    single, products = np.ones((*alpha.shape, _BLOCK)), np.empty((len(degrees), _BLOCK))
    for start in range(0, len(germs), _BLOCK):
        block = germs[start:start + _BLOCK]
        _evaluate_block(block, degrees, alpha, root_beta, single, products)
        multiply(products.T[:len(block)], coefficients, sums[start:start + len(block)])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _evaluate_block(germs: np.ndarray, degrees: np.ndarray, alpha: np.ndarray, root_beta: np.ndarray,
                    single: np.ndarray, products: np.ndarray) -> None:
    """Set `products` (t, block) at the germs; they are innermost, so that the loops become vector instructions.

    `single` (d, highest degree + 1, block) has space for the polynomials of each germ, the first of which is 1.
    """
    dimension, count = alpha.shape
    for axis in range(dimension):
        if count > 1:
            for point in range(len(germs)):  # numba compiles an assignment of slices for seconds
                single[axis, 1, point] = germs[point, axis]
        for degree in range(1, count - 1):
            shift, below, above = alpha[axis, degree], root_beta[axis, degree], root_beta[axis, degree + 1]
            first, current, previous, new = single[axis, 1], single[axis, degree], single[axis, degree - 1], single[
                axis, degree + 1]
            for point in range(_BLOCK):
                new[point] = ((first[point] - shift) * current[point] - below * previous[point]) / above
    for term in range(len(degrees)):
        into, factor = products[term], single[0, degrees[term, 0]]
        for point in range(_BLOCK):
            into[point] = factor[point]
        for axis in range(1, dimension):
            factor = single[axis, degrees[term, axis]]
            for point in range(_BLOCK):
                into[point] *= factor[point]
