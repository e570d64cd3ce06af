"""Signals in the form of rows: clocks, noise filter and means in one pass over the samples."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def fill(signal, late, rho, scale, width, failed, out):  # type: ignore[no-untyped-def]
    """Fill `out` (m, k // width) with the scaled means of `width` samples each of e_t = (y_t - rho y_{t-1}) / root.

    y is the `signal` (m, k) with a clock that is `late` by this share of a sample, by its derivative as `np.gradient`
    has it; root is sqrt(1 - rho^2), and 1 in the first sample. Means that are not numbers become `failed`.
    """
    k, fresh = signal.shape[1], scale / np.sqrt(1 - rho * rho)
    for i in range(len(signal)):
        before = 0.0
        for block in range(out.shape[1]):
            total = 0.0
            for t in range(block * width, (block + 1) * width):
                behind, ahead = max(0, t - 1), min(k - 1, t + 1)
                y = signal[i, t] - late * (signal[i, ahead] - signal[i, behind]) / (ahead - behind)
                total += scale * y if t == 0 else fresh * (y - rho * before)
                before = y
            out[i, block] = failed if np.isnan(total) else total / width
