"""What functions on tables take and return: a table or its file, axes, conditions as columns, and numbers as JSON."""

import csv
import io
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Self, get_args

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.conditions import CONDITION_UNITS
from slipstick.black_box import BlackBox, BlackBoxDescription, Measurements, measure_runs
from slipstick.errors import InvalidValue, UnknownName
from slipstick.inference.problems import Measured
from slipstick.interface.frames import data_frame
from slipstick.interface.models import describe
from slipstick.interface.result import Result
from slipstick.machine import Runs, holds_runs, read_runs
from slipstick.pictures.conditions import described
from slipstick.recordings import Recordings
from slipstick.table import Outside, Table
from slipstick.table.subject import Setting, columns
from slipstick.uncertainty import Inputs

TableLike = Table | Path | str
"""A table, or the path of its file."""


def open_table(given: TableLike) -> Table:
    """The table that is `given`, or that of a file; raises `InvalidValue`, `UnknownName` and `BadTable`."""
    table = Table.open(given) if isinstance(given, Path | str) else given
    if not isinstance(table, Table):
        raise InvalidValue(f"{describe(given)} is not a table",
                           "Give a table, such as `slipstick.build` returns, or the path of its file")
    return table


def measured_of(given: Measured | Runs | Path | str, simulator: Table | Bench | BlackBox) -> Measured:
    """Recordings or measurements that are `given` or in a file, or what runs of a black box measure.

    What a file has depends on what the `simulator` is of. Raises `InvalidValue`, `UnknownName` and `BadRecording`.
    """
    measured = _open_measured(Path(given), simulator) if isinstance(given, Path | str) else given
    if isinstance(measured, Runs) and isinstance(simulator, BlackBox):
        return measure_runs(measured, simulator)
    if not isinstance(measured, Recordings | Measurements):
        raise InvalidValue(f"{describe(given)} is not recordings",
                           "Give Recordings, their name or path, or Measurements of a black box, those of runs by "
                           "slipstick.black_box.measure_runs")
    return measured


def _open_measured(path: Path, simulator: Table | Bench | BlackBox) -> Recordings | Measurements | Runs:
    if isinstance(simulator, Bench):
        return Recordings.open(path, profiles=simulator.profiles)
    machine = simulator.model if isinstance(simulator, Table) else simulator.description
    if not isinstance(machine, BlackBoxDescription):
        return Recordings.open(path)
    return read_runs(path) if holds_runs(path) else Measurements.open(path, machine)


def table_name(given: TableLike) -> str:
    """The name of a table in reports: that of its file, if it was given as one."""
    return Path(given).stem if isinstance(given, Path | str) else "table"


def require_outside(outside: str) -> None:
    """Raise `UnknownName` for a policy that does not exist."""
    if outside not in get_args(Outside):
        raise UnknownName.of("policy for points outside the table,", str(outside), get_args(Outside))


def axes_of(table: Table) -> list[dict[str, Any]]:
    """The axes of a table as JSON: name, and what the multiple 1 stands for."""
    return [{"name": axis.name, "nominal": axis.nominal, "unit": axis.unit} for axis in table.axes]


def inputs_of(inputs: Inputs) -> dict[str, Any]:
    """Inputs as JSON, as the REST service takes them."""
    given = {name: getattr(inputs, name) for name in ("mean", "std", "correlation", "support", "mixing")}
    return {**{name: None if value is None else value.tolist() for name, value in given.items()},
            "families": list(inputs.families)}


@lru_cache(maxsize=64)
def descriptions(conditions: Setting) -> tuple[str, ...]:
    """All conditions of a table or of recordings in words."""
    given = columns(conditions)
    return tuple(described(given, place) for place in range(len(conditions)))


def condition_columns(conditions: Mapping[str, Sequence[Any] | None]) -> dict[str, Sequence[Any]]:
    """The columns of conditions under headings with units; those of another machine have them already."""
    return {f"{name} [{unit}]" if (unit := CONDITION_UNITS.get(name, "1")) != "1" else name: column
            for name, column in conditions.items() if column is not None}


def list_finite(values: np.ndarray) -> list[Any]:
    """An array as nested lists, with None for numbers that are not finite, which JSON does not have."""
    entries = values.astype(object)
    entries[~np.isfinite(values)] = None
    listed: list[Any] = entries.tolist()
    return listed


def numbers(values: Sequence[Any], missing: float = np.nan) -> np.ndarray:
    """Nested lists as an array, with `missing` for None."""
    array = np.array(values, dtype=float)
    return np.where(np.isnan(array), missing, array)


def take_entries(values: Mapping[str, Any], names: Sequence[str], kind: str) -> dict[str, Any]:
    """The entries `names` of a saved result; raises `InvalidValue` where it is incomplete."""
    missing = [name for name in names if name not in values]
    if missing:
        raise InvalidValue(f"The {kind} is incomplete: it has no `{missing[0]}`", "Give a file that `save` wrote")
    return {name: values[name] for name in names}


@dataclass(frozen=True, eq=False, repr=False)
class TableAnswer(Result):
    """A result about a table: the `answer` of the REST service as JSON, and what the picture needs beside it.

    `output` is the name and unit of the output, `request` what was asked for, and `condition_columns` are conditions.
    """

    entries: ClassVar[tuple[str, ...]]
    """Names of the entries of the answer."""

    answer: dict[str, Any]
    output: Mapping[str, str]
    request: Mapping[str, Any]
    condition_columns: Mapping[str, Sequence[float]]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the d uncertain inputs."""
        return tuple(axis["name"] for axis in self.answer["axes"])

    @property
    @abstractmethod
    def columns(self) -> dict[str, list[Any]]:
        """Heading with unit -> the values of a column."""

    def to_frame(self) -> Any:
        """The columns as a data frame."""
        return data_frame(self.columns)

    def to_dict(self) -> dict[str, Any]:
        """The answer of the REST service, and the other fields beside it."""
        return {**self.answer, **{name: getattr(self, name) for name in self._beside()}}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The result whose `to_dict` is `values`; raises `InvalidValue`."""
        return cls(take_entries(values, cls.entries, cls.kind), **take_entries(values, cls._beside(), cls.kind))

    @classmethod
    def _beside(cls) -> list[str]:
        return [field.name for field in fields(cls) if field.name != "answer"]


def csv_text(columns: Mapping[str, Iterable[Any]]) -> str:
    """Columns of equal length as CSV, with headings; an entry without a value is empty."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    rows.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()
