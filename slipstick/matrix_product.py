"""A matrix product with bit-identical results on any number of threads, for one processor type.

BLAS splits a product among its threads, and the rounding depends on the split. A fit that is resumed on another machine
would therefore diverge from the original fit. A single plain loop avoids this, at 1.6 times the cost on one core.
"""

import numba
import numpy as np


def matrix_product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The product of (m, k) and (k, n), shape (m, n), in single precision if both factors are."""
    result = np.zeros((len(left), right.shape[1]), np.result_type(left, right, np.float32))
    _add_product(np.ascontiguousarray(left), np.ascontiguousarray(right), result)
    return result


@numba.njit(cache=True, nogil=True)
def _add_product(left: np.ndarray, right: np.ndarray, result: np.ndarray) -> None:
    for row in range(result.shape[0]):
        for inner in range(right.shape[0]):
            factor = left[row, inner]
            for column in range(result.shape[1]):
                result[row, column] += factor * right[inner, column]
