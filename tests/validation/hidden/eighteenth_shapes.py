"""Shapes that several effects of the list `boreal` have."""

import numpy as np


def captured(x: np.ndarray, start: float, end: float, edge: float) -> np.ndarray:
    """Return by how much a wave is off that another one captures: 1 behind `start`, straight down to -1 before `end`.

    It is 0 outside, where the wave is free; both jumps are rounded over about twice `edge`.
    """
    return (start + end - 2 * x) / (end - start) * (np.tanh((x - start) / edge) - np.tanh((x - end) / edge)) / 2


def unlocked(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return 0 where `x` is less than `width` from `at`, and the share at which it slips beyond: a root, up to +-1.

    The corner between them is rounded.
    """
    share = 1 - (1 + ((x - at) / width) ** 8) ** -0.25
    return np.sign(x - at) * share * np.sqrt(1.15 / (share + 0.15))


def worn(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return how long a part that swings from `start` to `end` is at `x`: nearly 1 at both ends, 0.25 in the middle."""
    z = (2 * x - start - end) / (end - start) + 0.02j
    return np.real(1 / np.sqrt(1 - z**2)) / 4


def tongues(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return where a mode is excited by its own stiffness: half ellipses at `at`, and at a half and a third of it.

    They are 1, 0.75 and 0.5 high, and reach as far to both sides as a `width`, a half and a third of it.
    """
    return sum((1.25 - k / 4) * np.sqrt(np.maximum(1 - ((k * x - at) / width) ** 2, 0)) for k in (1, 2, 3))


def rubbed(x: np.ndarray, start: float, pitch: float, loss: float) -> np.ndarray:
    """Return 0 up to `start`, and a swing about 1 that dry friction brakes: each half is less by twice `loss`.

    It sticks where the spring no longer overcomes the friction, off 1 by less than `loss`.
    """
    halves = np.maximum(x - start, 0) / (pitch / 2)
    number = np.minimum(np.floor(halves), np.ceil((1 / loss - 1) / 2))
    turn = np.cos(np.pi * np.clip(halves - number, 0, 1))
    stuck = number == np.ceil((1 / loss - 1) / 2)
    away = np.where(stuck, 1 - 2 * number * loss, loss + (1 - (2 * number + 1) * loss) * turn)
    return 1 - (-1.0) ** number * away


def puddles(x: np.ndarray, rate: float, *rains: tuple[float, float]) -> np.ndarray:
    """Return what is left of several `rains`, each with a place and an amount, and dries up at a constant `rate`."""
    level, before, left = np.zeros_like(x, dtype=float), 0.0, 0.0
    for at, amount in rains:
        left = max(left - rate * (at - before), 0.0) + amount
        level, before = np.where(x >= at, np.maximum(left - rate * (x - at), 0), level), at
    return level


def missing(x: np.ndarray, pitch: float, number: int) -> np.ndarray:
    """Return round teeth of height 1 side by side from 0 on, of each `number` of which the last one is missing."""
    return np.where(np.mod(np.floor(x / pitch), number) == number - 1, 0.0, np.sin(np.pi * x / pitch) ** 2)


def yields(x: np.ndarray, upper: float, end: float, length: float) -> np.ndarray:
    """Return the force of mild steel over positive `x`: straight up to 1 at `upper`, where it drops, then 0.55 up to
    `end`, and a hardening by another 0.75 over about `length` behind it.
    """
    drop = 0.55 + 0.45 * np.exp(-np.maximum(x - upper, 0) / (0.12 * upper))
    hardening = 0.75 * (1 - np.exp(-np.maximum(x - end, 0) / length))
    return np.where(x < upper, np.maximum(x, 0) / upper, drop + hardening)


def passband(x: np.ndarray, edge: float, order: int) -> np.ndarray:
    """Return what a ladder of an `order` passes: ripples between 1 and 0.5 up to `edge`, and hardly anything above."""
    z = np.abs(x) / edge
    above = np.cosh(order * np.arccosh(np.clip(z, 1, 3)))
    return 1 / (1 + np.where(z < 1, np.cos(order * np.arccos(np.minimum(z, 1))), above) ** 2)


def hunting(x: np.ndarray, at: float, pitch: float, full: float) -> np.ndarray:
    """Return a wave that sets in at `at`, and whose height grows as a root, to 1 at `full` and a little more."""
    return np.sqrt(np.clip((x - at) / (full - at), 0, 1.5)) * np.sin(2 * np.pi * (x - at) / pitch)


def overdue(x: np.ndarray, due: float, late: float, end: float) -> np.ndarray:
    """Return a warming with a boil that is overdue: straight past 1 at `due` until `late`, a drop to 1, and on from 1
    at `end`.
    """
    drop = (late / due - 1) * np.exp(-np.maximum(x - late, 0) / (0.06 * late))
    return np.where(x < late, x / due, 1 + drop + np.maximum(x - end, 0) / due)


def widening(x: np.ndarray, start: float, end: float, number: int) -> np.ndarray:
    """Return so many pulses of height 1 from `start` to `end`, each wider than the last; 0 before, and 1 behind.

    They are where a wave is above a ramp, with rounded edges.
    """
    z = np.clip((x - start) / (end - start), 0, 1)
    return (1 + np.tanh((2.4 * z - 1.2 - np.cos(2 * np.pi * number * z)) / 0.2)) / 2


def chopped(x: np.ndarray, pitch: float, share: float) -> np.ndarray:
    """Return a wave of which the first `share` of each half is cut out, as by a thyristor."""
    return np.where(np.mod(2 * x / pitch, 1.0) < share, 0.0, np.sin(2 * np.pi * x / pitch))


def code(x: np.ndarray, pitch: float, bits: str) -> np.ndarray:
    """Return the bit at `x`: each of the `bits` is one `pitch` long, and they are repeated."""
    places = np.floor(np.asarray(x) / pitch).astype(int) % len(bits)
    return np.array([float(bit) for bit in bits])[places]
