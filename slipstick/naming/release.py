"""Where plates that had locked may slip again: the torque is then again what the friction can transmit."""

import numpy as np

_NEAR = 0.9
"""Share of the friction torque from which on the plates may slip, because neither signal is exact."""
_SLIPPING = 10
"""Samples before lock-up that show the friction torque for each bar."""


def released(torque: np.ndarray, pressure: np.ndarray, slipping: np.ndarray, locked: np.ndarray) -> np.ndarray:
    """Samples (n, k) from the first one on at which plates that had locked may slip again.

    `torque` in N m and `pressure` in bar are smooth signals (n, k), `slipping` and `locked` are samples (n, k) before
    and after lock-up. The plates stick while they transmit less than the friction could, whose torque for each bar is
    that of the last samples of slip.
    """
    last = slipping & (np.cumsum(slipping, axis=1) > slipping.sum(axis=1, keepdims=True) - _SLIPPING)
    forced = np.sum(torque * last, axis=1) / np.maximum(np.sum(pressure * last, axis=1), 1e-9)
    return np.asarray(np.logical_or.accumulate(locked & (torque >= _NEAR * forced[:, None] * pressure), axis=1))
