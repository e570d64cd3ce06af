"""Bad runs: a valve that sticks, wrong channels, a frozen sensor, or a wrong number of the current profile."""

from dataclasses import dataclass, replace

import numpy as np

from .bench import SENSORS, Bench

KINDS = ("valve sticks", "channels swapped", "sign flipped", "sensor frozen", "wrong profile")
RETURN = 0.005  # s, in which a valve that has stuck moves to the commanded current


@dataclass(frozen=True)
class BadRun:
    """What is wrong with a run: `condition` is its index in the bench, `run` its row in the recordings.

    `start` in s applies to a valve that sticks, for `duration` s, and to a frozen sensor. `other` is the channel
    swapped with `channel`. `recorded` is the wrong number of the profile.
    """

    condition: int
    kind: str
    channel: str | None = None
    other: str | None = None
    start: float | None = None
    duration: float | None = None
    recorded: int | None = None
    run: int | None = None


def draw(conditions: np.ndarray, share: float, bench: Bench, random: np.random.Generator) -> tuple[BadRun, ...]:
    """Draw the bad runs among those of `conditions` (n,): at least one, on average about `share` of them."""
    count = max(1, random.binomial(len(conditions), share))
    return tuple(_draw(int(condition), bench, random)
                 for condition in np.sort(random.choice(conditions, count, replace=False)))


def _draw(condition: int, bench: Bench, random: np.random.Generator) -> BadRun:
    bad = BadRun(condition, KINDS[random.integers(len(KINDS))])
    first, second = (SENSORS[i] for i in random.permutation(len(SENSORS))[:2])
    if bad.kind == "valve sticks":
        start, duration = bench.horizon * random.uniform([0.05, 0.1], [0.4, 0.2])
        return replace(bad, start=float(start), duration=float(duration))
    if bad.kind == "channels swapped":
        return replace(bad, channel=first, other=second)
    if bad.kind == "sign flipped":
        return replace(bad, channel=first)
    if bad.kind == "sensor frozen":
        return replace(bad, channel=first, start=float(bench.horizon * random.uniform(0.05, 0.4)))
    others = np.setdiff1d(np.unique(bench.profile), bench.profile[condition])
    return replace(bad, recorded=int(random.choice(others)))


def stick(time: np.ndarray, current: np.ndarray, start: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots (m + 3,) of a profile (m,) whose current is constant for `duration` from `start`.

    If knots that are replaced are more than three, the last knot is repeated.
    """
    end = start + duration
    held, caught = np.interp([start, end + RETURN], time, current)
    before, after = time < start, time > end + RETURN
    times = np.concatenate([time[before], [start, end, end + RETURN], time[after]])
    currents = np.concatenate([current[before], [held, held, caught], current[after]])
    padding = (0, len(time) + 3 - len(times))
    return np.pad(times, padding, mode="edge"), np.pad(currents, padding, mode="edge")


def corrupt(signals: dict[str, np.ndarray], time: np.ndarray, bad_runs: tuple[BadRun, ...]) -> None:
    """Change the measured signals (n, k) of the bad runs in place."""
    for bad in bad_runs:
        if bad.kind == "channels swapped":
            channel, other = signals[bad.channel], signals[bad.other]
            channel[bad.run], other[bad.run] = other[bad.run].copy(), channel[bad.run].copy()
        elif bad.kind == "sign flipped":
            signals[bad.channel][bad.run] *= -1
        elif bad.kind == "sensor frozen":
            first = np.searchsorted(time, bad.start)
            signals[bad.channel][bad.run, first:] = signals[bad.channel][bad.run, first]
