"""Functions that are linear between knots and constant beyond them."""

import numpy as np
from numba import njit


def hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Hat functions (n, m, ...) of x (n, ...) at m increasing knots, in the unit of x, and constant beyond them.

    Each is 1 at its own knot and 0 at the others; together they are 1 everywhere.
    """
    if len(knots) < 2:
        return np.ones((len(x), len(knots), *x.shape[1:]))
    out = np.zeros((len(x), len(knots), *x.shape[1:]))
    _fill_hats(np.ascontiguousarray(x, float).reshape(len(x), -1), knots, out.reshape(len(x), len(knots), -1))
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_hats(x, knots, out):  # type: ignore[no-untyped-def]
    last = len(knots) - 2
    for i in range(x.shape[0]):
        j = 0
        for t in range(x.shape[1]):
            while j < last and x[i, t] >= knots[j + 1]:  # the next value is seldom far from this one
                j += 1
            while j > 0 and x[i, t] < knots[j]:
                j -= 1
            share = min(max((x[i, t] - knots[j]) / (knots[j + 1] - knots[j]), 0.0), 1.0)
            out[i, j, t], out[i, j + 1, t] = 1 - share, share


def slope(x: np.ndarray, knots: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Slope at x of the function with these values at increasing `knots`; 0 beyond them."""
    steps = np.concatenate([[0.0], np.diff(values) / np.diff(knots), [0.0]])
    return np.asarray(steps[np.searchsorted(knots, x, side="right")])
