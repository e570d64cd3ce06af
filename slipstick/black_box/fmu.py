"""A functional mock-up unit (FMI 2 or 3) as simulator, run by FMPy in a process of its own, which it may crash."""

import atexit
import faulthandler
import hashlib
import json
import os
import re
import shutil
import signal
import tempfile
import threading
import time
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.bench.document import Section
from slipstick.black_box.cases import Cases
from slipstick.black_box.description import Input, Quantity
from slipstick.black_box.function import NoResult
from slipstick.errors import InvalidValue, UnknownName
from slipstick.machine import Output, evaluate_output
from slipstick.machine.declaration import TAKEN
from slipstick.numerics.quantities import NotAQuantity, factor_of, in_unit
from slipstick.storage.children import ChildFailed, Kept

KEYS = "fmu", "parameters", "duration", "step", "timeout"
"""Keys of the simulator."""
OUTPUT_KEYS = "name", "unit", "of", "above", "below", "take"
_BASE_UNITS = "kg", "m", "s", "A", "K", "mol", "cd", "rad"
_REAL = "Real", "Float64", "Float32"
_NO_NUMBERS = "String", "Binary", "Clock"


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU; where the file has v in its unit, it is factor * v + offset."""

    name: str
    factor: float
    offset: float
    is_whole: bool


@dataclass(frozen=True)
class Fmu:
    """The FMU at `path`, which runs from `start` for `duration` s with a sample every `step` s.

    `variables` are those of inputs and conditions, by their names in the file. `output` is computed of the samples of
    the variable `measured`, whose levels are in the unit of that. A run of more than `timeout` s fails.
    """

    path: str
    variables: Mapping[str, Variable] = field(hash=False)
    output: Output
    measured: Variable
    start: float
    duration: float
    step: float
    timeout: float

    @property
    def identity(self) -> str:
        """The digest of the file, which may be moved, and the settings."""
        settings = {"variables": {name: asdict(each) for name, each in self.variables.items()},
                    "output": asdict(self.output), "measured": asdict(self.measured), "start": self.start,
                    "duration": self.duration, "step": self.step}
        return f"FMU with SHA-256 {_digest(*_version(self.path))}, settings {json.dumps(settings, sort_keys=True)}"

    def run(self, inputs: Mapping[str, float], cases: Cases) -> list[float | NoResult]:
        """The output under each of the n conditions, NaN where there is none."""
        names = [quantity.name for quantity in cases.quantities]
        with _UNPACKING:
            folder = _unpack(*_version(self.path))
        return [self._simulate(folder, {**inputs, **dict(zip(names, row.tolist(), strict=True))})
                for row in cases.values]

    def _simulate(self, folder: str, values: Mapping[str, float]) -> float | NoResult:
        starts = {}
        for name, variable in self.variables.items():
            starts[variable.name] = variable.factor * values[name] + variable.offset
            if variable.is_whole and not starts[variable.name].is_integer():
                return NoResult(f"'{variable.name}' takes whole numbers, and {name} is {values[name]:g}")
        asked = {"folder": folder, "values": starts, "output": asdict(self.output), "start": self.start,
                 "duration": self.duration, "step": self.step, "timeout": self.timeout}
        child, begin = _CHILDREN.of(folder), time.monotonic()
        try:
            answer = child.call(f"{__name__}:simulate_unpacked", json.dumps(asked).encode(), InvalidValue)
        except InvalidValue as error:
            return NoResult(error.cause)
        except ChildFailed:
            is_late = time.monotonic() - begin >= self.timeout
            return NoResult(f"no result within {self.timeout:g} s" if is_late else "the FMU crashed its process")
        value = float(np.frombuffer(answer)[0])
        if self.output.above is not None or self.output.below is not None:
            return self.measured.factor * value  # a time
        return (value - self.measured.offset) / self.measured.factor


def simulate_unpacked(content: bytes) -> bytes:
    """In the child process: the output of a run, as the bytes of a number; raises `InvalidValue`."""
    import fmpy

    asked = json.loads(content)
    output, end = Output(**asked["output"]), asked["start"] + asked["duration"]
    signal.alarm(0)  # a run may take longer than others that the process is for
    faulthandler.dump_traceback_later(asked["timeout"], exit=True)  # also out of native code that does not return
    try:
        os.chdir(asked["folder"])  # FMUs write files
        result = fmpy.simulate_fmu(
            asked["folder"], start_time=asked["start"], stop_time=end, output_interval=asked["step"],
            record_events=False, start_values=asked["values"], output=[output.of], remote_platform=None,
            model_description=_describe(asked["folder"]))
        value = evaluate_output(output, result["time"] - asked["start"], {output.of: result[output.of][None].astype(
            float)})
        is_event = output.above is not None or output.below is not None
        if result["time"][-1] < end - asked["step"] / 2 and (np.isnan(value[0]) or not is_event):
            raise InvalidValue(f"the FMU ended at {result['time'][-1]:g} s", "")
        return value.tobytes()
    except InvalidValue:
        raise
    except Exception as error:
        raise InvalidValue(f"{type(error).__name__}: {error}", "") from error
    finally:
        faulthandler.cancel_dump_traceback_later()


@cache
def _describe(folder: str) -> Any:
    import fmpy

    return fmpy.read_model_description(folder, validate=False)


class _Children(threading.local):
    """The child process of a thread, which is for one FMU: what its libraries keep must not reach another."""

    def __init__(self) -> None:
        self.folder, self.child = "", Kept()

    def of(self, folder: str) -> Kept:
        """The process for an unpacked FMU; one that has just started does not count as time of a run."""
        if folder != self.folder:
            self.folder, self.child = folder, Kept()
            self.child.call("builtins:len", b"", InvalidValue)
        return self.child


_CHILDREN, _UNPACKING = _Children(), threading.Lock()


def _version(path: str) -> tuple[str, int, int]:
    try:
        status = Path(path).stat()
    except OSError as error:
        raise InvalidValue(f"There is no FMU at '{path}'", "Correct `fmu`; it is relative to the file of the machine") \
            from error
    return path, status.st_mtime_ns, status.st_size


@lru_cache(maxsize=16)
def _digest(path: str, changed: int, size: int) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


@cache
def _unpack(path: str, changed: int, size: int) -> str:
    import fmpy

    folder = tempfile.mkdtemp(prefix="slipstick-fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    fmpy.extract(path, folder)
    return folder


def read_fmu(section: Section, output: Section, inputs: Sequence[Input], columns: Sequence[Quantity], folder: Path,
             timeout: float) -> Fmu:
    """The FMU that the sections of simulator and output describe; raises `BadBench` and `InvalidValue`.

    A missing FMPy is an `InvalidValue` with how to install it.
    """
    path = str((folder / section.text("fmu")).resolve())
    description = _open(path, section)
    known = {each.name: each for each in description.modelVariables}
    mapping, entries = section.section("parameters"), list[Input | Quantity]([*inputs, *columns])
    for name in mapping.values:
        if name not in [entry.name for entry in entries]:
            raise mapping.error(name, "this is no input or condition", "Name inputs and conditions of this file")
    variables = {}
    for entry in entries:
        place, key = (mapping, entry.name) if entry.name in mapping.values else (section, "parameters")
        variable = _find(known, mapping.text(entry.name, entry.name), place, key)
        if variable.causality not in ("parameter", "input") or variable.variability == "constant":
            raise place.error(key, f"'{variable.name}' of the FMU is no parameter or input, but of the causality "
                              f"'{variable.causality}'", f"Known: {_listed(known.values())}")
        if isinstance(entry, Input) and variable.type not in _REAL:
            raise place.error(key, f"'{variable.name}' of the FMU is of type {variable.type}, and multiples of an "
                              "input are real numbers", "Make it a condition")
        variables[entry.name] = _bind(description, variable, entry.unit, place, key)
    experiment = description.defaultExperiment
    stop, sample, start = (float(value) if (value := getattr(experiment, name, None)) else None
                           for name in ("stopTime", "stepSize", "startTime"))
    duration = section.quantity("duration", "s", stop - (start or 0.0) if stop else None)
    step = section.quantity("step", "s", sample)
    if not (step > 0 and duration > 1.5 * step and abs(duration / step - round(duration / step)) < 1e-6):
        raise section.error("step", f"a duration of {duration:g} s is no multiple of {step:g} s",
                            "Give steps of which the duration has two or more")
    measured, declared = _read_output(output, description, known)
    return Fmu(path, variables, declared, measured, start or 0.0, duration, step, timeout)


def _read_output(section: Section, description: Any, known: Mapping[str, Any]) -> tuple[Variable, Output]:
    """The variable of which the output is, and the output with levels in its unit."""
    section.keys(OUTPUT_KEYS)
    name, unit = section.text("name"), section.text("unit")
    variable = _find(known, section.text("of", name), section, "of" if "of" in section.values else "name")
    take = section.text("take", TAKEN[0])
    if take not in TAKEN:
        raise section.error("take", f"'{take}' cannot be taken of a variable", f"Give one of: {', '.join(TAKEN)}")
    given = [key for key in ("above", "below") if key in section.values]
    if len(given) == 2 or (given and "take" in section.values):
        raise section.error(given[0], "an output is either a time or a value", "Give `above`, `below` or `take`")
    if not given:
        return _bind(description, variable, unit, section, "unit"), Output(name, unit, variable.name, take=take)
    level, own = section.values[given[0]], _unit_of(variable)
    try:
        number = in_unit(level, own) if isinstance(level, str) and own else in_unit(level, "1")
        factor = factor_of("s", unit)
    except NotAQuantity as error:
        raise section.error(given[0], str(error), error.remedy or f"Give a level in '{own}', and the output a unit of "
                            "time") from None
    above, below = (number if key in given else None for key in ("above", "below"))
    return Variable(variable.name, factor, 0.0, False), Output(name, unit, variable.name, above, below)


def _open(path: str, section: Section) -> Any:
    """The model description of an FMU that can be simulated here."""
    try:
        import fmpy
    except ImportError:
        raise InvalidValue("An FMU needs the package FMPy, which is not installed",
                           "Install it: pip install 'slipstick[fmu]'") from None
    if not Path(path).is_file():
        raise section.error("fmu", f"there is no file '{path}'", "Name an FMU relative to this file")
    if not zipfile.is_zipfile(path):
        raise section.error("fmu", f"'{Path(path).name}' is not an FMU: it is no ZIP archive", "Export the FMU again")
    try:
        description = fmpy.read_model_description(path, validate=False)
        platforms = fmpy.supported_platforms(path)
    except Exception as error:
        raise section.error("fmu", f"'{Path(path).name}' cannot be read: {error}", "Export it for FMI 2 or 3") from None
    if not str(description.fmiVersion).startswith(("2.", "3.")):
        raise section.error("fmu", f"'{Path(path).name}' is of FMI {description.fmiVersion}",
                            "Export it for FMI 2 or 3")
    if description.coSimulation is None and description.modelExchange is None:
        raise section.error("fmu", f"'{Path(path).name}' is for neither co-simulation nor model exchange",
                            "Export it for one of them")
    if fmpy.platform not in platforms:
        raise section.error("fmu", f"'{Path(path).name}' has no binary for {fmpy.platform}, but for: "
                            f"{', '.join(platforms) or 'none'}", "Export it for this platform")
    return description


def _find(known: Mapping[str, Any], name: str, section: Section, key: str) -> Any:
    """The variable `name` with one number; raises `BadBench`."""
    if name not in known:
        error = UnknownName.of("variable", name, known)
        raise section.error(key, f"{error.cause} in the FMU", error.remedy)
    if known[name].type in _NO_NUMBERS or known[name].dimensions:
        raise section.error(key, f"'{name}' of the FMU is not a number", "Name a scalar variable")
    return known[name]


def _bind(description: Any, variable: Any, unit: str, section: Section, key: str) -> Variable:
    """The variable with the conversion from the `unit` of the file to its own one, if it declares one."""
    own, factor, offset = _unit_of(variable), 1.0, 0.0
    if own not in ("", unit):
        base = next((each.baseUnit for each in description.unitDefinitions if each.name == own), None)
        powers = {name: int(getattr(base, name)) for name in _BASE_UNITS} if base is not None else {}
        target = " ".join(f"{name}^{power}" for name, power in powers.items() if power) or "1"
        if base is None:  # N.m2 is spelled N m^2 elsewhere
            target = re.sub(r"(?<=[A-Za-z])(-?\d)", r"^\1", own).replace(".", " ")
        try:
            factor = factor_of(unit, target)
        except NotAQuantity as error:
            raise section.error(key, f"'{variable.name}' of the FMU is in '{own}', and here in '{unit}': {error}",
                                f"Give it in {own}") from None
        if base is not None:
            factor, offset = factor / float(base.factor), -float(base.offset) / float(base.factor)
    return Variable(variable.name, factor, offset, variable.type not in _REAL)


def _unit_of(variable: Any) -> str:
    return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None) or ""


def _listed(variables: Iterable[Any]) -> str:
    names = [each.name for each in variables if each.causality in ("parameter", "input")]
    return ", ".join(names[:20]) + " and others" * (len(names) > 20) or "none"
