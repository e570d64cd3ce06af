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
from slipstick.numerics.quantities import is_unit
from slipstick.storage.cells import number, timestamp

_LOOK = 1000
"""Rows from which the layout is inferred."""
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
_STATED = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
"""First row by which spreadsheets are told the separator."""
_END_OF_HEADER = "***End_of_Header***"
"""Last row of the headers of LVM files, of which the second states the channels one by one."""
COMMENT = "Comment"
"""The last name in LVM files, of a column that few rows have."""


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
    `unit_row`. Numbers begin in row `first`, above which row `counted`, if any, counts the columns. Rows of numbers
    have `length` cells.
    """

    separator: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    name_row: int
    unit_row: int | None
    first: int
    length: int
    counted: int | None


def split(line: str, separator: str) -> list[str]:
    """The cells of a row, without spaces around them; a cell in quotation marks may contain the separator."""
    cells = next(csv.reader([line], delimiter=separator), []) if '"' in line else line.split(separator)
    return [cell.strip() for cell in cells]


def infer_layout(name: str, lines: Sequence[str], options: CsvOptions) -> Layout:
    """The layout of the file `name` with the given `lines`; raises `BadRecording`."""
    stated = _STATED.fullmatch(lines[0].strip()) if lines else None
    separators = options.separator or (stated[1] if stated else None)
    start = 1 if stated else 0
    if options.header is not None:
        start = options.header - 1
        if start >= len(lines):
            raise BadRecording(f"{name} has {len(lines)} rows, and csv.header states row {options.header}",
                               "Correct csv.header in the mapping; rows are counted from 1")
    elif any(line.startswith(_END_OF_HEADER) for line in lines[:_LOOK]):
        start = max(row for row, line in enumerate(lines[:_LOOK]) if line.startswith(_END_OF_HEADER)) + 1
    sample = lines[start:start + _LOOK]
    refusal = None
    # Where the separator with most numbers leaves no row of names, as a decimal comma may, the next one is tried.
    for separator, decimal in _by_numbers(sample, options, separators):
        try:
            return _infer(name, sample, start, separator, decimal, options.header is not None)
        except BadRecording as error:
            refusal = refusal or error
    raise refusal or _no_numbers_error(name, lines, start)


def _infer(name: str, sample: Sequence[str], start: int, separator: str, decimal: str, has_header: bool) -> Layout:
    rows = [split(line, separator) for line in sample]
    contents = [_Contents.of(row, decimal) for row in rows]
    body = _body(contents[1:] if has_header else contents)
    if not body:
        raise _no_numbers_error(name, sample, 0)
    first = next(row for row, content in enumerate(contents) if content in body)
    length = Counter(content.length for content in contents if content in body).most_common(1)[0][0]
    columns = frozenset(column for content in body for column in content.numbers if column < length)
    header = _Header(rows, contents, first, max(columns) + 1, length)
    name_row, unit_row = header.names_and_units() if not has_header else (
        0, next((row for row in range(1, first) if header.states_units(row)), None))
    if name_row is None:
        raise BadRecording(f"{name} has no row of {header.width} column names above row {start + first + 1}, the first "
                           "of numbers", "Name each column in a row above the numbers, or state csv.header in the "
                           "mapping, the row of the names counted from 1")
    # A cell of text in the first rows of numbers must not make them a part of the heading.
    above = range(max(name_row, unit_row if unit_row is not None else 0) + 1, first)
    first = next((row for row in above if contents[row].numbers & columns), first)
    counted = start + first if _counts_columns(rows[first:], columns) else None
    names = rows[name_row]
    units = rows[unit_row] if unit_row is not None else []
    return Layout(separator, decimal, tuple(names),
                  tuple(_strip_brackets(units[column]) if column < len(units) else "" for column in range(len(names))),
                  start + name_row, None if unit_row is None else start + unit_row,
                  start + first + (counted is not None), length, counted)


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


def _by_numbers(lines: Sequence[str], options: CsvOptions, stated: str | None) -> list[tuple[str, str]]:
    """Separators and decimal signs by which cells are numbers, those of most numbers first."""
    counts: dict[tuple[str, str], int] = {}
    for separator in [stated] if stated else SEPARATORS:
        rows = [split(line, separator) for line in lines]
        for decimal in [options.decimal] if options.decimal else (".", ","):
            counts[separator, decimal] = sum(number(cell, decimal) is not None or timestamp(cell) is not None
                                             for row in rows if len(row) > 1 for cell in row)
    return sorted((form for form, count in counts.items() if count), key=lambda form: -counts[form])


def _no_numbers_error(name: str, lines: Sequence[str], start: int) -> BadRecording:
    row = min(start + 1, len(lines) - 1)
    return BadRecording(f"{name} has no rows of two or more numbers among its first {_LOOK}; row {row + 1} is "
                        f"'{lines[row][:60].strip()}'" if lines else f"{name} has no rows",
                        "Separate cells by semicolons, tabs or commas, or state csv.separator and csv.decimal in the "
                        "mapping; other binary formats must be exported as CSV")


@dataclass(frozen=True, eq=False)
class _Header:
    """The `rows` above row `first`. Rows of numbers have `length` cells, of which the first `width` hold numbers."""

    rows: Sequence[Sequence[str]]
    contents: Sequence[_Contents]
    first: int
    width: int
    length: int

    def names_and_units(self) -> tuple[int | None, int | None]:
        """The rows of names and of units, None for none.

        Names stand directly above the units, or below them where nothing stands above, and without units in the row
        with most different cells. Where all rows could be units, names are those that differ most.
        """
        block = self._block()
        if not block:
            return None, None
        different = {row: len({cell for cell in self.rows[row] if cell}) for row in block}
        units = [row for row in block if self.states_units(row)] if len(block) > 1 else []
        if len(units) == len(block) > 1:
            names = max(block, key=lambda row: (different[row], -row))
            return names, min((row for row in block if row != names), key=lambda row: abs(row - names))
        if units:
            place = block.index(units[-1])
            return block[place - 1 if place else 1], units[-1]
        # Above two columns, a row of a name and a value is more frequent than a row of remarks below the names.
        nearest = 1 if self.width == 2 else -1
        return max(block, key=lambda row: (different[row], nearest * row)), None

    def states_units(self, row: int) -> bool:
        """Whether most of the cells of a row are units; a number other than 1 is none."""
        cells = [_strip_brackets(cell) for cell in self.rows[row] if cell]
        units = [cell for cell in cells if is_unit(spelled(cell))]
        return 2 * len(units) > len(cells) and any(cell not in ("1", "-") for cell in units)

    def _block(self) -> list[int]:
        """The rows of full width above the numbers without numbers and dates, unless no other could have the names.

        Empty rows below names are passed over.
        """
        block: list[int] = []
        for row in range(self.first - 1, -1, -1):
            if self._fits(row):
                block.insert(0, row)
            elif any(self.rows[row]) or not all(map(self.states_units, block)):
                break
        without = [row for row in block if self.states_units(row) or not (
            self.contents[row].numbers or any(cell[:1].isdigit() for cell in self.rows[row]))]
        return without or block[:1]

    def _fits(self, row: int) -> bool:
        cells = list(self.rows[row])
        while cells and not cells[-1]:
            cells.pop()
        if cells and cells[-1] == COMMENT:
            cells.pop()
        return 0 < len(cells) <= self.length and len(self.rows[row]) >= self.width


def _strip_brackets(unit: str) -> str:
    return unit.strip("[]() ")


def _counts_columns(rows: Sequence[Sequence[str]], columns: frozenset[int]) -> bool:
    """Whether the first row counts the columns, from 0 or 1.

    A program writes all numbers of a column in one form: where the row below has a decimal sign in each column, whole
    numbers are no sample.
    """
    stated = [[row[column] for column in sorted(columns) if column < len(row)] for row in rows[:2]]
    if len(stated) < 2 or len(stated[0]) < 3:
        return False
    is_count = any(stated[0] == [str(count) for count in range(start, start + len(stated[0]))] for start in (0, 1))
    return is_count and all(not cell.lstrip("+-").isdigit() for cell in stated[1] if cell)
