"""A bench file (TOML) as a `Bench`: every value checked, every error with its key and line."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.bench import Bench, Prior, Sensor
from slipstick.bench.converter import CAPACITY_UNIT, Converter
from slipstick.bench.document import Document, Section
from slipstick.bench.experiments import read_experiments
from slipstick.bench.physics import Physics
from slipstick.errors import BadBench, InvalidValue, UnknownName
from slipstick.storage.shipped import FOLDER

SENSOR_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m",
                "shifting_time": "s"}
"""Signals in the units of recordings, and the shifting time."""
_LARGEST = 4 << 20  # bytes of a bench file


def read_file(path: Path) -> Bench:
    """Read the bench file at `path`; CSV files that it names are looked up beside it."""
    if not path.is_file():
        beside = {other.name for other in path.parent.glob("*.toml") if _is_bench(other)}
        shipped = {other.stem for other in FOLDER.glob("*.toml") if other.name not in beside and _is_bench(other)}
        raise UnknownName.of("bench file", path.name, beside | shipped)
    return read(path.read_bytes(), path.name, path.parent)


def _is_bench(path: Path) -> bool:
    """Whether a TOML file has the sections of a bench, as that of another machine or a mapping has not."""
    try:
        return {"parameters", "sensors"} <= tomllib.loads(path.read_text()).keys()
    except (OSError, ValueError, RecursionError):
        return False


def read(content: bytes, name: str, folder: Path | None = None) -> Bench:
    """Read the bytes of a bench file; without a `folder` it may not refer to other files. Raises `BadBench`."""
    if len(content) > _LARGEST:
        raise BadBench(f"{name} is larger than {_LARGEST:,} bytes", "Keep long profiles and conditions in CSV files")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadBench(f"Byte {error.start} of {name} is not UTF-8", "Save the file as UTF-8") from None
    root = Document.read(text, name, folder).root
    root.keys(("name", "title", "source", "parameters", "converter", "sensors", "profiles", "conditions"))
    nominal, priors = _parameters(root.section("parameters"))
    converter = _converter(root.section("converter")) if "converter" in root.values else None
    sensors, sample_time = _sensors(root.section("sensors"))
    return Bench(_name(root), root.text("title"), root.text("source"), Physics(nominal, converter), priors, sensors,
                 sample_time, read_experiments(root, converter is None))


def _name(root: Section) -> str:
    name = root.text("name")
    if not (name.isascii() and name.replace("_", "").replace("-", "").isalnum() and len(name) <= 64):
        raise root.error("name", f"'{name[:80]}' is not a valid name", "Use up to 64 letters, digits, - and _")
    return name


def _parameters(section: Section) -> tuple[tuple[float, ...], tuple[Prior, ...]]:
    section.keys(parameters.NAMES)
    values, priors = [], []
    for parameter in parameters.PARAMETERS:
        written = section.values.get(parameter.name)
        if not isinstance(written, dict):
            values.append(section.quantity(parameter.name, parameter.unit))
            priors.append(Prior())
            continue
        entry = section.section(parameter.name)
        entry.keys(("value", "uncertain", "lower", "upper", "scatter"))
        values.append(entry.quantity("value", parameter.unit))
        default = Prior()
        lower, upper = entry.quantity("lower", "1", default.lower), entry.quantity("upper", "1", default.upper)
        if not lower < 1 < upper:
            raise entry.error("lower", f"the bounds {lower:g} to {upper:g} do not enclose the nominal value, 1",
                              "Give bounds as multiples of the value, such as lower = 0.5 and upper = 1.5")
        if parameter.positive and not lower > 0:
            raise entry.error("lower", f"{lower:g} times a value that must be positive is not", "Give a positive bound")
        if entry.flag("uncertain", False) and values[-1] == 0:
            raise entry.error("uncertain", "bounds are multiples of the value, and those of 0 are all 0",
                              "Give a nominal value other than 0, or leave out `uncertain`")
        scatter = entry.quantity("scatter", "1") if "scatter" in entry.values else None
        if scatter is not None and not 0 <= scatter < 1:
            raise entry.error("scatter", f"{scatter:g} is not between 0 and 1",
                              "Give the std from run to run as a share of the value, such as 0.01")
        priors.append(Prior(entry.flag("uncertain", False), lower, upper, scatter))
    for parameter, value in zip(parameters.PARAMETERS, values, strict=True):
        if parameter.positive and not value > 0:
            raise section.error(parameter.name, f"{value:g} {parameter.unit} is not positive", "Give a positive value")
    return tuple(values), tuple(priors)


def _converter(section: Section) -> Converter:
    section.keys(("speed_ratio", "torque_ratio", "capacity_factor"))
    curves = [section.numbers("speed_ratio", "1"), section.numbers("torque_ratio", "1"),
              section.numbers("capacity_factor", CAPACITY_UNIT)]
    try:
        return Converter(*(tuple(curve.tolist()) for curve in curves))
    except InvalidValue as error:
        raise section.error("speed_ratio", error.cause, error.remedy) from None


def _sensors(section: Section) -> tuple[dict[str, Sensor], float]:
    section.keys((*SENSOR_UNITS, "sample_time"))
    sensors = {}
    for name, unit in SENSOR_UNITS.items():
        entry = section.section(name)
        entry.keys(("noise", "resolution", "lag"))
        given: dict[str, Any] = {key: entry.quantity(key, "s" if key == "lag" else unit) for key in entry.values}
        for key, value in given.items():
            if not (np.isfinite(value) and value >= 0):
                raise entry.error(key, f"{value:g} is negative", "Give 0 or more, or leave it out where it is unknown")
        sensors[name] = Sensor(**given)
    sample_time = section.quantity("sample_time", "s")
    if not sample_time > 0:
        raise section.error("sample_time", f"{sample_time:g} s is not positive", "Give the time between two samples")
    return sensors, sample_time
