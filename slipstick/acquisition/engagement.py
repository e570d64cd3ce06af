"""The engagements of one file: cut at the triggers, with the shift command at t = 0, and their numbers."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.channel import Source
from slipstick.acquisition.excerpt import Excerpt, read_marks, slowest_of
from slipstick.acquisition.lock_up import LockUp, lock_up
from slipstick.acquisition.mapping import ChannelMap, Marker
from slipstick.acquisition.numbers import Numbers
from slipstick.acquisition.tracks import Track, track
from slipstick.errors import BadRecording
from slipstick.recordings.signals import SIGNAL_UNITS


@dataclass(frozen=True, eq=False, kw_only=True)
class Engagement(Excerpt):
    """One engagement, with times in s from its shift command.

    `located` is its lock-up by the speeds and `recorded` its recorded shifting time, None where unknown.
    """

    located: LockUp | None
    recorded: float | None

    @property
    def measured_time(self) -> float | None:
        """The recorded shifting time, else that by the speeds."""
        return self.recorded if self.recorded is not None else self.located.time if self.located else None


def engagements(source: Source, mapping: ChannelMap, numbers: Numbers, gear_ratio: float,
                horizon: float) -> Iterator[Engagement]:
    """The engagements of a file, in the order of time; raises `BadRecording`.

    Lock-up is looked for up to `horizon` s after the shift command: later the clutch may have opened again.
    """
    tracks = {name: track(source, ref, mapping.time, SIGNAL_UNITS[name]) for name, ref in mapping.signals.items()}
    further = {name: track(source, ref, mapping.time, None) for name, ref in mapping.further.items()}
    begin = min(float(signal.time[0]) for signal in tracks.values())
    end = max(float(signal.time[-1]) for signal in tracks.values())
    starts = np.array([begin])
    if mapping.trigger is not None:
        # Where a change marks the next engagement, the first one begins with the file.
        starts = np.append(starts if mapping.trigger.level is None else [],
                           read_marks(source, mapping, mapping.trigger, "trigger"))
    ends = np.append(starts[1:], np.nextafter(end, np.inf))
    commands = None if isinstance(mapping.shift_command, float) else \
        read_marks(source, mapping, mapping.shift_command, "shift command")
    marked = mapping.shifting_time if isinstance(mapping.shifting_time, Marker) else None
    lock_marks = None if marked is None else read_marks(source, mapping, marked, "lock-up")
    for number, (start, stop) in enumerate(zip(starts, ends, strict=True)):
        label = source.name if mapping.trigger is None else f"{source.name}, engagement {number}"
        if commands is None:
            assert isinstance(mapping.shift_command, float)
            zero = _nearest_sample(tracks, start + mapping.shift_command, label)
        else:
            inside = commands[(commands >= start) & (commands < stop)]
            if len(inside) != 1:
                at = f", the first at {', '.join(f'{command:.4g}' for command in inside[:3])} s" if len(inside) else ""
                raise BadRecording(f"{label} has {len(inside)} shift commands between {start:g} and {stop:g} s{at}",
                                   "Give [shift_command] a level that its channel crosses once (a current that falls "
                                   "below the level and rises again marks several), or another channel; cut files of "
                                   "many engagements by a [trigger], or leave the file out")
            zero = _nearest_sample(tracks, float(inside[0]), label)
        cut = {name: signal.between(start, stop, zero) for name, signal in tracks.items()}
        if any(len(signal.time) < 2 or signal.time[-1] <= 0 for signal in cut.values()):
            raise BadRecording(f"{label} has no samples after its shift command at {zero:g} s",
                               "Correct [shift_command] or [trigger], or leave the file out")
        recorded = None
        if lock_marks is not None:
            after = lock_marks[(lock_marks > zero) & (lock_marks < stop)]
            recorded = float(after[0]) - zero if len(after) else None
        elif mapping.shifting_time is not None:
            assert not isinstance(mapping.shifting_time, Marker)
            recorded = numbers.number(source, number, "shifting_time", mapping.shifting_time, zero, stop)
        yield Engagement(label=label, zero=zero, begin=float(start), tracks=cut,
                         further={name: signal.between(start, stop, zero) for name, signal in further.items()},
                         numbers=numbers.of(source, number, zero, float(stop)),
                         located=_locate_lock_up(cut, gear_ratio, horizon), recorded=recorded)


def _nearest_sample(tracks: Mapping[str, Track], zero: float, label: str) -> float:
    """The sample of the slowest signal that is nearest to the shift command; raises `BadRecording` where none is near.

    A clock between the samples would mix neighbours, and calibration and study would misjudge the noise.
    """
    time = slowest_of(tracks).time
    step = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    if not time[0] - step <= zero <= time[-1] + step:
        raise BadRecording(f"The shift command of {label} is at {zero:g} s, and its samples are from {time[0]:g} to "
                           f"{time[-1]:g} s", "Correct [shift_command] or [trigger], or leave the file out")
    return float(time[np.argmin(np.abs(time - zero))])


def _locate_lock_up(tracks: Mapping[str, Track], gear_ratio: float, horizon: float) -> LockUp | None:
    """Lock-up on the clock of the slower speed; None where a speed is missing or has gaps."""
    if not {"input_speed", "output_speed"} <= tracks.keys():
        return None
    given, other = sorted((tracks["input_speed"], tracks["output_speed"]), key=lambda signal: len(signal.time))
    inside = (given.time >= other.time[0]) & (given.time <= min(horizon, other.time[-1]))
    time = given.time[inside]
    speeds = {id(signal): np.interp(time, signal.time, signal.values) for signal in (given, other)}
    slip = speeds[id(tracks["input_speed"])] - gear_ratio * speeds[id(tracks["output_speed"])]
    return lock_up(time, slip)
