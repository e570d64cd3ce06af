"""Recordings: test-bench measurements of n engagements, the data of calibration, fits and studies."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.errors import BadRecording, InvalidValue, UnknownName
from slipstick.recordings import csv_form, hdf5_form
from slipstick.recordings.csv_form import Profiles
from slipstick.recordings.signals import FurtherChannel, Signals
from slipstick.storage.files import replacing
from slipstick.storage.isolated import require_readable
from slipstick.storage.shipped import FOLDER, file_of

Form = Literal["h5", "csv"]
_HDF5_READER = "slipstick.recordings.hdf5_form:read"


@dataclass(frozen=True, eq=False)
class Recordings:
    """The measured shifting time of each of the n `conditions`, and optionally the sensor signals.

    `measured_time` (n,) is in s. `run_order` (n,) is the position of each engagement in the test sequence, from 0;
    recordings read from a file have it in `conditions` as well. `further` maps names to channels beside the signals, of
    the same shape. Raises `BadRecording`, whose messages number the conditions from 0.
    """

    conditions: Conditions
    measured_time: np.ndarray
    signals: Signals | None = None
    run_order: np.ndarray | None = None
    description: str = ""
    further: Mapping[str, FurtherChannel] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the properties on which likelihood and calibration rely."""
        n, time = len(self.conditions), self.measured_time
        if n == 0 or time.shape != (n,):
            raise BadRecording(f"There are {time.size} shifting times for {n} conditions",
                               "Give one shifting time per condition, for at least one condition")
        end = self.conditions.profile_time[self.conditions.current_profile, -1]
        invalid = np.flatnonzero(~((time > 0) & (time <= end)))
        if len(invalid):
            row = invalid[0]
            raise BadRecording(f"The shifting time of condition {row} is {time[row]:g} s, which is not between 0 and "
                               f"the {end[row]:g} s of its current profile",
                               "Give seconds from the shift command, and leave out engagements that never locked")
        if self.run_order is not None and not np.array_equal(np.sort(self.run_order), np.arange(n)):
            raise BadRecording(f"The run order does not contain each number from 0 to {n - 1} exactly once",
                               "Give the position of each engagement in the test sequence, or leave out run_order")
        if self.signals is not None and len(self.signals) != n:
            raise BadRecording(f"The signals have {len(self.signals)} rows for {n} conditions",
                               "Give signals for all conditions or for none")
        for name, channel in self.further.items():
            shape = None if self.signals is None else (n, len(self.signals.time))
            if channel.values.shape != shape:
                raise BadRecording(f"The further channel {name} has shape {channel.values.shape}, not {shape}",
                                   "Give further channels at the times of the signals, and only beside them")

    def __len__(self) -> int:
        """Number of conditions."""
        return len(self.conditions)

    def take(self, rows: np.ndarray) -> "Recordings":
        """The engagements `rows`, without a run order, which is that of all."""
        further = {name: replace(channel, values=channel.values[rows]) for name, channel in self.further.items()}
        return replace(self, conditions=self.conditions.take(rows), measured_time=self.measured_time[rows],
                       signals=None if self.signals is None else self.signals.take(rows), run_order=None,
                       further=further)

    @classmethod
    def open(cls, path: Path | str, signals: Path | str | None = None,
             profiles: Profiles | None = None) -> "Recordings":
        """Read the `.h5` or `.csv` file at `path`, or the shipped recordings of this name, such as "sample".

        A CSV needs the current `profiles`, and may have a `signals` file. Raises `BadRecording`, and `UnknownName` if
        a file does not exist.
        """
        path = file_of(path, ".h5")
        if not path.suffix and not path.exists() and path.parent == Path():
            raise UnknownName.of("recordings file", path.name, [shipped.stem for shipped in FOLDER.glob("*.h5")])
        if path.suffix not in (".h5", ".csv"):
            raise BadRecording(f"'{path.name}' is neither an .h5 nor a .csv file",
                               "Give the file the extension of its format")
        form: Form = "h5" if path.suffix == ".h5" else "csv"
        return cls._read(_bytes(path), form, None if signals is None else _bytes(Path(signals)), profiles,
                         f"'{path.name}'")

    @classmethod
    def read(cls, content: bytes, form: Form, signals: bytes | None = None,
             profiles: Profiles | None = None) -> "Recordings":
        """Read the bytes of an untrusted file; raises `BadRecording`.

        An HDF5 file is first read in a limited child process (storage/isolated.py), which adds half a second.
        """
        if form == "h5" and signals is None:
            require_readable(content, _HDF5_READER, BadRecording)
        return cls._read(content, form, signals, profiles)

    @classmethod
    def _read(cls, content: bytes, form: Form, signals: bytes | None, profiles: Profiles | None,
              name: str = "The file") -> "Recordings":
        if form == "csv":
            return cls(*csv_form.read(content, signals, _require_profiles(profiles)))
        if signals is not None:
            raise BadRecording("A separate signals file was given with an HDF5 file",
                               "Store the signals in the HDF5 file")
        return cls(*hdf5_form.read(content, name))

    def save(self, path: Path | str) -> Path:
        """Write the recordings as HDF5 to `path`, which `open` reads, and return the path.

        Raises `InvalidValue` unless it ends in `.h5`.
        """
        path = Path(path)
        if path.suffix != ".h5" or path.is_dir():
            raise InvalidValue(f"'{path}' is not the name of a .h5 file", "Give a path that ends in .h5")
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_bytes(self.to_bytes())
        return path

    def to_bytes(self) -> bytes:
        """The recordings as the bytes of an HDF5 file, which `read` reads."""
        return hdf5_form.to_bytes(self.conditions, self.measured_time, self.signals, self.description, self.further)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all numbers: equal measurements have the same digest, whatever the file format."""
        hashed = hashlib.sha256(self.conditions.digest.encode())
        signals = self.signals
        columns = [] if signals is None else [getattr(signals, column.name) for column in fields(signals)]
        for array in (self.measured_time, self.run_order, *columns):
            if array is None:
                hashed.update(b"absent\n")
                continue
            little_endian = np.ascontiguousarray(array, dtype="<f8")
            hashed.update(f"{little_endian.shape}\n".encode())
            hashed.update(little_endian.data)
        for name, channel in sorted(self.further.items()):
            hashed.update(f"{name} [{channel.unit}]\n".encode())
            hashed.update(np.ascontiguousarray(channel.values, dtype="<f8").data)
        return hashed.hexdigest()


def open_conditions(path: Path | str, profiles: Profiles | None = None) -> Conditions:
    """Read only the conditions of the recordings at `path`; a CSV need not have shifting times, but needs profiles."""
    path = Path(path)
    if path.suffix == ".csv":
        return csv_form.read_conditions(_bytes(path), _require_profiles(profiles))
    return Recordings.open(path).conditions


def _require_profiles(profiles: Profiles | None) -> Profiles:
    if profiles is None:
        raise BadRecording("Recordings as CSV do not contain their current profiles",
                           "Give the bench whose profiles they number, or use an HDF5 file")
    return profiles


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise UnknownName.of("recordings file", path.name, [other.name for other in path.parent.glob("*.h5")])
    return path.read_bytes()
