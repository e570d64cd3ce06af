"""Tracks: what a mapping makes of the channels of one file, in the units of the model."""

from dataclasses import dataclass, replace

import numpy as np

from slipstick.acquisition.channel import Channel, Source
from slipstick.acquisition.clock import own_clock
from slipstick.acquisition.mapping import ChannelRef, TimeRef
from slipstick.acquisition.units import convert_to
from slipstick.errors import BadRecording


@dataclass(frozen=True, eq=False)
class Track:
    """`values` (k,) in `unit` at the increasing times `time` (k,) in s; a missing value is NaN.

    `stated` is the unit in the file, "" for none, and `limits` are those of the sensor, in `unit`. `note` says what was
    assumed about values and times.
    """

    channel: str
    unit: str
    stated: str
    time: np.ndarray
    values: np.ndarray
    limits: tuple[float, float] | None = None
    note: str = ""

    def between(self, start: float, end: float, zero: float = 0.0) -> "Track":
        """The samples from `start` to `end` in s, with `zero` as the origin of their times."""
        first, last = np.searchsorted(self.time, (start, end))
        last = min(last + 1, len(self.time)) if last < len(self.time) and self.time[last] == end else last
        return replace(self, time=self.time[first:last] - zero, values=self.values[first:last])

    def around(self, start: float, end: float, zero: float) -> "Track":
        """The samples from the last one before `start` to the first one after `end` in s, with `zero` as the origin."""
        first = max(int(np.searchsorted(self.time, start, "right")) - 1, 0)
        last = int(np.searchsorted(self.time, end)) + 1
        return replace(self, time=self.time[first:last] - zero, values=self.values[first:last])

    def known(self) -> "Track":
        """The samples that are not missing."""
        seen = np.isfinite(self.values)
        return replace(self, time=self.time[seen], values=self.values[seen])


def track(source: Source, ref: ChannelRef, times: TimeRef, unit: str | None) -> Track:
    """The channel of `ref` in `unit`, or as the file has it where that is None; raises `BadRecording`."""
    channel = source.channel(ref.channel)
    where = f"The channel '{ref.channel}' of {source.name}"
    written = ref.unit or channel.unit
    # An infinite reading is no reading.
    values = np.where(np.isfinite(channel.values), channel.values, np.nan) if unit is None else \
        convert_to(unit, written, channel.values, where)
    time = _times(source, channel, ref, times)
    if len(time) != len(channel.values):
        raise BadRecording(f"{where} has {len(channel.values)} samples for {len(time)} times",
                           "Map the times that belong to it: time = \"...\" beside its channel")
    if len(time) < 2:
        raise BadRecording(f"{where} has {len(time)} samples", "Leave the file out, or map another channel")
    # A sample without a time, as in a column that is shorter than others, cannot be used; where its value is there, it
    # leaves a gap. The clock of a group of MDF has a time for each sample.
    timed = np.isfinite(time) | (time is channel.time)
    time, values = time[timed], ref.sign * values[timed]
    if len(time) < 2:
        raise BadRecording(f"{where} has {len(time)} samples with a time", "Map the times that belong to it")
    wrong = np.flatnonzero(~(np.diff(time) > 0))
    if len(wrong):
        sample = int(wrong[0]) + 1
        raise BadRecording(f"The times of {where[0].lower() + where[1:]} do not increase at sample {sample} "
                           f"({time[sample]:g} s after {time[sample - 1]:g} s)",
                           "Remove duplicates, split the file where the clock starts again, or map the right times")
    time, values, clock = own_clock(time, values)
    return Track(ref.channel, written if unit is None else unit, channel.unit, time, values, ref.limits,
                 "; ".join(note for note in (channel.note, clock) if note))


def _times(source: Source, channel: Channel, ref: ChannelRef, times: TimeRef) -> np.ndarray:
    """Sample times in s of a channel: its own, those that the mapping states, or equal steps; NaN where missing."""
    if channel.time is not None and ref.time is None:
        return channel.time
    stated = ref.time or times
    if stated.channel:
        given = source.channel(stated.channel)
        unit = stated.unit or (times.unit if stated.channel == times.channel else "") or given.unit or times.unit
        where = f"The times '{stated.channel}' of {source.name}"
        if not unit:
            raise BadRecording(f"{where} have no unit", f'State it in the mapping: time = {{ channel = '
                               f'"{stated.channel}", unit = "s" }} beside the channel, or [time] with unit = "s"')
        return convert_to("s", unit, given.values, where)
    if stated.step is not None:
        return np.arange(len(channel.values)) * stated.step
    reason = f": {channel.no_time}" if channel.no_time else ""
    raise BadRecording(f"The channel '{channel.name}' of {source.name} has no times of its own{reason}",
                       "Add [time] to the mapping, with the channel of the times and its unit, or with a step")
