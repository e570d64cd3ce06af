"""Text files as data-acquisition systems write them: other separators, decimal commas, a row of units, remarks above.

What a mapping does not state is inferred from the rows, and said in `remarks`.
"""

import codecs
import io
import re
from collections.abc import Sequence
from typing import BinaryIO

import numpy as np

from slipstick.acquisition.channel import LARGEST, Channel, Listed
from slipstick.acquisition.csv_layout import SEPARATORS, CsvOptions, Layout, infer_layout, split
from slipstick.acquisition.names import Names
from slipstick.acquisition.units import split_unit
from slipstick.errors import BadRecording
from slipstick.storage.cells import TIME_OF_DAY, number, timestamp

_ENCODINGS = {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252", "utf-16": "UTF-16", "utf-16-le": "UTF-16",
              "utf-16-be": "UTF-16"}
_DAY = 86400.0  # s
_PLAIN = re.compile(r"[0-9eE+\-.,;\t \n]*")
"""Text in which `numpy.loadtxt` reads nothing as a number but what `cells.number` does."""


class CsvFile:
    """A text file, all of whose cells are in memory. An empty cell is a missing value.

    A column is read when it is asked for: other text in it is refused then, and in a column that nobody needs never. A
    column of dates with times, or of times of day, is in s after its first row.
    """

    def __init__(self, name: str, file: BinaryIO, options: CsvOptions) -> None:
        self.name = name
        text, encoding = _decode(name, file.read(), options.encoding)
        lines = text.split("\n")
        layout = infer_layout(name, lines, options)
        self._names = Names.of_headings(name, layout.names, [str(column + 1) for column in range(len(layout.names))])
        self._layout = layout
        if len(lines) * len(layout.names) > LARGEST:
            raise BadRecording(f"{name} has more than {LARGEST:,} numbers", "Split the file")
        self._table = _plain_table(lines, layout)
        self._rows = _rows(name, lines, layout) if self._table is None else []
        self._stamped = [column for column in range(len(layout.names)) if self._states_times(column)]
        left_out = self._rows[-1][0] + 1 if self._rows else len(lines)
        footer = [line.strip() for line in lines[left_out:] if any(split(line, layout.separator))]
        self.remarks: tuple[str, ...] = (
            f"text with {SEPARATORS.get(layout.separator, repr(layout.separator))} between cells, decimal "
            f"{'commas' if layout.decimal == ',' else 'points'}, {encoding}, names in row {layout.name_row + 1}"
            f"{'' if layout.unit_row is None else f', units in row {layout.unit_row + 1}'}, numbers from row "
            f"{layout.first + 1}",
            *(f"the column '{layout.names[column]}' states dates or times of day, which are read as s after its first "
              "row" for column in self._stamped),
            *(f"row {row + 1} counts the columns, and is left out" for row in (layout.counted,) if row is not None),
            *(f"the text from row {left_out + 1} on, at the end of the file, is left out: '{footer[0][:60]}'"
              for _ in footer[:1]))

    def listed(self) -> tuple[Listed, ...]:
        """The columns whose first value is a number or a time, or that have none."""
        return tuple(Listed(name, self._unit(column), self._count()) for name, column in self._names.positions.items()
                     if self._table is not None or column in self._stamped or self._first_number(column) is not None)

    def channel(self, name: str) -> Channel:
        """One column."""
        column = self._names.position(name)
        if self._table is None:
            values = self._read(column)
        else:
            values = self._table[:, column] if column < self._table.shape[1] else np.full(len(self._table), np.nan)
        return Channel(name, self._unit(column), values)

    def _unit(self, column: int) -> str:
        heading = split_unit(self._layout.names[column])[1]
        return "s" if column in self._stamped else self._layout.units[column] or heading

    def _count(self) -> int:
        return len(self._rows if self._table is None else self._table)

    def _first_cell(self, column: int) -> str:
        return next((cell for _, cells in self._rows if (cell := _cell(cells, column))), "")

    def _first_number(self, column: int) -> float | None:
        cell = self._first_cell(column)
        return number(cell, self._layout.decimal) if cell else 0.0

    def _states_times(self, column: int) -> bool:
        return timestamp(self._first_cell(column)) is not None

    def _read(self, column: int) -> np.ndarray:
        decimal = self._layout.decimal
        start = timestamp(self._first_cell(column)) if column in self._stamped else None
        values = np.full(len(self._rows), np.nan)
        for place, (row, cells) in enumerate(self._rows):
            cell = _cell(cells, column)
            if not cell:
                continue
            if start is None:
                value = number(cell, decimal)
            else:
                stated = timestamp(cell)
                is_alike = stated is not None and (stated.tzinfo is None) == (start.tzinfo is None)
                value = (stated - start).total_seconds() if stated is not None and is_alike else None
            if value is None:
                raise self._cell_error(row, column, cell, "a number" if start is None else
                                    "a date with a time, as in the first row")
            values[place] = value
        return values if start is None or start.year > TIME_OF_DAY else _over_midnight(values)

    def _cell_error(self, row: int, column: int, cell: str, kind: str) -> BadRecording:
        where = f"Row {row + 1} of {self.name}, column '{self._layout.names[column]}'"
        remedy = "Correct the cell, leave it empty where the value is missing, or state csv.decimal in the mapping"
        if number(re.sub(r"(?<=\d)[.,' ](?=\d{3})", "", cell), self._layout.decimal) is not None:
            remedy = f"Write numbers without thousands separators. {remedy}"
        return BadRecording(f"{where}: '{cell[:40]}' is not {kind}", remedy)


def _over_midnight(values: np.ndarray) -> np.ndarray:
    """Times of day (k,) in s, where each midnight between two of them adds a day."""
    known = np.flatnonzero(np.isfinite(values))
    midnights = np.cumsum(np.diff(values[known], prepend=values[known[:1]]) < -_DAY / 2)
    values[known] += _DAY * midnights
    return values


def _cell(cells: Sequence[str], column: int) -> str:
    return cells[column] if column < len(cells) else ""


def _decode(name: str, content: bytes, encoding: str | None) -> tuple[str, str]:
    """The text with its ends of lines as `\\n`, and its encoding.

    UTF-16 is known by a byte order mark, or by zeros in every second byte; other text is UTF-8, or Windows-1252 where
    it is not valid UTF-8.
    """
    candidates = [encoding] if encoding else [*wide_encoding(content), "utf-8-sig", "cp1252"]
    for candidate in candidates:
        try:
            text = content.decode(candidate).removeprefix("\ufeff")
        except (UnicodeDecodeError, LookupError):
            continue
        text = text.rstrip("\0").replace("\r\n", "\n").replace("\r", "\n")
        if "\0" in text:
            row = text.count("\n", 0, text.index("\0")) + 1
            raise BadRecording(f"Row {row} of {name} contains characters of value 0: the file is damaged, or no text",
                               "Export it again, or leave it out")
        return text, _ENCODINGS.get(candidate, candidate)
    raise BadRecording(f"{name} is not text in the encoding {encoding or 'UTF-8 or Windows-1252'}",
                       "Give its encoding in the mapping, such as csv.encoding = \"utf-16\", or save it as UTF-8")


def wide_encoding(content: bytes) -> list[str]:
    """The encoding of text in UTF-16 by its first bytes, or none."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return ["utf-16"]
    start = content[:64]
    if len(start) > 2 and not any(start[1::2]) and all(start[::2]):
        return ["utf-16-le"]
    return ["utf-16-be"] if len(start) > 2 and not any(start[::2]) and all(start[1::2]) else []


def _plain_table(lines: Sequence[str], layout: Layout) -> np.ndarray | None:
    """The numbers (r, c) by the reader of numpy, or None where it might not read them as `cells.number` does."""
    text = "\n".join(lines[layout.first:])
    if not _PLAIN.fullmatch(text) or (layout.decimal == "," and "." in text):
        return None
    try:
        table = np.loadtxt(io.StringIO(text.replace(",", ".") if layout.decimal == "," else text),
                           delimiter=layout.separator, comments=None, ndmin=2)
    except ValueError:
        return None
    return table if table.shape[1] == layout.length and np.all(np.isfinite(table)) else None


def _rows(name: str, lines: Sequence[str], layout: Layout) -> list[tuple[int, list[str]]]:
    """Number, from 0, and cells of each row that has any, up to the last one with numbers; raises `BadRecording`."""
    rows = [(row, cells) for row, line in enumerate(lines[layout.first:], layout.first)
            if any(cells := split(line, layout.separator))]
    while rows and not any(number(cell, layout.decimal) is not None or timestamp(cell) for cell in rows[-1][1]):
        rows.pop()
    for row, cells in rows:
        if len(cells) != layout.length and not layout.length < len(cells) <= len(layout.names):
            raise BadRecording(f"Row {row + 1} of {name} has {len(cells)} cells, and the others {layout.length}",
                               "Give one cell for each column")
    return rows
