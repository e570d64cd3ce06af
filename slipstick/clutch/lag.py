"""First-order lags that vanish exactly at zero: as a memory in the equations, or as an exact filter of a signal."""

import numpy as np

from slipstick.clutch.fastmath import allocating, compiled

SHORTEST_LAG = 5e-4
"""Lag in s below which the lagged value is blended with the instantaneous value, to keep steps long."""


@compiled
def lagged(value: float, memory: float, lag: float) -> float:
    """Output of a first-order lag in s with the state `memory` and the input `value`; exactly `value` at lag 0."""
    return value + min(1.0, lag / SHORTEST_LAG) * (memory - value)


@compiled
def lag_rate(value: float, memory: float, lag: float) -> float:
    """Time derivative of the state `memory` of a lag in s with the input `value`; 0 at lag 0."""
    rate = (value - memory) / max(SHORTEST_LAG, lag)
    return rate if lag > 0.0 else 0.0


def time_constant(lag: np.ndarray) -> np.ndarray:
    """Time constant in s that limits the steps; infinite without a lag."""
    return np.where(lag > 0, np.maximum(lag, SHORTEST_LAG), np.inf)


def lagged_signal(values: np.ndarray, times: np.ndarray, lag: np.ndarray) -> np.ndarray:
    """Signals (..., k) at `times` (k,) in s after first-order lags in s, which broadcast to (..., 1).

    The lag is in steady state at the first sample. The result is exact for signals that are linear between samples,
    and bit-identical to `values` at a lag of 0.
    """
    rows = values.reshape(-1, values.shape[-1])
    filtered = np.empty_like(rows)
    _filter(rows, times, np.full((*values.shape[:-1], 1), lag).ravel(), filtered)
    return filtered.reshape(values.shape)


def _filter(values: np.ndarray, times: np.ndarray, lags: np.ndarray, filtered: np.ndarray) -> None:
    decays = np.zeros(len(times))
    for row in range(len(values)):
        lag = lags[row]
        if row == 0 or lag != lags[row - 1]:  # rows usually share their lag, and exponentials are slow
            for k in range(1, len(times)):
                decays[k] = np.exp(-(times[k] - times[k - 1]) / lag) if lag > 0.0 else 0.0
        state = values[row, 0]
        filtered[row, 0] = state
        for k in range(1, len(times)):
            step, before, now = times[k] - times[k - 1], values[row, k - 1], values[row, k]
            # On a ramp the output trails the input by lag * slope, after an exponential transient.
            ramp_error = lag * (now - before) / step if lag > 0.0 and step > 0.0 else 0.0
            state = now - ramp_error + (state - before + ramp_error) * decays[k]
            filtered[row, k] = state


_filter = allocating(_filter, cache=True)
