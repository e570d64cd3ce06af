"""The common clock of all engagements, and their signals on it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.clock import JITTER, resampled, sampling_step
from slipstick.acquisition.engagement import Engagement
from slipstick.acquisition.mapping import ChannelMap
from slipstick.acquisition.tracks import Track
from slipstick.bench import Bench
from slipstick.errors import BadRecording


@dataclass(frozen=True, eq=False)
class Window:
    """The common clock: `time` (m,) in s from the shift command in equal steps of `step` s.

    `profile_end` in s is the end of the shortest current profile, and `remarks` say how step and end were chosen.
    """

    time: np.ndarray
    step: float
    profile_end: float
    remarks: tuple[str, ...]

    @property
    def end(self) -> float:
        """Time of the last sample in s."""
        return float(self.time[-1])


def common_window(engagements: Sequence[Engagement], mapping: ChannelMap, bench: Bench) -> Window:
    """The clock that the mapping states, or the slowest signal and the end of the shortest engagement that locks.

    Raises `BadRecording` where a clock is asked for that is faster than a signal, has fewer than two samples, or ends
    after all engagements.
    """
    steps = {name: max(sampling_step(engagement.tracks[name].time) for engagement in engagements)
             for name in engagements[0].tracks}
    slowest = max(steps, key=lambda name: steps[name])
    remarks = []
    step = mapping.step
    if step is None:
        step = float(f"{steps[slowest]:.4g}")  # times in files are rounded; their median step is off in the last digits
        remarks.append(f"the clock has steps of {1e3 * step:g} ms, those of the slowest signal, {slowest}")
    elif step * JITTER < steps[slowest]:
        raise BadRecording(f"clock.step is {1e3 * step:g} ms, and {slowest} is sampled every "
                           f"{1e3 * steps[slowest]:.4g} ms",
                           f"Give a step of at least {1e3 * steps[slowest]:.4g} ms: samples would be made up")
    profile_end = float(bench.profiles[0][:, -1].min())
    end, longest = mapping.end, max(engagement.end for engagement in engagements)
    if end is None:
        locked = [engagement for engagement in engagements if engagement.measured_time is not None
                  and engagement.end > engagement.measured_time] or list(engagements)
        shortest = min(locked, key=lambda engagement: engagement.end)
        end = min(shortest.end, profile_end)
        remarks.append(f"the recordings end {end:.4g} s after the shift command, " + (
            "with the current profile" if end == profile_end else
            "with all engagements" if longest - end < step else
            f"with the shortest engagement that locks, {shortest.label}; the longest ends at {longest:.4g} s"))
    elif end > longest + step:
        raise BadRecording(f"clock.end is {end:g} s, and the longest engagement ends {longest:.4g} s after its shift "
                           "command", f"Give an end of at most {longest:.4g} s, or none")
    if end < step:
        raise BadRecording(f"clock.step is {step:g} s, and the recordings end {end:.4g} s after the shift command",
                           "Give a shorter step, or a later end")
    # Where signals are sampled faster, a mean over whole samples: it shares none with its neighbours.
    fastest = min(sampling_step(track.time) for engagement in engagements for track in engagement.tracks.values())
    start = 0.5 * max(0.0, step - fastest) if fastest * JITTER < step else 0.0
    count = int(np.floor((end - start) / step + 1e-6)) + 1
    return Window(start + np.arange(count) * step, step, profile_end, tuple(remarks))


def align(tracks: Sequence[Track], window: Window) -> np.ndarray:
    """Tracks of one signal on the common clock, (n, m); NaN where a track has no samples."""
    rows = [resampled(track.time[known], track.values[known], window.time, window.step)
            if (known := np.isfinite(track.values)).sum() > 1 else np.full(len(window.time), np.nan)
            for track in tracks]
    return np.array(rows)
