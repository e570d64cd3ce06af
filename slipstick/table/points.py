"""Points against the axes of a table: what they must be, and what becomes of those beyond the edges."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from slipstick.errors import InvalidValue, OutsideTable
from slipstick.table.axis import Axis, box

Outside = Literal["error", "clip", "nan"]
"""What a point beyond the axes gives: `OutsideTable`, the value at the nearest edge, or NaN."""


def placed(axes: Sequence[Axis], points: np.ndarray, outside: Outside) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, d) moved to the nearest edge, and which of them (m,) lay inside.

    Raises `InvalidValue` where the points are not finite or not (m, d), and `OutsideTable` for the policy `error`.
    """
    if points.ndim != 2 or points.shape[1] != len(axes):
        raise InvalidValue(f"Points have shape {points.shape}, not (m, {len(axes)})",
                           f"Give one multiplier each of {', '.join(axis.name for axis in axes)}")
    lower, upper = box(axes)
    inside = (points >= lower) & (points <= upper)
    if not np.isfinite(points).all():
        row, column = np.argwhere(~np.isfinite(points))[0]
        raise InvalidValue(f"Point {row} is not finite in {axes[column].name}", "Give finite multipliers")
    if outside == "error" and not inside.all():
        row, column = np.argwhere(~inside)[0]
        axis = axes[column]
        raise OutsideTable(f"Point {row} has {axis.name} = {points[row, column]:.6g}, outside the table's "
                           f"{axis.lower:.6g} to {axis.upper:.6g}",
                           "Choose clip or nan for such points, or build a wider table")
    return np.clip(points, lower, upper), np.asarray(inside.all(axis=1))
