"""First-order lags that change within an engagement: what a signal trails by, with a lag at each sample."""

import numpy as np
from numba import njit

from slipstick.naming.block import Pair
from slipstick.naming.scene import WITHIN

CONSTANT: dict[str, Pair] = {"friction lag": ("contact pressure", "lag"), "converter lag": ("converter torque", "lag")}
"""Quantities of blocks that are such a lag, and the pair of the same lag where it is constant: both are one effect."""
OVER = (*WITHIN, "run order", "motor speed")
"""What such a lag may depend on."""
_STEP = 1e-3
"""Step of the finite difference with respect to the coefficients of a lag, which are about 1."""


def trailing(signal: np.ndarray, lag: np.ndarray, step: float) -> np.ndarray:
    """The change (n, k) of a `signal` (n, k), sampled every `step` s, that follows it with a `lag` (n, k) in s.

    In steady state at the first sample, and exact for a signal that is linear between samples with a constant lag. A
    negative lag is a lead by it on a ramp, of a sample at most: the change is linear in the lag about 0, so that a fit
    can begin there, and no fit can go far beyond.
    """
    found = np.empty(signal.shape)
    _trail(np.ascontiguousarray(signal), np.ascontiguousarray(lag), step, found)
    return found


def trailing_columns(signal: np.ndarray, lag: np.ndarray, basis: np.ndarray, step: float) -> np.ndarray:
    """Changes (n, m, k) of what a signal trails by with the coefficients of a further lag, with `basis` (n, m, k) in s.
    """
    now = trailing(signal, lag, step)
    return np.stack([(trailing(signal, lag + _STEP * one, step) - now) / _STEP for one in basis.transpose(1, 0, 2)],
                    axis=1)


def with_constant_lag(pair: Pair) -> Pair:
    """The pair of the same effect with a constant lag, or the pair itself where it is no lag that changes."""
    return CONSTANT.get(pair[0], pair)


@njit(nogil=True, cache=True, error_model="numpy")
def _trail(signal, lag, step, found):  # type: ignore[no-untyped-def]
    n, k = signal.shape
    for i in range(n):
        change = 0.0
        found[i, 0] = change
        for t in range(1, k):
            ratio = max(lag[i, t] / step, -1.0)
            left = np.exp(-1 / ratio) if ratio > 0 else 0.0
            change = left * change + ratio * (1 - left) * (signal[i, t - 1] - signal[i, t])
            found[i, t] = change
