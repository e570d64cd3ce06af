"""Shapes that several effects of the list `farther` have."""

import numpy as np


def comb(x: np.ndarray, pitch: float, sharpness: float) -> np.ndarray:
    """Return narrow peaks of height 1 every `pitch`, one of them at 0, as of standing waves."""
    return 1 / (1 + sharpness * np.sin(np.pi * x / pitch) ** 2)


def settling(x: np.ndarray, at: float, pitch: float, decay: float) -> np.ndarray:
    """Return a step from 0 to 1 at `at` that swings about its end with a `pitch` and dies out over `decay`."""
    z = np.maximum(x - at, 0)
    return np.where(x > at, 1 - np.exp(-z / decay) * np.cos(2 * np.pi * z / pitch), 0.0)


def brim(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a bump of height 1 at `at` between two dips of 0.45 at 1.7 times `width` from it."""
    z = ((x - at) / width) ** 2
    return (1 - z) * np.exp(-z / 2)


def fork(x: np.ndarray, at: float) -> np.ndarray:
    """Return the distance of positive `x` from `at` in the logarithm: a sharp valley, steep before it."""
    return np.abs(np.log(x / at))


def arch(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return a parabolic arch of height 1 from `start` to `end`, and 0 outside of it."""
    return np.maximum(4 * (x - start) * (end - x) / (end - start) ** 2, 0)


def tared(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return a root that is set back to 0 every `pitch`, at which it reaches 1."""
    return np.sqrt(np.mod(x / pitch, 1.0))
