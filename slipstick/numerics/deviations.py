"""Deviations from a median, which a few outlying values hardly change."""

import numpy as np


def from_median(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return deviations of values (n, ...) from their median, and their robust standard deviation (...)."""
    off = values - np.median(values, axis=0)
    return off, 1.4826 * np.median(np.abs(off), axis=0)
