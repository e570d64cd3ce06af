"""Shapes that several effects of the list `abroad` have."""

import numpy as np


def edge(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a step from 0 to 1 at `at` whose flanks die out slowly; half of it is within 0.6 `width` of it."""
    z = (x - at) / width
    return 0.5 + 0.5 * z / np.sqrt(1 + z**2)


def hinge(x: np.ndarray, at: float, rounding: float) -> np.ndarray:
    """Return by how much `x` is above `at`, with a corner that is rounded over about `rounding`."""
    return 0.5 * (x - at + np.hypot(x - at, rounding))


def hump(x: np.ndarray, at: float, power: float) -> np.ndarray:
    """Return a hump over positive `x` with height 1 at `at`, steep before it and slow after it; 0 elsewhere."""
    z = np.maximum(x, 0) / at
    return z**power * np.exp(power * (1 - z))


def burr(x: np.ndarray, at: float, width: float, length: float) -> np.ndarray:
    """Return a soft step up at `at`, about `width` wide, that decays over `length`."""
    return edge(x, at, width) * np.exp(-np.maximum(x - at, 0) / length)
