"""Read the file of a machine: a TOML file, such as docs/motor.toml, or the Python file that declares a machine."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slipstick.bench.document import Document, Section
from slipstick.black_box.bridge import Bridge
from slipstick.black_box.cases import Cases
from slipstick.black_box.declared import Declared, name_of, open_declared, open_once
from slipstick.black_box.description import BlackBoxDescription, Input, Quantity
from slipstick.black_box.fmu import KEYS, Fmu, read_fmu
from slipstick.black_box.function import Function
from slipstick.errors import BadBench, InvalidValue, UnknownName
from slipstick.machine import has_experiments
from slipstick.numerics.quantities import NotAQuantity, in_unit
from slipstick.storage.shipped import FOLDER, file_of

Simulator = Function | Bridge | Fmu | Declared
_GRID, _TIMEOUT = 11, 60.0  # points per axis; s per call


@dataclass(frozen=True)
class BlackBox:
    """A machine as a function of inputs and conditions: what a TOML file, or the file that declares it, says about it.

    Its description, the conditions to simulate, the simulator, and the default number of grid points of each input.
    """

    description: BlackBoxDescription
    cases: Cases
    simulator: Simulator
    points: tuple[int, ...]

    @classmethod
    def open(cls, path: Path | str, output: str | None = None) -> "BlackBox":
        """Read the file at `path`, or that of a shipped declared machine of this name.

        `output` chooses among those of a declared machine, by default the first. Raises `BadBench` with key and line,
        `BadMachine`, and `UnknownName` where there is no file, or no such output.
        """
        path = file_of(path, ".py", "machines")
        if path.suffix == ".py":
            description, cases, simulator = open_declared(path, output)
            return cls(description, cases, simulator, (_GRID,) * len(description.inputs))
        file = cls._open_toml(path)
        if output not in (None, file.description.output.name):
            raise UnknownName.of("output", str(output), [file.description.output.name])
        return file

    @classmethod
    def open_all(cls, path: Path | str) -> list["BlackBox"]:
        """As `open`, for each output that the file declares: none of a declared machine without outputs or experiments,
        which is not simulated, but may have recorded runs."""
        path = file_of(path, ".py", "machines")
        if path.suffix != ".py":
            return [cls.open(path)]
        machine = open_once(path)
        return [cls.open(path, name_of(output.name)) for output in machine.outputs] if has_experiments(machine) else []

    @classmethod
    def _open_toml(cls, path: Path) -> "BlackBox":
        if not path.is_file():
            known = [other.name for other in path.parent.glob("*.toml")]
            raise UnknownName.of("machine", path.name, known + [other.stem for other in FOLDER.glob("machines/*.py")])
        try:
            document = Document.read(path.read_text("utf-8-sig"), path.name, path.parent)
            return _read(document.root, path.parent)
        except UnicodeDecodeError as error:
            raise BadBench(f"Byte {error.start} of {path.name} is not UTF-8", "Save the file as UTF-8") from None
        except InvalidValue as error:
            raise BadBench(f"{path.name}: {error.cause}", error.remedy) from None
        except BadBench as error:  # the reader of TOML documents is that of benches
            raise BadBench(error.cause, error.remedy.replace("`slipstick bench new FILE` writes a template",
                                                             "docs/any_machine.md describes every key")) from None


def is_black_box(path: Path) -> bool:
    """Whether a TOML file describes a machine, valid or not; a bench has no simulator."""
    try:
        return "simulator" in tomllib.loads(path.read_text("utf-8-sig"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False


def _read(root: Section, folder: Path) -> BlackBox:
    root.keys(("title", "simulator", "output", "inputs", "conditions"))
    inputs, points = [], []
    for name in root.section("inputs").values:
        entry, count = _input(root.section("inputs").section(name), name)
        inputs.append(entry)
        points.append(count)
    cases = _cases(root.section("conditions"))
    output = root.section("output")
    section = root.section("simulator")
    timeout = _read_timeout(section)
    simulator: Simulator
    if "fmu" in section.values:
        section.keys(KEYS)
        simulator = read_fmu(section, output, inputs, cases.quantities, folder, timeout)
    else:
        output.keys(("name", "unit"))
        simulator = _simulator(section, folder, [entry.name for entry in inputs],
                               [quantity.name for quantity in cases.quantities], timeout)
    description = BlackBoxDescription(root.text("title"), tuple(inputs), cases.quantities,
                      Quantity(output.text("name"), output.text("unit")), simulator.identity)
    return BlackBox(description, cases, simulator, tuple(points))


def _input(section: Section, name: str) -> tuple[Input, int]:
    section.keys(("nominal", "range", "points"))
    nominal = section.values.get("nominal")
    unit = nominal.strip().partition(" ")[2].strip() if isinstance(nominal, str) else "1"
    if not unit:  # here the unit is what the file says, so that its absence would make another one of it
        raise section.error("nominal", f"'{str(nominal)[:60]}' has no unit", "Write a number, a space and its unit, "
                            'such as "1.5 ohm", or a plain number without quotation marks')
    limits = section.numbers("range", "1")
    points = section.values.get("points", _GRID)
    if len(limits) != 2:
        raise section.error("range", f"there are {len(limits)} numbers", "Give the lowest and the highest multiple")
    if isinstance(points, bool) or not isinstance(points, int) or points < 2:
        raise section.error("points", f"{points!r} is not a number of grid points", "Give a whole number from 2")
    return Input(name, unit, section.quantity("nominal", unit), *map(float, limits)), points


def _cases(section: Section) -> Cases:
    quantities, columns = [], []
    for name, entry in section.values.items():
        unit = entry.get("unit", "1") if isinstance(entry, dict) else "1"
        columns.append(section.numbers(name, unit))
        quantities.append(Quantity(name, str(unit)))
        if len(columns[-1]) != len(columns[0]):
            raise section.error(name, f"there are {len(columns[-1])} numbers, but {len(columns[0])} of "
                                f"'{quantities[0].name}'", "Give every column one number per condition")
    if not columns:
        raise section.document.error("conditions", "there are no conditions", "Add [conditions] with a column, such as "
                                     'voltage = { values = [12, 24], unit = "V" }')
    return Cases(tuple(quantities), np.array(columns).T)


def _read_timeout(section: Section) -> float:
    """The time of a call in s."""
    try:
        timeout = in_unit(section.values.get("timeout", f"{_TIMEOUT:g} s"), "s")
    except NotAQuantity as error:
        raise section.error("timeout", str(error),
                            error.remedy or 'Write the time of one call, such as "60 s"') from None
    if timeout <= 0:
        raise section.error("timeout", "the time is not positive", 'Write the time of one call, such as "60 s"')
    return timeout


def _simulator(section: Section, folder: Path, inputs: list[str], columns: list[str], timeout: float) -> Simulator:
    section.keys(("callable", "url", "model", "arguments", "config", "fmu", "timeout"))
    if ("callable" in section.values) == ("url" in section.values):
        raise section.error("callable", "a simulator is either a callable or an UM-Bridge model, or else an FMU",
                            'Give callable = "module:function", fmu = "FILE.fmu", or url and model')
    if "callable" in section.values:
        section.keys(("callable", "timeout"))
        return Function(section.text("callable"), str(folder.resolve()), timeout)
    arguments = section.values.get("arguments", [[*inputs, *columns]])
    known = {*inputs, *columns}
    if not (isinstance(arguments, list) and all(isinstance(vector, list) for vector in arguments)):
        raise section.error("arguments", "a list of lists of names is needed",
                            f"Name the entries of each input vector, such as {[[*inputs, *columns]]}")
    flat = [name for vector in arguments for name in vector]
    for name in flat:
        if name not in known:
            raise section.error("arguments", f"'{name}' is neither an input nor a condition",
                                f"Known: {', '.join(sorted(known))}")
    unused = [name for name in inputs if name not in flat]
    if unused:
        raise section.error("arguments", f"the input '{unused[0]}' is missing", "Name every input once")
    return Bridge(section.text("url").rstrip("/"), section.text("model"), tuple(map(tuple, arguments)),
                  dict(section.section("config").values), timeout)
