"""Shapes that several effects of the list `alpine` have."""

import numpy as np
from scipy.special import fresnel


def fano(x: np.ndarray, at: float, width: float, share: float) -> np.ndarray:
    """Return a resonance near `at` that interferes with a direct path: 0 at one place, and a peak of 1 behind it.

    The zero is `share` times `width` before `at`, and the peak `width` / `share` behind it.
    """
    z = (x - at) / width
    return (share + z) ** 2 / ((1 + share**2) * (1 + z**2))


def avalanches(x: np.ndarray, rate: float, edge: float, *falls: tuple[float, float]) -> np.ndarray:
    """Return a load that grows at a `rate` over positive `x`, and from which uneven `falls` go down.

    A fall has a place, from which it takes `edge`, and an amount.
    """
    return rate * np.maximum(x, 0) - sum(amount * np.clip((x - at) / edge, 0, 1) for at, amount in falls)


def leaning(x: np.ndarray, at: float, lean: float, loss: float, edge: float) -> np.ndarray:
    """Return the amplitude of an oscillator whose spring becomes harder: up to 1 at `at` + `lean`, where it collapses.

    It would be at `at`, and half as wide as `loss`, if it were small; the collapse is rounded over about `edge`.
    """
    amplitude = np.geomspace(0.004, 1, 400)
    backbone, away = at + lean * amplitude**2, loss * np.sqrt(1 / amplitude**2 - 1)
    fold = int(np.argmin(backbone + away)) + 1
    high = np.interp(x, backbone - away, amplitude)
    low = np.interp(x, (backbone + away)[:fold][::-1], amplitude[:fold][::-1])
    collapsed = 1 / (1 + np.exp(-np.clip((x - at - lean) / edge, -30, 30)))
    return high * (1 - collapsed) + low * collapsed


def shadow(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return waves behind an edge: a fourth of their strength at `at`, nothing before, and ripples about 1 behind.

    The ripples are up to 1.37, the first one 1.2 times `width` behind, and become ever closer and lower.
    """
    sine, cosine = fresnel((x - at) / width)
    return ((cosine + 0.5) ** 2 + (sine + 0.5) ** 2) / 2


def swell(x: np.ndarray, pitch: float, steep: float) -> np.ndarray:
    """Return a swell of water, between -1 and 1: a sharp crest every `pitch`, one of them at 0, and broad troughs.

    A particle of it goes round a circle; `steep` is from 0, for a sine, to 1, for cusps.
    """
    angle = np.linspace(-np.pi, np.pi, 801)
    place = (angle - steep * np.sin(angle)) / (2 * np.pi)
    return np.interp(np.mod(x / pitch + 0.5, 1.0) - 0.5, place, np.cos(angle))


def tipping(x: np.ndarray, pitch: float, edge: float) -> np.ndarray:
    """Return a relaxation oscillation: from 1 ever faster down to 0.5 over half a `pitch`, a jump to -1, and so on.

    A jump takes the share `edge` of half a pitch; half of the first one is over at 0.
    """
    level = np.linspace(1, 0.5, 201)
    place = (2 - 2 * level**2 + np.log(level)) / (1.5 - np.log(2))
    halves = 2 * x / pitch + edge / 2
    phase, sign = np.mod(halves, 1.0), 1 - 2 * np.mod(np.floor(halves), 2)
    slow = np.interp((phase - edge) / (1 - edge), place, level)
    return sign * np.where(phase < edge, -0.5 + 1.5 * phase / edge, slow)


def bores(x: np.ndarray, *ports: tuple[float, float, float]) -> np.ndarray:
    """Return how much of round `ports` is free as round bores pass them; each has a place and the radii of both.

    It is the area that is shared by two circles, relative to the smaller one; chamfers of their edges make it smooth.
    """
    free = np.zeros_like(x, dtype=float)
    for at, first, second in ports:
        d = np.clip(np.abs(x - at), abs(first - second) + 1e-9, first + second)
        a = np.arccos(np.clip((d**2 + first**2 - second**2) / (2 * d * first), -1, 1))
        b = np.arccos(np.clip((d**2 + second**2 - first**2) / (2 * d * second), -1, 1))
        shared = first**2 * (a - np.sin(2 * a) / 2) + second**2 * (b - np.sin(2 * b) / 2)
        share = np.clip(shared / (np.pi * min(first, second) ** 2), 0, 1)
        free += share**2 * (3 - 2 * share)
    return free


def folded(x: np.ndarray, pitch: float, turns: float) -> np.ndarray:
    """Return the fringes that a part shows as it swings to and fro with a `pitch`, by so many `turns` each way."""
    return np.sin(2 * np.pi * turns * np.sin(2 * np.pi * x / pitch))


def holed(x: np.ndarray, at: float, width: float, hole: float) -> np.ndarray:
    """Return a broad hump up to `width` from `at`, with a narrow hole down to 0 in the middle, as of what is used up.

    Both humps beside the hole are nearly 1 high, and half of the hole is as wide as `hole`.
    """
    z, inner = np.clip((x - at) / width, -1, 1), ((x - at) / hole) ** 2
    return 1.25 * (1 - z**2) ** 2 * inner / (1 + inner)


def meshing(x: np.ndarray, pitch: float, share: float) -> np.ndarray:
    """Return how stiff two wheels mesh: one pair of teeth, softest at their tips, and two over a `share` of each pitch.

    It is about 0.1 with one pair and 1 with two; a pair takes a tenth of the `pitch` to come into mesh or out of it.
    """
    stiffness = np.zeros_like(x, dtype=float)
    for number in (0, 1):
        place = np.mod(x / pitch, 1.0) + number
        z = np.clip(place / (1 + share), 0, 1)
        ends = np.clip(10 * place, 0, 1) * np.clip(10 * (1 + share - place), 0, 1)
        stiffness = stiffness + ends * (0.6 + 1.6 * z * (1 - z))
    return (stiffness - 0.9) / 0.75


def plucked(x: np.ndarray, pitch: float, number: int, decay: float) -> np.ndarray:
    """Return a string that is plucked at 0 and every `pitch`, swings so many times in between, and dies out.

    It dies out over `decay`; the first swing is about 1 high.
    """
    phase = np.mod(x, pitch)
    return 1.2 * np.exp(-phase / decay) * np.sin(2 * np.pi * number * phase / pitch)


def condensing(x: np.ndarray, least: float, length: float) -> np.ndarray:
    """Return the pressure of a vapour over its room: 1 at `least`, a dip to -0.36, a rise to 0.53, and a slow fall.

    It is van der Waals' equation at 0.8 of the critical temperature; `length` is the critical room.
    """
    room = 0.492 + np.maximum(x - least, 0) / length
    return 6.4 / (3 * room - 1) - 3 / room**2


def switchbacks(x: np.ndarray, start: float, end: float, ratio: float, legs: int) -> np.ndarray:
    """Return a path that goes up and down from `start` to `end`, equally steep, and turns ever farther from 0.

    Each of its turns is `ratio` times as far from 0 as the last, and the last one, at which it ends, is at 1 or -1.
    """
    heights = np.array([0, *((-1.0) ** k * ratio ** (k + 1 - legs) for k in range(legs))])
    lengths = np.cumsum(np.abs(np.diff(heights, prepend=0.0)))
    return np.interp(x, start + (end - start) * lengths / lengths[-1], heights)


def uneven(x: np.ndarray, pitch: float) -> np.ndarray:
    """Return three waves whose pitches have no common measure, as of an uneven road; the longest one has `pitch`."""
    golden = (1 + np.sqrt(5)) / 2
    waves = (0.85**k * np.sin(2 * np.pi * golden**k * x / pitch + k) for k in range(3))
    return sum(waves) / 2.1


def vernier(x: np.ndarray, first: float, second: float) -> np.ndarray:
    """Return where the marks of two rules meet, which are `first` and `second` apart, and both begin at 0.

    It is 1 where they meet, a part of it where they nearly do, and 0 elsewhere.
    """
    return (np.cos(np.pi * x / first) * np.cos(np.pi * x / second)) ** 4
