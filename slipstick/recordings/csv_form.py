"""Recordings as CSV: one row a condition, and if there are signals a second file in long form.

The first row names the columns with their units: `current_profile` (0 to 5, a profile of the paper's
conditions), `motor_speed [rad/s]`, `load_inertia [kg m^2]`, `brake_torque [N m]`, `shifting_time [s]` and
optionally `run_order`. The second file has `condition` (its place in the first, from 0), `time [s]`,
`pressure [bar]`, `input_speed [rad/s]`, `output_speed [rad/s]`, `output_torque [N m]`: condition after
condition, all with the same times. Lines before the first row that begin with # describe the recordings.
Errors count rows as an editor counts lines, from 1.
"""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from slipstick.clutch.conditions import HORIZON, Conditions, paper_conditions
from slipstick.errors import BadRecording, InvalidValue
from slipstick.recordings.hdf5_form import Fields
from slipstick.recordings.signals import LARGEST, SIGNAL_UNITS, Signals
from slipstick.storage.condition_layout import CONDITION_UNITS


def read(content: bytes, signals: bytes | None) -> Fields:
    """Read the conditions and shifting times in `content` and the `signals`; raises `BadRecording`."""
    sheet = _sheet(content, {**CONDITION_UNITS, "shifting_time": "s"}, {"run_order": "1"}, "recordings")
    conditions = _conditions(sheet)
    measured = _shifting_time(sheet)
    found = None if signals is None else _signals(signals, len(measured))
    return conditions, measured, found, conditions.run_order, sheet.remarks


def read_conditions(content: bytes) -> Conditions:
    """Read only the conditions, from a CSV with or without shifting times; raises `BadRecording`."""
    optional = {"shifting_time": "s", "run_order": "1"}
    return _conditions(_sheet(content, CONDITION_UNITS, optional, "conditions"))


@dataclass(frozen=True)
class _Sheet:
    """Columns of finite numbers (r,) by name, their headings, and the line of each row."""

    columns: dict[str, np.ndarray]
    headings: dict[str, str]
    lines: np.ndarray
    remarks: str

    def refusal(self, name: str, row: int, says: str, remedy: str) -> BadRecording:
        return BadRecording(f"Row {self.lines[row]}, column '{self.headings[name]}': "
                            f"{self.columns[name][row]:g} {says}", remedy)


def _sheet(content: bytes, required: dict[str, str], optional: dict[str, str], what: str) -> _Sheet:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRecording(f"Byte {error.start} of the {what} is not UTF-8", "Save as UTF-8") from error
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        remarks, heading = _heading(reader)
        every = {**required, **optional}
        known = {name if unit == "1" else f"{name} [{unit}]": name for name, unit in every.items()}
        names = _names(heading, known, required)
        lines: list[int] = []
        rows: list[list[float]] = []
        for cells in reader:
            if cells:
                lines.append(reader.line_num)
                rows.append(_numbers(cells, heading, reader.line_num))
                if len(rows) * len(heading) > LARGEST:
                    raise BadRecording(f"There are more than {LARGEST:,} numbers", "Thin out the signals")
    except csv.Error as error:
        raise BadRecording(f"Row {reader.line_num} is not CSV: {error}", "Separate by commas") from error
    if not rows:
        raise BadRecording(f"There is no row of {what}", "Give them below the names of the columns")
    table = np.array(rows)
    columns = {name: table[:, column] for column, name in enumerate(names)}
    return _Sheet(columns, dict(zip(names, heading, strict=True)), np.array(lines), remarks)


def _heading(reader: Iterator[list[str]]) -> tuple[str, list[str]]:
    remarks: list[str] = []
    for cells in reader:
        if cells and cells[0].startswith("#"):
            remarks.append(",".join(cells).lstrip("# "))
        elif cells:
            return "\n".join(remarks), [cell.strip() for cell in cells]
    raise BadRecording("The CSV file has no row", "Name the columns in the first row")


def _names(heading: list[str], known: dict[str, str], required: dict[str, str]) -> list[str]:
    wanted = {name: column for column, name in known.items()}
    for column in heading:
        if column not in known:
            near = get_close_matches(column, known, n=1, cutoff=0.5)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            raise BadRecording(f"The column '{column[:40]}' is unknown", f"{hint}Known: {', '.join(known)}")
    for name in required:
        if wanted[name] not in heading:
            raise BadRecording(f"The column '{wanted[name]}' is missing",
                               "Name it in the first row, unit included, and separate columns by commas")
    if len(set(heading)) < len(heading):
        raise BadRecording("A column appears twice", "Give each once")
    return [known[column] for column in heading]


def _numbers(cells: list[str], heading: list[str], line: int) -> list[float]:
    if len(cells) != len(heading):
        raise BadRecording(f"Row {line} has {len(cells)} cells for {len(heading)} columns",
                           "Give every row one cell a column")
    numbers = []
    for column, cell in zip(heading, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = np.nan
        if not np.isfinite(number):
            says = f"'{cell.strip()[:40]}' is not a finite number" if cell.strip() else "the cell is empty"
            raise BadRecording(f"Row {line}, column '{column}': {says}",
                               "Give a number with a decimal point, or leave the whole row out")
        numbers.append(number)
    return numbers


def _conditions(sheet: _Sheet) -> Conditions:
    paper = paper_conditions()
    profile = _whole(sheet, "current_profile")
    beyond = np.flatnonzero((profile < 0) | (profile >= len(paper.profile_time)))
    if len(beyond):
        raise sheet.refusal("current_profile", int(beyond[0]), "is none of the paper's profiles",
                            f"Number them 0 to {len(paper.profile_time) - 1}; give others in an HDF5 file")
    order = _whole(sheet, "run_order") if "run_order" in sheet.columns else None
    try:
        return Conditions(profile, _positive(sheet, "motor_speed"), _positive(sheet, "load_inertia"),
                          _positive(sheet, "brake_torque", zero=True),
                          paper.profile_time, paper.profile_current, order)
    except InvalidValue as error:
        raise BadRecording(error.cause, error.remedy) from error


def _whole(sheet: _Sheet, name: str) -> np.ndarray:
    column = sheet.columns[name]
    broken = np.flatnonzero(column != np.round(column))
    if len(broken):
        raise sheet.refusal(name, int(broken[0]), "is not a whole number", "Count from 0")
    return column.astype(np.int64)


def _positive(sheet: _Sheet, name: str, zero: bool = False) -> np.ndarray:
    column = sheet.columns[name]
    low = np.flatnonzero(column < 0 if zero else column <= 0)
    if len(low):
        says = "is negative" if zero else "is not positive"
        raise sheet.refusal(name, int(low[0]), says, "Check the column and its unit")
    return column


def _shifting_time(sheet: _Sheet) -> np.ndarray:
    column = _positive(sheet, "shifting_time")
    late = np.flatnonzero(column > HORIZON)
    if len(late):
        raise sheet.refusal("shifting_time", int(late[0]), f"is beyond the {HORIZON} s of an engagement",
                            "Give seconds from the shift command, and leave out what did not lock")
    return column


def _signals(content: bytes, n: int) -> Signals:
    sheet = _sheet(content, {"condition": "1", "time": "s", **SIGNAL_UNITS}, {}, "signals")
    condition, time = _whole(sheet, "condition"), sheet.columns["time"]
    k = int(np.count_nonzero(condition == 0))
    if k == 0 or len(time) != n * k:
        raise BadRecording(f"There are {len(time)} rows of signals, {k} of condition 0, for {n} conditions",
                           "Give every condition the same number of samples")
    for name, expected in (("condition", np.repeat(np.arange(n), k)), ("time", np.tile(time[:k], n))):
        other = np.flatnonzero(sheet.columns[name] != expected)
        if len(other):
            row = int(other[0])
            raise sheet.refusal(name, row, f"where {expected[row]:g} is due",
                                "Give condition after condition, counted from 0, each with the same times")
    return Signals(time[:k], *(sheet.columns[name].reshape(n, k) for name in SIGNAL_UNITS))
