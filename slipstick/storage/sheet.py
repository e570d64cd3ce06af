"""CSV files of numbers whose first row names the columns with their units, such as `motor_speed [rpm]`.

Lines before the first row that begin with # are remarks. Errors count rows as an editor counts lines, from 1.
"""

import csv
import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from slipstick.errors import SlipstickError
from slipstick.numerics.quantities import NotAQuantity, factor_of
from slipstick.storage.cells import number

_HEADING = re.compile(r"(?P<name>[^\[\]]*?)\s*(\[(?P<unit>[^\[\]]*)\])?")
LARGEST = 20_000_000
"""Most numbers of one file."""


@dataclass(frozen=True)
class Sheet:
    """Columns of finite numbers (r,) by name, their headings with units, the line number of each row (r,).

    `columns` are in the `units` of the caller, whatever units the headings state.
    """

    columns: dict[str, np.ndarray]
    units: dict[str, str]
    headings: dict[str, str]
    lines: np.ndarray
    remarks: str
    error: type[SlipstickError]

    @classmethod
    def read(cls, content: bytes, what: str, required: Mapping[str, str], optional: Mapping[str, str],
             error: type[SlipstickError]) -> "Sheet":
        """Read the bytes of a file, converting the columns to the units in `required` and `optional`.

        `what` names the file in errors. Raises `error`.
        """
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError as fault:
            raise error(f"Byte {fault.start} of the {what} file is not valid UTF-8",
                        "Save the file in the encoding UTF-8") from fault
        units = {**required, **optional}
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        try:
            remarks, heading = _first_row(reader, error)
            columns = _columns(heading, units, tuple(required), error)
            lines: list[int] = []
            rows: list[list[float]] = []
            for cells in reader:
                if cells:
                    lines.append(reader.line_num)
                    rows.append(_numbers(cells, heading, reader.line_num, error))
                    if len(rows) * len(heading) > LARGEST:
                        raise error(f"The {what} file has more than {LARGEST:,} numbers",
                                    "Reduce the sampling rate of the signals, or split the file")
        except csv.Error as fault:
            raise error(f"Row {reader.line_num} is not valid CSV: {fault}",
                        "Separate the cells by commas and close every quotation mark") from fault
        if not rows:
            raise error(f"The {what} file has no rows of numbers", "Add them below the row of column names")
        table = np.array(rows)
        return cls({name: table[:, column] * factor for column, (name, factor) in enumerate(columns)}, units,
                   dict(zip((name for name, _ in columns), heading, strict=True)), np.array(lines), remarks, error)

    def refusal(self, name: str, row: int, says: str, remedy: str) -> SlipstickError:
        """The error about one cell, by the row (from 0) and the name of its column."""
        heading, unit = self.headings[name], self.units[name]
        converted = "" if unit == "1" or f"[{unit}]" in heading else f" {unit}"  # the file has another number
        return self.error(f"Row {self.lines[row]}, column '{heading}': {self.columns[name][row]:g}{converted} {says}",
                          remedy)

    def whole(self, name: str) -> np.ndarray:
        """A column of whole numbers that count from 0; refuses others."""
        column = self.columns[name]
        broken = np.flatnonzero((column != np.round(column)) | (column < 0))
        if len(broken):
            raise self.refusal(name, int(broken[0]), "is not an integer from 0", "Enter an integer, counted from 0")
        return column.astype(np.int64)

    def positive(self, name: str, zero: bool = False) -> np.ndarray:
        """A column of positive numbers, or with `zero` of numbers that are not negative; refuses others."""
        column = self.columns[name]
        low = np.flatnonzero(column < 0 if zero else column <= 0)
        if len(low):
            says = "is negative" if zero else "is not positive"
            raise self.refusal(name, int(low[0]), says, "Check the value and its unit")
        return column


def _first_row(reader: Iterator[list[str]], error: type[SlipstickError]) -> tuple[str, list[str]]:
    remarks: list[str] = []
    for cells in reader:
        if cells and cells[0].startswith("#"):
            remarks.append(",".join(cells).lstrip("# "))
        elif cells:
            return "\n".join(remarks), [cell.strip() for cell in cells]
    raise error("The CSV file has no row of column names", "Name the columns in the first row")


def _columns(heading: list[str], units: dict[str, str], required: tuple[str, ...],
             error: type[SlipstickError]) -> list[tuple[str, float]]:
    """Name of each column, and the factor to its unit."""
    known = {name if unit == "1" else f"{name} [{unit}]": name for name, unit in units.items()}
    columns: list[tuple[str, float]] = []
    for column in heading:
        parts = _HEADING.fullmatch(column)
        name = parts["name"] if parts else column
        if name not in units:
            if len(heading) == 1 and ";" in column:
                raise error("The columns are separated by semicolons",
                            "Separate them by commas, and write decimal points")
            near = get_close_matches(name, units, n=1, cutoff=0.5)
            # The unit stays that of the numbers, which another name does not change.
            hint = f"Did you mean '{near[0]}{column[len(name):]}'? " if near else ""
            raise error(f"The column '{column[:40]}' is unknown",
                        f"{hint}Known: {', '.join(known)}, each with these or other units of the same dimension")
        try:
            factor = factor_of((parts and parts["unit"]) or "", units[name])
        except NotAQuantity as fault:
            raise error(f"The column '{column[:40]}': {fault}", fault.remedy or
                        f"Write the unit of its numbers behind the name, such as '{name} [{units[name]}]'") from None
        columns.append((name, factor))
    names = [name for name, _ in columns]
    for label, name in known.items():
        if name in required and name not in names:
            raise error(f"The column '{label}' is missing",
                        "Add it under this name, with the unit of its numbers, and separate columns by commas")
    if len(set(names)) < len(names):
        double = next(name for name in names if names.count(name) > 1)
        raise error(f"The column '{double}' appears more than once", "Give each column once")
    return columns


def _numbers(cells: list[str], heading: list[str], line: int, error: type[SlipstickError]) -> list[float]:
    if len(cells) != len(heading):
        raise error(f"Row {line} has {len(cells)} cells for {len(heading)} columns",
                    "Give one cell per column, and use a decimal point, not a decimal comma")
    numbers = []
    for column, cell in zip(heading, cells, strict=True):
        value = number(cell)
        if value is None or not np.isfinite(value):
            says = f"'{cell.strip()[:40]}' is not a finite number" if cell.strip() else "the cell is empty"
            raise error(f"Row {line}, column '{column}': {says}",
                        "Enter a number with a decimal point, or leave out the row")
        numbers.append(value)
    return numbers
