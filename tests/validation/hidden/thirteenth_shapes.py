"""Shapes that several effects of the list `outlying` have."""

import numpy as np

from .twelfth_shapes import ramp


def stairs(x: np.ndarray, *steps: tuple[float, float]) -> np.ndarray:
    """Return 0 before the first of the `steps`, and from each of them on the value that it states with its place."""
    values = np.zeros_like(x, dtype=float)
    for at, value in steps:
        values = np.where(x >= at, value, values)
    return values


def treads(x: np.ndarray, *rises: tuple[float, float, float]) -> np.ndarray:
    """Return straight `rises` with level parts in between; each has a start, an end and a height."""
    return sum(height * ramp(x, start, end) for start, end, height in rises)
