"""First-order lags of signals, several at a time: the changes that each makes, or their weighted sum.

The lags are in steady state at the first sample, and exact for signals that are linear between samples, which are
equally spaced.
"""

import numpy as np
from numba import njit

from slipstick.naming.bases import delayed, doubled
from slipstick.numerics.memory import weigh_lags

_LAGS = np.array([0.1, 0.3, 1.0, 3.0])
"""Lags relative to the time scale of a block: their combinations come close to any lag between."""


def lags_about(scale: float) -> np.ndarray:
    """Lags (4,) in s of which that of a sensor is a mixture, about the time `scale` in s of a block."""
    return scale * _LAGS


def late_by(signal: np.ndarray, time: np.ndarray, scale: float) -> np.ndarray:
    """What sensors of a `signal` (n, k) at `time` (k,) in s read too much, (n, 4, k), with lags about `scale` in s."""
    signal, times = np.ascontiguousarray(signal), lags_about(scale) / (time[1] - time[0])
    return np.stack([weigh_lags(signal, times[[lag]], np.ones(1)) for lag in range(len(times))], axis=1)


def mixed(signal: np.ndarray, time: np.ndarray, scale: float, weights: np.ndarray) -> np.ndarray:
    """The sum (n, k) of those, with `weights` (n, 4, k), whose last axis may have a length of 1.

    Weights (n / m, 4, k) are those of m signals each, one after the other.
    """
    total = np.empty(signal.shape)
    _sum(np.ascontiguousarray(signal), *_factors(time, scale), np.ascontiguousarray(weights), total)
    return total


def modulated(late: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Columns (n, m l, k) of `late` ones (n, l, k) that have each of the `sizes` (n, m, k), or (n, m, 1)."""
    columns = sizes[:, :, None] * late[:, None]
    return np.asarray(columns.reshape(len(late), -1, late.shape[-1]))


def lag_points(finer: int) -> np.ndarray:
    """Points of a `finer` lag of a sensor, over the largest signal."""
    return np.linspace(0, 1, doubled(2, finer - 1))


def dead_times(signal: np.ndarray, time: np.ndarray, scale: float) -> list[np.ndarray]:
    """What sensors of a `signal` (n, k) read too much that are late by a dead time, (n, k) for each of the lags."""
    return [delayed(signal, lag / (time[1] - time[0])) - signal for lag in lags_about(scale)]


def add_dead_times(total: np.ndarray, signal: np.ndarray, time: np.ndarray, scale: float, sizes: np.ndarray) -> None:
    """Add the sum of those with `sizes` (4,) to a `total` (n, k), which is contiguous."""
    _add_late(np.ascontiguousarray(signal), lags_about(scale) / (time[1] - time[0]), sizes, total)


def _factors(time: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """What is left of a change (4,) after a sample, and what a step of the signal adds to it, as a share.

    On a ramp the reading trails the signal by the lag times its slope, after an exponential transient.
    """
    ratio = lags_about(scale) / (time[1] - time[0])
    left = np.exp(-1 / ratio)
    return left, ratio * (1 - left)


@njit(nogil=True, cache=True, error_model="numpy")
def _sum(signal, left, added, weights, total):  # type: ignore[no-untyped-def]
    n, k = signal.shape
    each = n // len(weights)
    # Four numbers each, which stay in registers: an array takes twice the time.
    left0, left1, left2, left3 = left
    added0, added1, added2, added3 = added
    for i in range(n):
        own = i // each
        w0, w1, w2, w3 = weights[own, 0, 0], weights[own, 1, 0], weights[own, 2, 0], weights[own, 3, 0]
        change0 = change1 = change2 = change3 = 0.0
        total[i, 0] = 0.0
        for t in range(1, k):
            step = signal[i, t - 1] - signal[i, t]
            change0 = left0 * change0 + added0 * step
            change1 = left1 * change1 + added1 * step
            change2 = left2 * change2 + added2 * step
            change3 = left3 * change3 + added3 * step
            if weights.shape[2] > 1:
                w0, w1, w2, w3 = weights[own, 0, t], weights[own, 1, t], weights[own, 2, t], weights[own, 3, t]
            total[i, t] = w0 * change0 + w1 * change1 + w2 * change2 + w3 * change3


@njit(nogil=True, cache=True, error_model="numpy")
def _add_late(signal, late, sizes, total):  # type: ignore[no-untyped-def]
    n, k = signal.shape
    for i in range(n):
        for each in range(len(late)):
            whole = int(np.ceil(late[each]))
            later = sizes[each] * (whole - late[each])  # of two samples
            earlier = sizes[each] - later
            begin = min(whole, k)
            for t in range(begin):
                total[i, t] += sizes[each] * (signal[i, 0] - signal[i, t])
            for t in range(begin, k):
                total[i, t] += (earlier * signal[i, t - whole] + later * signal[i, t - whole + 1]
                                - sizes[each] * signal[i, t])
