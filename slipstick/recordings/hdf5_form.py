"""Recordings as HDF5: `conditions`, `current_profiles`, `shifting_time`, `signals`; units are attributes."""

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.errors import BadRecording
from slipstick.recordings.signals import LARGEST, SIGNAL_UNITS, Signals
from slipstick.storage.condition_layout import read_conditions
from slipstick.storage.hdf5 import SIGNATURE, reading

Fields = tuple[Conditions, np.ndarray, Signals | None, np.ndarray | None, str]
"""The fields of `Recordings`, in order."""


def read(content: bytes) -> Fields:
    """Read the bytes of an untrusted file; raises `BadRecording`."""
    if not content.startswith(SIGNATURE):
        raise BadRecording("The file is not an HDF5 file", "Provide an HDF5 file; a CSV file must be named .csv")
    with reading(content, BadRecording, largest=8 * LARGEST // len(SIGNAL_UNITS)) as source:
        conditions = read_conditions(source)
        n = len(conditions)
        measured_time = source.array("shifting_time", "f", (n,), "s").astype(np.float64)
        signals = None
        if source.has("signals"):
            time = source.array("signals/time", "f", (None,), "s").astype(np.float64)
            columns = [source.array(f"signals/{name}", "f", (n, len(time)), unit).astype(np.float64)
                       for name, unit in SIGNAL_UNITS.items()]
            signals = Signals(time, *columns)
        description = source.attribute("", "description") if "description" in source.file.attrs else ""
    return conditions, measured_time, signals, conditions.run_order, description
