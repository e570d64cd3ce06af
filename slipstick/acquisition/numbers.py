"""The numbers of each engagement: from constants, file names, the sheet of conditions, or means of channels."""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.channel import Source, split_unit
from slipstick.acquisition.mapping import (
    ChannelMap,
    ChannelRef,
    Constant,
    FromColumn,
    FromName,
    NumberSource,
)
from slipstick.acquisition.mapping_file import NUMBERS
from slipstick.acquisition.tracks import Track, track
from slipstick.acquisition.units import factor_to
from slipstick.errors import BadRecording

_KEYS = ("file", "engagement")
_STARTS = 1000
"""Most shift commands that are tried where the current follows no profile."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Finds the numbers of an engagement: by the `mapping`, the rows of the `plan` and the `profiles` of the bench.

    `plan` maps (file, number of the engagement in the file) to cells by heading. `profiles` are times in s and currents
    in A, (p, k) each.
    """

    mapping: ChannelMap
    plan: Mapping[tuple[str, int], Mapping[str, str]]
    profiles: tuple[np.ndarray, np.ndarray]

    def of(self, source: Source, number: int, start: float, end: float) -> dict[str, float]:
        """All numbers of the engagement `number` of a file, from `start` to `end` in s."""
        return {name: self.number(source, number, name, one, start, end)
                for name, one in self.mapping.conditions.items()}

    def number(self, source: Source, number: int, name: str, given: NumberSource, start: float, end: float) -> float:
        """One number in the unit of the model; raises `BadRecording`."""
        unit = NUMBERS.get(name, "s")
        if isinstance(given, Constant):
            return given.value
        if isinstance(given, FromName):
            found = self.mapping.pattern.search(source.name) if self.mapping.pattern else None
            if found is None or found[given.group] is None:
                raise BadRecording(f"The name '{source.name}' does not match conditions.pattern of {self.mapping.name}",
                                   "Rename the file, correct the pattern, or leave the file out")
            return _value(found[given.group], given.unit, unit, f"'{given.group}' in the name '{source.name}'")
        if isinstance(given, FromColumn):
            return self._cell(source.name, number, given, unit)
        if name == "current_profile":
            return float(self._nearest_profile(source, given, start, end))
        mean = np.nanmean(_inside(source, given, self.mapping, unit, start, end).values)
        return float(mean)

    def _cell(self, file: str, number: int, given: FromColumn, unit: str) -> float:
        row = self.plan.get((file, number))
        if row is None:
            raise BadRecording(f"{self.mapping.plan} has no row for engagement {number} of {file}",
                               "Add a row with this name in the column 'file', and the number in 'engagement' where a "
                               "file has several")
        named = {split_unit(heading)[0]: (split_unit(heading)[1], cell) for heading, cell in row.items()}
        if given.column not in named:
            raise BadRecording(f"{self.mapping.plan} has no column '{given.column}'",
                               f"It has {', '.join(named)}: correct the mapping")
        stated, cell = named[given.column]
        where = f"The column '{given.column}' of {self.mapping.plan}, row of {file}"
        return _value(cell, given.unit or stated, unit, where)

    def _nearest_profile(self, source: Source, given: ChannelRef, start: float, end: float) -> int:
        """The current profile that the measured current follows; refused where no profile is clearly nearest."""
        best, away, apart = self._follows(_inside(source, given, self.mapping, "A", start, end), start)
        if away < apart:
            return best
        # From another instant on, it may follow one; of the end of an engagement, too little is left to tell.
        whole = _inside(source, given, self.mapping, "A", start - float(self.profiles[0].max()), end).known()
        starts = whole.time[:len(whole.time) // 2 + 1]
        tried = [(self._follows(whole.between(one, end), one), one) for one in starts[::len(starts) // _STARTS + 1]]
        (other, off, limit), begin = min(tried, key=lambda one: one[0][1] - one[0][2])
        raise BadRecording(
            f"The current '{given.channel}' of {source.name} follows no current profile of the bench: from the shift "
            f"command at {start:.4g} s on, it is {away:.3g} A off profile {best}, the nearest",
            f"Correct [shift_command]: from {begin:.3g} s on, the current follows profile {other}" if off < limit else
            "Check its unit and the shift command, or add the profile to the bench")

    def _follows(self, measured: Track, start: float) -> tuple[int, float, float]:
        """The profile nearest to a current, its root mean square distance in A, and that from which on it is another.
        """
        measured = measured.known()
        currents = np.array([np.interp(measured.time - start, time, current)
                             for time, current in zip(*self.profiles, strict=True)])
        away = _rms(currents - measured.values)
        best, *others = np.argsort(away)
        # Half of the way to another profile, or the spread of the current where there is no other one.
        apart = 0.5 * _rms(currents[others] - currents[best]).min() if others else float(np.std(currents[best]))
        return int(best), float(away[best]), float(apart)


def read_plan(content: bytes, name: str) -> dict[tuple[str, int], dict[str, str]]:
    """The sheet of conditions: rows by the columns `file` and `engagement` (0 where absent); raises `BadRecording`."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRecording(f"Byte {error.start} of {name} is not UTF-8", "Save the sheet as UTF-8") from None
    lines = text.splitlines()
    separator = ";" if lines and ";" in lines[0] else "\t" if lines and "\t" in lines[0] else ","
    reader = csv.DictReader(io.StringIO(text), delimiter=separator)
    if "file" not in (reader.fieldnames or ()):
        raise BadRecording(f"{name} has no column 'file'", "Name the file of each row in a column 'file'")
    rows: dict[tuple[str, int], dict[str, str]] = {}
    for row in reader:
        number = (row.get("engagement") or "0").strip()
        if None in row or None in row.values() or not number.isdigit():
            raise BadRecording(f"Row {reader.line_num} of {name} does not have one cell for each column",
                               "Give as many cells as the first row has, and a whole number as `engagement`")
        key = row["file"].strip(), int(number)
        if key in rows:
            raise BadRecording(f"Row {reader.line_num} of {name} is a second one for engagement {key[1]} of {key[0]}",
                               "Give each engagement one row")
        rows[key] = {heading: cell for heading, cell in row.items() if heading not in _KEYS}
    return rows


def _inside(source: Source, given: ChannelRef, mapping: ChannelMap, unit: str, start: float, end: float) -> Track:
    found = track(source, given, mapping.time, unit).between(start, end)
    if not np.any(np.isfinite(found.values)):
        raise BadRecording(f"The channel '{given.channel}' of {source.name} has no values from {start:g} to {end:g} s",
                           "Map another channel, or leave the file out")
    return found


def _rms(values: np.ndarray) -> np.ndarray:
    """Root mean squares (p,) of rows (p, k)."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=1)))


def _value(text: str, written: str, unit: str, where: str) -> float:
    try:
        number = float(text.strip().replace(",", "."))
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise BadRecording(f"{where}: it is '{text.strip()[:40]}', not a number", "Correct it, or leave the file out")
    return number * factor_to(unit, written, where) if unit != "1" or written else number
