"""Shapes that several effects of the list `further` have."""

import numpy as np


def skewed(turns: np.ndarray, skew: float) -> np.ndarray:
    """Return a wave that rises slowly and falls fast, as of an eccentric; between -1 and 1."""
    angle = 2 * np.pi * turns
    return np.arctan2(skew * np.sin(angle), 1 + skew * np.cos(angle)) / np.arcsin(skew)


def root(x: np.ndarray, rounding: float) -> np.ndarray:
    """Return the root of `x` with its sign, smooth near 0."""
    return x / (x**2 + rounding**2) ** 0.25
