"""Shapes that several effects of the list `polar` have."""

import numpy as np


def slits(x: np.ndarray, pitch: float, number: int) -> np.ndarray:
    """Return the light behind so many slits: peaks of height 1 every `pitch`, one at 0, and low ones in between."""
    waves = (2 * (1 - k / number) * np.cos(2 * np.pi * k * x / pitch) for k in range(1, number))
    return (1 + sum(waves)) / number


def bond(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the energy of a bond: a wall before `at`, cut off at 2, 0 at it, and a slow rise to 1 behind it."""
    return np.minimum((1 - np.exp(-np.maximum(x - at, -3 * width) / width)) ** 2, 2.0)


def fins(x: np.ndarray, pitch: float, share: float, rate: float) -> np.ndarray:
    """Return fins of height 1 side by side, as of a vessel that is filled over a `share` of each `pitch`, and emptied.

    Filling and emptying become slower, by the exponential of `rate` from their start to their end.
    """
    phase = np.mod(x / pitch, 1.0)
    filled = 1 - np.exp(-rate * phase / share)
    left = np.exp(-rate * (phase - share) / (1 - share)) - np.exp(-rate)
    return np.where(phase < share, filled, left) / (1 - np.exp(-rate))


def absorber(x: np.ndarray, at: float, beside: float, width: float) -> np.ndarray:
    """Return the logarithm of a response with an absorber: a pointed dip of -1 at `at`, and a peak of 1 at `beside`."""
    dip, peak = ((x - place) ** 2 + width**2 for place in (at, beside))
    return np.log(dip / peak) / np.log1p(((beside - at) / width) ** 2)


def rough(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return Takagi's curve of height 1: roofs from 0 every `pitch`, with roofs of half the length on them, and so on.

    There are five sizes of roofs.
    """
    return sum(np.abs(np.mod(x / pitch * 2**k + 0.5, 1.0) - 0.5) / 2**k for k in range(5)) / 0.65625


def overtones(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return a wave with its third and fifth overtone: a square one between -1 and 1 that ripples on its flats."""
    return sum(np.sin(2 * np.pi * k * x / pitch) / k for k in (1, 3, 5)) / 0.934


def recoil(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return 0 up to `at`, a dip of 0.54, and a rise to 1 behind it, as of a machine that gives way at first."""
    z = np.maximum(x - at, 0) / width
    return 1 - (1 + 3 * z) * np.exp(-z)


def crowded(x: np.ndarray, start: float, end: float, order: int) -> np.ndarray:
    """Return waves between `start` and `end` that crowd at both ends: the Chebyshev polynomial of an `order`."""
    return np.cos(order * np.arccos(np.clip((2 * x - start - end) / (end - start), -1, 1)))


def winds(x: np.ndarray, at: float, width: float, turns: float) -> np.ndarray:
    """Return the sine of an angle that makes so many `turns` about `at`, where it is 0, and rests far from it."""
    return np.sin(np.pi * turns * np.tanh((x - at) / width))


def echoes(x: np.ndarray, first: float, pitch: float, ratio: float, width: float) -> np.ndarray:
    """Return five bumps from `first` on, every `pitch`, the first 1 high, each `ratio` times as high as the last."""
    return sum(ratio**k * np.exp(-(((x - first - k * pitch) / width) ** 2)) for k in range(5))
