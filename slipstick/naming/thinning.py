"""Fewer points for a piecewise linear law."""

import numpy as np


def thinned(x: np.ndarray, change: np.ndarray, most: int) -> np.ndarray:
    """Indices of at most `most` points of a law `change` (m,) at the ascending x (m,), both ends among them.

    Points are left out one by one, each time that without which the law differs least, at its worst, from all points.
    """
    kept = np.arange(len(x))
    while len(kept) > most:
        fewer = [np.delete(kept, i) for i in range(1, len(kept) - 1)]
        worst = [np.abs(np.interp(x, x[some], change[some]) - change).max() for some in fewer]
        kept = fewer[int(np.argmin(worst))]
    return kept
