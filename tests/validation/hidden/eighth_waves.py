"""Shapes that several effects of the list `beyond` have."""

import numpy as np
from scipy.special import ellipj


def flat(turns: np.ndarray) -> np.ndarray:
    """Return a wave with steep flanks and flat tops, between -1 and 1."""
    return np.tanh(3 * np.sin(2 * np.pi * turns)) / np.tanh(3)


def modulated(turns: np.ndarray, depth: float) -> np.ndarray:
    """Return a wave whose phase is shifted by up to `depth` turns, slowly and periodically."""
    return np.sin(2 * np.pi * (turns + depth * np.sin(2 * np.pi * turns / 2.3)))


def pulses(turns: np.ndarray, sharpness: float) -> np.ndarray:
    """Return alternating pulses with rests in between, between -1 and 1, as of an elliptic pendulum."""
    return ellipj(8 * turns, sharpness)[1]
