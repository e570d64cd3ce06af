"""Shapes that several effects of the list `overseas` have."""

import numpy as np


def saddle(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return two humps of height 1, one `width` before and one after `at`, and 0 between them."""
    z = ((x - at) / width) ** 2
    return z * np.exp(1 - z)


def lull(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a dip of -1 one `width` before `at`, and a bump of 1 as far after it, with a level part in between."""
    z = (x - at) / width
    return z**3 * np.exp(1.5 * (1 - z**2))


def dome(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return half an ellipse of height 1, upright at `start` and at `end`, and 0 outside of it."""
    z = (2 * x - start - end) / (end - start)
    return np.sqrt(np.maximum(1 - z**2, 0))


def spike(x: np.ndarray, at: float, before: float, after: float) -> np.ndarray:
    """Return a logarithmic peak of height 1 at `at`; a tenth of it is left at `before` in front and `after` behind."""
    z = (x - at) / np.where(x < at, before, after)
    return np.log1p(1 / (z**2 + 0.0025)) / np.log1p(400)


def packet(x: np.ndarray, at: float, pitch: float, width: float) -> np.ndarray:
    """Return a train of waves about `at`, whose middle one has the height 1."""
    return np.cos(2 * np.pi * (x - at) / pitch) * np.exp(-(((x - at) / width) ** 2) / 2)


def beat(x: np.ndarray, first: float, second: float) -> np.ndarray:
    """Return the mean of two waves with the pitches `first` and `second`, both at their top at 0."""
    return (np.cos(2 * np.pi * x / first) + np.cos(2 * np.pi * x / second)) / 2


def fringes(x: np.ndarray, at: float, lead: float) -> np.ndarray:
    """Return waves over positive `x` that become ever longer; the last top is at `at` less `lead`."""
    return np.cos(2 * np.pi * at / (np.maximum(x, 0) + lead))


def cusps(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return pointed tops of height 1 every `pitch`, one of them at 0, and hollows down to 0 with a root's flanks."""
    return 1 - np.sqrt(np.abs(2 * np.mod(x / pitch + 0.5, 1.0) - 1))


def gears(x: np.ndarray, ratio: float, fall: float) -> np.ndarray:
    """Return teeth of height 1 over `x` from 1 on, each `ratio` times as long as the one before it.

    A tooth rises with the logarithm of `x`, and falls over the share `fall` of it.
    """
    share = np.mod(np.log(np.maximum(x, 1e-3)) / np.log(ratio), 1.0)
    return np.minimum(share / (1 - fall), (1 - share) / fall)


def bounces(x: np.ndarray, start: float, length: float, ratio: float) -> np.ndarray:
    """Return arches from `start` on, as of a ball; each is `ratio` times as long as the last, and lower by its square.

    The first one is `length` long and 1 high; there are five.
    """
    height = np.zeros_like(x, dtype=float)
    for number in range(5):
        reach = length * ratio**number
        share = (x - start) / reach
        height += np.where((share >= 0) & (share < 1), 4 * ratio ** (2 * number) * share * (1 - share), 0.0)
        start = start + reach
    return height
