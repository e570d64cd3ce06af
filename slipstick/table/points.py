"""Validation and clipping of points at which a table is evaluated."""

import functools
from collections.abc import Sequence
from typing import Literal

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
    inside = (points >= lower) & (points <= upper)
    if inside.all():  # and so finite
        return points, np.ones(len(points), bool)
    if not np.isfinite(points).all():
        row, column = np.argwhere(~np.isfinite(points))[0]
        raise InvalidValue(f"Point {row} is not finite in {axes[column].name}", "Give finite multipliers")
    if outside == "error" and not inside.all():
        row, column = np.argwhere(~inside)[0]
        axis = axes[column]
        raise OutsideTable(f"Point {row} has {axis.name} = {points[row, column]:.6g}, outside the range of the table, "
                           f"{axis.lower:.6g} to {axis.upper:.6g}",
                           "Choose the policy clip or nan, or build a wider table")
    # A third of the time of `all` over few columns.
    return np.clip(points, lower, upper), functools.reduce(np.logical_and, inside.T)
