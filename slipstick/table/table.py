"""The table: shifting times over parameter multipliers, the contract between worker and service.

There are two kinds: `Grid` (grid.py) holds the times at the points of a grid, for a few axes; `Surrogate`
(surrogate.py) holds a network trained on simulations, for as many axes as one likes. Who uses a table need not know.
"""

from abc import ABC, abstractmethod
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, Self
from weakref import WeakKeyDictionary

import h5py
import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue, WrongDigest, WrongLayout
from slipstick.storage.files import replacing
from slipstick.storage.hdf5 import Source
from slipstick.table import store
from slipstick.table.axis import Axis, box
from slipstick.table.points import Outside


class Table(ABC):
    """Shifting times over d `axes` for n `conditions` of one `model`; `origin` says who computed it and how."""

    kind: ClassVar[Literal["grid", "surrogate"]]
    layout: ClassVar[str]
    """What the file says it is; its version is `store.LAYOUT_VERSION`."""

    axes: tuple[Axis, ...]
    conditions: Conditions
    model: Model
    origin: str

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Read and verify the table at `path`, of any kind, or of this one where called on a kind.

        Raises `UnknownName` where there is none, `WrongLayout`, `CorruptTable` or `WrongDigest`.
        """
        kinds = {kind.layout: kind for kind in (cls, *cls.__subclasses__()) if hasattr(kind, "layout")}
        with store.opened(Path(path)) as source:
            layout = source.attribute("", "layout") if "layout" in source.file.attrs else "none"
            if layout not in kinds:
                raise WrongLayout(f"The file is not a table of the kind {' or '.join(k.kind for k in kinds.values())}",
                                  "Give a table that `worker build` or `worker surrogate` wrote")
            try:
                table = kinds[layout]._read(source, **store.read_header(source))
            except InvalidValue as error:
                raise CorruptTable(error.cause, store.REBUILD) from error
            stated = source.attribute("", "content_digest")
        if table.digest != stated:
            raise WrongDigest("The content of the table does not have the digest that the file states",
                              "Restore it from a copy or build it again")
        return table

    def write(self, path: Path | str) -> None:
        """Put the table at `path`: written under a temporary name, verified, synced and renamed."""
        with replacing(Path(path)) as temporary:
            # from 1.10 on HDF5 checksums its metadata
            with h5py.File(temporary, "w", libver=("v110", "v110")) as file:
                store.write_header(file, self.layout, self.digest, self.origin, self.axes, self.conditions, self.model)
                self._write(file)
            if type(self).open(temporary).digest != self.digest:
                raise CorruptTable(f"'{path}' did not come back as it was written", "Check the disk")

    def __getstate__(self) -> dict[str, Any]:
        """Travel to another process without what is remembered here."""
        return {name: value for name, value in vars(self).items() if name not in ("digest", "_restricted")}

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the content: the same digest means the same numbers, model and conditions."""
        return store.content_digest(self.layout, self.axes, self._arrays, self.conditions, self.model)

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
        """Multipliers of each axis between which times are linear in it; None where they are smooth throughout."""

    @abstractmethod
    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """Shifting times in s of all n conditions at `points` (m, d), multipliers in axis order: (m, n).

        NaN where there is no time. Raises `InvalidValue` and `OutsideTable`.
        """

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        """Shifting times in s of `conditions` (n,) at `points` (m, d): (m, n), clipped at the table's edge.

        The conditions may be any of the table's, in any order; raises `InvalidValue` on others.
        """
        return self.restricted(conditions).interpolate(points)

    def restricted(self, conditions: Conditions) -> Self:
        """Return the table of only `conditions`, found by what they are; raises `InvalidValue` on others."""
        if conditions is self.conditions:
            return self
        if conditions not in self._restricted:
            rows = self._rows(conditions)
            whole = len(rows) == len(self.conditions) and bool(np.all(rows == np.arange(len(rows))))
            self._restricted[conditions] = self if whole else self._take(rows)
        return self._restricted[conditions]

    @cached_property
    def _restricted(self) -> WeakKeyDictionary[Conditions, Self]:
        return WeakKeyDictionary()

    @property
    @abstractmethod
    def _arrays(self) -> tuple[np.ndarray, ...]:
        """All numbers of the content beside axes and conditions, for the digest."""

    @abstractmethod
    def _take(self, rows: np.ndarray) -> Self:
        """The table of only the conditions with these numbers."""

    @abstractmethod
    def _write(self, file: h5py.File) -> None:
        """Write what the header lacks."""

    @classmethod
    @abstractmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Conditions, model: Model, origin: str) -> Self:
        """Read what `_write` wrote; raises the errors of `source`, and `InvalidValue` on contradictions."""

    def _check(self) -> None:
        names = [axis.name for axis in self.axes]
        if not names or len(set(names)) < len(names) or not len(self.conditions):
            raise InvalidValue(f"A table of {len(self.conditions)} conditions has the axes {names}",
                               "Give one condition and one axis or more, each parameter once")

    def _rows(self, conditions: Conditions) -> np.ndarray:
        known = {key: row for row, key in enumerate(_keys(self.conditions, self.model.uses_run_order))}
        rows = [known.get(key, -1) for key in _keys(conditions, self.model.uses_run_order)]
        if -1 in rows:
            lost = rows.index(-1)
            raise InvalidValue(f"Condition {lost} (counted from 0: {conditions.motor_speed[lost]:g} rad/s, "
                               f"{conditions.load_inertia[lost]:g} kg m^2, {conditions.brake_torque[lost]:g} N m) "
                               "is not in the table" + " at its place in the run order" * self.model.uses_run_order,
                               "Build a table for them with `--conditions FILE`, or leave it out")
        return np.array(rows, dtype=np.int64)


def _keys(conditions: Conditions, in_order: bool) -> list[str]:
    """What a condition is, to five digits: as many as a recordings file written by hand may keep.

    `in_order`: its place in the run order is part of it.
    """
    profiles = [" ".join(f"{value:.5g}" for value in (*time, *current))
                for time, current in zip(conditions.profile_time, conditions.profile_current, strict=True)]
    order = conditions.run_order if in_order else None
    places = [""] * len(conditions) if order is None else [f"{place:.0f}" for place in order]
    rows = zip(conditions.current_profile, conditions.motor_speed, conditions.load_inertia,
               conditions.brake_torque, places, strict=True)
    return [f"{speed:.5g} {inertia:.5g} {brake:.5g} {profiles[profile]} {place}"
            for profile, speed, inertia, brake, place in rows]
