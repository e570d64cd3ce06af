"""The page of recordings: the signals of a run to flip through, its levels and flaws, and numbers of all runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from weakref import WeakKeyDictionary

import numpy as np

from slipstick.acquisition.flaws import Flaw, flaws
from slipstick.acquisition.result import LeadIn
from slipstick.bench.conditions import CONDITION_UNITS
from slipstick.black_box import Measurements
from slipstick.errors import UnknownName
from slipstick.machine import Profile, Runs
from slipstick.pictures import units
from slipstick.pictures.conditions import described
from slipstick.pictures.engagement import VACUUM
from slipstick.pictures.panels import Signal, Span, draw_numbers, draw_signal, titled
from slipstick.pictures.theme import in_words
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.report.words import listed
from slipstick.table.subject import columns

from ..drawings import Drawings
from ..front.details import conditions_table, numbers_table, page
from ..front.elements import Link, plural
from ..front.panels import Panel, draw_panels

_MOST_SAMPLES = 2_000_000
"""Samples of all signals together that are searched for flaws of all runs; of more, only those of the shown run are."""
_MOST_LINKS = 20
_KNOWN: WeakKeyDictionary[Recordings | Runs, Mapping[int, Sequence[str]]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Course:
    """What recordings of any machine have over time: `signals` and `commands` (n, k) at `time` (k,) in s, and `units`.

    `levels` and `results` (n,) are constant in each run: the conditions, and what was measured once. `instants` (n,)
    are in s. A run is called by a `word`, and by its name where `names` are known.
    """

    word: str
    count: int
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    commands: Mapping[str, Profile]
    units: Mapping[str, str]
    levels: Mapping[str, np.ndarray]
    results: Mapping[str, np.ndarray]
    conditions: Mapping[str, Sequence[float]]
    instants: Mapping[str, np.ndarray] = field(default_factory=dict)
    lowest: Mapping[str, float] = field(default_factory=dict)
    names: Sequence[str] = ()


def recordings_page(name: str, recordings: Recordings | Measurements | Runs, about: str, run: int,
                    drawings: Drawings) -> str:
    """Return the content of the page of recordings, which shows the run of this number; raises `UnknownName`."""
    course = _course_of(recordings)
    if run >= course.count:
        raise UnknownName(f"The recordings '{name}' have no {course.word} {run}",
                          f"Give a number from 0 to {course.count - 1}")
    flawed = _flaws_by_run(recordings, course, run)
    numbers = [Panel(draw_numbers(entry, course.units.get(entry, ""), values, run, course.word),
                     f"The {in_words(entry)} of each {course.word}; {course.word} {run} has a ring.")
               for entry, values in course.results.items()]
    return page("Recordings", name, about, f"/v1/recordings/{name}", [
        _shown_run(recordings, course, run, flawed.get(run, ()), drawings),
        section(f"All {course.word}s", _flaws_of_all(course, flawed, run),
                draw_panels(drawings, numbers, "numbers", recordings.digest, str(run)),
                _all_numbers(recordings, course)),
        section("Recorded", _recorded(course)) if course.signals else "",
        section("Origin", definitions([*([("machine", recordings.machine)] if isinstance(recordings, Runs) else []),
                                       ("digest", recordings.digest)]))])


def previewed_run(recordings: Recordings | Runs, run: int, lead: LeadIn | None) -> tuple[str, list[Panel]]:
    """Return the conditions of a run in words, and its signals as panels, which begin with what `lead` has of it."""
    course = _course_of(recordings)
    words = described(course.conditions, run)
    if lead is None or not course.signals:
        return words, _panels(course, run) if course.signals else []
    whole = np.concatenate([lead.time, course.time])
    signals = {entry: np.hstack([lead.signals[entry], values[:len(lead.signals[entry])]])
               for entry, values in course.signals.items()}
    return words, _panels(replace(course, time=whole, signals=signals, instants={
        "shift command": np.zeros(course.count), **course.instants}), run)


def _course_of(recordings: Recordings | Measurements | Runs) -> Course:
    if isinstance(recordings, Runs):
        constants = {**recordings.conditions, **{entry: values for entry, values in recordings.channels.items()
                                                 if values.ndim == 1}}
        over_time = {entry: values for entry, values in recordings.channels.items() if values.ndim == 2}
        return Course("run", len(recordings), recordings.time, {**recordings.signals, **over_time},
                      recordings.commands, recordings.units, constants, constants,
                      {f"{entry} [{recordings.units.get(entry, '1')}]": values.tolist()
                       for entry, values in constants.items()}, names=recordings.names)
    conditions = columns(recordings.conditions)
    if isinstance(recordings, Measurements):
        output = recordings.output
        return Course("measurement", len(recordings), np.zeros(0), {}, {}, {output.name: output.unit}, {},
                      {output.name: recordings.measured_time}, conditions)
    result = {"shifting time": recordings.measured_time}
    known = {"shifting time": "s", "current": "A", **SIGNAL_UNITS, **CONDITION_UNITS}
    if recordings.signals is None:
        return Course("engagement", len(recordings), np.zeros(0), {}, {}, known, {}, result, conditions)
    setting, further = recordings.conditions, recordings.further
    signals = {entry: recordings.signals[entry] for entry in reversed(recordings.signals.names)}
    profile = setting.current_profile
    return Course("engagement", len(recordings), recordings.signals.time,
                  {**signals, **{entry: channel.values for entry, channel in further.items()}},
                  {"current": Profile(setting.profile_time[profile], setting.profile_current[profile])},
                  {**known, **{entry: channel.unit for entry, channel in further.items()}},
                  {"motor_speed": setting.motor_speed, "brake_torque": setting.brake_torque}, result, conditions,
                  {"shifting time": recordings.measured_time}, {"pressure": VACUUM})


def _shown_run(recordings: Recordings | Measurements | Runs, course: Course, run: int, flawed: Sequence[str],
               drawings: Drawings) -> str:
    """Return the section of one run: links to its neighbours, its conditions in words, and its signals."""
    words = described(course.conditions, run)
    results = [units.with_unit(f"{in_words(entry)} {values[run]:.4g}", units.raised(course.units.get(entry, "")))
               for entry, values in course.results.items() if entry not in course.levels]
    parts = [_flip(course, run) if course.count > 1 else "",
             paragraph("; ".join([words, *results] if words else results))]
    if course.signals:
        parts += [paragraph("; ".join(flawed) or "No gap, no spike and no saturation in any signal.",
                            "flawed" if flawed else "note"),
                  draw_panels(drawings, _panels(course, run), "run", recordings.digest, str(run))]
    title = f"{course.word.capitalize()} {run}" + (f": {course.names[run]}" if course.names else "")
    return (f'<section id="run" aria-labelledby="run-title">\n<h2 id="run-title">{escape(title)}</h2>\n'
            + "\n".join(parts) + "\n</section>")


def _flip(course: Course, run: int) -> str:
    """Return links to the previous and the next run, and a field for the number of any."""
    def neighbour(text: str, number: int, relation: str) -> str:
        if not 0 <= number < course.count:
            return f'<span class="off">{text}</span>'
        return f'<a rel="{relation}" href="?run={number}#run">{text}</a>'

    return (f'<form class="flip" action="#run" method="get">{neighbour("← Previous", run - 1, "prev")}\n'
            f'{neighbour("Next →", run + 1, "next")}\n'
            f'<label>{escape(course.word.capitalize())} <input type="number" name="run" min="0" '
            f'max="{course.count - 1}" value="{run}" required></label>\n'
            f'<span class="off">of 0 to {course.count - 1}</span>\n<button>Show</button></form>')


def _panels(course: Course, run: int) -> list[Panel]:
    panels = []
    commands = {entry: profile.at(course.time)[run] for entry, profile in course.commands.items()}
    for entry, values in {**{entry: values[run] for entry, values in course.signals.items()}, **commands}.items():
        unit = course.units.get(entry, "")
        levels = {in_words(level): float(constant[run]) for level, constant in course.levels.items()
                  if course.units.get(level) == unit and np.isfinite(constant[run])}
        known = np.flatnonzero(np.isfinite(values))
        inside = slice(known[0], known[-1] + 1) if len(known) else slice(None)
        spans = () if entry in commands else [Span(flaw.kind, flaw.start, flaw.end)
                                              for flaw in flaws(course.time[inside], values[inside])]
        lowest = course.lowest.get(entry, -np.inf)
        signal = Signal(entry, unit, values, levels, spans,
                        {label: float(instant[run]) for label, instant in course.instants.items()}, lowest)
        marks = [f"dotted: {listed(list(levels))}" if levels else "",
                 f"dashed: {listed(list(course.instants))}" if course.instants else "",
                 "shaded: flaws" if spans else ""]
        about = "; ".join(mark for mark in marks if mark)
        panels.append(Panel(draw_signal(course.time, signal), f"{in_words(entry)} of {course.word} {run} over time"
                            + (f"; {about}" if about else ""), _below(course.time, values, lowest)))
    return panels


def _below(time: np.ndarray, values: np.ndarray, lowest: float) -> str:
    """Say what of a pressure is not drawn, because no pressure is below vacuum."""
    below = np.flatnonzero(values < lowest)
    if not len(below):
        return ""
    least = units.number(float(values.min()))
    return (f"{plural(len(below), 'sample')} from {1e3 * time[below[0]]:.0f} to {1e3 * time[below[-1]]:.0f} ms below "
            f"vacuum, down to {least} bar, not drawn: an offset of the sensor or, in simulated recordings, the "
            "approximated delay of the valve, whose answer to a step starts in the wrong direction.")


def _flaws_by_run(recordings: Recordings | Measurements | Runs, course: Course,
                  run: int) -> Mapping[int, Sequence[str]]:
    """Return the flaws of each run that has some, in words; of the shown run alone where all have too many samples."""
    if isinstance(recordings, Measurements) or not course.signals:
        return {}
    if not _searched_all(course):
        return {run: words} if (words := _describe_flaws(course, run)) else {}
    if recordings not in _KNOWN:
        entries = ((number, _describe_flaws(course, number)) for number in range(course.count))
        _KNOWN[recordings] = {number: words for number, words in entries if words}
    return _KNOWN[recordings]


def _searched_all(course: Course) -> bool:
    return course.count * len(course.signals) * len(course.time) <= _MOST_SAMPLES


def _describe_flaws(course: Course, run: int) -> list[str]:
    return [f"{in_words(entry)}: {_describe(flaw)}" for entry, values in course.signals.items()
            for flaw in flaws(course.time, values[run])]


def _describe(flaw: Flaw) -> str:
    where = f"at {flaw.start:.4g} s" if flaw.start == flaw.end else f"from {flaw.start:.4g} to {flaw.end:.4g} s"
    return f"{flaw.kind} {where}"


def _flaws_of_all(course: Course, flawed: Mapping[int, Sequence[str]], run: int) -> str:
    if not course.signals:
        return ""
    if not _searched_all(course):
        return paragraph(f"There are so many samples that flaws are searched in the shown {course.word} alone.", "note")
    if not flawed:
        return paragraph(f"No signal of any {course.word} has a gap, a spike or a saturation.", "note")
    links = ", ".join(Link(str(number), f"?run={number}#run").html() for number in list(flawed)[:_MOST_LINKS])
    more = f" and {plural(len(flawed) - _MOST_LINKS, 'more', 'more')}" if len(flawed) > _MOST_LINKS else ""
    return (f'<p class="flawed">{plural(len(flawed), course.word)} with a gap, a spike or a saturation: {links}{more}'
            "</p>")


def _all_numbers(recordings: Recordings | Measurements | Runs, course: Course) -> str:
    if isinstance(recordings, Runs):
        return numbers_table("run", course.conditions, course.count, "run") if course.conditions else ""
    output = ("shifting time [s]" if isinstance(recordings, Recordings) else
              f"{recordings.output.name} [{recordings.output.unit}]")
    return conditions_table(recordings.conditions, {output: recordings.measured_time.tolist()})


def _recorded(course: Course) -> str:
    step = np.median(np.diff(course.time))
    commands = {entry: profile.value for entry, profile in course.commands.items()}
    rows = [(titled(entry, course.units.get(entry, "")), kind,
             f"{units.number(np.nanmin(values), 4)} to {units.number(np.nanmax(values), 4)}")
            for kind, entries in (("signal", course.signals), ("command", commands))
            for entry, values in entries.items()]
    return paragraph(f"{len(course.time):,} samples of each {course.word}, from {course.time[0]:g} to "
                     f"{course.time[-1]:g} s, {1e3 * step:.3g} ms apart") + table(
        ("quantity", "kind", f"range of all {course.word}s"), rows, {1})
