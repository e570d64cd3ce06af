"""Weighted least squares as one matrix, with the same bits on any number of threads (see product.py)."""

import numba
import numpy as np

from slipstick.errors import InvalidValue

_DEPENDENT = 1e-6


def projection(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The matrix (t, q) that takes q observations to the t coefficients of least weighted squares.

    `values` (q, t) are the terms at the observations, `weights` (q,) positive. Raises `InvalidValue` where the
    observations cannot tell the terms apart.
    """
    root = np.sqrt(weights)
    rows = np.ascontiguousarray((values * root[:, None]).T)
    factor = np.zeros((len(rows), len(rows)))
    _orthogonalise(rows, factor)
    diagonal = np.abs(np.diag(factor))
    if not np.all(diagonal > _DEPENDENT):
        raise InvalidValue(f"{len(values)} samples cannot tell {len(rows)} polynomials apart", "Take more samples")
    _substitute_back(rows, factor)
    solved: np.ndarray = rows * root
    return solved


@numba.njit(cache=True, nogil=True)
def _orthogonalise(rows: np.ndarray, factor: np.ndarray) -> None:
    """Modified Gram-Schmidt: rows become orthonormal, and were combined of them by the columns of `factor`."""
    for row in range(rows.shape[0]):
        length = np.sqrt(np.sum(rows[row] ** 2))
        factor[row, row] = length
        for place in range(rows.shape[1]):
            rows[row, place] /= length if length > 0 else 1.0
        for other in range(row + 1, rows.shape[0]):
            common = 0.0
            for place in range(rows.shape[1]):
                common += rows[row, place] * rows[other, place]
            factor[row, other] = common
            for place in range(rows.shape[1]):
                rows[other, place] -= common * rows[row, place]


@numba.njit(cache=True, nogil=True)
def _substitute_back(rows: np.ndarray, factor: np.ndarray) -> None:
    for row in range(rows.shape[0] - 1, -1, -1):
        for other in range(row + 1, rows.shape[0]):
            for place in range(rows.shape[1]):
                rows[row, place] -= factor[row, other] * rows[other, place]
        for place in range(rows.shape[1]):
            rows[row, place] /= factor[row, row]
