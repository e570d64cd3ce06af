"""First-order lags that are exactly absent at zero: in the equations by a memory, on a signal by exact updates."""

import numpy as np

from slipstick.clutch.fastmath import allocating, compiled

SHORTEST_LAG = 5e-4
"""Lag in s below which the equations mix the lagged value with the instant one, so that steps need not shrink to 0."""


@compiled
def lagged(value: float, memory: float, lag: float) -> float:
    """What is left of `value` behind a lag in s whose state is `memory`; exactly `value` at lag 0."""
    return value + min(1.0, lag / SHORTEST_LAG) * (memory - value)


@compiled
def lag_rate(value: float, memory: float, lag: float) -> float:
    """Rate at which the state `memory` of a lag in s goes after `value`; 0 at lag 0, where steps may be long."""
    rate = (value - memory) / max(SHORTEST_LAG, lag)
    return rate if lag > 0.0 else 0.0


def time_constant(lag: np.ndarray) -> np.ndarray:
    """What limits the steps, in s: no limit where there is no lag."""
    return np.where(lag > 0, np.maximum(lag, SHORTEST_LAG), np.inf)


def lagged_signal(values: np.ndarray, times: np.ndarray, lag: np.ndarray) -> np.ndarray:
    """Signals (..., k) sampled at `times` (k,) in s behind first-order lags in s, that broadcast to (..., 1).

    Relaxed at the first sample; exact for signals that are straight between samples; a lag of 0 gives every bit back.
    """
    rows = values.reshape(-1, values.shape[-1])
    behind = np.empty_like(rows)
    _follow(rows, times, np.broadcast_to(lag, (*values.shape[:-1], 1)).ravel(), behind)
    return behind.reshape(values.shape)


def _follow(values: np.ndarray, times: np.ndarray, lags: np.ndarray, behind: np.ndarray) -> None:
    for row in range(len(values)):
        lag = lags[row]
        state = values[row, 0]
        behind[row, 0] = state
        for k in range(1, len(times)):
            step, before, now = times[k] - times[k - 1], values[row, k - 1], values[row, k]
            # On a ramp the reading ends up behind by lag times the slope, and nears that exponentially.
            drag = lag * (now - before) / step if lag > 0.0 and step > 0.0 else 0.0
            left = np.exp(-step / lag) if lag > 0.0 else 0.0
            state = now - drag + (state - before + drag) * left
            behind[row, k] = state


_follow = allocating(_follow, cache=True)
