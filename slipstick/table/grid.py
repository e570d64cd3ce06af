"""The table on a grid: simulated at every grid point, interpolated linearly between them."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import h5py
import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, WrongLayout
from slipstick.storage.hdf5 import Source
from slipstick.table import interpolation, store
from slipstick.table.axis import Axis
from slipstick.table.points import Outside
from slipstick.table.table import Table

STATUS_MEANINGS = "locked never_locked failed"
"""What the statuses 0, 1, 2 say, after the CF convention `flag_meanings`."""


@dataclass(frozen=True, eq=False)
class Grid(Table):
    """`times` (g1, ..., gd, n) s and `status` (same shape, uint8) on d axes for n conditions of one model.

    A time is NaN exactly where its status is not 0, locked (1: never locked, 2: failed). Raises `InvalidValue`
    where these do not fit together.
    """

    kind: ClassVar[Literal["grid"]] = "grid"
    layout: ClassVar[str] = "slipstick table"

    axes: tuple[Axis, ...]
    times: np.ndarray
    status: np.ndarray
    conditions: Conditions
    model: Model
    origin: str = ""

    def __post_init__(self) -> None:
        """Check shapes, types and statuses once, so that nothing downstream has to."""
        self._check()
        shape = (*(len(axis.values) for axis in self.axes), len(self.conditions))
        for name, array, kind in (("times", self.times, "float64"), ("status", self.status, "uint8")):
            if array.shape != shape or array.dtype != kind:
                raise InvalidValue(f"The {name} are {array.dtype} {array.shape}, not {kind} {shape}",
                                   "Give one value a grid point and condition")
        if np.any(self.status > 2) or np.any(np.isfinite(self.times) != (self.status == 0)):
            raise InvalidValue("Times and statuses of the table contradict each other",
                               "Give a finite time where the status is 0 (locked), NaN elsewhere")

    @property
    def knots(self) -> tuple[np.ndarray, ...]:
        """The multipliers of each axis, between which times are linear in it."""
        return tuple(axis.values for axis in self.axes)

    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """As `Table.interpolate`; NaN where a corner of the cell that counts did not lock."""
        return interpolation.interpolate(self.axes, self.times, points, outside)

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        return self.times, self.status

    def _take(self, rows: np.ndarray) -> Self:
        return type(self)(self.axes, np.ascontiguousarray(self.times[..., rows]), self.status[..., rows],
                          self.conditions.take(rows), self.model, self.origin)

    def _write(self, file: h5py.File) -> None:
        chunk = (1,) * (len(self.axes) - 1) + self.times.shape[-2:]
        times = file.create_dataset("times", data=self.times, dtype="<f8", chunks=chunk, fletcher32=True)
        store.describe(times, units="s", long_name="shifting time")
        status = file.create_dataset("status", data=self.status, dtype="u1", chunks=chunk, fletcher32=True)
        store.describe(status, units="1", long_name="how the engagement ended", flag_meanings=STATUS_MEANINGS)
        status.attrs["flag_values"] = np.arange(3, dtype="u1")
        for dataset in (times, status):
            for position, axis in enumerate(self.axes):
                dataset.dims[position].label = axis.name
                dataset.dims[position].attach_scale(file[f"axes/{axis.name}"])
            dataset.dims[len(self.axes)].label = "condition"

    @classmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Conditions, model: Model, origin: str) -> Self:
        shape = (*(len(axis.values) for axis in axes), len(conditions))
        times = source.array("times", "f", shape, "s")
        status = source.array("status", "u", shape, "1")
        if source.attribute("status", "flag_meanings") != STATUS_MEANINGS:
            raise WrongLayout("The statuses of the table have other meanings", store.REBUILD)
        return cls(axes, times, status, conditions, model, origin)
