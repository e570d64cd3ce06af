"""Play (backlash) of the valve: its current follows the commanded current only after that has moved by a width."""

import numpy as np


def play(time: np.ndarray, current: np.ndarray, up: float, down: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and currents of the knots (p, m) after play, exactly; `up` and `down` are the lags in A."""
    profiles = [_profile(*knots, up, down) for knots in zip(time, current, strict=True)]
    longest = max(len(knots) for knots in profiles)
    padded = np.array([knots + knots[-1:] * (longest - len(knots)) for knots in profiles])
    return padded[..., 0], padded[..., 1]


def plays(time: np.ndarray, current: np.ndarray, up: np.ndarray, down: np.ndarray,
          weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots (p, m) of several plays in parallel, their mean with `weights`; `up`, `down` are lags in A."""
    times, currents = zip(*(play(time, current, *lags) for lags in zip(up, down, strict=True)), strict=True)
    merged = [np.unique(np.concatenate(knots)) for knots in zip(*times, strict=True)]
    means = [weights @ np.array([np.interp(knots, t[row], c[row]) for t, c in zip(times, currents, strict=True)])
             for row, knots in enumerate(merged)]
    longest = max(len(knots) for knots in merged)
    padded = tuple(np.array([np.pad(knots, (0, longest - len(knots)), mode="edge") for knots in column])
                   for column in (merged, means))
    return padded[0], padded[1]


def _profile(time: np.ndarray, current: np.ndarray, up: float, down: float) -> list[tuple[float, float]]:
    knots = [(time[0], current[0])]
    for start, end, before, after in zip(time[:-1], time[1:], current[:-1], current[1:], strict=True):
        held = knots[-1][1]
        lag = up if after > before else -down
        moved = (after - lag - held) * np.sign(after - before) > 0
        if moved:
            release = start + (end - start) * (held + lag - before) / (after - before)
            if start < release < end:
                knots.append((release, held))
        knots.append((end, after - lag if moved else held))
    return knots
