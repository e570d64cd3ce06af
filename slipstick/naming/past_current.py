"""What the current of the valve keeps of its past: mechanical play, and relaxation."""

import numpy as np

from slipstick.clutch.lag import lagged_signal
from slipstick.naming.bases import doubled
from slipstick.numerics.memory import play

_PLAY = np.array([0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32])
"""Half-widths of the play operators over the largest current: a factor 2 apart, any between them is a sum of two."""
_MEMORY, _MEMORIES = (1.0, 10.0), 3
"""Times over which the current is forgotten: the shortest and the longest over the delay of the valve, and how many."""
_MOST_MEMORIES = 3
"""How many times the resolution of these times is doubled at most."""


def widths(current: np.ndarray) -> np.ndarray:
    """Half-widths in A of the play operators on a `current` (n, k) in A."""
    return np.asarray(current.max() * _PLAY)


def remembered(current: np.ndarray, times: np.ndarray, delay: float, finer: int) -> np.ndarray:
    """Changes (n, m, k) of a `current` (n, k) in A with its own past: by play, and where `finer` by relaxation.

    Relaxation is a function of the current less its average over a time, which fades exponentially. Its columns bend,
    because what is linear in the current is a lag. `times` (k,) and the `delay` of the valve are in s.
    """
    change = [play(current, width) - current for width in widths(current)]
    count = doubled(_MEMORIES, min(finer, _MOST_MEMORIES) - 1) if finer else 0
    places = np.linspace(-1, 1, 2**finer + 1)[1:-1]  # closer near 0, where a current turns round
    for time in delay * np.geomspace(*_MEMORY, count):
        excess = current - lagged_signal(current, times, np.array([time]))
        knots = places * np.abs(places) * np.abs(excess).max()
        change.extend(np.maximum(excess - knot, 0.0) for knot in knots)
    return np.stack(change, axis=1)
