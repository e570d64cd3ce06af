"""Propose a mapping from the names and units of channels; each guess is written into the file with its reason."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from slipstick.acquisition.channel import Channel, Listed, Source
from slipstick.acquisition.machine_mapping import CUTS
from slipstick.acquisition.mapping import ChannelRef, Marker
from slipstick.acquisition.markers import instants
from slipstick.acquisition.units import spelled
from slipstick.bench import Bench
from slipstick.errors import BadRecording
from slipstick.machine import Machine
from slipstick.numerics.quantities import NotAQuantity, convert

_WORDS = {
    "pressure": r"press|druck|(^|_)p(_|\d|$)|^p[A-Z]",
    "input_speed": r"(n|speed|omega|rpm|drehzahl|w)\w*(in|an|turb|prim)|(in|an|turb|prim)\w*(speed|rpm|drehzahl|n$)",
    "output_speed": r"(n|speed|omega|rpm|drehzahl|w)\w*(out|ab|sec|sek)|(out|ab|sec|sek)\w*(speed|rpm|drehzahl|n$)",
    "output_torque": r"torque|moment|trq|(^|_)(m|t|md)(_|\d|$)|^M[A-Z]",
    "motor_speed": r"(n|speed|rpm|drehzahl)\w*mot|mot\w*(n|speed|rpm|drehzahl)|eng\w*(speed|rpm)",
    "current": r"curr|strom|(^|_)i(_|\d|$)|^i[A-Z]|^I",
    "oil_temperature": r"temp|oil|oel|öl|(^|_)t_?(oil|oel)",
    "time": r"^(t|time|zeit|timestamp|timestamps)$",
    "shift_command": r"shift|schalt|request|anford|(^|_)(cmd|command|trigger)(_|$)",
}
"""What names of channels look like in English and German. A unit must fit as well, where there is one."""
_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m",
          "motor_speed": "rad/s", "current": "A", "oil_temperature": "K", "time": "s"}
_FEW = 12
"""Most channels that are named in a reason."""


@dataclass(frozen=True)
class Guess:
    """A proposed channel, None where none fits, and the reason; `sure` where its unit, and no other channel, fits."""

    name: str
    channel: Listed | None
    reason: str
    sure: bool


@dataclass(frozen=True)
class Proposal:
    """The `text` of a mapping file, the guesses in it, and how many keys are left to fill in."""

    text: str
    guesses: tuple[Guess, ...]
    open_keys: tuple[str, ...]


def propose(source: Source, bench: Bench) -> Proposal:
    """A mapping for files like `source`, with conditions of the `bench`; every guess has its reason beside it."""
    listed = source.listed()
    needs_time = _needs_time(source, listed)
    taken: set[str] = set()
    guesses = {}
    for name in ("time", "pressure", "output_torque", "motor_speed", "input_speed", "output_speed", "current",
                 "oil_temperature"):
        guesses[name] = _guess(name, [entry for entry in listed if entry.name not in taken], _UNITS[name])
        proposed = guesses[name].channel
        if proposed is not None:
            taken.add(proposed.name)
    if not needs_time:
        guesses.pop("time")
    remaining = [entry for entry in listed if entry.name not in taken]
    shift, level = _shift_command(source, bench, remaining, guesses["current"])
    return _write_proposal(source, bench, guesses, shift, level)


def propose_for_machine(source: Source, machine: Machine) -> Proposal:
    """A mapping for files like `source` and a declared machine; every guess has its reason beside it."""
    lines, missing, listed = _head(source), list[str](), list(source.listed())
    guesses, channels = list[Guess](), _name_channels(source.listed())
    own_units = _states_units(source)

    def section(heading: str, guess: Guess, unit: str) -> None:
        if guess.channel is None and channels:
            guess = replace(guess, reason=f"{guess.reason}; the file has {channels}")
        guesses.append(guess)
        lines.extend([heading, *_lines(guess, unit, missing, own_units), ""])
        if guess.channel is not None:
            listed.remove(guess.channel)

    if _needs_time(source, listed):
        section("[time]", _guess("time", listed, "s"), "s")
    wanted = [*(("signals", each.signal, each.unit) for each in machine.sensors),
              *(("commands", each.name, each.unit) for each in machine.commands),
              *(("further", each, None) for each in machine.inputs)]
    # A channel that is called like a signal is not left to another one, whose unit alone fits.
    for kind, name, unit in sorted(wanted, key=lambda each: not _called(each[1], listed)):
        section(f'[{kind}."{name}"]', _guess_named(name, listed, unit), unit or "1")
    lines.append("[conditions]")
    for each in machine.conditions:
        missing.append(each.name)
        lines.append(f'# OPEN: "{each.name}" = {{ value = "1 {each.unit}" }}, or a name, column or channel')
    lines += ["", "[runs]", "# Without `cut` each file is a run. Of one long recording, give one of:",
              *(f'# cut = "{cut}"' for cut in CUTS)]
    return Proposal("\n".join(lines) + "\n", tuple(guesses), tuple(missing))


def _name_channels(channels: Sequence[Listed]) -> str:
    """Return few channels with their units, to choose from; empty for many."""
    return ", ".join(f"'{each.name}' [{each.unit or 'no unit'}]" for each in channels) if len(channels) <= _FEW else ""


def _states_units(source: Source) -> bool:
    """Whether a file states the unit of each channel: another one in the mapping would replace it."""
    return all(each.unit for each in source.listed())


def _called(name: str, channels: Sequence[Listed]) -> list[Listed]:
    """The channels whose name has that of a signal in it, or nearly is it."""
    def bare(text: str) -> str:
        return re.sub(r"[\W_]+", "", text).lower()

    return [channel for channel in channels if bare(name) in bare(channel.name)] or [
        channel for channel in channels if get_close_matches(bare(name), [bare(channel.name)])]


def _guess_named(name: str, channels: Sequence[Listed], unit: str | None) -> Guess:
    """The channel that is called like a signal, or the only one whose stated unit fits; any unit fits None."""
    fitting = [channel for channel in channels if unit is None or _fits(channel.unit, unit or "1")]
    alike = _called(name, channels)
    by_name = [channel for channel in alike if channel in fitting]
    if by_name or alike:
        return _choose(name, alike, by_name)
    by_unit = [channel for channel in fitting if channel.unit] if unit else []
    if len(by_unit) == 1:
        return Guess(name, by_unit[0], f"the unit '{by_unit[0].unit}', which no other channel has", False)
    return Guess(name, None, "no channel has such a name, or such a unit alone", False)


def _needs_time(source: Source, listed: Sequence[Listed]) -> bool:
    """Whether the channels of a file have no times of their own."""
    first = next((channel for entry in listed if (channel := _read(source, entry.name)) is not None), None)
    return first is not None and first.time is None


def _guess(name: str, channels: Sequence[Listed], unit: str) -> Guess:
    by_name = [channel for channel in channels
               if re.search(_WORDS[name], channel.name, re.IGNORECASE if name != "current" else 0)]
    return _choose(name, by_name, [channel for channel in by_name if _fits(channel.unit, unit)])


def _choose(name: str, by_name: Sequence[Listed], fitting: Sequence[Listed]) -> Guess:
    """The best of the `fitting` ones of the channels `by_name`."""
    if not fitting:
        other = f"; '{by_name[0].name}' has the unit '{by_name[0].unit}'" if by_name else ""
        return Guess(name, None, f"no channel has such a name and unit{other}", False)
    best = max(fitting, key=lambda channel: (bool(channel.unit), channel.samples))
    unit = f" and the unit '{best.unit}'" if best.unit else ", and the file states no unit"
    rest = [channel.name for channel in fitting if channel is not best]
    also = f"; {', '.join(rest[:4])} would fit as well" if rest else ""
    return Guess(name, best, f"the name '{best.name}'{unit}{also}", not rest and bool(best.unit))


def _fits(written: str, unit: str) -> bool:
    if not written:
        return True
    if unit == "K":
        return spelled(written) in ("K", "°C", "degC", "C", "degF", "°F")
    try:
        convert(np.array(1.0), spelled(written), unit)
    except NotAQuantity as error:
        return unit == "rad/s" and "which angle" in str(error)  # 1/min: the mapping must say that it is rpm
    return True


def _shift_command(source: Source, bench: Bench, channels: Sequence[Listed], current: Guess) -> tuple[Guess, float]:
    """A digital channel with such a name, or else the current, and the level through which it rises once."""
    for channel in channels:
        if re.search(_WORDS["shift_command"], channel.name, re.IGNORECASE) and (read := _read(source, channel.name)):
            values = np.unique(read.values[np.isfinite(read.values)])
            level = float(values.mean()) if len(values) == 2 else np.nan
            if _rises(source, channel.name, level) == 1:
                return Guess("shift_command", channel, f"the name '{channel.name}' and its two values, of which the "
                             "larger begins once", True), level
    listed, amperes = current.channel, _level_of_rise(bench)
    if listed is None or amperes is None:
        why = current.reason if listed is None else "the current profiles of the bench have no level that marks t = 0"
        return Guess("shift_command", None, why, False), np.nan
    unit = spelled(listed.unit) or "A"
    level = float(convert(np.array(amperes), "A", unit))
    where = "midway between the currents of the bench before the shift command and the lowest after it"
    count = _rises(source, listed.name, level)
    if count != 1:
        return Guess("shift_command", None, f"'{listed.name}' rises {count} times through {level:.3g} {unit}, {where}",
                     False), level
    return Guess("shift_command", listed, f"{current.reason}; the level is {where}", False), level


def _level_of_rise(bench: Bench) -> float | None:
    """A current in A through which every profile rises at its begin, and then never falls; None without such a one."""
    before, after = [], []
    for current in bench.profiles[1]:
        above = np.flatnonzero(current > current[0])
        if not len(above):
            return None
        before.append(current[0])
        after.append(current[above[0]:].min())
    return float(max(before) + min(after)) / 2 if max(before) < min(after) else None


def _rises(source: Source, name: str, level: float) -> int:
    read = _read(source, name)
    if read is None:
        return 0
    time = np.arange(len(read.values), dtype=float)
    return len(instants(Marker(ChannelRef(name), level), time, read.values))


def _read(source: Source, name: str) -> Channel | None:
    """A channel, None for one that cannot be read: a proposal goes on without it."""
    try:
        return source.channel(name)
    except BadRecording:
        return None


def _write_proposal(source: Source, bench: Bench, guesses: dict[str, Guess], shift: Guess, level: float) -> Proposal:
    lines = _head(source)
    missing: list[str] = []
    own_units = _states_units(source)
    if "time" in guesses:
        lines += ["[time]", *_lines(guesses["time"], "s", missing, own_units), ""]
    for name in ("pressure", "input_speed", "output_speed", "output_torque"):
        lines += [f"[signals.{name}]", *_lines(guesses[name], _UNITS[name], missing, own_units),
                  *(() if guesses[name].channel else ("# Remove this section if the bench does not measure it",)), ""]
    lines.append("[shift_command]")
    if shift.channel is not None:
        lines += [f"# GUESS: {shift.reason}", f'channel = "{_quote(shift.channel.name)}"', f"above = {level:.3g}", ""]
    else:
        missing.append("shift_command")
        lines += [f"# OPEN: {shift.reason}. Name the channel that marks t = 0, or the time in the file",
                  '# channel = "..."', "# above = 0.5", ""]
    lines.append("[conditions]")
    lines += _conditions(guesses, bench, missing)
    oil = guesses["oil_temperature"]
    if oil.channel is not None:
        lines += ["", "[further.oil_temperature]", *_lines(oil, "degC", missing, own_units)]
    return Proposal("\n".join(lines) + "\n", (*guesses.values(), shift), tuple(missing))


def _head(source: Source) -> list[str]:
    return [f"# Proposed from the names and units of {source.name}. Check every line below a GUESS, and fill in every",
            "# line marked OPEN. docs/your_files.md describes the keys.", ""]


def _lines(guess: Guess, unit: str, missing: list[str], own_units: bool) -> list[str]:
    if guess.channel is None:
        missing.append(guess.name)
        return [f"# OPEN: {guess.reason}", '# channel = "..."',
                *([] if own_units else [f'# unit = "{unit}" # only of a channel for which the file states none'])]
    lines = [f"# GUESS: {guess.reason}", f'channel = "{_quote(guess.channel.name)}"']
    if not guess.channel.unit:
        missing.append(f"unit of {guess.name}")
        return [*lines, f'# OPEN: unit = "{unit}"']
    if unit == "rad/s" and not _is_convertible(guess.channel.unit, unit):
        return [*lines, f"# GUESS: '{guess.channel.unit}' are revolutions", 'unit = "rpm"']
    return lines


def _is_convertible(written: str, unit: str) -> bool:
    try:
        convert(np.array(1.0), spelled(written), unit)
    except NotAQuantity:
        return False
    return True


def _conditions(guesses: dict[str, Guess], bench: Bench, missing: list[str]) -> list[str]:
    lines = []
    motor, current = guesses["motor_speed"], guesses["current"]
    if len(bench.profiles[0]) > 1:
        if current.channel is not None:
            lines += [f"# GUESS: the profile of the bench that is nearest to the current, {current.reason}",
                      f'current_profile = {{ channel = "{_quote(current.channel.name)}" }}']
        else:
            missing.append("current_profile")
            lines.append("# OPEN: current_profile = { value = 0 }")
    if motor.channel is not None:
        rpm = "" if not motor.channel.unit or _is_convertible(motor.channel.unit, "rad/s") else ', unit = "rpm"'
        lines += [f"# GUESS: {motor.reason}; its mean over the engagement",
                  f'motor_speed = {{ channel = "{_quote(motor.channel.name)}"{rpm} }}']
    else:
        missing.append("motor_speed")
        lines += [f"# OPEN: {motor.reason}", '# motor_speed = { value = "1500 rpm" }']
    missing += ["load_inertia", "brake_torque"]
    return [*lines, '# OPEN: load_inertia = { value = "1 kg m^2" }', '# OPEN: brake_torque = { value = "10 N m" }']


def _quote(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
