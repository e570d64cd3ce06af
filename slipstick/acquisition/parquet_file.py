"""Parquet files, read by pyarrow (an extra: `pip install slipstick[parquet]`).

The unit of a column stands in its name, as in `n_mot [rpm]`, or in the metadata `unit` or `units` of its field.
"""

from typing import Any, BinaryIO

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed, unreadable
from slipstick.acquisition.names import Names
from slipstick.acquisition.units import split_unit
from slipstick.errors import BadRecording


class ParquetFile:
    """A Parquet file; columns are read one by one."""

    def __init__(self, name: str, file: BinaryIO) -> None:
        self.name = name
        self.remarks: tuple[str, ...] = ("Parquet",)
        try:
            import pyarrow.parquet
        except ImportError:
            raise BadRecording(f"{name} is a Parquet file, and the package pyarrow is not installed",
                               "Install it: pip install 'slipstick[parquet]'") from None
        try:
            self._file: Any = pyarrow.parquet.ParquetFile(file, page_checksum_verification=True)
            self._rows = int(self._file.metadata.num_rows)
            self._schema: Any = self._file.schema_arrow
        except Exception as error:  # pyarrow raises errors of its own, OSError and ValueError
            raise unreadable(self.name, "Parquet", error) from error
        if self._rows > LARGEST:
            raise BadRecording(f"{name} has {self._rows:,} rows, more than {LARGEST:,}", "Split the file")
        if not self._rows:
            raise BadRecording(f"{name} has no rows", "Leave it out, or export it again")
        self._columns = [column for column, field in enumerate(self._schema) if _is_number(field.type)]
        self._fields = [self._schema.field(column) for column in self._columns]
        self._names = Names.of_headings(name, [field.name for field in self._fields],
                                        [str(column + 1) for column in self._columns])

    def listed(self) -> tuple[Listed, ...]:
        """The columns of numbers and of times."""
        return tuple(Listed(name, _unit(self._fields[position]), self._rows)
                     for name, position in self._names.positions.items())

    def channel(self, name: str) -> Channel:
        """One column. Dates with times are in s since the earliest; a null is NaN."""
        position = self._names.position(name)
        try:
            values = self._values(position)
        except Exception as error:
            raise unreadable(self.name, "Parquet", error) from error
        if len(values) != self._rows:
            raise BadRecording(f"The channel '{name}' of {self.name} has {len(values)} values for {self._rows} rows: "
                               "the file is damaged", "Export it again, or leave it out")
        if values.dtype.kind in "mM":
            start = np.timedelta64(0, "ns")
            if values.dtype.kind == "M":
                known = values[~np.isnat(values)]
                start = known.min() if len(known) else values[0]
            values = (values - start) / np.timedelta64(1, "s")
        return Channel(name, _unit(self._fields[position]), values.astype(float))

    def _values(self, position: int) -> np.ndarray:
        """The values of a column. pyarrow selects columns by name, so that those of equal names come together."""
        name = self._fields[position].name
        alike = [other for other, field in enumerate(self._schema) if field.name == name]
        table = self._file.read(columns=[name])
        read = [other for other, field in enumerate(table.schema) if field.name == name]
        return np.asarray(table.column(read[alike.index(self._columns[position])]).to_numpy())


def _unit(field: Any) -> str:
    metadata = field.metadata or {}
    stated = metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace")
    return stated or split_unit(field.name)[1] or ("s" if _is_time(field.type) else "")


def _is_time(kind: Any) -> bool:
    return str(kind).startswith(("timestamp", "duration"))


def _is_number(kind: Any) -> bool:
    return _is_time(kind) or str(kind).startswith(("int", "uint", "float", "double", "halffloat", "bool", "decimal"))
