"""Parquet files, read by pyarrow (an extra: `pip install slipstick[parquet]`).

The unit of a column stands in its name, as in `n_mot [rpm]`, or in the metadata `unit` or `units` of its field.
"""

from typing import Any, BinaryIO

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed, split_unit, unknown_channel, unreadable
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
            self._file: Any = pyarrow.parquet.ParquetFile(file)
            self._rows = int(self._file.metadata.num_rows)
            self._columns = {split_unit(field.name)[0]: (field.name, _unit(field))
                             for field in self._file.schema_arrow if _is_number(field.type)}
        except Exception as error:  # pyarrow raises errors of its own, OSError and ValueError
            raise unreadable(self.name, "Parquet", error) from error
        if self._rows > LARGEST:
            raise BadRecording(f"{name} has {self._rows:,} rows, more than {LARGEST:,}", "Split the file")

    def listed(self) -> tuple[Listed, ...]:
        """The columns of numbers and of times."""
        return tuple(Listed(name, unit, self._rows) for name, (_, unit) in self._columns.items())

    def channel(self, name: str) -> Channel:
        """One column. Times of day are in s since the first; a null is NaN."""
        if name not in self._columns:
            raise unknown_channel(self.name, name, self._columns)
        column, unit = self._columns[name]
        try:
            values = self._file.read(columns=[column]).column(0).to_numpy()
        except Exception as error:
            raise unreadable(self.name, "Parquet", error) from error
        if values.dtype.kind in "mM":
            start = values[0] if values.dtype.kind == "M" else np.timedelta64(0, "ns")
            values = (values - start) / np.timedelta64(1, "s")
        return Channel(name, unit, values.astype(float))


def _unit(field: Any) -> str:
    metadata = field.metadata or {}
    stated = metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace")
    return stated or split_unit(field.name)[1] or ("s" if _is_time(field.type) else "")


def _is_time(kind: Any) -> bool:
    return str(kind).startswith(("timestamp", "duration"))


def _is_number(kind: Any) -> bool:
    return _is_time(kind) or str(kind).startswith(("int", "uint", "float", "double", "halffloat", "bool", "decimal"))
