"""How a text file is laid out: separator and decimal sign, where its numbers begin, which rows are names and units.

A row belongs to the body if it states numbers, and no text where other rows state numbers. Columns of text, such as a
status or a date, are therefore part of the body, while a row of names is not, though `Force 2` may stand beside `1`.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from slipstick.acquisition.units import spelled
from slipstick.errors import BadRecording
from slipstick.quantities import is_unit
from slipstick.storage.cells import number, timestamp

_LOOK = 1000
"""Rows from which the layout is inferred."""
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
_STATED = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
"""First row by which spreadsheets are told the separator."""


@dataclass(frozen=True)
class CsvOptions:
    """How text is read: `separator` and `decimal` sign, `encoding`, and the row of names, `header`, counted from 1.

    None: inferred from the file.
    """

    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    header: int | None = None


@dataclass(frozen=True)
class Layout:
    """The layout of a text file, with rows counted from 0.

    `names` and `units` have an entry for each column, "" where the file states none, and are in the rows `name_row` and
    `unit_row`. Numbers begin in row `first`, and the last column of numbers is `last_column`.
    """

    separator: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    name_row: int
    unit_row: int | None
    first: int
    last_column: int


def split(line: str, separator: str) -> list[str]:
    """The cells of a row, without spaces around them; a cell in quotation marks may contain the separator."""
    cells = next(csv.reader([line], delimiter=separator), []) if '"' in line else line.split(separator)
    return [cell.strip() for cell in cells]


def infer_layout(name: str, lines: Sequence[str], options: CsvOptions) -> Layout:
    """The layout of the file `name` with the given `lines`; raises `BadRecording`."""
    stated = _STATED.fullmatch(lines[0].strip()) if lines else None
    separator = options.separator or (stated[1] if stated else None)
    start = 1 if stated else 0
    if options.header is not None:
        start = options.header - 1
        if start >= len(lines):
            raise BadRecording(f"{name} has {len(lines)} rows, and csv.header states row {options.header}",
                               "Correct csv.header in the mapping; rows are counted from 1")
    sample = lines[start:start + _LOOK]
    separator, decimal = _most_numbers(name, sample, options, separator)
    rows = [split(line, separator) for line in sample]
    contents = [_Contents.of(row, decimal) for row in rows]
    body = _body(contents[1:] if options.header else contents)
    if not body:
        raise _no_numbers(name, lines, start)
    first = next(row for row, content in enumerate(contents) if content in body)
    length = Counter(content.length for content in contents if content in body).most_common(1)[0][0]
    columns = frozenset(column for content in body for column in content.numbers if column < length)
    header = _Header(rows, first, max(columns) + 1, length)
    name_row, unit_row = header.names_and_units() if options.header is None else (
        0, next((row for row in range(1, first) if header.states_units(row)), None))
    if name_row is None:
        raise BadRecording(f"{name} has no row of {header.width} column names above row {start + first + 1}, the first "
                           "of numbers", "Name each column in a row above the numbers, or state csv.header in the "
                           "mapping, the row of the names counted from 1")
    # A cell of text in the first rows of numbers must not make them a part of the heading.
    above = range(max(name_row, unit_row if unit_row is not None else 0) + 1, first)
    first = next((row for row in above if 2 * len(contents[row].numbers & columns) >= len(columns)), first)
    if _numbers_columns(rows[first], columns) and first + 1 < len(rows) and not _is_whole(rows[first + 1]):
        first += 1
    names = rows[name_row]
    units = rows[unit_row] if unit_row is not None else []
    return Layout(separator, decimal, tuple(names),
                  tuple(_bare(units[column]) if column < len(units) else "" for column in range(len(names))),
                  start + name_row, None if unit_row is None else start + unit_row, start + first, max(columns))


@dataclass(frozen=True)
class _Contents:
    """The columns of a row that state numbers or times, those of other text, and the number of its cells."""

    numbers: frozenset[int]
    texts: frozenset[int]
    length: int

    @classmethod
    def of(cls, cells: Sequence[str], decimal: str) -> "_Contents":
        stated = frozenset(column for column, cell in enumerate(cells)
                           if number(cell, decimal) is not None or timestamp(cell))
        other = frozenset(column for column, cell in enumerate(cells) if cell) - stated
        return cls(stated, other, len(cells))


def _body(contents: Sequence[_Contents]) -> frozenset[_Contents]:
    """The contents that rows of the body have: those without text where usual rows state numbers."""
    counts = Counter[frozenset[int]]()
    for content in contents:
        counts[content.texts] += len(content.numbers)
    texts = max(counts, key=lambda columns: counts[columns])
    columns = frozenset[int]().union(*(content.numbers for content in contents if content.texts == texts))
    if len(columns) < 2:
        return frozenset()
    return frozenset(content for content in contents if content.numbers & columns and not content.texts & columns)


def _most_numbers(name: str, lines: Sequence[str], options: CsvOptions, stated: str | None) -> tuple[str, str]:
    """The separator and the decimal sign by which most cells are numbers; the first of them where several are."""
    most, best = 0, None
    for separator in [stated] if stated else SEPARATORS:
        rows = [split(line, separator) for line in lines]
        for decimal in [options.decimal] if options.decimal else (".", ","):
            count = sum(number(cell, decimal) is not None or timestamp(cell) is not None
                        for row in rows if len(row) > 1 for cell in row)
            if count > most:
                most, best = count, (separator, decimal)
    if best is None:
        raise _no_numbers(name, lines, 0)
    return best


def _no_numbers(name: str, lines: Sequence[str], start: int) -> BadRecording:
    row = min(start + 1, len(lines) - 1)
    return BadRecording(f"{name} has no rows of two or more numbers among its first {_LOOK}; row {row + 1} is "
                        f"'{lines[row][:60].strip()}'" if lines else f"{name} has no rows",
                        "Separate cells by semicolons, tabs or commas, or state csv.separator and csv.decimal in the "
                        "mapping; other binary formats must be exported as CSV")


@dataclass(frozen=True, eq=False)
class _Header:
    """The `rows` above row `first`. Rows of numbers have `length` cells, of which the first `width` hold numbers."""

    rows: Sequence[Sequence[str]]
    first: int
    width: int
    length: int

    def names_and_units(self) -> tuple[int | None, int | None]:
        """The rows of names and of units, None for none.

        Names stand directly above the units, or below them where nothing stands above, and without units in the row
        with most different cells.
        """
        block = self._block()
        if not block:
            return None, None
        unit_row = next((row for row in reversed(block) if self.states_units(row)), None) if len(block) > 1 else None
        if unit_row is None:
            return max(block, key=lambda row: (len({cell for cell in self.rows[row] if cell}), -row)), None
        place = block.index(unit_row)
        return block[place - 1 if place else 1], unit_row

    def states_units(self, row: int) -> bool:
        """Whether most of the cells of a row are units."""
        cells = [_bare(cell) for cell in self.rows[row] if cell]
        return 2 * sum(is_unit(spelled(cell)) for cell in cells) > len(cells)

    def _block(self) -> list[int]:
        """The rows of full width directly above the numbers; empty rows below names are passed over."""
        block: list[int] = []
        for row in range(self.first - 1, -1, -1):
            if self._fits(row):
                block.insert(0, row)
            elif any(self.rows[row]) or not all(map(self.states_units, block)):
                break
        return block or [row for row in (self.first - 1,) if row >= 0 and len(self.rows[row]) >= self.width]

    def _fits(self, row: int) -> bool:
        cells = self.rows[row]
        filled = max((column + 1 for column, cell in enumerate(cells) if cell), default=0)
        return 0 < filled <= self.length and len(cells) >= self.width


def _bare(unit: str) -> str:
    return unit.strip("[]() ")


def _numbers_columns(cells: Sequence[str], columns: frozenset[int]) -> bool:
    """Whether a row counts its columns, from 0 or 1; of two numbers that is no wonder."""
    stated = [cells[column] for column in sorted(columns) if column < len(cells)]
    return len(stated) > 2 and any(stated == [str(count) for count in range(start, start + len(stated))]
                                   for start in (0, 1))


def _is_whole(cells: Sequence[str]) -> bool:
    return all(cell.lstrip("+-").isdigit() for cell in cells if cell)
