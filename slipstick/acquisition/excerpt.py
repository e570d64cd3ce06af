"""Excerpts of files, such as engagements and runs: what is common to them before a model says what signals mean."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.alignment import Window
from slipstick.acquisition.channel import Source
from slipstick.acquisition.clock import FILTER, JITTER, sampling_step
from slipstick.acquisition.flaws import flaws
from slipstick.acquisition.mapping import ChannelRef, FileMap, Marker
from slipstick.acquisition.markers import instants
from slipstick.acquisition.result import MappedChannel
from slipstick.acquisition.tracks import Track, track
from slipstick.acquisition.units import spelled
from slipstick.errors import BadRecording
from slipstick.numerics.quantities import raised


@dataclass(frozen=True, eq=False, kw_only=True)
class Excerpt:
    """One experiment in a file, with times in s from its t = 0.

    `label` names file and number in error messages, `zero` and `begin` are t = 0 and the begin of the experiment in s
    of the clock of the file, `tracks` and `further` are those of the mapping, `numbers` its conditions. What comes
    after `limit` belongs to another one.
    """

    label: str
    zero: float
    begin: float
    tracks: Mapping[str, Track]
    further: Mapping[str, Track]
    numbers: Mapping[str, float]
    limit: float = np.inf

    @property
    def end(self) -> float:
        """Time of the last sample that all signals have."""
        return min(self.limit, *(float(signal.time[-1]) for signal in self.tracks.values()))


def read_marks(source: Source, mapping: FileMap, marker: Marker, what: str) -> np.ndarray:
    """Instants in s of a marker in a file; raises `BadRecording` where there is none."""
    channel = track(source, marker.source, mapping.time, None)
    marks = instants(marker, channel.time, channel.values)
    if not len(marks):
        raise BadRecording(
            f"The channel '{marker.source.channel}' of {source.name} never marks a {what}: it lies between "
            f"{np.nanmin(channel.values):g} and {np.nanmax(channel.values):g} {raised(channel.unit)}".rstrip(),
            "Correct `above` or `below` in the mapping; they are in the unit of the file")
    return marks


def slowest_of(tracks: Mapping[str, Track]) -> Track:
    """The signal with the fewest samples."""
    return min(tracks.values(), key=lambda signal: len(signal.time))


def find_defect(excerpt: Excerpt, window: Window, origin: str, gap: float | None = None) -> str:
    """Why the signals of an excerpt cannot be used; empty where they can.

    `origin` is what its t = 0 is called, and samples more than `gap` s apart have a gap between them.
    """
    needed = window.end if window.time[-1] > 0 else excerpt.end
    for name, signal in excerpt.tracks.items():
        near = signal.between(-window.step, needed + window.step)
        allowed = max(window.step, gap or 0.0)
        if not len(near.time) or (near.time[0] > 0 and near.time[0] > allowed):
            return f"{name} ('{signal.channel}') has no samples at the {origin}"
        flawed = flaws(near.time, near.values, signal.limits, gap)
        if flawed:
            first = flawed[0]
            more = f", and {len(flawed) - 1} more flaws" if len(flawed) > 1 else ""
            return (f"{name} ('{signal.channel}') has a {first.kind} from {first.start:.4g} to {first.end:.4g} s after "
                    f"the {origin}{more}")
    return ""


def describe_channels(kept: Sequence[Mapping[str, Track]],
                      channels: Mapping[str, ChannelRef]) -> tuple[MappedChannel, ...]:
    """What was read of each of the mapped `channels`; `kept` are the tracks of each excerpt."""
    described = []
    for name, ref in channels.items():
        tracks = [given[name] for given in kept]
        described.append(MappedChannel(
            name, ref.channel, tracks[0].stated, tracks[0].unit, ref.sign,
            float(np.median([sampling_step(signal.time) for signal in tracks if len(signal.time) > 1] or [np.nan])),
            min(float(np.nanmin(signal.values, initial=np.inf)) for signal in tracks),
            max(float(np.nanmax(signal.values, initial=-np.inf)) for signal in tracks),
            next((signal.note for signal in tracks if signal.note), "")))
    return tuple(described)


def tell_origins(kept: Sequence[Excerpt], mapping: FileMap) -> str:
    """Where t = 0 was put."""
    first, after = kept[0], [excerpt.zero - excerpt.begin for excerpt in kept]
    others = f"; in all {mapping.experiment}s, {min(after):.4g} to {max(after):.4g} s after the first sample"
    return (f"t = 0 was put at {first.zero:.6g} s on the clock of {first.label}, {after[0]:.4g} s after its first "
            f"sample at {first.begin:.6g} s{others if len(kept) > 1 else ''}")


def tell_channels(channels: Sequence[MappedChannel], mapped: Mapping[str, ChannelRef], clock: Iterable[str],
                  step: float) -> tuple[str, ...]:
    """Where the unit of the mapping takes the place of another one in the files, and how clocks were changed.

    Channels named in `clock` were brought to steps of `step` s.
    """
    lines = []
    for channel in channels:
        if channel.note:
            lines.append(f"{channel.name} ('{channel.channel}'): {channel.note}")
        written = mapped[channel.name].unit
        if written and channel.stated and spelled(written) != spelled(channel.stated):
            lines.append(f"{channel.name}: the files state the unit {channel.stated} for '{channel.channel}', the "
                         f"mapping {written}: that of the mapping was used")
    resampled = [channel for channel in channels if channel.name in clock]
    faster = [channel.name for channel in resampled if channel.step * JITTER < step]
    if faster:
        lines.append(f"{', '.join(faster)}: sampled faster than the common clock, and brought to it by {FILTER}")
    slower = [channel.name for channel in resampled if channel.step > step * JITTER]
    if slower:
        lines.append(f"{', '.join(slower)}: sampled slower than the common clock, and interpolated linearly between "
                     "samples")
    return tuple(lines)


def tell_formats(formats: Mapping[str, Sequence[str]]) -> list[str]:
    """The remarks of readers, each with the files that it is about."""
    return [f"{names[0] if len(names) == 1 else f'{len(names)} files, {names[0]} first'}: {remark}"
            for remark, names in formats.items()]
