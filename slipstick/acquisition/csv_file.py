"""Text files as data-acquisition systems write them: other separators, decimal commas, a row of units, remarks above.

What a mapping does not state is found out from the first rows of numbers, and said in `remarks`.
"""

import codecs
import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import BinaryIO

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed, split_unit, unknown_channel
from slipstick.acquisition.timestamps import timestamp
from slipstick.errors import BadRecording

_LOOK = 200  # rows from which the format is found out
_ENCODINGS = {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252", "utf-16": "UTF-16"}
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}


@dataclass(frozen=True)
class CsvOptions:
    """How text is read: `separator` and `decimal` sign, and `encoding`; None: found out from the file."""

    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None


class CsvFile:
    """A text file, all of whose columns are in memory. An empty cell is a missing value; other text is refused.

    A column of dates with times, or of times of day, is in s after its first row.
    """

    def __init__(self, name: str, file: BinaryIO, options: CsvOptions) -> None:
        self.name = name
        text, encoding = _decoded(name, file.read(), options.encoding)
        lines = text.splitlines()
        separator, decimal, first = _format(name, lines, options)
        heading = [next(csv.reader([line], delimiter=separator), []) for line in lines[:first]]
        widths = len(_cells(lines[first], separator))
        named = [row for row in heading if len(row) == widths and any(cell.strip() for cell in row)]
        if not named:
            raise BadRecording(f"{name} has no row of {widths} column names above row {first + 1}, the first of "
                               "numbers", "Name each column in the row above the numbers")
        has_units = len(named) > 1 and heading[-2:] == named[-2:]  # names and units are the two rows above the numbers
        names = named[-2] if has_units else named[-1]
        self._columns: dict[str, tuple[str, int]] = {}
        for column, cell in enumerate(names):
            label, unit = split_unit(cell)
            unit = named[-1][column].strip("[]() ") if has_units else unit
            if label in self._columns:
                raise BadRecording(f"{name} has more than one column '{label}'", "Give each column a name of its own")
            self._columns[label] = unit, column
        stamped = [column for column, cell in enumerate(_cells(lines[first], separator)) if timestamp(cell)]
        self._columns |= {label: ("s", column) for label, (_, column) in self._columns.items() if column in stamped}
        self._table = _numbers(name, text, lines, first, separator, decimal, [cell.strip() for cell in names])
        self.remarks: tuple[str, ...] = (
            f"text with {_SEPARATORS.get(separator, repr(separator))} between cells, decimal "
            f"{'commas' if decimal == ',' else 'points'}, {encoding}, numbers from row {first + 1}"
            f"{', units in the row above' if has_units else ''}",
            *(f"the column '{names[column].strip()}' states dates or times of day, which are read as s after its first "
              "row" for column in stamped))

    def listed(self) -> tuple[Listed, ...]:
        """The columns."""
        return tuple(Listed(name, unit, len(self._table)) for name, (unit, _) in self._columns.items() if name)

    def channel(self, name: str) -> Channel:
        """One column."""
        if name not in self._columns:
            raise unknown_channel(self.name, name, self._columns)
        unit, column = self._columns[name]
        return Channel(name, unit, self._table[:, column])


def _decoded(name: str, content: bytes, encoding: str | None) -> tuple[str, str]:
    """The text and its encoding: UTF-16 with a byte order mark, UTF-8, or Windows-1252 where it is neither."""
    marked = ["utf-16"] if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else []
    for candidate in ([encoding] if encoding else [*marked, "utf-8-sig", "cp1252"]):
        try:
            return content.decode(candidate), _ENCODINGS.get(candidate, candidate)
        except (UnicodeDecodeError, LookupError):
            continue
    raise BadRecording(f"{name} is not text in the encoding {encoding or 'UTF-8 or Windows-1252'}",
                       "Give its encoding in the mapping, such as csv.encoding = \"utf-16\", or save it as UTF-8")


def _format(name: str, lines: list[str], options: CsvOptions) -> tuple[str, str, int]:
    """Separator, decimal sign and the number of the first row of numbers, from 0."""
    for separator in ([options.separator] if options.separator else _SEPARATORS):
        found = {}
        for decimal in ([options.decimal] if options.decimal else (".", ",")):
            rows = [number for number, line in enumerate(lines[:_LOOK]) if _is_row(line, separator, decimal)]
            if rows and decimal != separator:
                found[decimal] = rows
        if found:
            decimal = max(found, key=lambda sign: len(found[sign]))
            return separator, decimal, found[decimal][0]
    raise BadRecording(f"{name} has no rows of two or more numbers among its first {_LOOK}",
                       "Separate cells by semicolons, tabs or commas, or state csv.separator and csv.decimal in the "
                       "mapping; other binary formats must be exported as CSV")


def _is_row(line: str, separator: str, decimal: str) -> bool:
    cells = _cells(line, separator)
    return len(cells) > 1 and all(not cell or _is_number(cell, decimal) or timestamp(cell) for cell in cells) and any(
        _is_number(cell, decimal) for cell in cells)


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _is_number(cell: str, decimal: str) -> bool:
    if decimal == "," and "." in cell:
        return False
    try:
        float(cell.replace(decimal, "."))
    except ValueError:
        return False
    return True


def _numbers(name: str, text: str, lines: Sequence[str], first: int, separator: str, decimal: str,
             names: Sequence[str]) -> np.ndarray:
    """The rows of numbers (r, c); the quick way of numpy first, and cell by cell where it refuses."""
    if len(lines) * len(names) > LARGEST:
        raise BadRecording(f"{name} has more than {LARGEST:,} numbers", "Split the file")
    rows = "\n".join(lines[first:])
    try:
        return np.loadtxt(io.StringIO(rows.replace(",", ".") if decimal == "," else rows), delimiter=separator, ndmin=2)
    except ValueError:
        pass
    table, starts = [], [timestamp(cell) for cell in _cells(lines[first], separator)]
    for number, line in enumerate(lines[first:], first + 1):
        if not line.strip():
            continue
        cells = _cells(line, separator)
        if len(cells) != len(names):
            raise BadRecording(f"Row {number} of {name} has {len(cells)} cells for {len(names)} columns",
                               "Give one cell for each column")
        table.append([_value(cell, decimal, start, f"Row {number} of {name}, column '{column}'")
                      for column, cell, start in zip(names, cells, starts, strict=True)])
    return np.array(table)


def _value(cell: str, decimal: str, start: datetime | None, where: str) -> float:
    """The number in a cell, or the time in s after the `start` of its column."""
    if not cell:
        return np.nan
    if start is None and _is_number(cell, decimal):
        return float(cell.replace(decimal, "."))
    stated = timestamp(cell)
    if start is None or stated is None:
        kind = "a number" if start is None else "a date with a time, as in the first row"
        raise BadRecording(f"{where}: '{cell[:40]}' is not {kind}",
                           "Correct the cell, leave it empty where the value is missing, or state csv.decimal in the "
                           "mapping")
    return (stated - start).total_seconds()
