"""Multilinear interpolation in any number of dimensions, as one sparse matrix of corner weights.

A row of the matrix contains the weights of the 2^d corners of the cell in which a point lies; the product with the
table gives all outputs at all points at once. This is about as fast as a compiled loop and needs no compilation. Zero
weights are removed, so that values at grid points are reproduced bit for bit and a NaN corner affects only the points
at which its weight is not zero.
"""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from scipy.sparse import csr_array

from slipstick.table.axis import Axis
from slipstick.table.derivatives import Derivatives
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


def derivatives(axes: Sequence[Axis], values: np.ndarray, point: np.ndarray) -> Derivatives:
    """Derivatives at a `point` (d,) inside the grid; NaN where a corner whose weight is not constantly 0 is NaN.

    The interpolation is linear in each axis, so that the second derivative with respect to one axis is 0.
    """
    d, n = len(axes), values.shape[-1]
    cells, weights, slopes = [], [], []
    for axis, x in zip(axes, point, strict=True):
        grid = axis.values
        cell = int(np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2))
        width = grid[cell + 1] - grid[cell]
        fraction = (x - grid[cell]) / width
        cells.append(slice(cell, cell + 2))
        weights.append(np.array([1 - fraction, fraction]))
        slopes.append(np.array([-1.0, 1.0]) / width)
    corners = values[tuple(cells)]

    def contracted(*differentiated: int) -> np.ndarray:
        total = np.zeros(n)
        for corner in product((0, 1), repeat=d):
            weight = np.prod([(slopes if axis in differentiated else weights)[axis][side]
                              for axis, side in enumerate(corner)])
            if weight != 0:
                total += weight * corners[corner]
        return total

    hessian = np.zeros((n, d, d))
    for first, second in combinations(range(d), 2):
        hessian[:, first, second] = hessian[:, second, first] = contracted(first, second)
    jacobian = np.column_stack([contracted(axis) for axis in range(d)])
    return Derivatives(contracted(), jacobian, hessian)


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
