"""Signals in the form of rows: clocks, noise filter and means in one pass over the samples."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def fill_rows(signal, late, rho, scale, width, failed, out):  # type: ignore[no-untyped-def]
    """Fill `out` (m, k // width) with the scaled means of `width` samples each of e_t = (y_t - rho y_{t-1}) / root.

    y is the `signal` (m, k) with a clock that is `late` by this share of a sample, by its derivative as `np.gradient`
    has it; root is sqrt(1 - rho^2), and 1 in the first sample. Means that are not numbers become `failed`.
    """
    k, root, half = signal.shape[1], np.sqrt(1 - rho * rho), 0.5 * late
    y, factor = np.empty(k), scale / (root * width)
    for i in range(len(signal)):
        row, means = signal[i], out[i]
        y[0], y[-1] = row[0] - late * (row[1] - row[0]), row[-1] - late * (row[-1] - row[-2])
        for t in range(1, k - 1):  # without branches: vectors
            y[t] = row[t] - half * (row[t + 1] - row[t - 1])
        before, total = 0.0, (root - 1) * y[0]
        for block in range(len(means)):
            for now in y[block * width:(block + 1) * width]:
                total += now - rho * before
                before = now
            means[block] = failed if np.isnan(total) else factor * total
            total = 0.0
