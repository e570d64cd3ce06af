"""Multilinear interpolation in any number of dimensions, as one compiled loop over the points.

The outputs of a grid point are adjacent in memory, so that the weighted sum over the 2^d corners of a cell runs over
contiguous rows, in SIMD registers. Corners of weight zero are left out, so that values at grid points are reproduced
bit for bit and a NaN corner affects only the points at which its weight is not zero.
"""

from collections.abc import Sequence
from itertools import combinations, product

import numba
import numpy as np

from slipstick.table.axis import Axis
from slipstick.table.derivatives import Derivatives
from slipstick.table.points import Outside, clip_points


def interpolate(axes: Sequence[Axis], values: np.ndarray, points: np.ndarray, outside: Outside) -> np.ndarray:
    """Interpolate `values` (g1, ..., gd, n) at `points` (m, d), multipliers in the order of the axes: (m, n).

    The result is NaN where a corner of nonzero weight is NaN. Raises `InvalidValue` if the points are not finite or
    not of shape (m, d), and `OutsideTable`.
    """
    clipped, inside = clip_points(axes, points, outside)
    result = np.empty((len(points), values.shape[-1]))
    _interpolate(np.concatenate([axis.values for axis in axes]), np.array([len(axis.values) for axis in axes]),
                 np.ascontiguousarray(values).reshape(-1, values.shape[-1]), np.ascontiguousarray(clipped), result)
    if outside == "nan":
        result[~inside.all(axis=1)] = np.nan
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


@numba.njit(cache=True, nogil=True)
def _interpolate(knots: np.ndarray, sizes: np.ndarray, values: np.ndarray, points: np.ndarray,
                 result: np.ndarray) -> None:
    """Interpolate rows of `values` at `points` inside the grid; `knots` are those of all axes, one after another."""
    corners, weights = np.empty(1 << len(sizes), np.int64), np.empty(1 << len(sizes))
    for row in range(points.shape[0]):
        corners[0], weights[0], count, start = 0, 1.0, 1, 0
        for axis in range(len(sizes)):
            grid, x = knots[start:start + sizes[axis]], points[row, axis]
            start += sizes[axis]
            cell = min(max(np.searchsorted(grid, x, side="right") - 1, 0), sizes[axis] - 2)
            fraction = (x - grid[cell]) / (grid[cell + 1] - grid[cell])
            count = _split(corners, weights, count, sizes[axis], cell, fraction)
        for first in range(0, count, 4):  # four corners in a pass, so that each result is stored once
            _add_rows(result[row], values, corners[first:count], weights[first:count], first > 0)


@numba.njit(cache=True, nogil=True)
def _split(corners: np.ndarray, weights: np.ndarray, count: int, size: int, cell: int, fraction: float) -> int:
    """Append an axis of `size` to the corners, in lexicographic order; returns how many have a weight other than 0."""
    lower, upper = 1.0 - fraction, fraction
    sides = (lower != 0.0) + (upper != 0.0)
    for old in range(count - 1, -1, -1):  # backwards, because the new corners take the places of the old ones
        corner, weight, new = corners[old] * size + cell, weights[old], sides * old
        if lower != 0.0:
            corners[new], weights[new] = corner, weight * lower
            new += 1
        if upper != 0.0:
            corners[new], weights[new] = corner + 1, weight * upper
    return sides * count


@numba.njit(cache=True, nogil=True)
def _add_rows(total: np.ndarray, values: np.ndarray, corners: np.ndarray, weights: np.ndarray, add: bool) -> None:
    """Set `total` to the weighted sum of up to four rows, or add the sum to it."""
    a, p = values[corners[0]], weights[0]
    count, n = len(corners), len(total)
    if count == 1:
        for i in range(n):
            total[i] = p * a[i]
        return
    b, q = values[corners[1]], weights[1]
    if count == 2:
        for i in range(n):
            total[i] = p * a[i] + q * b[i]
        return
    c, r, d, s = values[corners[2]], weights[2], values[corners[3]], weights[3]
    if add:
        for i in range(n):
            total[i] = total[i] + p * a[i] + q * b[i] + r * c[i] + s * d[i]
    else:
        for i in range(n):
            total[i] = p * a[i] + q * b[i] + r * c[i] + s * d[i]
