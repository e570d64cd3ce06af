"""The numbers of each experiment: from constants, file names, the sheet of conditions, or means of channels."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.acquisition.channel import Source
from slipstick.acquisition.mapping import (
    ChannelRef,
    Constant,
    FileMap,
    FromColumn,
    FromName,
    NumberSource,
)
from slipstick.acquisition.names import Names
from slipstick.acquisition.tracks import Track, track
from slipstick.acquisition.units import convert_to, split_unit
from slipstick.errors import BadRecording
from slipstick.storage.cells import number

_STARTS = 1000
"""Most shift commands that are tried where the current follows no profile."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Finds the numbers of an experiment: by the `mapping` and the rows of the `plan`, in `units` by their names.

    A bench has `profiles` of current: times in s and currents in A, (p, k) each.
    """

    mapping: FileMap
    plan: "Plan | None"
    units: Mapping[str, str]
    profiles: tuple[np.ndarray, np.ndarray] | None = None

    def of(self, source: Source, place: int, start: float, end: float) -> dict[str, float]:
        """All numbers of an experiment, counted in its file, from `start` to `end` in s."""
        return {name: self.number(source, place, name, given, start, end)
                for name, given in self.mapping.conditions.items()}

    def number(self, source: Source, place: int, name: str, given: NumberSource, start: float, end: float) -> float:
        """One number in the unit of the model; raises `BadRecording`."""
        unit = self.units[name]
        if isinstance(given, Constant):
            return given.value
        if isinstance(given, FromName):
            match = self.mapping.pattern.search(source.name) if self.mapping.pattern else None
            if match is None or match[given.group] is None:
                raise BadRecording(f"The name '{source.name}' does not match conditions.pattern of {self.mapping.name}",
                                   "Rename the file, correct the pattern, or leave the file out")
            text = match[given.group]
            return _value(text, "," if "," in text else ".", given.unit, unit,
                          f"'{given.group}' in the name '{source.name}'")
        if isinstance(given, FromColumn):
            return self._cell(source.name, place, given, unit)
        if name == "current_profile" and self.profiles is not None:
            return float(self._nearest_profile(source, given, self.profiles, start, end))
        channel = source.channel(given.channel)
        if len(channel.values) == 1:  # a constant that a file has beside its channels
            where = f"The channel '{given.channel}' of {source.name}"
            return given.sign * float(convert_to(unit, given.unit or channel.unit, channel.values, where)[0])
        return float(np.nanmean(_read_between(source, given, self.mapping, unit, start, end).values))

    def _cell(self, file: str, place: int, given: FromColumn, unit: str) -> float:
        plan, word = self.plan, self.mapping.experiment
        key = file, place if plan is not None and plan.counted else 0
        if plan is None or key not in plan.rows:
            raise BadRecording(f"{self.mapping.plan} has no row for {word} {place} of {file}",
                               f"Add a row with this name in the column 'file', and the number in '{word}' where a "
                               "file has several")
        column = plan.names.position(given.column)
        written = given.unit or split_unit(plan.headings[column])[1]
        return _value(plan.rows[key][column], plan.decimal, written, unit,
                      f"The column '{given.column}' of {plan.name}, row of {file}")

    def _nearest_profile(self, source: Source, given: ChannelRef, profiles: tuple[np.ndarray, np.ndarray],
                         start: float, end: float) -> int:
        """The current profile that the measured current follows; refused where no profile is clearly nearest."""
        best, away, apart = _follow(profiles, _read_between(source, given, self.mapping, "A", start, end), start)
        if away < apart:
            return best
        # From another instant on, it may follow one; of the end of an engagement, too little is left to tell.
        whole = _read_between(source, given, self.mapping, "A", start - float(profiles[0].max()), end).known()
        starts = whole.time[:len(whole.time) // 2 + 1]
        tried = [(_follow(profiles, whole.between(begin, end), begin), begin)
                 for begin in starts[::len(starts) // _STARTS + 1]]
        (other, off, limit), begin = min(tried, key=lambda candidate: candidate[0][1] - candidate[0][2])
        raise BadRecording(
            f"The current '{given.channel}' of {source.name} follows no current profile of the bench: from the shift "
            f"command at {start:.4g} s on, it is {away:.3g} A off profile {best}, the nearest",
            f"Correct [shift_command], or leave the file out where its trigger alone is off: from {begin:.3g} s on, "
            f"the current follows profile {other}" if off < limit else
            "Check its unit and the shift command, add the profile to the bench, or leave the file out")


def _follow(profiles: tuple[np.ndarray, np.ndarray], measured: Track, start: float) -> tuple[int, float, float]:
    """The profile nearest to a current, its root mean square distance in A, and that from which on it is another."""
    measured = measured.known()
    currents = np.array([np.interp(measured.time - start, time, current)
                         for time, current in zip(*profiles, strict=True)])
    away = _rms(currents - measured.values)
    best, *others = np.argsort(away)
    # Half of the way to another profile, or the spread of the current where there is no other one.
    apart = 0.5 * _rms(currents[others] - currents[best]).min() if others else float(np.std(currents[best]))
    return int(best), float(away[best]), float(apart)


@dataclass(frozen=True, eq=False)
class Plan:
    """The sheet of conditions `name`: its `headings`, their unique `names`, and the cells of each row.

    `rows` maps (file, number of the experiment in the file, 0 where it is not stated) to cells, whose numbers have the
    sign `decimal`. Where experiments are not `counted`, the row of a file is that of all in it.
    """

    name: str
    headings: tuple[str, ...]
    names: Names
    rows: Mapping[tuple[str, int], Sequence[str]]
    decimal: str
    counted: bool

    @classmethod
    def read(cls, content: bytes, name: str, word: str) -> "Plan":
        """Read the bytes of a sheet, in which the column `word` counts the experiments; raises `BadRecording`."""
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise BadRecording(f"Byte {error.start} of {name} is not UTF-8", "Save the sheet as UTF-8") from None
        separator = next((sign for sign in ";\t" if sign in text.partition("\n")[0]), ",")
        reader = csv.reader(io.StringIO(text), delimiter=separator)
        headings = [cell.strip() for cell in next(reader, [])]
        if "file" not in headings:
            raise BadRecording(f"{name} has no column 'file'", "Name the file of each row in a column 'file'")
        names = Names.of_headings(name, headings, [str(place + 1) for place in range(len(headings))])
        file = names.position("file")
        counted = names.position(word) if word in headings else None
        rows: dict[tuple[str, int], Sequence[str]] = {}
        for cells in filter(any, reader):
            place = "0" if counted is None or counted >= len(cells) else cells[counted].strip() or "0"
            if len(cells) != len(headings) or not place.isdigit():
                raise BadRecording(f"Row {reader.line_num} of {name} does not have one cell for each column",
                                   f"Give as many cells as the first row has, and a whole number as `{word}`")
            key = cells[file].strip(), int(place)
            if key in rows:
                raise BadRecording(f"Row {reader.line_num} of {name} is a second one for {word} {key[1]} of {key[0]}",
                                   f"Give each {word} one row")
            rows[key] = cells
        with_comma = separator != "," and any("," in cell and number(cell, ",") is not None
                                              for cells in rows.values() for cell in cells)
        return cls(name, tuple(headings), names, rows, "," if with_comma else ".", counted is not None)


def _read_between(source: Source, given: ChannelRef, mapping: FileMap, unit: str, start: float, end: float) -> Track:
    channel = track(source, given, mapping.time, unit).between(start, end)
    if not np.any(np.isfinite(channel.values)):
        raise BadRecording(f"The channel '{given.channel}' of {source.name} has no values from {start:g} to {end:g} s",
                           "Map another channel, or leave the file out")
    return channel


def _rms(values: np.ndarray) -> np.ndarray:
    """Root mean squares (p,) of rows (p, k)."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=1)))


def _value(text: str, decimal: str, written: str, unit: str, where: str) -> float:
    value = number(text, decimal)
    if value is None or not np.isfinite(value):
        raise BadRecording(f"{where}: it is '{text.strip()[:40]}', not a number with a decimal "
                           f"{'comma' if decimal == ',' else 'point'}", "Correct it, or leave the file out")
    return float(convert_to(unit, written, np.array(value), where))
