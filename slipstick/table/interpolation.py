"""Multilinear interpolation in any number of dimensions, as one sparse matrix of corner weights.

A row of the matrix contains the weights of the 2^d corners of the cell in which a point lies; the product with the
table gives all outputs at all points at once. This is about as fast as a compiled loop and needs no compilation. Zero
weights are removed, so that values at grid points are reproduced bit for bit and a NaN corner affects only the points
at which its weight is not zero.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from slipstick.table.axis import Axis
from slipstick.table.points import Outside, clip_points


def interpolate(axes: Sequence[Axis], values: np.ndarray, points: np.ndarray, outside: Outside) -> np.ndarray:
    """Interpolate `values` (g1, ..., gd, n) at `points` (m, d), multipliers in the order of the axes: (m, n).

    The result is NaN where a corner of nonzero weight is NaN. Raises `InvalidValue` if the points are not finite or
    not of shape (m, d), and `OutsideTable`.
    """
    clipped, inside = clip_points(axes, points, outside)
    result: np.ndarray = _weights(axes, clipped) @ values.reshape(-1, values.shape[-1])
    if outside == "nan":
        result[~inside] = np.nan
    return result


def _weights(axes: Sequence[Axis], points: np.ndarray) -> csr_array:
    m = len(points)
    corner = np.zeros((m, 1), dtype=np.int64)
    weight = np.ones((m, 1))
    for column, axis in enumerate(axes):
        grid, x = axis.values, points[:, column]
        cell = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
        fraction = (x - grid[cell]) / (grid[cell + 1] - grid[cell])
        corner = _outer(corner * len(grid), np.add, np.stack([cell, cell + 1], axis=1))
        weight = _outer(weight, np.multiply, np.stack([1 - fraction, fraction], axis=1))
    row_starts = np.arange(m + 1) * weight.shape[1]
    grid_points = int(np.prod([len(axis.values) for axis in axes]))
    matrix = csr_array((weight.ravel(), corner.ravel(), row_starts), shape=(m, grid_points))
    matrix.eliminate_zeros()
    return matrix


def _outer(rows: np.ndarray, combine: np.ufunc, pairs: np.ndarray) -> np.ndarray:
    combined: np.ndarray = combine(rows[:, :, None], pairs[:, None, :])
    return combined.reshape(len(rows), 2 * rows.shape[1])
