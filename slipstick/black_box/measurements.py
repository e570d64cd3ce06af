"""Measured outputs of a machine: a CSV file with a column per condition and one of the output, stored as HDF5."""

import hashlib
import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from slipstick.black_box.cases import Cases
from slipstick.black_box.description import BlackBoxDescription, Quantity
from slipstick.errors import BadRecording, UnknownName
from slipstick.storage.hdf5 import reading, text
from slipstick.storage.sheet import Sheet

MARK = "measurements"
"""Attribute of the file: the name of the measured output."""
_LARGEST = 1 << 26  # bytes of one dataset


@dataclass(frozen=True, eq=False)
class Measurements:
    """The measured `output` of each of the n `conditions`: `measured_time` (n,), in the unit of the output.

    The name of the field is that of recordings of clutches, which likelihoods and fits use in the same way.
    """

    conditions: Cases
    measured_time: np.ndarray
    output: Quantity
    description: str = ""

    def __post_init__(self) -> None:
        """Check that there is one finite number per condition."""
        if self.measured_time.shape != (len(self.conditions),) or not np.isfinite(self.measured_time).all():
            raise BadRecording(f"The measured {self.output.name} is not one finite number per condition",
                               "Leave out conditions without a measurement")

    def __len__(self) -> int:
        """Number of conditions."""
        return len(self.conditions)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of conditions, output and numbers."""
        hashed = hashlib.sha256(f"{self.conditions.digest} {self.output.name} [{self.output.unit}]\n".encode())
        hashed.update(np.ascontiguousarray(self.measured_time, dtype="<f8").data)
        return hashed.hexdigest()

    @classmethod
    def open(cls, path: Path, machine: BlackBoxDescription) -> "Measurements":
        """Read the `.csv` file of measurements of `machine` at `path`, or the HDF5 file that `to_bytes` wrote.

        Raises `BadRecording`, and `UnknownName` if the file does not exist.
        """
        if not path.is_file():
            raise UnknownName.of("file of measurements", path.name, [
                other.name for other in path.parent.glob("*") if other.suffix in (".csv", ".h5")])
        return cls.read_csv(path.read_bytes(), machine) if path.suffix == ".csv" else cls.read(path)

    @classmethod
    def read_csv(cls, content: bytes, machine: BlackBoxDescription) -> "Measurements":
        """Read the bytes of a CSV file whose headings are the conditions and the output of `machine`, with units.

        Other units of the same dimension are converted. Raises `BadRecording`.
        """
        units = {quantity.name: quantity.unit for quantity in (*machine.columns, machine.output)}
        sheet = Sheet.read(content, "measurements", units, {}, BadRecording)
        values = np.column_stack([sheet.columns[quantity.name] for quantity in machine.columns])
        return cls(Cases(machine.columns, values), sheet.columns[machine.output.name], machine.output, sheet.remarks)

    def to_bytes(self) -> bytes:
        """The measurements as the bytes of an HDF5 file."""
        memory = io.BytesIO()
        with h5py.File(memory, "w", libver=("earliest", "v110")) as file:
            file.attrs[MARK] = text(self.output.name)
            file.attrs["description"] = text(self.description)
            self.conditions.write(file)
            measured = file.create_dataset("measured", data=self.measured_time, dtype="<f8")
            measured.attrs["units"] = text(self.output.unit)
        return memory.getvalue()

    @classmethod
    def read(cls, content: Path | bytes) -> "Measurements":
        """Read an HDF5 file that `to_bytes` wrote; raises `BadRecording`."""
        with reading(content, BadRecording, _LARGEST) as source:
            if not source.has_attribute("", MARK):
                raise BadRecording("The file holds no measurements of the output of a machine",
                                   "Give a CSV file with the columns of its conditions and its output, or measurements "
                                   "downloaded from the service")
            conditions = Cases.read(source)
            unit = source.attribute("measured", "units")
            measured = source.array("measured", "f", (len(conditions),), unit)
            return cls(conditions, measured, Quantity(source.attribute("", MARK), unit),
                       source.attribute("", "description"))
