"""Shapes that several effects of the list `glacial` have."""

import numpy as np
from scipy.special import airy, j1


def rainbow(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return waves before a turning point `at`, as within a rainbow: Airy's function, and hardly anything behind it.

    The last crest is 1 high and about one `width` before `at`; those farther before it are closer and lower.
    """
    return airy((x - at) / width)[0] / 0.5357


def stalled(x: np.ndarray, at: float, end: float) -> np.ndarray:
    """Return the lift of a vane over positive `x`: straight up to nearly 1 at `at`, where the flow leaves the vane.

    Behind it is a second, broad hump of 0.9 in the middle between 0 and `end`, and 0 from `end` on.
    """
    z = np.maximum(x, 0) / at
    left = 1 / (1 + np.exp(-np.clip((z - 1.15) / 0.06, -30, 30)))
    return (1 - left) * np.minimum(z, 2) + left * 0.9 * np.sin(np.pi * np.clip(x / end, 0, 1))


def lobes(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the wave behind one slit: 1 at `at`, 0 at every other multiple of `width` from it, and lobes in between.

    The first lobes to both sides are -0.22 high, and the second ones 0.13.
    """
    return np.sinc((x - at) / width)


def drum(x: np.ndarray, at: float) -> np.ndarray:
    """Return the first ring of waves on a drum, odd in `x`: 1 at `at`, -0.59 at 2.9 times it, and ever less beyond."""
    return j1(1.8412 * x / at) / 0.5819


def doubling(x: np.ndarray, pitch: float, start: float, end: float) -> np.ndarray:
    """Return waves with a crest of 1 at 0, of which every other crest is lost by and by from `start` to `end`."""
    lost = np.clip((x - start) / (end - start), 0, 1)
    return (np.cos(2 * np.pi * x / pitch) + lost * np.cos(np.pi * x / pitch)) / (1 + lost)


def regrown(x: np.ndarray, pace: float, *cuts: tuple[float, float]) -> np.ndarray:
    """Return what grows up to 1 like an S, at a `pace`; each of the `cuts` has a place, and what it leaves."""
    level = np.zeros_like(x, dtype=float)
    for at, left in cuts:
        grown = 1 / (1 + (1 / left - 1) * np.exp(-pace * np.maximum(x - at, 0)))
        level = np.where(x >= at, grown, level)
    return level


def slam(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the beat of a valve: a low hump, a sharp peak of about 1 at `at`, a dip behind it, and a broad hump."""
    parts = ((0.25, -2.2, 0.7), (1.1, 0.0, 0.35), (-0.55, 0.75, 0.35), (0.55, 2.6, 0.9))
    return sum(height * np.exp(-((((x - at) / width - place) / breadth) ** 2)) for height, place, breadth in parts)


def smoothed(x: np.ndarray, pitch: float, decay: float) -> np.ndarray:
    """Return a rectified wave behind a store: a crest of 1 every `pitch`, one of them at 0.

    The store drains over `decay` behind each crest, until the next one fills it up.
    """
    phase = np.mod(x, pitch)
    return np.maximum(np.abs(np.cos(np.pi * phase / pitch)), np.exp(-phase / decay))


def warble(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return a sound of two tones by turns: one wave over the first half of each `pitch`, and two over the second."""
    phase = np.mod(x / pitch, 1.0)
    return np.sin(2 * np.pi * np.where(phase < 0.5, 2 * phase, 4 * phase - 1))


def trapped(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a wave that is trapped in a bowl about `at`: four lobes, the outer ones about 1 high, the inner ones 0.84.

    The outer lobes are two times `width` from `at`, and their signs are those of the side.
    """
    z = (x - at) / width
    return (2 * z**3 - 3 * z) * np.exp(-(z**2) / 2) / 1.356


def locking(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return how far a part is ahead that follows in steps of three sizes from `start` to `end`: Cantor's staircase.

    It is 1 where the widest step begins, -1 where it ends, and 0 outside.
    """
    places, levels = np.array([0.0, 1.0]), np.array([0.0, 1.0])
    for _ in range(3):
        places, levels = np.append(places, places + 2) / 3, np.append(levels, levels + 1) / 2
    z = np.clip((x - start) / (end - start), 0, 1)
    return 6 * (np.interp(z, places, levels) - z)


def shingles(x: np.ndarray, start: float, ridge: float, end: float, number: int) -> np.ndarray:
    """Return a roof from `start` over a `ridge` of 1 to `end`, from which so many shingles hang down by 0.4 each."""
    z = np.clip((x - start) / (end - start), 0, 1)
    roof = np.interp(x, [start, ridge, end], [0.0, 1.0, 0.0])
    return roof - 0.4 * np.mod(number * z, 1.0)


def twisted(x: np.ndarray, at: float, full: float, turns: float) -> np.ndarray:
    """Return the light through a crystal that a field untwists from `at` on: 0 before, and waves between 0 and 1.

    There are so many waves up to `full`; the first one is the steepest.
    """
    untwisted = np.clip((x**2 - at**2) / (full**2 - at**2), 0, None)
    return np.sin(np.pi * turns * np.sqrt(untwisted)) ** 2


def jam(x: np.ndarray, at: float, drop: float, end: float) -> np.ndarray:
    """Return a flow that grows straight up to 1 at `at`, where it jams and loses a `drop`.

    From there on it falls straight to 0 at `end`.
    """
    return np.interp(x, [0, at, 1.06 * at, end], [0.0, 1.0, 1 - drop, 0.0])


def revived(x: np.ndarray, pitch: float, period: float) -> np.ndarray:
    """Return waves with a `pitch` that die out and are revived every `period`, one of which is at 0."""
    return np.cos(2 * np.pi * x / pitch) * np.exp(-((np.sin(np.pi * x / period) / 0.75) ** 2))
