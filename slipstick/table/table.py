"""The table: shifting times on a grid of parameter multipliers, the contract between worker and service."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue, WrongDigest
from slipstick.files import replacing
from slipstick.table import interpolation, store
from slipstick.table.axis import Axis
from slipstick.table.interpolation import Outside


@dataclass(frozen=True, eq=False)
class Table:
    """`times` (g1, ..., gd, n) s and `status` (same shape, uint8) on d axes for n conditions of one model.

    A time is NaN exactly where its status is not 0, locked (1: never locked, 2: failed). `origin` says in
    words who computed it and how. Raises `InvalidValue` where these do not fit together.
    """

    axes: tuple[Axis, ...]
    times: np.ndarray
    status: np.ndarray
    conditions: Conditions
    model: Model
    origin: str = ""
    _restricted: WeakKeyDictionary[Conditions, "Table"] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False)

    def __post_init__(self) -> None:
        """Check shapes, types and statuses once, so that nothing downstream has to."""
        names = [axis.name for axis in self.axes]
        if not names or len(set(names)) < len(names) or not len(self.conditions):
            raise InvalidValue(f"A table of {len(self.conditions)} conditions has the axes {names}",
                               "Give one condition and one axis or more, each parameter once")
        shape = (*(len(axis.values) for axis in self.axes), len(self.conditions))
        for name, array, kind in (("times", self.times, "float64"), ("status", self.status, "uint8")):
            if array.shape != shape or array.dtype != kind:
                raise InvalidValue(f"The {name} are {array.dtype} {array.shape}, not {kind} {shape}",
                                   "Give one value a grid point and condition")
        if np.any(self.status > 2) or np.any(np.isfinite(self.times) != (self.status == 0)):
            raise InvalidValue("Times and statuses of the table contradict each other",
                               "Give a finite time where the status is 0 (locked), NaN elsewhere")

    @classmethod
    def open(cls, path: Path | str) -> "Table":
        """Read and verify the table at `path`.

        Raises `UnknownName` where there is none, `WrongLayout`, `CorruptTable` or `WrongDigest`.
        """
        content, stated, origin = store.load(Path(path))
        try:
            table = cls(*content, origin)
        except InvalidValue as error:
            raise CorruptTable(error.cause, "Build the table again") from error
        if table.digest != stated:
            raise WrongDigest("The content of the table does not have the digest that the file states",
                              "Restore it from a copy or build it again")
        return table

    def write(self, path: Path | str) -> None:
        """Put the table at `path`: written under a temporary name, verified, synced and renamed."""
        with replacing(Path(path)) as temporary:
            store.save(temporary, self._content, self.digest, self.origin)
            if Table.open(temporary).digest != self.digest:
                raise CorruptTable(f"'{path}' did not come back as it was written", "Check the disk")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Travel to another process without what is remembered here."""
        return Table, (*self._content, self.origin)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the content: the same digest means the same numbers, model and conditions."""
        return store.content_digest(self._content)

    @property
    def lower(self) -> np.ndarray:
        """Smallest multiplier of each axis, (d,)."""
        return np.array([axis.lower for axis in self.axes])

    @property
    def upper(self) -> np.ndarray:
        """Largest multiplier of each axis, (d,)."""
        return np.array([axis.upper for axis in self.axes])

    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """Shifting times in s of all n conditions at `points` (m, d), multipliers in axis order: (m, n).

        NaN where a corner of the cell that counts did not lock. Raises `InvalidValue` and `OutsideTable`.
        """
        return interpolation.interpolate(self.axes, self.times, points, outside)

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        """Shifting times in s of `conditions` (n,) at `points` (m, d): (m, n), clipped at the table's edge.

        The conditions may be any of the table's, in any order; raises `InvalidValue` on others.
        """
        return self.restricted(conditions).interpolate(points)

    def restricted(self, conditions: Conditions) -> "Table":
        """Return the table of only `conditions`, found by what they are; raises `InvalidValue` on others."""
        if conditions is self.conditions:
            return self
        if conditions not in self._restricted:
            rows = self._rows(conditions)
            whole = len(rows) == len(self.conditions) and bool(np.all(rows == np.arange(len(rows))))
            self._restricted[conditions] = self if whole else Table(
                self.axes, np.ascontiguousarray(self.times[..., rows]), self.status[..., rows],
                self.conditions.take(rows), self.model, self.origin)
        return self._restricted[conditions]

    @property
    def _content(self) -> store.Content:
        return self.axes, self.times, self.status, self.conditions, self.model

    def _rows(self, conditions: Conditions) -> np.ndarray:
        known = {key: row for row, key in enumerate(_keys(self.conditions))}
        rows = [known.get(key, -1) for key in _keys(conditions)]
        if -1 in rows:
            lost = rows.index(-1)
            raise InvalidValue(f"Condition {lost} (counted from 0: {conditions.motor_speed[lost]:g} rad/s, "
                               f"{conditions.load_inertia[lost]:g} kg m^2, {conditions.brake_torque[lost]:g} N m) "
                               "is not in the table",
                               "Build a table for them by `worker build --conditions FILE`, or leave it out")
        return np.array(rows, dtype=np.int64)


def _keys(conditions: Conditions) -> list[str]:
    """What a condition is, to five digits: as many as a recordings file written by hand may keep."""
    profiles = [" ".join(f"{value:.5g}" for value in (*time, *current))
                for time, current in zip(conditions.profile_time, conditions.profile_current, strict=True)]
    rows = zip(conditions.current_profile, conditions.motor_speed, conditions.load_inertia,
               conditions.brake_torque, strict=True)
    return [f"{speed:.5g} {inertia:.5g} {brake:.5g} {profiles[profile]}"
            for profile, speed, inertia, brake in rows]
