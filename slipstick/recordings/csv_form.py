"""Recordings as CSV: a file with one row per condition, and optionally a second file with the signals.

The first row names the columns with their units: `current_profile` (0 to 5, a current profile of the paper),
`motor_speed [rad/s]`, `load_inertia [kg m^2]`, `brake_torque [N m]`, `shifting_time [s]` and optionally `run_order`.
The signals file has one row per sample: `condition` (row index in the first file, from 0), `time [s]`,
`pressure [bar]`, `input_speed [rad/s]`, `output_speed [rad/s]`, `output_torque [N m]`, sorted by condition, with the
same times for every condition. Lines starting with # before the column names are the description of the recordings.
Row numbers in error messages are line numbers of the file, from 1.
"""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from slipstick.bench.conditions import HORIZON, Conditions, paper_conditions
from slipstick.errors import BadRecording, InvalidValue
from slipstick.recordings.hdf5_form import Fields
from slipstick.recordings.signals import LARGEST, SIGNAL_UNITS, Signals
from slipstick.storage.condition_layout import CONDITION_UNITS


def read(content: bytes, signals: bytes | None) -> Fields:
    """Read recordings from the bytes of the conditions file and of the `signals` file; raises `BadRecording`."""
    sheet = _sheet(content, {**CONDITION_UNITS, "shifting_time": "s"}, {"run_order": "1"}, "recordings")
    conditions = _conditions(sheet)
    measured_time = _shifting_times(sheet)
    sampled = None if signals is None else _signals(signals, len(measured_time))
    return conditions, measured_time, sampled, conditions.run_order, sheet.description


def read_conditions(content: bytes) -> Conditions:
    """Read only the conditions, from a CSV with or without shifting times; raises `BadRecording`."""
    optional = {"shifting_time": "s", "run_order": "1"}
    return _conditions(_sheet(content, CONDITION_UNITS, optional, "conditions"))


@dataclass(frozen=True)
class _Sheet:
    """Columns of finite numbers (r,) by name, their headings with units, the line number of each row (r,)."""

    columns: dict[str, np.ndarray]
    headings: dict[str, str]
    lines: np.ndarray
    description: str

    def error(self, name: str, row: int, problem: str, remedy: str) -> BadRecording:
        return BadRecording(f"Row {self.lines[row]}, column '{self.headings[name]}': "
                            f"{self.columns[name][row]:g} {problem}", remedy)


def _sheet(content: bytes, required: dict[str, str], optional: dict[str, str], kind: str) -> _Sheet:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRecording(f"Byte {error.start} of the {kind} file is not valid UTF-8",
                           "Save the file in the encoding UTF-8") from error
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        description, header = _header(reader)
        units = {**required, **optional}
        known = {name if unit == "1" else f"{name} [{unit}]": name for name, unit in units.items()}
        names = _names(header, known, required)
        lines: list[int] = []
        rows: list[list[float]] = []
        for cells in reader:
            if cells:
                lines.append(reader.line_num)
                rows.append(_numbers(cells, header, reader.line_num))
                if len(rows) * len(header) > LARGEST:
                    raise BadRecording(f"The {kind} file has more than {LARGEST:,} numbers",
                                       "Reduce the sampling rate of the signals, or split the file")
    except csv.Error as error:
        raise BadRecording(f"Row {reader.line_num} is not valid CSV: {error}",
                           "Separate the cells by commas and close every quotation mark") from error
    if not rows:
        raise BadRecording(f"The {kind} file has no rows of numbers", "Add them below the row of column names")
    table = np.array(rows)
    columns = {name: table[:, column] for column, name in enumerate(names)}
    return _Sheet(columns, dict(zip(names, header, strict=True)), np.array(lines), description)


def _header(reader: Iterator[list[str]]) -> tuple[str, list[str]]:
    description: list[str] = []
    for cells in reader:
        if cells and cells[0].startswith("#"):
            description.append(",".join(cells).lstrip("# "))
        elif cells:
            return "\n".join(description), [cell.strip() for cell in cells]
    raise BadRecording("The CSV file has no row of column names", "Name the columns in the first row")


def _names(header: list[str], known: dict[str, str], required: dict[str, str]) -> list[str]:
    headings = {name: heading for heading, name in known.items()}
    for heading in header:
        if heading not in known:
            closest = get_close_matches(heading, known, n=1, cutoff=0.5)
            hint = f"Did you mean '{closest[0]}'? " if closest else ""
            raise BadRecording(f"The column '{heading[:40]}' is unknown", f"{hint}Known: {', '.join(known)}")
        if header.count(heading) > 1:
            raise BadRecording(f"The column '{heading}' appears more than once", "Give each column once")
    for name in required:
        if headings[name] not in header:
            raise BadRecording(f"The column '{headings[name]}' is missing",
                               "Add it under this name, unit included, and separate columns by commas")
    return [known[heading] for heading in header]


def _numbers(cells: list[str], header: list[str], line: int) -> list[float]:
    if len(cells) != len(header):
        raise BadRecording(f"Row {line} has {len(cells)} cells for {len(header)} columns",
                           "Give one cell per column, and use a decimal point, not a decimal comma")
    numbers = []
    for heading, cell in zip(header, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = np.nan
        if not np.isfinite(number):
            problem = f"'{cell.strip()[:40]}' is not a finite number" if cell.strip() else "the cell is empty"
            raise BadRecording(f"Row {line}, column '{heading}': {problem}",
                               "Enter a number with a decimal point, or leave out the engagement")
        numbers.append(number)
    return numbers


def _conditions(sheet: _Sheet) -> Conditions:
    paper = paper_conditions()
    profile = _integers(sheet, "current_profile")
    unknown = np.flatnonzero((profile < 0) | (profile >= len(paper.profile_time)))
    if len(unknown):
        raise sheet.error("current_profile", int(unknown[0]), "is not the number of a current profile of the paper",
                          f"Enter 0 to {len(paper.profile_time) - 1}, or give other profiles in an HDF5 file")
    order = _integers(sheet, "run_order") if "run_order" in sheet.columns else None
    try:
        return Conditions(profile, _positive(sheet, "motor_speed"), _positive(sheet, "load_inertia"),
                          _positive(sheet, "brake_torque", allow_zero=True),
                          paper.profile_time, paper.profile_current, order)
    except InvalidValue as error:
        raise BadRecording(error.cause, error.remedy) from error


def _integers(sheet: _Sheet, name: str) -> np.ndarray:
    column = sheet.columns[name]
    fractional = np.flatnonzero(column != np.round(column))
    if len(fractional):
        raise sheet.error(name, int(fractional[0]), "is not an integer", "Enter an integer, counted from 0")
    return column.astype(np.int64)


def _positive(sheet: _Sheet, name: str, allow_zero: bool = False) -> np.ndarray:
    column = sheet.columns[name]
    too_low = np.flatnonzero(column < 0 if allow_zero else column <= 0)
    if len(too_low):
        problem = "is negative" if allow_zero else "is not positive"
        raise sheet.error(name, int(too_low[0]), problem, "Check the value and its unit")
    return column


def _shifting_times(sheet: _Sheet) -> np.ndarray:
    column = _positive(sheet, "shifting_time")
    too_late = np.flatnonzero(column > HORIZON)
    if len(too_late):
        raise sheet.error("shifting_time", int(too_late[0]), f"exceeds the {HORIZON} s of an engagement",
                          "Enter seconds from the shift command, and leave out engagements that never locked")
    return column


def _signals(content: bytes, n: int) -> Signals:
    sheet = _sheet(content, {"condition": "1", "time": "s", **SIGNAL_UNITS}, {}, "signals")
    condition, time = _integers(sheet, "condition"), sheet.columns["time"]
    k = int(np.count_nonzero(condition == 0))
    if k == 0 or len(time) != n * k:
        raise BadRecording(f"The signals file has {len(time)} rows, {k} of them of condition 0, for {n} conditions",
                           "Give every condition the same number of samples, counting conditions from 0")
    for name, expected in (("condition", np.repeat(np.arange(n), k)), ("time", np.tile(time[:k], n))):
        mismatch = np.flatnonzero(sheet.columns[name] != expected)
        if len(mismatch):
            row = int(mismatch[0])
            raise sheet.error(name, row, f"instead of {expected[row]:g}",
                              "Sort the rows by condition, counted from 0, and give all conditions the same times")
    return Signals(time[:k], *(sheet.columns[name].reshape(n, k) for name in SIGNAL_UNITS))
