"""From open files and their mapping to runs of a declared machine: cut, on one clock, flawed ones set aside."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.alignment import Window, align, choose_step, make_window
from slipstick.acquisition.channel import Source
from slipstick.acquisition.clock import GAP, HELD, mean_step, sampling_step
from slipstick.acquisition.cutting import cut_runs
from slipstick.acquisition.excerpt import (
    Excerpt,
    describe_channels,
    find_defect,
    slowest_of,
    tell_channels,
    tell_formats,
    tell_origins,
)
from slipstick.acquisition.mapping import MachineMap
from slipstick.acquisition.markers import instants
from slipstick.acquisition.numbers import Numbers, Plan
from slipstick.acquisition.result import ImportedRuns, SetAside
from slipstick.acquisition.tracks import Track, track
from slipstick.errors import BadRecording
from slipstick.machine import Machine, Profile, Runs, SignalRange, require_runs, units_of
from slipstick.machine.doubts import describe_span, list_doubts
from slipstick.numerics.quantities import raised
from slipstick.recordings.signals import LARGEST

_JUMP = 1e-3
"""Share of a step of the clock, or of a held command, that its jumps take: corners are joined by lines."""
_WHOLE = 0.5
"""Share of the median length below which a run is no whole one, and does not shorten the others."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RunExcerpt(Excerpt):
    """One run, with its `commands` and its `place` in the file.

    It begins `since` s after the file, whose signals have the `steps` in s, by name.
    """

    commands: Mapping[str, Track]
    place: int
    since: float
    steps: Mapping[str, float]

    @property
    def all_tracks(self) -> dict[str, Track]:
        """Signals, commands and further channels."""
        return {**self.tracks, **self.commands, **self.further}


def import_runs(sources: Iterable[Source], mapping: MachineMap, machine: Machine, plan: bytes | None = None,
                ranges: Sequence[SignalRange] = (), progress: Callable[[str], None] = lambda name: None
                ) -> ImportedRuns:
    """The runs of a `machine` in files, by a `mapping`; `plan` is the sheet of conditions that it names.

    `ranges` are those of signals in the machine's own experiments, to which the runs are compared.
    `progress` is called with the name of each file that was read. Raises `BadRecording`, which names file, channel or
    row, if a file does not have what is mapped or no run remains.
    """
    sheet = Plan.read(plan, mapping.plan, mapping.experiment) if plan is not None and mapping.plan is not None else None
    numbers = Numbers(mapping, sheet, mapping.units)
    candidates: list[RunExcerpt] = []
    aside: list[SetAside] = []
    formats: dict[str, list[str]] = {}
    files = 0
    for source in sources:
        for remark in source.remarks:
            formats.setdefault(remark, []).append(source.name)
        for excerpt in _list_excerpts(source, mapping, numbers):
            if isinstance(excerpt, SetAside):
                aside.append(excerpt)
            else:
                candidates.append(excerpt)
        progress(source.name)
        files += 1
    if not files:
        raise BadRecording("No file was given", "Name the files of the recordings")
    if not candidates:
        raise _nothing_left(aside)
    return _of_excerpts(candidates, aside, mapping, machine, ranges, tell_formats(formats), files)


def _list_excerpts(source: Source, mapping: MachineMap, numbers: Numbers) -> Iterator[RunExcerpt | SetAside]:
    """The runs of a file in the order of time, and those whose t = 0 is not known."""
    tracks = {name: track(source, ref, mapping.time, mapping.units[name]) for name, ref in mapping.signals.items()}
    commands = {name: track(source, ref, mapping.time, mapping.units[name]) for name, ref in mapping.commands.items()}
    further = {name: track(source, ref, mapping.time, None) for name, ref in mapping.further.items()}
    begin = max(float(signal.time[0]) for signal in tracks.values())
    end = min(float(signal.time[-1]) for signal in tracks.values())
    if not begin < end:
        raise BadRecording(f"The signals of {source.name} have no time in common: the last one begins at {begin:g} s, "
                           f"and the first one ends at {end:g} s", "Correct their `time`, or leave the file out")
    steps = {name: mean_step(signal.time, mapping.gap) for name, signal in tracks.items()}
    usual = max(steps.values())
    margin = 2 * max(usual, mapping.step or 0.0)
    for name, given in commands.items():
        if name not in mapping.held and HELD not in given.note and sampling_step(given.time) > GAP * margin / 2:
            raise BadRecording(f"The command '{given.channel}' of {source.name} has a sample every "
                               f"{1e3 * sampling_step(given.time):.4g} ms, and the runs every {500 * margin:.4g} ms",
                               f'Say under [commands."{name}"] what it does between them: held = true where it holds '
                               "each value until the next one, held = false where it follows a line")
    spans = np.array([[begin, end]])
    if mapping.cut is not None:
        spans = cut_runs(mapping.cut, source, mapping, begin, end + usual)
    marks = None
    if not isinstance(mapping.start, float):
        marked = track(source, mapping.start.source, mapping.time, None)
        marks = instants(mapping.start, marked.time, marked.values)
    clock = slowest_of(tracks).time
    clock = clock[clock >= begin]  # another signal may begin later than the slowest
    for place, (start, stop) in enumerate(spans):
        label = source.name if mapping.cut is None else f"{source.name}, run {place}"
        if marks is None:
            assert isinstance(mapping.start, float)
            wanted = start + mapping.start
        else:
            inside = marks[(marks >= start) & (marks < stop)]
            if len(inside) != 1:
                yield SetAside(label, f"its start is marked {len(inside)} times from {start:.7g} to {stop:.7g} s")
                continue
            wanted = float(inside[0])
        # Values between samples would mix neighbours, and their noise would be misjudged.
        near = int(np.searchsorted(clock, wanted))
        zero = float(min(clock[max(near - 1, 0):near + 1], key=lambda instant: abs(instant - wanted)))
        if zero >= stop - usual:
            yield SetAside(label, f"from its start at {wanted:.7g} s it has fewer than two samples, and ends at "
                                  f"{stop:.7g} s")
            continue
        # The sample at a cut is the first one of the next run.
        limit = stop - zero if mapping.cut is None else stop - zero - usual / 2
        parts = [{name: signal.around(zero - margin, stop + margin, zero) for name, signal in tracks.items()},
                 *({name: given.around(zero - (own := sampling_step(given.time)), stop + own, zero)
                    for name, given in group.items()} for group in (commands, further))]
        yield RunExcerpt(label=label, zero=zero, begin=float(start), tracks=parts[0], commands=parts[1],
                         further=parts[2], numbers=numbers.of(source, place, zero, float(stop)), limit=limit,
                         place=place, since=float(start) - begin, steps=steps)


def _of_excerpts(candidates: Sequence[RunExcerpt], aside: list[SetAside], mapping: MachineMap, machine: Machine,
                 ranges: Sequence[SignalRange], remarks: list[str], files: int) -> ImportedRuns:
    steps = {name: [excerpt.steps[name] for excerpt in candidates] for name in mapping.signals}
    step, chosen = choose_step({name: max(each) for name, each in steps.items()}, mapping.step)
    ends = np.array([excerpt.end for excerpt in candidates])
    if mapping.length is None:
        whole = ends >= _WHOLE * np.median(ends)
        end = float(ends[whole].min())
        chosen.append(f"the runs end {end:.4g} s after their begin, with the shortest of the {whole.sum()} that last "
                      f"at least half as long as the median; the longest lasts {ends.max():.4g} s")
    else:
        end = mapping.length - step / 2
    if end < 2 * step:
        raise BadRecording(f"The runs last {end:.4g} s, and the clock has steps of {step:g} s",
                           "Give a longer length, a shorter step, or other cuts")
    window = make_window(step, min(map(min, steps.values())), end)
    kept = []
    for excerpt in candidates:
        reason = _find_defect(excerpt, window, mapping)
        if reason:
            aside.append(SetAside(excerpt.label, reason))
        else:
            kept.append(excerpt)
    if not kept:
        raise _nothing_left(aside)
    if len(kept) * len(window.time) * len(mapping.signals) > LARGEST:
        raise BadRecording(f"{len(kept)} runs of {len(window.time):,} samples are more than {LARGEST:,} numbers",
                           "Give a longer clock.step, or a shorter runs.length")
    runs = require_runs(machine, _make_runs(kept, window, mapping, machine, files))
    mapped = {**mapping.signals, **mapping.commands, **mapping.further}
    channels = describe_channels([excerpt.all_tracks for excerpt in kept], mapped)
    if mapping.cut is not None:
        chosen.append(f"{len(kept) + len(aside)} runs were cut from {files} file{'s' if files > 1 else ''}; the first "
                      f"one begins at {kept[0].zero:.6g} s on the clock of its file, at the sample nearest to its cut")
    chosen += [f"{name}: each value is held until the next sample" for name in mapping.commands
               if any(_is_held(name, excerpt.commands[name], mapping) for excerpt in kept)]
    return ImportedRuns(
        runs=runs, labels=tuple(excerpt.label for excerpt in kept), step=step, channels=channels,
        set_aside=tuple(aside), begins=np.array([excerpt.zero for excerpt in kept]),
        remarks=(*remarks, *(tell_origins(kept, mapping) for _ in range(mapping.cut is None)), *chosen,
                 *(f"{each.name} is {describe_span(runs.conditions[each.name], each.unit)} in the runs"
                   for each in machine.conditions),
                 *tell_channels(channels, mapped, {**mapping.signals, **mapping.further}, step)),
        doubts=(*(f"{channel.name} ('{channel.channel}') has the same value in all runs, {channel.lowest:g} "
                  f"{raised(channel.unit)}. Check its channel"
                  for channel in channels if channel.lowest == channel.highest),
                *list_doubts(runs, machine, ranges)))


def _nothing_left(aside: Sequence[SetAside]) -> BadRecording:
    remedy = "Check channels, [runs] and units in the mapping"
    if "has a gap" in aside[0].reason:
        remedy += ". Where the clock of the logger is irregular, state its longest step, such as clock.gap = \"40 ms\""
    return BadRecording(f"None of the {len(aside)} runs can be used; {aside[0].label}: {aside[0].reason}", remedy)


def _find_defect(excerpt: RunExcerpt, window: Window, mapping: MachineMap) -> str:
    """Why a run cannot be used; empty where it can."""
    if excerpt.end < window.end - window.step / 2:
        return f"it lasts {excerpt.end:.4g} s, and the runs {window.end:.4g} s"
    reason = find_defect(excerpt, window, mapping.origin, mapping.gap)
    for name, given in {**excerpt.commands, **excerpt.further}.items():
        reason = reason or _find_missing(name, given, window, mapping)
    return reason


def _find_missing(name: str, given: Track, window: Window, mapping: MachineMap) -> str:
    """Where a command or a further channel is not known during a run; empty for nowhere."""
    where, is_held = f"{name} ('{given.channel}')", _is_held(name, given, mapping)
    during = (given if is_held else given.known()).around(0.0, window.end, 0.0)
    allowed = mapping.gap or GAP * sampling_step(given.time) if len(given.time) > 1 else window.step
    if not len(during.time) or during.time[0] > allowed or (during.time[-1] < window.end - allowed and not is_held):
        return f"{where} has no samples at the begin or the end of the run"
    missing = np.flatnonzero(~np.isfinite(during.values) & (during.time < window.end) if is_held else
                             np.diff(during.time) > allowed)
    if len(missing):
        first, last = (*during.time[missing[0]:missing[0] + 2], window.end)[:2]
        hint = "" if is_held or name not in mapping.commands else ". If it holds its values, add held = true"
        return f"{where} has a gap from {first:.4g} to {last:.4g} s after the {mapping.origin}{hint}"
    return ""


def _is_held(name: str, given: Track, mapping: MachineMap) -> bool:
    return mapping.held.get(name, name in mapping.commands and HELD in given.note)


def _make_runs(kept: Sequence[RunExcerpt], window: Window, mapping: MachineMap, machine: Machine, files: int) -> Runs:
    further = {name: _align_further([excerpt.further[name] for excerpt in kept], window, mapping.gap)
               for name in mapping.further}
    numbers = {name: np.array([excerpt.numbers[name] for excerpt in kept]) for name in mapping.conditions}
    order = None
    if "run_order" in numbers or (files == 1 and mapping.cut is not None):
        stated = numbers.pop("run_order", np.zeros(len(kept)))
        places = np.array([excerpt.place for excerpt in kept])
        order = np.argsort(np.lexsort((places, stated))).astype(float)
    conditions = {each.name: numbers.pop(each.name) for each in machine.conditions}
    begins = {mapping.begin_as: np.array([excerpt.since for excerpt in kept])} if mapping.begin_as else {}
    units = {**{name: given.unit for name, given in kept[0].further.items()},
             **{name: mapping.units[name] for name in numbers}, **dict.fromkeys(begins, "s"), **units_of(machine)}
    return Runs(
        window.time,
        {name: align([excerpt.tracks[name] for excerpt in kept], window, mapping.gap) for name in mapping.signals},
        {name: _join([_corners(given.known().around(0.0, window.end, 0.0), _is_held(name, given, mapping), window.step)
                      for given in (excerpt.commands[name] for excerpt in kept)]) for name in mapping.commands},
        conditions, {**further, **numbers, **begins}, order, units, machine.name,
        mapping.description or f"Imported by {mapping.name}", tuple(excerpt.label for excerpt in kept))


def _align_further(tracks: Sequence[Track], window: Window, gap: float | None) -> np.ndarray:
    """A further channel (n, m) on the clock; its first and last values reach the ends of a run, less than a step away.
    """
    rows = align(tracks, window, gap)
    return np.array([np.interp(window.time, window.time[known], row[known])
                     for row, known in zip(rows, np.isfinite(rows), strict=True)])


def _corners(command: Track, is_held: bool, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants and values (m,) of a command: its own samples, or where it is held, both sides of each jump.

    `step` in s is that of the common clock.
    """
    time, values = command.time, command.values
    if not is_held or len(time) < 2:
        return time, values
    jumps = np.flatnonzero(np.diff(values)) + 1
    before = time[jumps] - _JUMP * min(step, np.diff(time).min())
    return (np.concatenate([time[:1], np.column_stack([before, time[jumps]]).ravel()]),
            np.concatenate([values[:1], np.column_stack([values[jumps - 1], values[jumps]]).ravel()]))


def _join(corners: Sequence[tuple[np.ndarray, np.ndarray]]) -> Profile:
    """Commands of runs with different numbers of corners: the last value is repeated."""
    most = max(len(time) for time, _ in corners)
    return Profile(
        np.array([np.concatenate([time, time[-1] + 1.0 + np.arange(most - len(time))]) for time, _ in corners]),
        np.array([np.pad(values, (0, most - len(values)), mode="edge") for _, values in corners]))
