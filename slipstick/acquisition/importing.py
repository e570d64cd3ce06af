"""From open files and their mapping to recordings: engagements on one clock, flawed ones set aside."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from slipstick.acquisition.alignment import Window, align, choose_step, make_window
from slipstick.acquisition.channel import Source
from slipstick.acquisition.clock import sampling_step
from slipstick.acquisition.doubts import doubts
from slipstick.acquisition.engagement import Engagement, engagements
from slipstick.acquisition.excerpt import describe_channels, find_defect, tell_channels, tell_formats, tell_origins
from slipstick.acquisition.mapping import ChannelMap
from slipstick.acquisition.mapping_file import NUMBERS
from slipstick.acquisition.numbers import Numbers, Plan
from slipstick.acquisition.open_questions import open_questions
from slipstick.acquisition.result import Imported, LeadIn, SetAside
from slipstick.bench import Bench, parameters
from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS, Conditions
from slipstick.errors import BadRecording, InvalidValue
from slipstick.recordings import FurtherChannel, Recordings, Signals
from slipstick.recordings.signals import LARGEST

_MOST_LED_IN, _LED_IN = 12, 0.25
"""Engagements that are shown with what precedes them, and its largest share of what follows."""


def import_sources(sources: Iterable[Source], mapping: ChannelMap, bench: Bench, plan: bytes | None = None,
                   progress: Callable[[str], None] = lambda name: None) -> Imported:
    """The recordings of a `bench` in files, by a `mapping`; `plan` is the sheet of conditions that it names.

    `progress` is called with the name of each file that was read. Raises `BadRecording`, which names file, channel or
    row, if a file does not have what is mapped or no engagement remains.
    """
    sheet = Plan.read(plan, mapping.plan, mapping.experiment) if plan is not None and mapping.plan is not None else None
    remarks = _require_conditions(mapping, bench)
    numbers = Numbers(mapping, sheet, {**NUMBERS, "shifting_time": "s"}, (bench.profiles[0], bench.profiles[1]))
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
    return _of_engagements(candidates, mapping, bench, [*remarks, *tell_formats(formats)])


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
    window, chosen = _common_window(candidates, mapping, bench)
    kept, aside = [], []
    for engagement in candidates:
        reason = find_defect(engagement, window, mapping.origin) or \
            _lack(engagement, window, float(bench.profiles[0][:, -1].min()))
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
    located = np.array([engagement.located.time if engagement.located else np.nan for engagement in kept])
    mapped = {**mapping.signals, **mapping.further}
    channels = describe_channels([{**engagement.tracks, **engagement.further} for engagement in kept], mapped)
    return Imported(
        recordings=recordings, labels=tuple(engagement.label for engagement in kept), step=window.step,
        channels=channels, located=located,
        error=np.array([engagement.located.error if engagement.located else np.nan for engagement in kept]),
        computed=mapping.shifting_time is None, led_in=_lead_in(kept[:_MOST_LED_IN], window), set_aside=tuple(aside),
        remarks=(*remarks, tell_origins(kept, mapping), *chosen, *tell_channels(channels, mapped, mapped, window.step)),
        doubts=doubts(recordings, bench, located), open_questions=open_questions(signals.names, bench))


def _common_window(engagements: Sequence[Engagement], mapping: ChannelMap, bench: Bench) -> tuple[Window, list[str]]:
    """The clock that the mapping states, or the slowest signal and the end of the shortest engagement that locks.

    With remarks on how step and end were chosen. Raises `BadRecording` where a clock is asked for that is faster than a
    signal, has fewer than two samples, or ends after all engagements.
    """
    steps = {name: [sampling_step(engagement.tracks[name].time) for engagement in engagements]
             for name in mapping.signals}
    # Times in files are rounded; their median step is off in the last digits.
    step, remarks = choose_step({name: float(f"{max(each):.4g}") for name, each in steps.items()}, mapping.step)
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
    return make_window(step, min(map(min, steps.values())), end), remarks


def _lead_in(kept: Sequence[Engagement], window: Window) -> LeadIn:
    """What precedes the shift commands in the files, for at most a part of the time after them."""
    begin = min(float(signal.time[0]) for engagement in kept for signal in engagement.tracks.values())
    count = int(min(-begin, _LED_IN * window.end) / window.step)
    before = Window(window.time[0] - window.step * np.arange(count, 0, -1.0), window.step)
    return LeadIn(before.time, {name: align([{**engagement.tracks, **engagement.further}[name]
                                             for engagement in kept], before)
                                for name in (*kept[0].tracks, *kept[0].further)})


def _lack(engagement: Engagement, window: Window, profile_end: float) -> str:
    """What an engagement without flaws lacks; empty for nothing."""
    if engagement.end < window.end - window.step / 2:
        return f"it ends {engagement.end:.4g} s after the shift command, and the recordings at {window.end:.4g} s"
    if engagement.measured_time is None and not {"input_speed", "output_speed"} <= engagement.tracks.keys():
        return "no shifting time is recorded, and to compute it both speeds are needed"
    if engagement.measured_time is None:
        return "no lock-up: no shifting time is recorded, and the speeds do not meet"
    if engagement.measured_time <= 0 or engagement.measured_time > profile_end:
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
