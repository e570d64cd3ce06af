"""From open files and their mapping to recordings: engagements on one clock, flawed ones set aside."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from slipstick.acquisition.alignment import Window, align, common_window
from slipstick.acquisition.channel import Source
from slipstick.acquisition.clock import FILTER, JITTER, sampling_step
from slipstick.acquisition.doubts import doubts
from slipstick.acquisition.engagement import Engagement, engagements
from slipstick.acquisition.flaws import flaws
from slipstick.acquisition.mapping import ChannelMap
from slipstick.acquisition.numbers import Numbers, Plan
from slipstick.acquisition.open_questions import open_questions
from slipstick.acquisition.result import Imported, MappedChannel, SetAside
from slipstick.acquisition.units import spelled
from slipstick.bench import Bench, parameters
from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS, Conditions
from slipstick.errors import BadRecording, InvalidValue
from slipstick.recordings import FurtherChannel, Recordings, Signals
from slipstick.recordings.signals import LARGEST


def import_sources(sources: Iterable[Source], mapping: ChannelMap, bench: Bench, plan: bytes | None = None,
                   progress: Callable[[str], None] = lambda name: None) -> Imported:
    """The recordings of a `bench` in files, by a `mapping`; `plan` is the sheet of conditions that it names.

    `progress` is called with the name of each file that was read. Raises `BadRecording`, which names file, channel or
    row, if a file does not have what is mapped or no engagement remains.
    """
    sheet = Plan.read(plan, mapping.plan) if plan is not None and mapping.plan is not None else None
    remarks = _require_conditions(mapping, bench)
    numbers = Numbers(mapping, sheet, (bench.profiles[0], bench.profiles[1]))
    gear_ratio = bench.physics.nominal[parameters.index("gear_ratio")]
    horizon = mapping.end if mapping.end is not None else float(bench.profiles[0][:, -1].max())
    candidates: list[Engagement] = []
    formats: dict[str, list[str]] = {}
    for source in sources:
        for remark in source.remarks:
            formats.setdefault(remark, []).append(source.name)
        candidates += engagements(source, mapping, numbers, gear_ratio, horizon)
        progress(source.name)
    if not candidates:
        raise BadRecording("No file was given", "Name the files of the recordings")
    remarks += [f"{names[0] if len(names) == 1 else f'{len(names)} files, {names[0]} first'}: {remark}"
                for remark, names in formats.items()]
    return _of_engagements(candidates, mapping, bench, remarks)


def _require_conditions(mapping: ChannelMap, bench: Bench) -> list[str]:
    """Remarks on the conditions of the mapping; raises `BadRecording` unless it has those of the bench.

    A single current profile need not be named.
    """
    wanted = [*CONDITION_UNITS, *(INPUT_UNITS if bench.physics.converter is None else ())]
    remarks: list[str] = []
    if len(bench.profiles[0]) == 1 and "current_profile" not in mapping.conditions:
        wanted.remove("current_profile")
        remarks.append("the only current profile of the bench is that of all engagements")
    for name in wanted:
        if name not in mapping.conditions:
            unit = {**CONDITION_UNITS, **INPUT_UNITS}[name]
            value = "0" if unit == "1" else f'"1 {unit}"'
            raise BadRecording(f"{mapping.name}, conditions: {name} is missing",
                               f"Add {name} = {{ value = {value} }} under [conditions], or its name, column or channel")
    for name in mapping.conditions:
        if name in INPUT_UNITS and name not in wanted:
            raise BadRecording(f"{mapping.name}, conditions.{name}: the bench has a torque converter, which gives it",
                               "Leave it out")
    return remarks


def _of_engagements(candidates: Sequence[Engagement], mapping: ChannelMap, bench: Bench,
                    remarks: list[str]) -> Imported:
    window = common_window(candidates, mapping, bench)
    kept, aside = [], []
    for engagement in candidates:
        reason = _defect(engagement, window)
        if reason:
            aside.append(SetAside(engagement.label, reason))
        else:
            kept.append(engagement)
    if not kept:
        raise BadRecording(f"None of the {len(candidates)} engagements can be used; {aside[0].label}: "
                           f"{aside[0].reason}",
                           "Check the channels (swapped speeds do not meet), the shift command, signs and units in the "
                           "mapping")
    if len(kept) * len(window.time) * len(mapping.signals) > LARGEST:
        raise BadRecording(f"{len(kept)} engagements of {len(window.time):,} samples are more than {LARGEST:,} numbers",
                           "Give a longer clock.step, or a shorter clock.end")
    signals = Signals(window.time, **{name: align([engagement.tracks[name] for engagement in kept], window)
                                      for name in mapping.signals})
    further = {name: FurtherChannel(kept[0].further[name].unit or "1",
                                    align([engagement.further[name] for engagement in kept], window))
               for name in mapping.further}
    times = np.array([engagement.measured_time for engagement in kept], float)
    try:
        conditions = _conditions(kept, bench)
        recordings = Recordings(conditions, times, signals, conditions.run_order,
                                mapping.description or f"Imported by {mapping.name}", further)
    except (InvalidValue, BadRecording) as error:
        raise BadRecording(f"{error.cause} (conditions in the order of the engagements, {kept[0].label} first)",
                           error.remedy) from error
    channels = _channels(kept, mapping)
    return Imported(
        recordings, tuple(engagement.label for engagement in kept), window.step, channels,
        np.array([engagement.located.time if engagement.located else np.nan for engagement in kept]),
        np.array([engagement.located.error if engagement.located else np.nan for engagement in kept]),
        mapping.shifting_time is None, tuple(aside),
        (*remarks, _shift_commands(kept), *window.remarks, *_remarks(channels, mapping, window.step)),
        doubts(recordings, bench),
        open_questions(signals.names, bench))


def _defect(engagement: Engagement, window: Window) -> str:
    """Why an engagement cannot be used; empty where it can."""
    needed = window.end if window.time[-1] > 0 else engagement.end
    for name, signal in engagement.tracks.items():
        near = signal.between(-window.step, needed + window.step)
        if not len(near.time) or (near.time[0] > 0 and near.time[0] > window.step):
            return f"{name} ('{signal.channel}') has no samples at the shift command"
        flawed = flaws(near.time, near.values, signal.limits)
        if flawed:
            first = flawed[0]
            more = f", and {len(flawed) - 1} more flaws" if len(flawed) > 1 else ""
            return (f"{name} ('{signal.channel}') has a {first.kind} from {first.start:.4g} to {first.end:.4g} s after "
                    f"the shift command{more}")
    if engagement.end < window.end - window.step / 2:
        return f"it ends {engagement.end:.4g} s after the shift command, and the recordings at {window.end:.4g} s"
    if engagement.measured_time is None and not {"input_speed", "output_speed"} <= engagement.tracks.keys():
        return "no shifting time is recorded, and to compute it both speeds are needed"
    if engagement.measured_time is None:
        return "no lock-up: no shifting time is recorded, and the speeds do not meet"
    if engagement.measured_time <= 0 or engagement.measured_time > window.profile_end:
        return f"its shifting time of {engagement.measured_time:.4g} s is not within its current profile"
    return ""


def _conditions(kept: Sequence[Engagement], bench: Bench) -> Conditions:
    def column(name: str) -> np.ndarray:
        return np.array([engagement.numbers.get(name, 0.0) for engagement in kept])

    profile = column("current_profile")
    wrong = np.flatnonzero((profile != np.round(profile)) | (profile < 0) | (profile >= len(bench.profiles[0])))
    if len(wrong):
        raise BadRecording(f"{kept[wrong[0]].label}: {profile[wrong[0]]:g} is not the number of a current profile",
                           f"Give 0 to {len(bench.profiles[0]) - 1}, or the bench that has this profile")
    given = {name: column(name) for name in INPUT_UNITS if bench.physics.converter is None}
    order = None
    if "run_order" in kept[0].numbers:
        order = np.argsort(np.argsort(column("run_order"), kind="stable")).astype(np.int64)
    return Conditions(profile.astype(np.int64), column("motor_speed"), column("load_inertia"), column("brake_torque"),
                      bench.conditions.profile_time, bench.conditions.profile_current, order, **given,
                      profile_input_torque=bench.conditions.profile_input_torque)


def _channels(kept: Sequence[Engagement], mapping: ChannelMap) -> tuple[MappedChannel, ...]:
    channels = []
    for name, ref in {**mapping.signals, **mapping.further}.items():
        tracks = [(engagement.tracks if name in mapping.signals else engagement.further)[name] for engagement in kept]
        channels.append(MappedChannel(
            name, ref.channel, tracks[0].stated, tracks[0].unit, ref.sign,
            float(np.median([sampling_step(signal.time) for signal in tracks if len(signal.time) > 1] or [np.nan])),
            min(float(np.nanmin(signal.values, initial=np.inf)) for signal in tracks),
            max(float(np.nanmax(signal.values, initial=-np.inf)) for signal in tracks),
            next((signal.note for signal in tracks if signal.note), "")))
    return tuple(channels)


def _shift_commands(kept: Sequence[Engagement]) -> str:
    """Where t = 0 was put."""
    first, after = kept[0], [engagement.zero - engagement.begin for engagement in kept]
    others = f"; in all engagements, {min(after):.4g} to {max(after):.4g} s after the first sample"
    return (f"t = 0 was put at {first.zero:.6g} s on the clock of {first.label}, {after[0]:.4g} s after its first "
            f"sample at {first.begin:.6g} s{others if len(kept) > 1 else ''}")


def _remarks(channels: Sequence[MappedChannel], mapping: ChannelMap, step: float) -> tuple[str, ...]:
    """Where the unit of the mapping takes the place of another one in the files, and how clocks were changed."""
    lines = []
    for channel in channels:
        if channel.note:
            lines.append(f"{channel.name} ('{channel.channel}'): {channel.note}")
        written = {**mapping.signals, **mapping.further}[channel.name].unit
        if written and channel.stated and spelled(written) != spelled(channel.stated):
            lines.append(f"{channel.name}: the files state the unit {channel.stated} for '{channel.channel}', the "
                         f"mapping {written}: that of the mapping was used")
    faster = [channel.name for channel in channels if channel.step * JITTER < step]
    if faster:
        lines.append(f"{', '.join(faster)}: sampled faster than the common clock, and brought to it by {FILTER}")
    slower = [channel.name for channel in channels if channel.step > step * JITTER]
    if slower:
        lines.append(f"{', '.join(slower)}: sampled slower than the common clock, and interpolated linearly between "
                     "samples")
    return tuple(lines)
