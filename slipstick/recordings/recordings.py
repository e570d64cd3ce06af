"""Recordings: what a test bench measured of n engagements, held against the model by calibration and fits."""

import hashlib
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.errors import BadRecording, UnknownName
from slipstick.recordings import csv_form, hdf5_form
from slipstick.recordings.signals import Signals
from slipstick.storage.isolated import require_readable

Form = Literal["h5", "csv"]
_HDF5_READER = "slipstick.recordings.hdf5_form:read"


@dataclass(frozen=True, eq=False)
class Recordings:
    """`measured_time` (n,) s, the shifting time of each of the n `conditions`, and signals if there are any.

    `run_order` (n,) is the place of each engagement in the sequence they were run in, from 0; what is read from a
    file has it in its conditions too. Raises `BadRecording`, which counts the conditions from 0.
    """

    conditions: Conditions
    measured_time: np.ndarray
    signals: Signals | None = None
    run_order: np.ndarray | None = None
    description: str = ""

    def __post_init__(self) -> None:
        """Check what the likelihood and the calibration rely on."""
        n, time = len(self.conditions), self.measured_time
        if n == 0 or time.shape != (n,):
            raise BadRecording(f"There are {time.size} shifting times for {n} conditions",
                               "Give one of each in a row, for one engagement or more")
        end = self.conditions.profile_time[self.conditions.current_profile, -1]
        bad = np.flatnonzero(~((time > 0) & (time <= end)))
        if len(bad):
            raise BadRecording(f"The shifting time of condition {bad[0]} is {time[bad[0]]:g} s, "
                               f"not between 0 and the {end[bad[0]]:g} s of its current profile",
                               "Give seconds from the shift command, and leave out what did not lock")
        if self.run_order is not None and not np.array_equal(np.sort(self.run_order), np.arange(n)):
            raise BadRecording("The run order does not number the engagements from 0, each once",
                               "Give the place of each engagement in the sequence, or leave run_order out")
        if self.signals is not None and len(self.signals.pressure) != n:
            raise BadRecording(f"There are signals of {len(self.signals.pressure)} conditions, not of {n}",
                               "Give signals for every condition, or for none")

    def __len__(self) -> int:
        """Number of conditions."""
        return len(self.conditions)

    @classmethod
    def open(cls, path: Path | str, signals: Path | str | None = None) -> "Recordings":
        """Read the `.h5` or `.csv` file at `path`; `signals` is the CSV of the signals that go with a CSV.

        Raises `BadRecording`, and `UnknownName` where there is no such file.
        """
        path = Path(path)
        if path.suffix not in (".h5", ".csv"):
            raise BadRecording(f"'{path.name}' is neither .h5 nor .csv", "Name the file after its format")
        form: Form = "h5" if path.suffix == ".h5" else "csv"
        return cls._read(_bytes(path), form, None if signals is None else _bytes(Path(signals)))

    @classmethod
    def read(cls, content: bytes, form: Form, signals: bytes | None = None) -> "Recordings":
        """Read the bytes of a file that nobody vouches for; raises `BadRecording`.

        An HDF5 file is first read in a limited child process, which takes half a second more (storage/isolated.py).
        """
        if form == "h5" and signals is None:
            require_readable(content, _HDF5_READER, BadRecording)
        return cls._read(content, form, signals)

    @classmethod
    def _read(cls, content: bytes, form: Form, signals: bytes | None) -> "Recordings":
        if form == "csv":
            return cls(*csv_form.read(content, signals))
        if signals is not None:
            raise BadRecording("A second file of signals came with an HDF5 file", "Put them into the first")
        return cls(*hdf5_form.read(content))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all numbers, whatever file they came from: equal for equal measurements."""
        hashed = hashlib.sha256(self.conditions.digest.encode())
        signals = self.signals
        columns = [] if signals is None else [getattr(signals, column.name) for column in fields(signals)]
        for array in (self.measured_time, self.run_order, *columns):
            if array is None:
                hashed.update(b"absent\n")
                continue
            plain = np.ascontiguousarray(array, dtype="<f8")
            hashed.update(f"{plain.shape}\n".encode())
            hashed.update(plain.data)
        return hashed.hexdigest()


def open_conditions(path: Path | str) -> Conditions:
    """Read only the conditions of the recordings at `path`: a CSV may then lack the shifting times."""
    path = Path(path)
    if path.suffix == ".csv":
        return csv_form.read_conditions(_bytes(path))
    return Recordings.open(path).conditions


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise UnknownName.of("recording", path.name, [found.name for found in path.parent.glob("*.h5")])
    return path.read_bytes()
