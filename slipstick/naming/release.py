"""From when to when plates stick: from where their slip is gone until the torque is what the friction can transmit."""

import numpy as np

_NEAR = 0.9
"""Share of the friction torque from which on the plates may slip, because neither signal is exact."""
_SLIPPING = 10
"""Samples before lock-up that show the friction torque for each bar."""

_STUCK, _SEEN = 20, 3.0
"""Samples after lock-up that show offset and noise of the slip, and standard deviations of a slip that is not noise."""
_EARLIER = 2
"""Samples by which a smooth slip may end late."""


def slips_until(slip: np.ndarray, locked: np.ndarray) -> np.ndarray:
    """Samples (n, k) up to those from which on the smooth `slip` (n, k) in rad/s is no more than noise until `locked`.

    The measured shifting time may be late by more than a bench states. Offset and noise of the slip are those of the
    first samples (n, k) at which the plates are `locked` for certain. Without any, all samples are returned.
    """
    stuck = locked & (np.cumsum(locked, axis=1) <= _STUCK)
    count = stuck.sum(axis=1, keepdims=True)
    left = slip - (slip * stuck).sum(axis=1, keepdims=True) / np.maximum(count, 1)
    noise = np.sqrt((left[stuck] ** 2).sum() / max(1, count.sum() - np.count_nonzero(count)))
    slips = np.logical_or.accumulate((~locked & (left > _SEEN * noise))[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(np.pad(slips[:, _EARLIER:], ((0, 0), (0, _EARLIER))) | (count == 0))


def released(torque: np.ndarray, pressure: np.ndarray, slipping: np.ndarray, locked: np.ndarray) -> np.ndarray:
    """Samples (n, k) from the first one on at which plates that had locked may slip again.

    `torque` in N m and `pressure` in bar are smooth signals (n, k), `slipping` and `locked` are samples (n, k) before
    and after lock-up. The plates stick while they transmit less than the friction could, whose torque for each bar is
    that of the last samples of slip.
    """
    last = slipping & (np.cumsum(slipping, axis=1) > slipping.sum(axis=1, keepdims=True) - _SLIPPING)
    forced = np.sum(torque * last, axis=1) / np.maximum(np.sum(pressure * last, axis=1), 1e-9)
    return np.asarray(np.logical_or.accumulate(locked & (torque >= _NEAR * forced[:, None] * pressure), axis=1))
