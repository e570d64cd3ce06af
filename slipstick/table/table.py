"""A table of shifting times over parameter multipliers: the interface between worker and service.

There are two kinds. `Grid` (grid.py) stores the times at the points of a grid, for a few axes; `Surrogate`
(surrogate.py) stores a network trained on simulations, for any number of axes. Both are used in the same way.
"""

from abc import ABC, abstractmethod
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, ClassVar, Literal, Self
from weakref import WeakKeyDictionary

import h5py
import numpy as np

from slipstick.black_box import BlackBoxDescription, Quantity
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue, WrongDigest, WrongLayout, quoted
from slipstick.storage.files import replacing
from slipstick.storage.hdf5 import Source
from slipstick.table import store
from slipstick.table.axis import Axis, box
from slipstick.table.derivatives import Derivatives
from slipstick.table.points import Outside, clip_points
from slipstick.table.subject import Setting, Subject, described, keys, output_of


class Table(ABC):
    """Shifting times over d `axes` for n `conditions` and one `model`; `origin` describes how they were computed."""

    kind: ClassVar[Literal["grid", "surrogate"]]
    layout: ClassVar[str]
    """Value of the attribute `layout` of the file; the version of the layout is `store.LAYOUT_VERSION`."""

    axes: tuple[Axis, ...]
    conditions: Setting
    model: Subject
    origin: str

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Read and verify the table at `path`: of any kind for `Table.open`, of one kind for `Grid.open`.

        Raises `UnknownName` if the file does not exist, `WrongLayout`, `CorruptTable` or `WrongDigest`.
        """
        with store.open_source(Path(path)) as source:
            return cls.of(source)

    @classmethod
    def of(cls, source: Source) -> Self:
        """Read and verify the table in an open file; raises as `open`."""
        kinds = {kind.layout: kind for kind in (cls, *cls.__subclasses__()) if hasattr(kind, "layout")}
        layout = source.attribute("", "layout") if "layout" in source.file.attrs else "none"
        if layout not in kinds:
            holds = "holds recordings, and is no table" if source.has("shifting_time") else "is not a table"
            raise WrongLayout(f"The file {holds} of the kind {' or '.join(k.kind for k in kinds.values())}",
                              "Give a table written by `slipstick build` or `slipstick surrogate`")
        try:
            table = kinds[layout]._read(source, **store.read_header(source))
        except InvalidValue as error:
            raise CorruptTable(error.cause, store.REBUILD) from error
        stored_digest = source.attribute("", "content_digest")
        if table.digest != stored_digest:
            raise WrongDigest("The content of the table does not match the digest stored in the file",
                              "Restore the file from a backup or build the table again")
        return table

    def save(self, path: Path | str) -> Path:
        """Write the table to `path`, as a whole or not at all, and return the path.

        Raises `InvalidValue` unless it ends in `.h5`.
        """
        path = Path(path)
        if path.suffix != ".h5" or path.is_dir():
            raise InvalidValue(f"'{path}' is not the name of a table", "End it in .h5")
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            self.write_to(temporary)
            if type(self).open(temporary).digest != self.digest:
                raise CorruptTable(f"'{path}' was not read back as it was written", "Check the disk")
        return path

    def write_to(self, target: Path | BinaryIO) -> None:
        """Write the table to a file that does not exist, or to an open empty one."""
        # HDF5 has checksums of its metadata since version 1.10.
        with h5py.File(target, "w", libver=("v110", "v110")) as file:
            store.write_header(file, self.layout, self.digest, self.origin, self.axes, self.conditions, self.model)
            self._write(file)

    def __getstate__(self) -> dict[str, Any]:
        """Omit cached values when the table is pickled for another process."""
        return {name: value for name, value in vars(self).items() if name not in ("digest", "_restricted")}

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the content: the same digest means the same numbers, model and conditions."""
        return store.content_digest(self.layout, self.axes, self._arrays, self.conditions, self.model)

    @property
    def output(self) -> Quantity:
        """Name and unit of the values: the shifting time in s, or the output of another machine."""
        return output_of(self.model)

    @property
    def clutch(self) -> Model:
        """The model of a clutch; raises `InvalidValue` for a table of another machine."""
        if isinstance(self.model, BlackBoxDescription):
            raise InvalidValue(f"The table is one of another machine: {self.model.title}",
                               "Give a table of a clutch, built with `slipstick build --bench`, or omit `bench`")
        return self.model

    @property
    def lower(self) -> np.ndarray:
        """Smallest multiplier of each axis, (d,)."""
        return box(self.axes)[0]

    @property
    def upper(self) -> np.ndarray:
        """Largest multiplier of each axis, (d,)."""
        return box(self.axes)[1]

    @property
    @abstractmethod
    def knots(self) -> tuple[np.ndarray, ...] | None:
        """Multipliers of each axis between which the times are linear in it; None if the times are smooth."""

    @abstractmethod
    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """Shifting times in s of all n conditions at `points` (m, d), multipliers in the order of the axes: (m, n).

        A time is NaN where it is undefined. Raises `InvalidValue` and `OutsideTable`.
        """

    def derivatives(self, point: np.ndarray, outside: Outside = "clip") -> Derivatives:
        """Values and exact derivatives at `point` (d,), in multipliers; raises `InvalidValue` and `OutsideTable`.

        Beyond an edge, a clipped value does not change with the multiplier of that axis.
        """
        clipped, inside = clip_points(self.axes, point[None], outside)
        derivatives = self._derivatives(clipped[0]).along(inside[0].astype(float))
        if outside == "nan" and not inside.all():
            return Derivatives(*(np.full(array.shape, np.nan) for array in vars(derivatives).values()))
        return derivatives

    def __call__(self, points: np.ndarray, conditions: Setting) -> np.ndarray:
        """Shifting times in s of n `conditions` at `points` (m, d), which are clipped to the table: (m, n).

        The conditions may be any of those of the table, in any order; raises `InvalidValue` for others.
        """
        return self.restricted(conditions).interpolate(points)

    def restricted(self, conditions: Setting) -> Self:
        """Return the table of only `conditions`, matched by value; raises `InvalidValue` for others."""
        if conditions is self.conditions:
            return self
        if conditions not in self._restricted:
            rows = self._rows(conditions)
            unchanged = len(rows) == len(self.conditions) and bool(np.all(rows == np.arange(len(rows))))
            self._restricted[conditions] = self if unchanged else self._take(rows)
        return self._restricted[conditions]

    @cached_property
    def _restricted(self) -> WeakKeyDictionary[Setting, Self]:
        return WeakKeyDictionary()

    @abstractmethod
    def _derivatives(self, point: np.ndarray) -> Derivatives:
        """As `derivatives`, at a point inside the table."""

    @property
    @abstractmethod
    def _arrays(self) -> tuple[np.ndarray, ...]:
        """All arrays of the content except axes and conditions, for the digest."""

    @abstractmethod
    def _take(self, rows: np.ndarray) -> Self:
        """The table of only the conditions at these indices."""

    @abstractmethod
    def _write(self, file: h5py.File) -> None:
        """Write everything except the header."""

    @classmethod
    @abstractmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Setting, model: Subject, origin: str) -> Self:
        """Read what `_write` wrote; raises the errors of `source`, and `InvalidValue` for inconsistent fields."""

    def _check(self) -> None:
        names = [axis.name for axis in self.axes]
        if not names or len(set(names)) < len(names) or not len(self.conditions):
            raise InvalidValue(f"A table of {len(self.conditions)} conditions has the axes "
                               f"{', '.join(map(quoted, names)) or 'none'}",
                               "Give at least one condition and one axis, and each parameter once")

    def _rows(self, conditions: Setting) -> np.ndarray:
        known = {key: row for row, key in enumerate(keys(self.conditions, self.model.uses_run_order))}
        rows = [known.get(key, -1) for key in keys(conditions, self.model.uses_run_order)]
        if -1 in rows:
            row = rows.index(-1)
            raise InvalidValue(f"Condition {row} (counted from 0: {described(conditions, row)}) "
                               "is not in the table" + " at its position in the run order" * self.model.uses_run_order,
                               "Build a table under the conditions of these recordings, or leave this one out")
        return np.array(rows, dtype=np.int64)

