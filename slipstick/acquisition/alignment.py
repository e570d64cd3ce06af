"""The common clock of all experiments, and their signals on it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.clock import JITTER, resampled
from slipstick.acquisition.tracks import Track
from slipstick.errors import BadRecording


@dataclass(frozen=True, eq=False)
class Window:
    """The common clock: `time` (m,) in s from t = 0 in equal steps of `step` s."""

    time: np.ndarray
    step: float

    @property
    def end(self) -> float:
        """Time of the last sample in s."""
        return float(self.time[-1])


def choose_step(steps: Mapping[str, float], stated: float | None) -> tuple[float, list[str]]:
    """The step in s that is `stated`, or the longest of the `steps` in s of signals by name, and a remark on it.

    Raises `BadRecording` where it is shorter than that of a signal.
    """
    slowest = max(steps, key=lambda name: steps[name])
    if stated is None:
        step = steps[slowest]
        return step, [f"the clock has steps of {1e3 * step:g} ms, those of the slowest signal, {slowest}"]
    if stated * JITTER < steps[slowest]:
        raise BadRecording(f"clock.step is {1e3 * stated:g} ms, and {slowest} is sampled every "
                           f"{1e3 * steps[slowest]:.4g} ms",
                           f"Give a step of at least {1e3 * steps[slowest]:.4g} ms: samples would be made up")
    return stated, []


def make_window(step: float, fastest: float, end: float) -> Window:
    """The clock with steps of `step` s up to `end` in s, for signals whose shortest step in s is `fastest`."""
    # Where signals are sampled faster, a mean over whole samples: it shares none with its neighbours.
    start = 0.5 * max(0.0, step - fastest) if fastest * JITTER < step else 0.0
    count = int(np.floor((end - start) / step + 1e-6)) + 1
    return Window(start + np.arange(count) * step, step)


def align(tracks: Sequence[Track], window: Window, gap: float | None = None) -> np.ndarray:
    """Tracks of one signal on the common clock, (n, m); NaN where a track has no samples within `gap` s."""
    rows = [resampled(track.time[known], track.values[known], window.time, window.step, gap)
            if (known := np.isfinite(track.values)).sum() > 1 else np.full(len(window.time), np.nan)
            for track in tracks]
    return np.array(rows)
