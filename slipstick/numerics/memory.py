"""What a signal keeps of its past: after a mechanical play, and after first-order lags."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def play(signal, width):  # type: ignore[no-untyped-def]
    """Return a signal (n, k) after a mechanical play of half-width `width`."""
    out = np.empty_like(signal)
    for i in range(len(signal)):
        here = signal[i, 0]
        for j in range(signal.shape[1]):
            here = min(max(here, signal[i, j] - width), signal[i, j] + width)
            out[i, j] = here
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_lags(signal, times, weights):  # type: ignore[no-untyped-def]
    """Return the weighted sum (n, k) of what first-order lags of `times` (m,) samples leave of a signal (n, k).

    The signal is linear between samples.
    """
    out, keep, behind = np.zeros_like(signal), np.exp(-1 / times), np.empty(len(times))
    slope = times * (1 - keep)  # how far a lag is behind a signal that has risen by 1 over the last sample
    for i in range(len(signal)):
        behind[:] = 0.0
        for t in range(signal.shape[1]):
            rise, total = signal[i, t] - signal[i, max(t - 1, 0)], 0.0
            for m in range(len(times)):
                behind[m] = keep[m] * behind[m] - slope[m] * rise
                total += weights[m] * behind[m]
            out[i, t] = total
    return out
