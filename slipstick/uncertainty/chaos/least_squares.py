"""Weighted least squares as a projection matrix, bit-identical on any number of threads (see matrix_product.py)."""

import numba
import numpy as np

from slipstick.errors import InvalidValue

_DEPENDENT = 1e-6  # norm of an orthogonalised term below which it is linearly dependent on the others


def projection(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The matrix (t, q) that maps q observations to the t coefficients of the weighted least-squares fit.

    `values` (q, t) are the terms at the observations; `weights` (q,) are positive. Raises `InvalidValue` if the terms
    are linearly dependent at the observations.
    """
    root = np.sqrt(weights)
    rows = np.ascontiguousarray((values * root[:, None]).T)
    factor = np.zeros((len(rows), len(rows)))
    _orthogonalise(rows, factor)
    diagonal = np.abs(np.diag(factor))
    if not np.all(diagonal > _DEPENDENT):
        raise InvalidValue(f"The {len(rows)} polynomials are linearly dependent at the {len(values)} samples",
                           "Take more samples")
    _substitute_back(rows, factor)
    return np.asarray(rows * root)


@numba.njit(cache=True, nogil=True)
def _orthogonalise(rows: np.ndarray, factor: np.ndarray) -> None:
    """Modified Gram-Schmidt in place: the original rows are `factor`.T @ rows, with `factor` upper triangular."""
    for row in range(rows.shape[0]):
        norm = np.sqrt(np.sum(rows[row] ** 2))
        factor[row, row] = norm
        for column in range(rows.shape[1]):
            rows[row, column] /= norm if norm > 0 else 1.0
        for other in range(row + 1, rows.shape[0]):
            product = 0.0
            for column in range(rows.shape[1]):
                product += rows[row, column] * rows[other, column]
            factor[row, other] = product
            for column in range(rows.shape[1]):
                rows[other, column] -= product * rows[row, column]


@numba.njit(cache=True, nogil=True)
def _substitute_back(rows: np.ndarray, factor: np.ndarray) -> None:
    for row in range(rows.shape[0] - 1, -1, -1):
        for other in range(row + 1, rows.shape[0]):
            for column in range(rows.shape[1]):
                rows[row, column] -= factor[row, other] * rows[other, column]
        for column in range(rows.shape[1]):
            rows[row, column] /= factor[row, row]
