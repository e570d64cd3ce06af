"""Play of the valve: its current follows the commanded one only once that has moved by a width."""

import numpy as np


def play(time: np.ndarray, current: np.ndarray, up: float, down: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots (p, m) of the played currents, exactly; `up` and `down` are the lags of rise and fall, A."""
    played = [_one(*knots, up, down) for knots in zip(time, current, strict=True)]
    longest = max(len(knots) for knots in played)
    padded = np.array([knots + knots[-1:] * (longest - len(knots)) for knots in played])
    return padded[..., 0], padded[..., 1]


def _one(time: np.ndarray, current: np.ndarray, up: float, down: float) -> list[tuple[float, float]]:
    knots = [(time[0], current[0])]
    for start, end, before, after in zip(time[:-1], time[1:], current[:-1], current[1:], strict=True):
        held = knots[-1][1]
        lag = up if after > before else -down
        moved = (after - lag - held) * np.sign(after - before) > 0
        if moved:
            leaves = start + (end - start) * (held + lag - before) / (after - before)
            if start < leaves < end:
                knots.append((leaves, held))
        knots.append((end, after - lag if moved else held))
    return knots
