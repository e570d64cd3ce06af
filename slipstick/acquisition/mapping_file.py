"""Read `channels.toml`; errors name the key and its line."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypedDict, TypeVar

import numpy as np

from slipstick.acquisition.csv_layout import CsvOptions
from slipstick.acquisition.mapping import (
    ChannelMap,
    ChannelRef,
    Constant,
    FileMap,
    FromColumn,
    FromName,
    Marker,
    NumberSource,
    TimeRef,
)
from slipstick.acquisition.units import spelled
from slipstick.bench.conditions import CONDITION_UNITS, INPUT_UNITS
from slipstick.bench.document import Document, Section
from slipstick.errors import BadBench, BadRecording, UnknownName
from slipstick.numerics.quantities import NotAQuantity, convert, in_unit
from slipstick.recordings.signals import SIGNAL_UNITS

NUMBERS = {**CONDITION_UNITS, **INPUT_UNITS, "run_order": "1"}
"""The numbers that [conditions] may state for each engagement, and their units."""

Kind = TypeVar("Kind", bound=FileMap)
_CHANNEL = ("channel", "unit", "sign", "time", "limits")
_MARKER = ("channel", "time", "above", "below", "changes")
_SOURCES = ("value", "name", "column", "channel")
_LARGEST = 1 << 20  # bytes
_FURTHER = re.compile(r"[a-z][a-z0-9_]{0,63}")


def open_mapping(path: Path) -> ChannelMap:
    """Read the mapping at `path`; raises `BadRecording` with key and line, and `UnknownName` where there is no file."""
    return read_mapping(read_content(path), path.name)


def read_content(path: Path) -> bytes:
    """The bytes of a mapping; raises `UnknownName` where there is no file."""
    if not path.is_file():
        raise UnknownName.of("mapping", path.name, [other.name for other in path.parent.glob("*.toml")])
    return path.read_bytes()


def read_mapping(content: bytes, name: str) -> ChannelMap:
    """Read the bytes of a mapping, called `name` in errors; raises `BadRecording` with key and line."""
    return read_document(content, name, _read)


def read_document(content: bytes, name: str, reader: Callable[[Section, str], Kind]) -> Kind:
    """Read the bytes of any mapping by the `reader` of its kind; raises `BadRecording` with key and line."""
    if len(content) > _LARGEST:
        raise BadRecording(f"{name} is larger than {_LARGEST:,} bytes", "Keep conditions in a sheet of their own")
    try:
        return reader(Document.read(content.decode("utf-8-sig"), name).root, name)
    except UnicodeDecodeError as error:
        raise BadRecording(f"Byte {error.start} of {name} is not UTF-8", "Save the file as UTF-8") from None
    except BadBench as error:  # the reader of TOML documents is that of benches
        raise BadRecording(error.cause, error.remedy.replace(
            "Add it; `slipstick bench new FILE` writes a template",
            "Add it; docs/your_files.md describes every key")) from None


def _read(root: Section, name: str) -> ChannelMap:
    root.keys(("description", "signals", "further", "time", "trigger", "shift_command", "shifting_time", "conditions",
               "clock", "csv"))
    given, further = root.section("signals"), root.section("further")
    given.keys(tuple(SIGNAL_UNITS))
    for key in further.values:
        if not _FURTHER.fullmatch(key):
            raise further.error(key, "this is not a valid name", "Use small letters, digits and _, such as "
                                "oil_temperature")
    conditions, clock = root.section("conditions"), root.section("clock")
    conditions.keys((*NUMBERS, "pattern", "plan"))
    clock.keys(("step", "end"))
    if not given.values:
        raise root.error("signals", "no signal is mapped", "Add [signals] with a channel for each signal that there "
                         f"is: {', '.join(SIGNAL_UNITS)}; `import --guess` proposes a mapping")
    command = root.section("shift_command")
    is_time = set(command.values) == {"time"}
    mapping = ChannelMap(
        name=name, signals={key: read_channel(given.section(key), SIGNAL_UNITS[key]) for key in given.values},
        conditions={key: read_number(conditions, key, NUMBERS[key]) for key in conditions.values if key in NUMBERS},
        shift_command=command.quantity("time", "s") if is_time else read_marker(command, "time = \"0 s\", "),
        trigger=read_marker(root.section("trigger")) if "trigger" in root.values else None,
        shifting_time=_shifting_time(root) if "shifting_time" in root.values else None,
        further={key: read_channel(further.section(key), "") for key in further.values},
        end=read_positive(clock, "end"), **read_files(root))
    require_groups(conditions, {**mapping.conditions, "shifting_time": mapping.shifting_time}, mapping)
    return mapping


class FileKeys(TypedDict):
    """How the files of any mapping are read."""

    time: TimeRef
    pattern: re.Pattern[str] | None
    plan: str | None
    step: float | None
    csv: CsvOptions
    description: str


def read_files(root: Section) -> FileKeys:
    """Read how the files of a mapping are read."""
    conditions = root.section("conditions")
    return {"time": _time(root.section("time")),
            "pattern": _pattern(conditions) if "pattern" in conditions.values else None,
            "plan": conditions.text("plan") if "plan" in conditions.values else None,
            "step": read_positive(root.section("clock"), "step"), "csv": _csv(root.section("csv")),
            "description": root.text("description", "")}


def read_channel(section: Section, unit: str, also: tuple[str, ...] = ()) -> ChannelRef:
    """Read a channel that is wanted in `unit`, "" for any; its section may have `also` other keys."""
    section.keys((*(_CHANNEL if unit else _CHANNEL[:-1]), *also))
    sign = section.quantity("sign", "1", 1.0)
    if sign not in (1, -1):
        raise section.error("sign", f"{sign:g} is neither 1 nor -1", "Use `unit` for factors")
    written, limits = section.text("unit", ""), section.values.get("limits")
    if written and unit:
        _require_unit(section, written, unit)
    if limits is not None:
        if not isinstance(limits, list) or len(limits) != 2:
            raise section.error("limits", f"{limits!r} is not a pair", f'Write limits = ["0 {unit}", "10 {unit}"]')
        limits = tuple(_in_unit(section, "limits", value, unit) for value in limits)
        if not limits[0] < limits[1]:
            raise section.error("limits", "the first is not below the second", "Give the least and the largest value")
    return ChannelRef(section.text("channel"), written, sign, _own_time(section), limits)


def read_marker(section: Section, other: str = "", also: tuple[str, ...] = ()) -> Marker:
    """Read what marks an instant; its section may have `also` other keys."""
    section.keys((*_MARKER, *also))
    stated = [key for key in ("above", "below", "changes") if key in section.values]
    if "channel" not in section.values or len(stated) != 1:
        raise section.document.error(section.path, "this does not say what marks the instant",
                                     f"Write {other}channel and above = 0.5, below = 0.5 or changes = true")
    source = read_source(section)
    if stated == ["changes"]:
        if not section.flag("changes", True):
            raise section.error("changes", "false marks nothing", "Write changes = true, above or below")
        return Marker(source, None)
    level = section.quantity(stated[0], "1")
    return Marker(source, level, stated == ["above"])


def read_source(section: Section) -> ChannelRef:
    """Read a channel that is taken as the file has it."""
    return ChannelRef(section.text("channel"), time=_own_time(section))


def read_number(conditions: Section, key: str, unit: str) -> NumberSource:
    """Read where a number of each experiment, wanted in `unit`, comes from."""
    section = conditions.section(key)
    stated = [key for key in _SOURCES if key in section.values]
    if len(stated) != 1:
        raise conditions.error(key, f"{'more than one' if stated else 'no'} source is given",
                               "Give one of value, name (a group of the pattern), column (of the plan) and channel")
    if stated == ["channel"]:
        return read_channel(section, unit if key != "current_profile" else "A")
    section.keys((stated[0], "unit"))
    written = section.text("unit", "")
    if stated == ["value"]:
        return Constant(section.quantity("value", unit))
    if written:
        _require_unit(section, written, unit)
    if stated == ["name"]:
        if not written and unit != "1":
            raise section.error("name", "the number in a file name has no unit", f'Add unit = "{unit}"')
        return FromName(section.text("name"), written)
    return FromColumn(section.text("column"), written)


def _shifting_time(root: Section) -> Marker | NumberSource:
    section = root.section("shifting_time")
    if {"above", "below"} & set(section.values):
        return read_marker(section)
    source = read_number(root, "shifting_time", "s")
    if isinstance(source, ChannelRef):
        raise root.error("shifting_time", "a channel has no value at an instant",
                         "Add above or below to say what marks lock-up, or leave [shifting_time] out")
    return source


def _own_time(section: Section) -> TimeRef | None:
    """Sample times beside a channel: the name of the channel that has them, or a table as [time]."""
    if "time" not in section.values:
        return None
    return TimeRef(section.text("time")) if isinstance(section.values["time"], str) else _time(section.section("time"))


def _time(section: Section) -> TimeRef:
    section.keys(("channel", "unit", "step"))
    if "channel" in section.values and "step" in section.values:
        raise section.error("step", "both a channel and a step are given", "Give one of them")
    unit = section.text("unit", "")
    if unit:
        _require_unit(section, unit, "s")
    return TimeRef(section.text("channel", ""), unit, read_positive(section, "step"))


def _csv(section: Section) -> CsvOptions:
    section.keys(("separator", "decimal", "encoding", "header"))
    header = section.quantity("header", "1") if "header" in section.values else None
    if header is not None and (header < 1 or header != round(header)):
        raise section.error("header", f"{header:g} is not the number of a row", "Count rows from 1, such as header = 3")
    separator, decimal, encoding = (section.text(key) if key in section.values else None
                                    for key in ("separator", "decimal", "encoding"))
    options = CsvOptions(separator, decimal, encoding, None if header is None else int(header))
    if options.decimal not in (None, ".", ","):
        raise section.error("decimal", f"'{options.decimal}' is neither . nor ,", 'Write decimal = ","')
    if options.separator is not None and len(options.separator) != 1:
        raise section.error("separator", f"'{options.separator}' is not one character", 'Write separator = ";"')
    return options


def _pattern(section: Section) -> re.Pattern[str]:
    try:
        return re.compile(section.text("pattern"))
    except re.error as error:
        raise section.error("pattern", f"this is not a regular expression: {error}",
                            "Write it as in Python, in single quotation marks, with named groups "
                            "such as (?P<speed>[0-9]+)") from None


def require_groups(section: Section, numbers: Mapping[str, object], mapping: FileMap) -> None:
    """Refuse numbers of a pattern or sheet that the mapping does not have."""
    groups = set(mapping.pattern.groupindex) if mapping.pattern else set[str]()
    for key, source in numbers.items():
        if isinstance(source, FromName) and source.group not in groups:
            raise section.error(key, f"the pattern of file names has no group '{source.group}'",
                                f"Add conditions.pattern with (?P<{source.group}>...)")
        if isinstance(source, FromColumn) and mapping.plan is None:
            raise section.error(key, f"there is no sheet with the column '{source.column}'",
                                'Name it: conditions.plan = "plan.csv"')


def read_positive(section: Section, key: str) -> float | None:
    """Read a positive time in s; None where there is none."""
    if key not in section.values:
        return None
    value = section.quantity(key, "s")
    if not value > 0:
        raise section.error(key, f"{value:g} s is not positive", "Give a positive time")
    return value


def _in_unit(section: Section, key: str, value: Any, unit: str) -> float:
    try:
        return in_unit(value, unit)
    except NotAQuantity as error:
        raise section.error(key, str(error), f'Write numbers with units, such as "10 {unit}"') from None


def _require_unit(section: Section, written: str, unit: str) -> None:
    try:
        convert(np.array(1.0), spelled(written), unit)
    except NotAQuantity as error:
        raise section.error("unit", str(error), f'Give a unit such as "{unit}"') from None
