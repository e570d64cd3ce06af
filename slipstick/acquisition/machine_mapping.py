"""Read the mapping of a declared machine: its signals, commands and conditions, and how runs are cut."""

from pathlib import Path

from slipstick.acquisition.mapping import Constant, Cut, MachineMap, NumberSource, Parts, Reversals, Standstills
from slipstick.acquisition.mapping_file import (
    read_channel,
    read_content,
    read_document,
    read_files,
    read_marker,
    read_number,
    read_positive,
    read_source,
    require_groups,
)
from slipstick.bench.document import Section
from slipstick.machine import Machine
from slipstick.machine.declaration import identifier_of

CUTS = ("standstills", "reversals", "edges", "length")
_ALWAYS = ("cut", "length", "start")
_CONSTANT = ("value", "name", "column")


def open_machine_mapping(path: Path, machine: Machine) -> MachineMap:
    """Read the mapping at `path`; raises `BadRecording` with key and line, and `UnknownName` where there is no file."""
    return read_machine_mapping(read_content(path), path.name, machine)


def read_machine_mapping(content: bytes, name: str, machine: Machine) -> MachineMap:
    """Read the bytes of a mapping, called `name` in errors; raises `BadRecording` with key and line."""
    return read_document(content, name, lambda root, name: _read(root, name, machine))


def _read(root: Section, name: str, machine: Machine) -> MachineMap:
    root.keys(("description", "signals", "commands", "further", "time", "conditions", "runs", "clock", "csv"))
    units = {"signals": {each.signal: each.unit or "1" for each in machine.sensors},
             "commands": {each.name: each.unit or "1" for each in machine.commands},
             "conditions": {each.name: each.unit or "1" for each in machine.conditions}}
    signals, commands, conditions, further, clock, runs = (
        root.section(key) for key in ("signals", "commands", "conditions", "further", "clock", "runs"))
    signals.keys(tuple(units["signals"]))
    commands.keys(tuple(units["commands"]))
    conditions.keys((*units["conditions"], "run_order", "pattern", "plan"))
    clock.keys(("step", "gap"))
    for section in (signals, commands, conditions):
        for each in units[section.path]:
            if each not in section.values:
                source = "its channel" if section is not conditions else (
                    f'value = "1 {units["conditions"][each]}", name = a group of the pattern of file names, '
                    "column = a column of the plan, or a channel")
                raise root.error(section.path, f"'{each}' of the machine '{machine.name}' is missing",
                                 f'Add [{section.path}."{each}"] with {source}, or declare the machine without it')
    for each in machine.inputs:
        if each not in further.values:
            raise root.error("further", f"the machine '{machine.name}' reads '{each}', which is missing",
                             f'Add [further."{each}"] with its channel')
    taken = {identifier_of(each): each for each in (*units["signals"], *units["commands"], *units["conditions"],
                                                     *machine.signals)}
    for each in further.values:
        _require_name(further, each, each, taken)
    constants = [each for each in further.values if _is_constant(further.section(each))]
    cut, start = _cut(runs), runs.section("start")
    begin_as = runs.text("begin_as", "")
    if begin_as:
        _require_name(runs, "begin_as", begin_as, {**taken, **{identifier_of(each): each for each in further.values}})
    numbers = {**units["conditions"], "run_order": "1", **{each: further.section(each).text("unit", "1")
                                                           for each in constants}}
    mapping = MachineMap(
        name=name, signals={each: read_channel(signals.section(each), unit) for each, unit in units["signals"].items()},
        commands={each: read_channel(commands.section(each), unit, ("held",))
                  for each, unit in units["commands"].items()},
        conditions={**{each: read_number(conditions, each, numbers[each]) for each in conditions.values
                       if each in numbers}, **{each: _constant(further, each, numbers[each]) for each in constants}},
        further={each: read_channel(further.section(each), "") for each in further.values if each not in constants},
        units={**units["signals"], **units["commands"], **numbers}, cut=cut, length=read_positive(runs, "length"),
        begin_as=begin_as, gap=read_positive(clock, "gap"),
        held={each: commands.section(each).flag("held", False) for each in commands.values
              if "held" in commands.section(each).values},
        start=start.quantity("time", "s", 0.0) if set(start.values) <= {"time"} else
        read_marker(start, "time = \"0 s\", "), **read_files(root))
    for section in (conditions, further):
        require_groups(section, {each: source for each, source in mapping.conditions.items()
                                 if each in section.values}, mapping)
    return mapping


def _require_name(section: Section, key: str, name: str, taken: dict[str, str]) -> None:
    attribute = identifier_of(name)
    if not attribute.isidentifier():
        raise section.error(key, f"'{name}' is not a valid name", "Begin with a letter, such as oil_temperature")
    if attribute in taken:
        raise section.error(key, f"'{name}' is '{taken[attribute]}' already", "Give it a name of its own")


def _is_constant(section: Section) -> bool:
    return section.flag("mean", False) or bool(set(_CONSTANT) & set(section.values))


def _constant(further: Section, key: str, unit: str) -> NumberSource:
    """A further constant of each run; of a channel it is the mean."""
    section = further.section(key)
    if "mean" in section.values:
        section.text("unit")  # which the mean has
        return read_channel(section, unit, ("mean",))
    if "value" in section.values:
        section.keys(("value", "unit"))
        return Constant(section.quantity("value", unit))
    return read_number(further, key, unit)


def _cut(runs: Section) -> Cut | None:
    """How runs are cut from a recording; None where each file is a run."""
    kind = runs.text("cut", "")
    if kind == "":
        runs.keys(_ALWAYS)
        return None
    always = (*_ALWAYS, "begin_as")
    if kind == "edges":
        return read_marker(runs, also=always)
    if kind == "length":
        runs.keys(always)
        if (length := read_positive(runs, "length")) is None:
            raise runs.error("cut", "the length of the parts is missing", 'Add length = "10 s"')
        return Parts(length)
    if kind == "standstills":
        runs.keys((*always, "channel", "time", "below", "within", "for", "from"))
        levels = [key for key in ("below", "within") if key in runs.values]
        if len(levels) != 1:
            raise runs.error("cut", "this does not say what a standstill is", "Give below = 0.01 (of a speed), or "
                             "within = 0.01 (of a position), in the unit of the file")
        return Standstills(read_source(runs), _level(runs, levels[0]), read_positive(runs, "for") or 0.0,
                           levels == ["within"], _choice(runs, "from", ("middle", "end")) == "end")
    if kind == "reversals":
        runs.keys((*always, "channel", "time", "level", "of", "direction"))
        direction = runs.quantity("direction", "1", 0.0)
        if direction not in (-1, 0, 1):
            raise runs.error("direction", f"{direction:g} is neither 1 nor -1", "Give 1, -1, or leave it out for both")
        return Reversals(read_source(runs), _level(runs, "level"),
                         _choice(runs, "of", ("rate", "sign")) == "sign", int(direction))
    raise runs.error("cut", f"'{kind}' is not known", f"Write one of: {', '.join(CUTS)}")


def _level(section: Section, key: str) -> float:
    level = section.quantity(key, "1")
    if not level > 0:
        raise section.error(key, f"{level:g} is not positive", "Give a level above the noise of the channel")
    return level


def _choice(section: Section, key: str, known: tuple[str, ...]) -> str:
    """A text that is one of those `known`, the first one by default."""
    text = section.text(key, known[0])
    if text not in known:
        raise section.error(key, f"'{text}' is not known", f"Write one of: {', '.join(known)}")
    return text
