"""A matrix product with bit-identical results on any number of threads, for one processor type.

BLAS splits a product among its threads, and the rounding depends on the split. A fit that is resumed on another machine
would therefore diverge from the original fit. Here every entry is one sum in the order of the inner index, whichever
rows are computed together.
"""

import numba
import numpy as np

from slipstick.numerics.register_tile import ROW_BYTES, ROWS, multiply_tile


def matrix_product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The product of (m, k) and (k, n), shape (m, n), in single precision if both factors are."""
    result = np.empty((len(left), right.shape[1]), np.result_type(left, right, np.float32))
    multiply(np.ascontiguousarray(left, result.dtype), np.ascontiguousarray(right, result.dtype), result)
    return result


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def multiply(left: np.ndarray, right: np.ndarray, result: np.ndarray) -> None:
    """Set `result` (m, n) to the product of (m, k) and (k, n), all of one type; `right` and `result` are C-ordered."""
    (m, k), n = left.shape, right.shape[1]
    width = ROW_BYTES // result.itemsize
    if k == 0 or m < ROWS:
        _multiply_rows(left, right, result)
    elif n < width:
        padded, wide = np.zeros((k, width), result.dtype), np.empty((m, width), result.dtype)
        _copy(right, padded)
        _multiply_tiles(left, padded, wide)
        _copy(wide, result)
    else:
        _multiply_tiles(left, right, result)


@numba.njit(cache=True, nogil=True)
def _copy(source: np.ndarray, target: np.ndarray) -> None:
    """Copy the columns that both have. An assignment of slices takes seconds to compile, for the text of its error."""
    for row in range(source.shape[0]):
        for column in range(min(source.shape[1], target.shape[1])):
            target[row, column] = source[row, column]


@numba.njit(cache=True, nogil=True)
def _multiply_tiles(left: np.ndarray, right: np.ndarray, result: np.ndarray) -> None:
    """The last tile of a row or column overlaps the one before it, and computes the same sums again."""
    m, n = result.shape
    width = ROW_BYTES // result.itemsize
    for column in range(0, n, width):
        for row in range(0, m, ROWS):
            multiply_tile(left, right, result, min(row, m - ROWS), min(column, n - width))


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def _multiply_rows(left: np.ndarray, right: np.ndarray, result: np.ndarray) -> None:
    result[:] = 0.0
    for row in range(result.shape[0]):
        total = result[row]
        for inner in range(right.shape[0]):
            factor, terms = left[row, inner], right[inner]
            for column in range(len(total)):
                total[column] += factor * terms[column]
