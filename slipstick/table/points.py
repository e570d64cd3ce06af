"""Validation and clipping of points at which a table is evaluated."""

from collections.abc import Sequence
from typing import Literal

import numba
import numpy as np

from slipstick.errors import InvalidValue, OutsideTable
from slipstick.table.axis import Axis, box

Outside = Literal["error", "clip", "nan"]
"""Policy for points outside the table: raise `OutsideTable`, take the value at the nearest edge, or return NaN."""
_ROUNDING = 1e-12
"""Distance beyond an edge, relative to the larger edge of the axis, up to which a point is inside: but for rounding it
is at the edge."""


def clip_points(axes: Sequence[Axis], points: np.ndarray, outside: Outside) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, d) clipped to the range of the axes, and a mask (m, d) of their multipliers inside it.

    Raises `InvalidValue` if the points are not finite or not of shape (m, d), and `OutsideTable` under the policy
    `error`.
    """
    if points.ndim != 2 or points.shape[1] != len(axes):
        raise InvalidValue(f"The points have shape {points.shape}, not (m, {len(axes)})",
                           f"Give one multiplier per axis: {', '.join(axis.name for axis in axes)}")
    lower, upper = box(axes)
    clipped, inside, are_finite = _clip(np.ascontiguousarray(points, float), lower, upper)
    if not are_finite:
        row, column = np.argwhere(~np.isfinite(points))[0]
        raise InvalidValue(f"Point {row} is not finite in {axes[column].name}", "Give finite multipliers")
    if outside == "error" and not inside.all():
        row, column = np.argwhere(~inside)[0]
        axis = axes[column]
        raise OutsideTable(f"Point {row} has {axis.name} = {points[row, column]:.6g}, outside the range of the table, "
                           f"{axis.lower:.6g} to {axis.upper:.6g}",
                           "Stay inside, set `outside` to `clip` (the value at the nearest edge) or `nan` (no value), "
                           "or build a wider table")
    return clipped, inside


def count_outside(axes: Sequence[Axis], points: np.ndarray) -> int:
    """Number of the points (m, d) outside the range of the axes; raises `InvalidValue` as `clip_points`."""
    return int(np.count_nonzero(~clip_points(axes, points, "clip")[1].all(axis=1)))


@numba.njit(cache=True, nogil=True)
def _clip(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """The clipped points (m, d), whether each multiplier is inside (m, d), and whether all numbers are finite.

    One loop: for a few hundred points, the calls of NumPy take longer than the interpolation.
    """
    clipped, inside, are_finite = np.empty(points.shape), np.empty(points.shape, np.bool_), True
    for row in range(points.shape[0]):
        for column in range(points.shape[1]):
            x = points[row, column]
            nearest = min(max(x, lower[column]), upper[column])
            clipped[row, column] = nearest
            largest = max(abs(lower[column]), abs(upper[column]))
            inside[row, column] = abs(x - nearest) <= _ROUNDING * largest
            if not inside[row, column]:
                are_finite &= np.isfinite(x)
    return clipped, inside, are_finite
