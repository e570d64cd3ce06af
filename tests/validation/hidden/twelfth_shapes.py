"""Shapes that several effects of the list `remote` have."""

from collections.abc import Sequence

import numpy as np


def ramp(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return 0 up to `start`, a straight line from there on, and 1 from `end` on, as of a part between two stops."""
    return np.clip((x - start) / (end - start), 0, 1)


def eased(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return `ramp` with half a cosine instead of the line, as of a part that is cushioned at both stops."""
    return (1 - np.cos(np.pi * ramp(x, start, end))) / 2


def roof(x: np.ndarray, start: float, top: float, end: float) -> np.ndarray:
    """Return a roof of two straight lines from `start` to a ridge of height 1 at `top` and on to `end`; 0 outside."""
    return np.minimum(ramp(x, start, top), ramp(-x, -end, -top))


def trough(x: np.ndarray, start: float, end: float, width: float) -> np.ndarray:
    """Return how far `x` is outside of the range from `start` to `end`, in units of `width`: a valley, flat inside."""
    return (np.maximum(start - x, 0) + np.maximum(x - end, 0)) / width


def onset(x: np.ndarray, at: float, flank: float, power: float) -> np.ndarray:
    """Return 0 up to `at`, a steep flank up to 1, and a slow decay by a power, as of a gas above its preload."""
    return ramp(x, at, at + flank) * (np.maximum(x, at + flank) / (at + flank)) ** -power


def swing(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a dip of -1 one `width` before `at`, and a bump of 1 as far after it."""
    z = (x - at) / width
    return z * np.exp((1 - z**2) / 2)


def since(x: np.ndarray, exchanges: Sequence[float]) -> np.ndarray:
    """Return how far `x` is from the last of the `exchanges` before it, of which 0 is the first."""
    return x - sum(np.where(x > at, at - before, 0.0)
                   for before, at in zip((0.0, *exchanges), exchanges, strict=False))
