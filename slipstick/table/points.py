"""Validation and clipping of points at which a table is evaluated."""

from collections.abc import Sequence
from typing import Literal

import numba
import numpy as np

from slipstick.errors import InvalidValue, OutsideTable
from slipstick.table.axis import Axis, box

Outside = Literal["error", "clip", "nan"]
"""Policy for points outside the table: raise `OutsideTable`, take the value at the nearest edge, or return NaN."""


def clip_points(axes: Sequence[Axis], points: np.ndarray, outside: Outside) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, d) clipped to the range of the axes, and a mask (m,) of those inside it.

    Raises `InvalidValue` if the points are not finite or not of shape (m, d), and `OutsideTable` under the policy
    `error`.
    """
    if points.ndim != 2 or points.shape[1] != len(axes):
        raise InvalidValue(f"The points have shape {points.shape}, not (m, {len(axes)})",
                           f"Give one multiplier per axis: {', '.join(axis.name for axis in axes)}")
    lower, upper = box(axes)
    clipped, inside, are_finite = _clipped(np.ascontiguousarray(points, float), lower, upper)
    if not are_finite:
        row, column = np.argwhere(~np.isfinite(points))[0]
        raise InvalidValue(f"Point {row} is not finite in {axes[column].name}", "Give finite multipliers")
    if outside == "error" and not inside.all():
        row, column = np.argwhere((points < lower) | (points > upper))[0]
        axis = axes[column]
        raise OutsideTable(f"Point {row} has {axis.name} = {points[row, column]:.6g}, outside the range of the table, "
                           f"{axis.lower:.6g} to {axis.upper:.6g}",
                           "Choose the policy clip or nan, or build a wider table")
    return clipped, inside


@numba.njit(cache=True, nogil=True)
def _clipped(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """The clipped points (m, d), whether each of them is inside (m,), and whether all numbers are finite.

    One loop: for a few hundred points, the calls of NumPy take longer than the interpolation.
    """
    clipped, inside, are_finite = np.empty(points.shape), np.empty(len(points), np.bool_), True
    for row in range(points.shape[0]):
        inside[row] = True
        for column in range(points.shape[1]):
            x = points[row, column]
            nearest = min(max(x, lower[column]), upper[column])
            clipped[row, column] = nearest
            if x != nearest:
                inside[row] = False
                are_finite &= np.isfinite(x)
    return clipped, inside, are_finite
