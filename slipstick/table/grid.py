"""A table on a grid: shifting times are simulated at every grid point and interpolated linearly in between."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import h5py
import numpy as np

from slipstick.errors import InvalidValue, WrongLayout
from slipstick.storage.hdf5 import Source
from slipstick.table import interpolation, store
from slipstick.table.axis import Axis
from slipstick.table.derivatives import Derivatives
from slipstick.table.points import Outside
from slipstick.table.subject import Setting, Subject, output_of
from slipstick.table.table import Table

STATUS_MEANINGS = "locked never_locked failed"
"""Meanings of the statuses 0, 1 and 2, as the attribute `flag_meanings` of the CF conventions."""


@dataclass(frozen=True, eq=False)
class Grid(Table):
    """Shifting times and statuses on a grid of d axes, for n conditions and one model.

    `times` (g1, ..., gd, n) are in s. `status` (same shape, uint8) is 0 (locked), 1 (never locked) or 2 (failed); a
    time is NaN exactly where the status is not 0. Raises `InvalidValue` if the fields are inconsistent.
    """

    kind: ClassVar[Literal["grid"]] = "grid"
    layout: ClassVar[str] = "slipstick table"

    axes: tuple[Axis, ...]
    times: np.ndarray
    status: np.ndarray
    conditions: Setting
    model: Subject
    origin: str = ""

    def __post_init__(self) -> None:
        """Check shapes, types and statuses."""
        self._check()
        shape = (*(len(axis.values) for axis in self.axes), len(self.conditions))
        for name, array, kind in (("times", self.times, "float64"), ("status", self.status, "uint8")):
            if array.shape != shape or array.dtype != kind:
                raise InvalidValue(f"The array '{name}' is {array.dtype} {array.shape}, not {kind} {shape}",
                                   "Give one value per grid point and condition")
        if np.any(self.status > 2) or np.any(np.isfinite(self.times) != (self.status == 0)):
            raise InvalidValue("The times and statuses of the table contradict each other",
                               "Give a finite time where the status is 0 (locked), and NaN elsewhere")

    @property
    def knots(self) -> tuple[np.ndarray, ...]:
        """Multipliers of each axis: times are linear in an axis between them."""
        return tuple(axis.values for axis in self.axes)

    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """As `Table.interpolate`; NaN if an engagement did not lock at a corner of nonzero weight."""
        return interpolation.interpolate(self.axes, self.times, points, outside)

    def _derivatives(self, point: np.ndarray) -> Derivatives:
        return interpolation.derivatives(self.axes, self.times, point)

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        return self.times, self.status

    def _take(self, rows: np.ndarray) -> Self:
        return type(self)(self.axes, np.ascontiguousarray(self.times[..., rows]), self.status[..., rows],
                          self.conditions.take(rows), self.model, self.origin)

    def _write(self, file: h5py.File) -> None:
        chunk = (1,) * (len(self.axes) - 1) + self.times.shape[-2:]
        times = file.create_dataset("times", data=self.times, dtype="<f8", chunks=chunk, fletcher32=True)
        store.describe(times, units=self.output.unit, long_name=self.output.name.replace("_", " "))
        status = file.create_dataset("status", data=self.status, dtype="u1", chunks=chunk, fletcher32=True)
        store.describe(status, units="1", long_name="how the engagement ended", flag_meanings=STATUS_MEANINGS)
        status.attrs["flag_values"] = np.arange(3, dtype="u1")
        for dataset in (times, status):
            for position, axis in enumerate(self.axes):
                dataset.dims[position].label = axis.name
                dataset.dims[position].attach_scale(file[f"axes/{axis.name}"])
            dataset.dims[len(self.axes)].label = "condition"

    @classmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Setting, model: Subject, origin: str) -> Self:
        shape = (*(len(axis.values) for axis in axes), len(conditions))
        times = source.array("times", "f", shape, output_of(model).unit)
        status = source.array("status", "u", shape, "1")
        if source.attribute("status", "flag_meanings") != STATUS_MEANINGS:
            raise WrongLayout(f"The attribute 'flag_meanings' of 'status' is not '{STATUS_MEANINGS}'", store.REBUILD)
        return cls(axes, times, status, conditions, model, origin)
