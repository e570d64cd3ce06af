"""Recordings as HDF5: `conditions`, `current_profiles`, `shifting_time`, `signals`, `further`; units are attributes."""

import io
from collections.abc import Mapping

import h5py
import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.errors import BadRecording, quoted
from slipstick.recordings.signals import LARGEST, SIGNAL_UNITS, FurtherChannel, Signals
from slipstick.storage.condition_layout import read_conditions, write_conditions
from slipstick.storage.hdf5 import SIGNATURE, reading, text

Fields = tuple[Conditions, np.ndarray, Signals | None, np.ndarray | None, str, Mapping[str, FurtherChannel]]
"""The fields of `Recordings`, in order."""


def read(content: bytes, name: str = "The file") -> Fields:
    """Read the bytes of an untrusted file, which errors call by its `name`; raises `BadRecording`."""
    if not content.startswith(SIGNATURE):
        raise BadRecording(f"{name} is not an HDF5 file", "Provide an HDF5 file; a CSV file must be named .csv")
    with reading(content, BadRecording, largest=8 * LARGEST // len(SIGNAL_UNITS)) as source:
        if "layout" in source.file.attrs:
            raise BadRecording(f"{name} is a table, not recordings: it has the attribute 'layout'",
                               "Give recordings, and the table where one is expected, such as to `slipstick verify` or "
                               "POST /v1/tables")
        conditions = read_conditions(source)
        n = len(conditions)
        measured_time = source.array("shifting_time", "f", (n,), "s").astype(np.float64)
        signals = None
        if source.has("signals"):
            unknown = set(source.group("signals")) - {"time", *SIGNAL_UNITS}
            if unknown:
                raise BadRecording(f"There is no signal {quoted(min(unknown))}",
                                   f"Signals are {', '.join(SIGNAL_UNITS)}; store other channels in further")
            time = source.array("signals/time", "f", (None,), "s").astype(np.float64)
            signals = Signals(time, **{
                name: source.array(f"signals/{name}", "f", (n, len(time)), unit).astype(np.float64)
                for name, unit in SIGNAL_UNITS.items() if source.has(f"signals/{name}")})
        further = {}
        for name in source.group("further") if source.has("further") else ():
            unit = source.attribute(f"further/{name}", "units")
            shape = (n, None if signals is None else len(signals.time))
            further[name] = FurtherChannel(unit, source.array(f"further/{name}", "f", shape, unit).astype(np.float64))
        description = source.attribute("", "description") if "description" in source.file.attrs else ""
    return conditions, measured_time, signals, conditions.run_order, description, further


def to_bytes(conditions: Conditions, measured_time: np.ndarray, signals: Signals | None, description: str,
             further: Mapping[str, FurtherChannel]) -> bytes:
    """Recordings as the bytes of an HDF5 file."""
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=("earliest", "v110")) as file:
        file.attrs["description"] = description
        write_conditions(file, conditions)
        file.create_dataset("shifting_time", data=measured_time).attrs["units"] = text("s")
        if signals is not None:
            file.create_dataset("signals/time", data=signals.time).attrs["units"] = text("s")
            for name in signals.names:
                _write(file, f"signals/{name}", signals[name], SIGNAL_UNITS[name])
        for name, channel in further.items():
            _write(file, f"further/{name}", channel.values, channel.unit)
    return memory.getvalue()


def _write(file: h5py.File, path: str, values: np.ndarray, unit: str) -> None:
    file.create_dataset(path, data=values, chunks=True, compression="gzip", shuffle=True,
                        fletcher32=True).attrs["units"] = text(unit)
