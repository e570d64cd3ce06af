"""Shapes that several effects of the list `distant` have."""

import numpy as np


def teeth(x: np.ndarray, pitch: float, fall: float) -> np.ndarray:
    """Return teeth of height 1 side by side, which rise straight from 0 on, and fall over the share `fall` of each."""
    share = np.mod(x / pitch, 1.0)
    return np.minimum(share / (1 - fall), (1 - share) / fall)


def peaks(x: np.ndarray, *places: tuple[float, float, float]) -> np.ndarray:
    """Return the sum of resonances; each has a place, half its width at half its height, and a height."""
    return sum(height / (1 + ((x - at) / width) ** 2) for at, width, height in places)


def landing(x: np.ndarray, at: float, pitch: float, decay: float) -> np.ndarray:
    """Return a step from 0 to 1 that begins smoothly at `at`, as of a mass on a spring; see `settling`."""
    z = np.maximum(x - at, 0)
    turns = 2 * np.pi * z / pitch
    return 1 - np.exp(-z / decay) * (np.cos(turns) + pitch / (2 * np.pi * decay) * np.sin(turns))
