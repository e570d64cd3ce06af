"""The fields that say which channel of a file is what, of a bench and of a declared machine.

Each field has the path of its key in the mapping as JSON, from which the script of the page writes the file.
"""

import json
import re
from collections.abc import Sequence
from html import escape

from slipstick.bench import Bench
from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS
from slipstick.machine import MachineDescription
from slipstick.pictures import units
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import paragraph

from ..front.elements import options

_LEVELS = (("above", "rises above"), ("below", "falls below"), ("changes", "changes"))
_OF_CHANNEL = "in the unit of the file"
_TIME = "a number with its unit, such as 1 ms"
_CUTS = (("", "each file is a run"), ("standstills", "at standstills"), ("reversals", "at reversals"),
         ("edges", "at edges of a channel"), ("length", "into parts of equal length"))


def bench_rows(bench: Bench) -> str:
    """Return the fields of the mapping of a bench."""
    signals = [_channel(("time",), "time", "s"),
               *(_channel(("signals", name), in_words(name), unit, has_sign=True)
                 for name, unit in SIGNAL_UNITS.items()),
               _channel(("further", "oil_temperature"), "oil temperature", "")]
    stated = {**CONDITION_UNITS, **(INPUT_UNITS if bench.physics.converter is None else {})}
    numbers = [(name, in_words(name), unit) for name, unit in stated.items()]
    return "\n".join([
        _rows("Which channel is what", signals),
        _rows("Begin of an engagement", [_instant(("shift_command",), "shift command", "at a time", "the level is "
                                                  "in the unit of the file; a time, such as 100 ms, counts from the "
                                                  "first sample of a file or engagement")]),
        _conditions(numbers),
        _folded("Several engagements in a file, and the clock", [
            _instant(("trigger",), "an engagement begins where", "", "only where a file has several"),
            _entry(("clock", "step"), "step of the samples", f"{_TIME}; default: that of the slowest signal"),
            _entry(("clock", "end"), "end of the recordings", f"{_TIME}; default: that of the shortest engagement")]),
        _text("limits of sensors, recorded shifting times, further channels, several clocks, forms of text files")])


def machine_rows(machine: MachineDescription) -> str:
    """Return the fields of the mapping of a declared machine."""
    signals = [_channel(("time",), "time", "s"),
               *(_channel(("signals", each.signal), each.signal, each.unit or "1", has_sign=True)
                 for each in machine.sensors)]
    commands = [_channel(("commands", each.name), each.name, each.unit or "1", is_command=True)
                for each in machine.commands]
    further = [_channel(("further", name), name, "") for name in machine.inputs]
    numbers = [(each.name, each.name, each.unit or "1") for each in machine.conditions]
    return "\n".join([
        _rows("Which channel is what", signals),
        _rows("Commands", commands, "Known without noise: set points, not what was measured of them."),
        _rows("Further channels that equations read", further),
        _conditions(numbers),
        _rows("How runs are cut", _cuts()),
        _folded("Begin within a run, and the clock", [
            _instant(("runs", "start"), "t = 0 of a run", "at a time", "default: where the run is cut"),
            _entry(("runs", "begin_as"), "keep the time of the cut as", "the name of a constant of each run, in s"),
            _entry(("clock", "step"), "step of the samples", f"{_TIME}; default: that of the slowest signal"),
            _entry(("clock", "gap"), "longest step of the logger", f"{_TIME}; samples further apart have a gap "
                                                                   "between them; default: 1.5 usual steps")]),
        _text("limits of sensors, further channels and constants, several clocks, forms of text files")])


def _cuts() -> list[str]:
    """The rows of the cuts; those with a `data-for` are shown for the cuts that it names."""
    length = _entry(("runs", "length"), "length of the runs", f"{_TIME}; default: that of the shortest")
    return [
        _choice(("runs", "cut"), "runs are cut", _CUTS, "what precedes the first cut and follows the last one is in "
                                                         "no run"),
        _instant(("runs",), "standstill", "", _OF_CHANNEL, (("below", "its magnitude is below"),
                                                            ("within", "it stays within a range of")), "standstills"),
        _entry(("runs", "for"), "for at least", "such as 0.2 s", "standstills"),
        _choice(("runs", "from"), "runs begin", (("", "in the middle of a standstill"), ("end", "at its end")), "",
                "standstills"),
        _instant(("runs",), "reversal", "", "choose the level above the noise of the channel",
                 (("level", "goes back by more than"),), "reversals"),
        _choice(("runs", "of"), "what reverses", (("", "its direction, at a turning point"), ("sign", "its sign")), "",
                "reversals"),
        _choice(("runs", "direction"), "runs are kept", (("", "all"), ("1", "that rise, or are positive"),
                                                         ("-1", "that fall, or are negative")), "", "reversals",
                kind="number"),
        _instant(("runs",), "a run begins where", "", _OF_CHANNEL, shown_for="edges"),
        length]


def _conditions(numbers: Sequence[tuple[str, str, str]]) -> str:
    """The conditions, each by key, label and unit, and where they may come from."""
    sheet = ('<div class="row"><label for="map-plan">sheet of conditions</label><input type="file" id="map-plan" '
             f'accept=".csv,.txt,.tsv" {_path("conditions", "plan")} aria-describedby="map-plan-why"><span '
             'class="about" id="map-plan-why">CSV with a column <code>file</code>, and a row for each file; its other '
             'columns can be chosen below</span><span class="wrong" id="map-plan-wrong" hidden></span></div>')
    pattern = _entry(("conditions", "pattern"), "pattern of the file names", "a regular expression of which the named "
                     "groups can be chosen below, such as _J(?P<J>[0-9.]+)")
    rows = "".join(_number(*each) for each in numbers) + _number("run_order", "order of the test", "1", "optional")
    return "\n".join([
        "<h3>Conditions</h3>", paragraph("A number with its unit, or a channel, of which the mean is taken.", "about"),
        _folded("From a sheet, or from the names of the files", [sheet, pattern]), f'<div class="map">{rows}</div>'])


def _rows(title: str, rows: Sequence[str], about: str = "") -> str:
    if not rows:
        return ""
    return f'<h3>{title}</h3>{paragraph(about, "about") if about else ""}<div class="map">{"".join(rows)}</div>'


def _folded(title: str, rows: Sequence[str]) -> str:
    return f'<details class="experts"><summary>{title}</summary><div class="map">{"".join(rows)}</div></details>'


def _text(rest: str) -> str:
    """What is said in the text of the mapping alone."""
    return f'<p class="about" id="map-rest">Only in the mapping as a file, below: {rest}.</p>'


def _path(*keys: str | None, kind: str = "text") -> str:
    """The attributes of a field: the path of its key as JSON, and what is made of its value."""
    name = ".".join(key or "level" for key in keys)
    return f'name="{escape(name)}" data-path="{escape(json.dumps(keys))}" data-kind="{kind}"'


def _id(*keys: str) -> str:
    return re.sub(r"\W+", "-", "-".join(("map", *keys)))


def _row(keys: tuple[str, ...], id: str, label: str, controls: str, about: str = "", shape: str = "",
         attributes: str = "") -> str:
    return (f'<div class="row {shape}" data-key="{escape(".".join(keys))}" {attributes}><label for="{id}">'
            f'{escape(label)}</label>{controls}<span class="about" id="{id}-why">{escape(about)}</span>'
            f'<span class="wrong" id="{id}-wrong" hidden></span></div>')


def _channel(keys: tuple[str, ...], label: str, unit: str, has_sign: bool = False, is_command: bool = False) -> str:
    """A row that chooses a channel, its unit where the file states none or a wrong one, and its sign."""
    id, name = _id(*keys), escape(label)
    controls = (f'<select id="{id}" class="channels needed" {_path(*keys, "channel")} aria-describedby="{id}-why">'
                f'<option value="">not recorded</option></select><input type="text" class="unit" '
                f'{_path(*keys, "unit")} aria-label="unit of {name}" autocomplete="off" spellcheck="false" '
                f'placeholder="{escape(unit)}">')
    if has_sign:
        controls += (f'<label class="sign"><input type="checkbox" value="-1" {_path(*keys, "sign", kind="number")} '
                     f'aria-label="opposite sign of {name}"> ×−1</label>')
    if is_command:
        controls += (f'<select {_path(*keys, "held", kind="json")} aria-label="{name} between samples">'
                     '<option value="">as the file shows</option><option value="true">holds each value</option>'
                     '<option value="false">follows a line</option></select>')
    return _row(keys, id, label, controls, shape="command" if is_command else "",
                attributes=f'data-needs="{escape(unit)}" data-guess="{escape(keys[-1])}"')


def _number(name: str, label: str, unit: str, about: str = "") -> str:
    """A row that states a condition as a number with its unit, or chooses where it comes from."""
    keys, shown = ("conditions", name), escape(label)
    id, example = _id(*keys), "0" if unit == "1" else f"1 {unit}"
    controls = (f'<input type="text" id="{id}" {_path(*keys, "value", kind="number")} autocomplete="off" '
                f'spellcheck="false" placeholder="{escape(example)}" aria-describedby="{id}-why"><select '
                f'class="source" {_path(*keys, kind="source")} aria-label="source of {shown}"><option value="">'
                f'or from …</option></select><input type="text" class="unit" {_path(*keys, "unit")} '
                f'aria-label="unit of {shown}" autocomplete="off" spellcheck="false" hidden>')
    guess = "current" if name == "current_profile" else name
    return _row(keys, id, f"{label} [{units.raised(unit)}]" if unit != "1" else label, controls, about, "condition",
                f'data-needs="{escape(unit)}" data-guess="{escape(guess)}"')


def _instant(keys: tuple[str, ...], label: str, time: str, about: str, levels: Sequence[tuple[str, str]] = _LEVELS,
             shown_for: str = "") -> str:
    """A row that chooses a channel, and the level that marks an instant in it, or a `time` instead of both."""
    id, name = _id(*keys, *((shown_for,) if shown_for else ())), escape(label)
    alone = ' data-alone=""' if time else ""
    controls = (f'<select id="{id}" class="channels needed" {_path(*keys, "channel")} aria-describedby="{id}-why">'
                f'<option value="">{time or "choose a channel"}</option></select>'
                f'<select class="how" aria-label="how the channel marks it: {name}">{options(levels)}</select>'
                f'<input type="text" class="level" {_path(*keys, None, kind="number")}{alone} autocomplete="off" '
                f'spellcheck="false" aria-label="{"level or time" if time else "level"} of {name}">')
    return _row(keys, id, label, controls, about, "instant", _shown_for(shown_for) +
                ' data-guess="shift_command"' * (keys == ("shift_command",)))


def _entry(keys: tuple[str, ...], label: str, about: str, shown_for: str = "") -> str:
    id = _id(*keys)
    kind = "number" if keys[0] in ("clock", "runs") and keys[-1] != "begin_as" else "text"
    control = (f'<input type="text" id="{id}" {_path(*keys, kind=kind)} autocomplete="off" spellcheck="false" '
               f'aria-describedby="{id}-why">')
    return _row(keys, id, label, control, about, attributes=_shown_for(shown_for))


def _choice(keys: tuple[str, ...], label: str, choices: Sequence[tuple[str, str]], about: str, shown_for: str = "",
            kind: str = "text") -> str:
    id = _id(*keys)
    control = f'<select id="{id}" {_path(*keys, kind=kind)} aria-describedby="{id}-why">{options(choices)}</select>'
    return _row(keys, id, label, control, about, attributes=_shown_for(shown_for))


def _shown_for(cut: str) -> str:
    return f'data-for="{cut}" hidden' if cut else ""
