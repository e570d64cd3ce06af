"""Recorded runs of a machine as an HDF5 file, which is read without trust: docs/your_files.md has its layout."""

import io
from pathlib import Path

import h5py
import numpy as np

from slipstick.errors import BadRecording
from slipstick.machine.declaration import Machine, identifier_of
from slipstick.machine.runs import Profile, Runs
from slipstick.storage.hdf5 import Source, reading, text, texts
from slipstick.storage.isolated import require_readable

MARK = "runs_of"
"""Attribute of the file: the name of the machine."""
_LARGEST = 1 << 30  # bytes of a dataset
_GROUPS = "signals", "conditions", "channels"


def write_runs(runs: Runs, machine: Machine | None = None) -> bytes:
    """Return runs as the bytes of an HDF5 file, with the units that a `machine` declares, or that they have."""
    units = {**runs.units, **(units_of(machine) if machine is not None else {})}
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=("earliest", "v110")) as file:
        file.attrs[MARK] = text(runs.machine if machine is None else machine.name)
        file.attrs["description"] = text(runs.description)

        def put(path: str, values: np.ndarray, unit: str) -> None:
            packed = {"compression": "gzip", "shuffle": True, "fletcher32": True} if np.ndim(values) > 1 else {}
            file.create_dataset(path, data=np.asarray(values, "<f8"), **packed).attrs["units"] = text(unit or "1")

        put("time", runs.time, "s")
        for group in _GROUPS:
            for name, values in getattr(runs, group).items():
                put(f"{group}/{name}", values, units.get(name, ""))
        for name, profile in runs.commands.items():
            put(f"commands/{name}/time", profile.time, "s")
            put(f"commands/{name}/value", profile.value, units.get(name, ""))
        if runs.order is not None:
            put("order", runs.order, "1")
        if runs.names:
            file["names"] = texts(runs.names)
    return memory.getvalue()


def read_runs(content: Path | bytes) -> Runs:
    """Read an HDF5 file that `write_runs` wrote; raises `BadRecording`."""
    with reading(content, BadRecording, _LARGEST) as source:
        if not source.has_attribute("", MARK):
            raise BadRecording("The file has no runs of a declared machine",
                               "Make them by `slipstick import --machine FILE.py`; recordings of a clutch need a bench")
        time = source.array("time", "f", (None,), "s")
        if len(time) < 3 or not (np.diff(time) > 0).all():
            raise BadRecording("The instants of the samples do not rise, or there are fewer than three",
                               "Store `time` in s, rising")
        units, groups = dict[str, str](), {group: dict[str, np.ndarray]() for group in _GROUPS}
        count = None
        for group in _GROUPS:
            for name in _names(source, group):
                path = f"{group}/{name}"
                units[name] = source.attribute(path, "units")
                is_signal = group == "signals" or (group == "channels" and len(source.shape(path)) > 1)
                shape = (count, len(time)) if is_signal else (count,)
                groups[group][name] = source.array(path, "f", shape, units[name])
                count = len(groups[group][name])
        if not groups["signals"]:
            raise BadRecording("The runs have no signals", "Store at least one under `signals`")
        commands = dict[str, Profile]()
        for name in _names(source, "commands"):
            path = f"commands/{name}"
            units[name] = source.attribute(f"{path}/value", "units")
            value = source.array(f"{path}/value", "f", (count, None), units[name])
            commands[name] = Profile(source.array(f"{path}/time", "f", (count, value.shape[1]), "s"), value)
        order = source.array("order", "fiu", (count,), "1").astype(float) if source.has("order") else None
        runs = Runs(time, groups["signals"], commands, groups["conditions"], groups["channels"], order, units,
                    source.attribute("", MARK), source.attribute("", "description"),
                    source.texts("names", count or 0) if source.has("names") else ())
    for name, values in runs.arrays().items():
        if not np.isfinite(values).all():
            raise BadRecording(f"'{name}' has values that are not finite", "Leave out the runs in which they are")
    return runs


def read_untrusted_runs(content: bytes) -> Runs | None:
    """Read the bytes of an untrusted file, first in a limited child process; None for a file of something else.

    Raises `BadRecording`.
    """
    if MARK.encode() not in content:  # which spares other files the child process
        return None
    is_checked = require_readable(content, f"{__name__}:{check_runs.__name__}", BadRecording)
    return read_runs(content) if is_checked else None


def check_runs(content: bytes) -> bytes:
    """Read runs in a child process; empty for a file of something else, or of nothing that HDF5 can open."""
    if not holds_runs(content):
        return b""
    read_runs(content)
    return MARK.encode()


def holds_runs(content: Path | bytes) -> bool:
    """Return whether a file has runs of a machine, valid or not."""
    try:
        with h5py.File(io.BytesIO(content) if isinstance(content, bytes) else content) as file:
            return MARK in file.attrs
    except OSError:
        return False


def units_of(machine: Machine) -> dict[str, str]:
    """Return the units of what runs of a machine have, by name."""
    return {**{each.name: each.unit for each in machine.commands},
            **{each.name: each.unit for each in machine.conditions},
            **{each.signal: each.unit for each in machine.sensors}}


def require_runs(machine: Machine, runs: Runs) -> Runs:
    """Return runs, of which all that equations of the machine read are there; raises `BadRecording`."""
    for kind, names, given in (("signal", [each.signal for each in machine.sensors], runs.signals),
                               ("command", [each.name for each in machine.commands], runs.commands),
                               ("condition", [each.name for each in machine.conditions], runs.conditions),
                               ("channel", machine.inputs, runs.channels)):
        missing = [name for name in names if name not in given]
        if missing:
            raise BadRecording(f"The runs lack the {kind} '{missing[0]}' of the machine '{machine.name}'",
                               f"They have: {', '.join(given) or 'none'}. Map the {kind}, or declare the machine "
                               "without it")
    for name, unit in units_of(machine).items():
        stored = runs.units.get(name, unit)
        if (stored or "1") != (unit or "1"):
            raise BadRecording(f"'{name}' is in '{stored}' in the runs, and in '{unit}' in the machine "
                               f"'{machine.name}'", "Import the runs again with this machine, or declare this unit")
    return runs


def _names(source: Source, group: str) -> list[str]:
    names = sorted(source.group(group)) if source.has(group) else []
    for name in names:
        if not identifier_of(name).isidentifier():
            raise BadRecording(f"'{name[:60]}' cannot be the name of a signal", "Begin with a letter")
    return names
