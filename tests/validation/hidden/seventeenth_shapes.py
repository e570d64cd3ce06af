"""Shapes that several effects of the list `austral` have."""

import numpy as np


def grip(x: np.ndarray, at: float, bend: float) -> np.ndarray:
    """Return the grip of a tyre over its slip: 0 at 0, 1 at `at`, and the sine of `bend` right angles far from it.

    It is odd in `x`; `bend` is between 1 and 2.
    """
    return np.sin(bend * np.arctan(np.tan(np.pi / (2 * bend)) * x / at))


def tunnel(x: np.ndarray, peak: float, end: float) -> np.ndarray:
    """Return the curve of a tunnel diode over positive `x`: 1 at `peak`, a valley, and 1 again near `end`."""
    z = np.maximum(x, 0)
    return z / peak * np.exp(1 - z / peak) + np.minimum(z / end, 1.1) ** 4


def flutter(x: np.ndarray, start: float, end: float, fall: float) -> np.ndarray:
    """Return an amplitude that sets in at `start`, grows as a root up to 1 at `end`, and dies out over `fall`."""
    z = np.clip((x - start) / (end - start), 0, 1)
    left = np.clip(1 - (x - end) / fall, 0, 1)
    return z / np.sqrt(z + 0.02) * np.sqrt(1.02) * left**2 * (3 - 2 * left)


def isolated(x: np.ndarray, at: float, damping: float) -> np.ndarray:
    """Return what a soft mounting passes on: a part below `at`, 1 at it, and ever less above it."""
    z, soft = (x / at) ** 2, 4 * damping**2
    return np.sqrt((1 + soft * z) / ((1 - z) ** 2 + soft * z) * soft / (1 + soft))


def moody(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the friction of a flow: laminar up to `at`, where it has fallen to 0.35, and turbulent above, from 0.9."""
    z = np.maximum(x / at, 0.35)
    turbulent = 1 / (1 + np.exp(-np.clip((x - at) / width, -30, 30)))
    return (1 - turbulent) * 0.35 / z + turbulent * 0.9 * z**-0.25


def boiling(x: np.ndarray, crisis: float, film: float) -> np.ndarray:
    """Return the heat that a boiling liquid takes: 1 at the `crisis`, 0.2 from the `film` on, and slowly more above."""
    z, above = np.clip(x / crisis, 0, 1), np.clip((x - crisis) / (film - crisis), 0, 1)
    rest = 0.4 * (1 - np.exp(-np.maximum(x - film, 0) / film))
    return z**3 * (4 - 3 * z) - 0.4 * (1 - np.cos(np.pi * above)) + rest


def closing(x: np.ndarray, at: float, width: float, length: float) -> np.ndarray:
    """Return the pull over a gap that closes with `x`: an inverse square up to nearly 1 at `at`, and a loss by half
    over `length` behind it, where the parts touch; the corner between them is rounded.
    """
    gap = 1 + np.logaddexp(0, 8 * (at - x) / width) / 8
    return gap**-2 - 0.5 * (1 - np.exp(-((np.maximum(x - at, 0) / length) ** 2)))


def foam(x: np.ndarray, first: float, last: float) -> np.ndarray:
    """Return the force on a foam: it yields at `first`, at half of the force, and is dense at `last`; odd in `x`."""
    z = np.minimum(np.abs(x) / last, 1.15)
    return np.sign(x) * (np.tanh(np.abs(x) / first) + z**7) / 2


def creeps(x: np.ndarray, first: float, last: float) -> np.ndarray:
    """Return the creep of a part up to its end at 1: fast over `first`, hardly in the middle, and fast over `last`."""
    return (1 - np.exp(-np.maximum(x, 0) / first) + np.exp((np.minimum(x, 1) - 1) / last)) / 2


def rebound(x: np.ndarray, at: float, rise: float, decay: float, under: float) -> np.ndarray:
    """Return 0 up to `at`, a rise to nearly 1, and a decay past 0 to less `under`, as of a controller with a bias."""
    z = np.maximum(x - at, 0)
    return (1 - np.exp(-z / rise)) * ((1 + under) * np.exp(-z / decay) - under)


def wells(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return two wells of depth 1 down to 0, one `width` before and one after `at`, with walls up to 1.4 outside."""
    return np.minimum((((x - at) / width) ** 2 - 1) ** 2, 1.4)


def notch(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the response of a trap that is tuned to `at`: 0 there, with a sharp corner, and nearly 1 far from it."""
    away = np.abs(x**2 - at**2)
    return away / np.hypot(away, width * x)


def drifted(x: np.ndarray, start: float, end: float, pace: float, decay: float, left: float) -> np.ndarray:
    """Return a logarithmic drift from `start` to 1 at `end`, and a recovery over `decay`, of which `left` is left."""
    drift = np.log1p((np.clip(x, start, end) - start) / pace) / np.log1p((end - start) / pace)
    return drift * (left + (1 - left) * np.exp(-np.maximum(x - end, 0) / decay))
