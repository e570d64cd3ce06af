"""A matrix product with bit-identical results on any number of threads, for one processor type.

BLAS splits a product among its threads, and the rounding depends on the split. A fit that is resumed on another machine
would therefore diverge from the original fit. Here every entry is one sum in the order of the inner index, whichever
rows are computed together. Four rows and four terms at a time are about as fast as BLAS on one core.
"""

import numba
import numpy as np


def matrix_product(left: np.ndarray, right: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """The product of (m, k) and (k, n), shape (m, n), in single precision if both factors are; written to `out`."""
    result = np.empty((len(left), right.shape[1]), np.result_type(left, right, np.float32)) if out is None else out
    result[:] = 0.0
    _add_product(np.ascontiguousarray(left, result.dtype), np.ascontiguousarray(right, result.dtype), result)
    return result


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def _add_product(left: np.ndarray, right: np.ndarray, result: np.ndarray) -> None:
    m, k = left.shape
    for row in range(0, m - 3, 4):
        for inner in range(0, k - 3, 4):
            _add_block(left[row:row + 4, inner:inner + 4], right[inner:inner + 4], result[row:row + 4])
        for inner in range(k - k % 4, k):
            for r in range(row, row + 4):
                _add_row(left[r, inner], right[inner], result[r])
    for row in range(m - m % 4, m):
        for inner in range(k):
            _add_row(left[row, inner], right[inner], result[row])


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def _add_row(factor: float, row: np.ndarray, total: np.ndarray) -> None:
    for column in range(len(total)):
        total[column] += factor * row[column]


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def _add_block(f: np.ndarray, rows: np.ndarray, totals: np.ndarray) -> None:
    """Add the product of the factors (4, 4) and four rows, written out so that a row is loaded once for four sums."""
    a, b, c, d = rows[0], rows[1], rows[2], rows[3]
    w, x, y, z = totals[0], totals[1], totals[2], totals[3]
    wa, wb, wc, wd = f[0, 0], f[0, 1], f[0, 2], f[0, 3]
    xa, xb, xc, xd = f[1, 0], f[1, 1], f[1, 2], f[1, 3]
    ya, yb, yc, yd = f[2, 0], f[2, 1], f[2, 2], f[2, 3]
    za, zb, zc, zd = f[3, 0], f[3, 1], f[3, 2], f[3, 3]
    for i in range(totals.shape[1]):
        w[i] = (((w[i] + wa * a[i]) + wb * b[i]) + wc * c[i]) + wd * d[i]
        x[i] = (((x[i] + xa * a[i]) + xb * b[i]) + xc * c[i]) + xd * d[i]
        y[i] = (((y[i] + ya * a[i]) + yb * b[i]) + yc * c[i]) + yd * d[i]
        z[i] = (((z[i] + za * a[i]) + zb * b[i]) + zc * c[i]) + zd * d[i]
