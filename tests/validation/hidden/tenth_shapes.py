"""Shapes that several effects of the list `afield` have."""

import numpy as np


def crest(x: np.ndarray, at: float, rise: float, fall: float) -> np.ndarray:
    """Return a pointed peak of height 1 at `at`, which grows over `rise` and dies out over `fall`."""
    return np.exp(np.minimum(x - at, 0) / rise - np.maximum(x - at, 0) / fall)


def shelf(x: np.ndarray, start: float, end: float, flank: float) -> np.ndarray:
    """Return 1 between two flanks in the form of half a cosine each, which are `flank` long, and 0 outside of them."""
    up, down = (np.clip(away / flank + 0.5, 0, 1) for away in (x - start, end - x))
    return (1 - np.cos(np.pi * up)) * (1 - np.cos(np.pi * down)) / 4


def scallops(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return parabolic arches of height 1 side by side, with an edge at 0 between two of them."""
    share = np.mod(x / pitch, 1.0)
    return 4 * share * (1 - share)


def warmed(x: np.ndarray, start: float, end: float, rise: float, fall: float) -> np.ndarray:
    """Return a warming from `start` to `end` that comes to rest over `rise`, and then a cooling over `fall`."""
    return (1 - np.exp(-np.clip(x - start, 0, end - start) / rise)) * np.exp(-np.maximum(x - end, 0) / fall)
